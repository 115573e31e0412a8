//! Layers to shapes.

use super::axis::Scale;
use super::layer::{Bar, Cell, Layer, LineDirection, Marker};
use super::panel::is_along_x;
use super::theme::{INK, MUTED, TEXT_SIZE};
use crate::draw::{Anchor, Colour, Fill, Pen, Rect, Shape, Text, text_width_px};

const WHITE: Colour = Colour(255, 255, 255);

/// Adds a layer's shapes: those that end at the panel's edge to `inside`, texts
/// and brackets, which may pass it, to `above`.
pub(super) fn draw(layer: &Layer, area: Rect, x: &Scale, y: &Scale, inside: &mut Vec<Shape>, above: &mut Vec<Shape>) {
    match layer {
        Layer::Line { points, colour, width, dashed } => {
            let stroke = Pen { colour: *colour, width: *width, dash: dashed.then_some([6.0, 4.0]) };
            line(points, x, y, stroke, inside);
        }
        Layer::Band { points, colour, opacity } => band(points, x, y, *colour, *opacity, inside),
        Layer::Points { points, colour, radius, marker } => {
            for point in points.iter().filter(|point| point.iter().all(|value| value.is_finite())) {
                inside.push(dot([x.at(point[0]), y.at(point[1])], *colour, *radius, *marker));
            }
        }
        Layer::Whiskers { spans, colour, direction } => {
            for span in spans.iter().filter(|span| span.iter().all(|value| value.is_finite())) {
                whisker(*span, x, y, *direction, *colour, inside);
            }
        }
        Layer::Level { at, direction, colour, dashed, text } => {
            let stroke = Pen { colour: *colour, width: 1.4, dash: dashed.then_some([5.0, 3.0]) };
            level(*at, *direction, stroke, text, area, x, y, inside, above);
        }
        Layer::Stretch { x: [from, to], colour, text } => {
            let (left, right) = (x.at(*from), x.at(*to));
            let rect = Rect { x: left, y: area.y, width: (right - left).max(0.0), height: area.height };
            let fill = Some(Fill { colour: *colour, opacity: 0.12 });
            inside.push(Shape::Rect { rect, fill, stroke: None });
            if !text.is_empty() {
                let place = [f64::midpoint(left, right), area.y + TEXT_SIZE + 2.0];
                above.push(note(text, place, MUTED, Anchor::Middle));
            }
        }
        Layer::Note { at, shift, text, colour, anchor } => {
            let place = [x.at(at[0]) + shift[0], y.at(at[1]) + shift[1]];
            above.push(note(text, place, *colour, *anchor));
        }
        Layer::Bars { bars, direction, thickness } => {
            for bar in bars {
                draw_bar(bar, *direction, *thickness, [x, y], inside, above);
            }
        }
        Layer::Cells(cells) => {
            for cell in cells {
                draw_cell(cell, x, y, inside);
            }
        }
        Layer::Bracket { rows, offset, text } => {
            bracket([y.at(rows[0]), y.at(rows[1])], area.right() + offset, text, above);
        }
    }
}

fn line(points: &[[f64; 2]], x: &Scale, y: &Scale, stroke: Pen, out: &mut Vec<Shape>) {
    for piece in points.split(|point| !(point[0].is_finite() && point[1].is_finite())) {
        if piece.len() > 1 {
            let points = thin(piece.iter().map(|point| [x.at(point[0]), y.at(point[1])]));
            out.push(Shape::Path { points, fill: None, stroke: Some(stroke) });
        }
    }
}

/// Leaves out points that lie on the straight line between their neighbours to
/// a twentieth of a pixel: a long record then costs no more than its shape.
fn thin(points: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::new();
    let mut skipped: Vec<[f64; 2]> = Vec::new();
    for point in points {
        let Some(&start) = kept.last() else {
            kept.push(point);
            continue;
        };
        let on_the_way =
            skipped.len() < 400 && skipped.iter().all(|between| distance_to_chord(*between, start, point) < 0.05);
        if on_the_way {
            skipped.push(point);
        } else {
            let last = skipped[skipped.len() - 1];
            kept.push(last);
            skipped.clear();
            skipped.push(point);
        }
    }
    kept.extend(skipped.last());
    kept
}

/// Distance of a point from the line through `a` and `b`; it also counts how far
/// the point lies before `a` or behind `b`.
fn distance_to_chord(point: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let from = [point[0] - a[0], point[1] - a[1]];
    let length2 = along[0].mul_add(along[0], along[1] * along[1]);
    if length2 == 0.0 {
        return from[0].hypot(from[1]);
    }
    let share = ((from[0] * along[0] + from[1] * along[1]) / length2).clamp(0.0, 1.0);
    (from[0] - share * along[0]).hypot(from[1] - share * along[1])
}

fn band(points: &[[f64; 3]], x: &Scale, y: &Scale, colour: Colour, opacity: f64, out: &mut Vec<Shape>) {
    for piece in points.split(|edge| !edge.iter().all(|value| value.is_finite())) {
        if piece.len() > 1 {
            let mut outline = thin(piece.iter().map(|edge| [x.at(edge[0]), y.at(edge[1])]));
            outline.extend(thin(piece.iter().rev().map(|edge| [x.at(edge[0]), y.at(edge[2])])));
            let fill = Some(Fill { colour, opacity });
            out.push(Shape::Path { points: outline, fill, stroke: None });
        }
    }
}

fn dot(centre: [f64; 2], colour: Colour, radius: f64, marker: Marker) -> Shape {
    let solid = Some(Fill { colour, opacity: 1.0 });
    match marker {
        Marker::Dot => Shape::Circle { centre, radius, fill: solid, stroke: None },
        Marker::Ring => Shape::Circle {
            centre,
            radius,
            fill: Some(Fill { colour: WHITE, opacity: 1.0 }),
            stroke: Some(Pen::solid(colour, 1.6)),
        },
        Marker::Diamond => {
            let [cx, cy] = centre;
            let r = 1.3 * radius;
            let points = vec![[cx, cy - r], [cx + r, cy], [cx, cy + r], [cx - r, cy]];
            Shape::Path { points, fill: solid, stroke: None }
        }
        Marker::Triangle => triangle(centre, colour, radius, false),
        Marker::Up => triangle(centre, colour, radius, true),
    }
}

/// A triangle that points up, filled with its colour or with white.
pub(super) fn triangle([cx, cy]: [f64; 2], colour: Colour, radius: f64, is_filled: bool) -> Shape {
    let (half, r) = (1.15 * radius, 1.3 * radius);
    let points = vec![[cx, cy - r], [cx + half, cy + 0.7 * r], [cx - half, cy + 0.7 * r], [cx, cy - r]];
    let fill = Some(Fill { colour: if is_filled { colour } else { WHITE }, opacity: 1.0 });
    Shape::Path { points, fill, stroke: (!is_filled).then_some(Pen::solid(colour, 1.6)) }
}

fn whisker(
    [at, low, high]: [f64; 3],
    x: &Scale,
    y: &Scale,
    direction: LineDirection,
    colour: Colour,
    out: &mut Vec<Shape>,
) {
    let points = if is_along_x(direction) {
        vec![[x.at(low), y.at(at)], [x.at(high), y.at(at)]]
    } else {
        vec![[x.at(at), y.at(low)], [x.at(at), y.at(high)]]
    };
    out.push(Shape::Path { points, fill: None, stroke: Some(Pen::solid(colour, 1.6)) });
}

#[expect(clippy::too_many_arguments, reason = "a place, a look and two lists to add to")]
fn level(
    at: f64,
    direction: LineDirection,
    stroke: Pen,
    text: &str,
    area: Rect,
    x: &Scale,
    y: &Scale,
    inside: &mut Vec<Shape>,
    above: &mut Vec<Shape>,
) {
    let (points, visible) = if is_along_x(direction) {
        let height = y.at(at);
        (vec![[area.x, height], [area.right(), height]], y.contains(at))
    } else {
        let place = x.at(at);
        (vec![[place, area.y], [place, area.bottom()]], x.contains(at))
    };
    let start = points[0];
    inside.push(Shape::Path { points, fill: None, stroke: Some(stroke) });
    if text.is_empty() || !visible {
        return;
    }
    if is_along_x(direction) {
        // Above the line, unless the panel ends there.
        let above_line = start[1] - area.y > TEXT_SIZE + 6.0;
        let base = if above_line { start[1] - 5.0 } else { start[1] + TEXT_SIZE + 3.0 };
        above.push(note(text, [area.x + 6.0, base], stroke.colour, Anchor::Start));
    } else {
        let width = text_width_px(text, TEXT_SIZE, false);
        let fits_right = start[0] + 6.0 + width < area.right();
        let (place, anchor) = if fits_right { (start[0] + 5.0, Anchor::Start) } else { (start[0] - 5.0, Anchor::End) };
        above.push(note(text, [place, area.y + TEXT_SIZE + 2.0], stroke.colour, anchor));
    }
}

/// Half the width of a mark that a bar's text stands behind.
const MARK_RADIUS: f64 = 5.0;

fn draw_bar(
    bar: &Bar,
    direction: LineDirection,
    thickness: f64,
    [x, y]: [&Scale; 2],
    inside: &mut Vec<Shape>,
    above: &mut Vec<Shape>,
) {
    let half = thickness / 2.0;
    let (corners, text_at, anchor) = if is_along_x(direction) {
        let (a, b) = (x.at(bar.from), x.at(bar.to));
        let corners = [[a, y.at(bar.at - half)], [b, y.at(bar.at + half)]];
        let mark = bar.mark.map(|mark| x.at(mark));
        let (end, anchor) = if b < a {
            (mark.map_or(b, |mark| b.min(mark - MARK_RADIUS)) - 6.0, Anchor::End)
        } else {
            (mark.map_or(b, |mark| b.max(mark + MARK_RADIUS)) + 6.0, Anchor::Start)
        };
        (corners, [end, y.at(bar.at) + 0.36 * TEXT_SIZE], anchor)
    } else {
        let (a, b) = (y.at(bar.from), y.at(bar.to));
        let corners = [[x.at(bar.at - half), a], [x.at(bar.at + half), b]];
        (corners, [x.at(bar.at), a.min(b) - 5.0], Anchor::Middle)
    };
    inside.push(Shape::Rect {
        rect: between(corners[0], corners[1]),
        fill: Some(Fill { colour: bar.colour, opacity: 1.0 }),
        stroke: None,
    });
    if !bar.text.is_empty() {
        above.push(note(&bar.text, text_at, INK, anchor));
    }
}

fn draw_cell(cell: &Cell, x: &Scale, y: &Scale, inside: &mut Vec<Shape>) {
    let rect = between([x.at(cell.x[0]), y.at(cell.y[0])], [x.at(cell.x[1]), y.at(cell.y[1])]);
    let fill = Some(Fill { colour: cell.colour, opacity: 1.0 });
    inside.push(Shape::Rect { rect, fill, stroke: None });
    if !cell.text.is_empty() {
        let colour = if cell.colour.is_dark() { WHITE } else { INK };
        let place = [rect.x + rect.width / 2.0, rect.y + rect.height / 2.0 + 0.36 * TEXT_SIZE];
        inside.push(Shape::Text(Text { halo: false, ..text_of(&cell.text, place, colour, Anchor::Middle) }));
    }
}

fn bracket(rows: [f64; 2], x: f64, text: &str, out: &mut Vec<Shape>) {
    let (top, bottom) = (rows[0].min(rows[1]) - 7.0, rows[0].max(rows[1]) + 7.0);
    let points = vec![[x, top], [x + 5.0, top], [x + 5.0, bottom], [x, bottom]];
    out.push(Shape::Path { points, fill: None, stroke: Some(Pen::solid(MUTED, 1.4)) });
    let place = [x + 10.0, f64::midpoint(top, bottom) + 0.36 * TEXT_SIZE];
    out.push(note(text, place, MUTED, Anchor::Start));
}

fn between(a: [f64; 2], b: [f64; 2]) -> Rect {
    Rect { x: a[0].min(b[0]), y: a[1].min(b[1]), width: (a[0] - b[0]).abs(), height: (a[1] - b[1]).abs() }
}

fn note(content: &str, at: [f64; 2], colour: Colour, anchor: Anchor) -> Shape {
    Shape::Text(text_of(content, at, colour, anchor))
}

fn text_of(content: &str, at: [f64; 2], colour: Colour, anchor: Anchor) -> Text {
    Text { content: content.to_owned(), at, size: TEXT_SIZE, bold: false, colour, anchor, upright: false, halo: true }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_shape() {
        let straight: Vec<[f64; 2]> = (0..100).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        assert_eq!(thin(straight.into_iter()), [[0.0, 0.0], [99.0, 198.0]]);
        let corner = [[0.0, 0.0], [5.0, 0.0], [10.0, 0.0], [10.0, 4.0], [10.0, 9.0]];
        assert_eq!(thin(corner.into_iter()), [[0.0, 0.0], [10.0, 0.0], [10.0, 9.0]]);
        let spike = [[0.0, 0.0], [1.0, 0.0], [1.0, 50.0], [1.0, 0.0], [2.0, 0.0]];
        assert_eq!(thin(spike.into_iter()).len(), 5, "{:?}", thin(spike.into_iter()));
    }
}
