//! The legend: a row of entries above a panel, where no data can be.

use super::marks;
use super::theme::{INK, TEXT_SIZE};
use crate::draw::{Anchor, Colour, Fill, Pen, Rect, Shape, Text, text_width_px};

/// What stands before the text of an entry.
#[derive(Debug, Clone, PartialEq)]
pub enum Swatch {
    /// A piece of line.
    Line(Colour),
    /// A piece of dashed line.
    Dashed(Colour),
    /// A piece of band.
    Band(Colour),
    /// A dot.
    Dot(Colour),
    /// A ring.
    Ring(Colour),
    /// A filled square, turned by an eighth.
    Diamond(Colour),
    /// An empty triangle.
    Triangle(Colour),
    /// A filled triangle.
    Up(Colour),
    /// A filled square.
    Square(Colour),
    /// A strip of colours, low to high, between the texts of its ends.
    Scale {
        /// The colours.
        colours: Vec<Colour>,
        /// What the first colour means.
        low: String,
        /// What the last colour means.
        high: String,
    },
}

/// One entry of a legend.
#[derive(Debug, Clone, PartialEq)]
pub struct LegendEntry {
    /// The look.
    pub swatch: Swatch,
    /// What it means.
    pub text: String,
}

impl LegendEntry {
    /// An entry.
    pub fn new(swatch: Swatch, text: impl Into<String>) -> Self {
        Self { swatch, text: text.into() }
    }
}

const ROW_HEIGHT: f64 = 18.0;
const SWATCH_WIDTH: f64 = 22.0;
const GAP: f64 = 6.0;
const BETWEEN: f64 = 18.0;
const SCALE_STEP: f64 = 11.0;

fn swatch_width(swatch: &Swatch) -> f64 {
    match swatch {
        Swatch::Dot(_)
        | Swatch::Ring(_)
        | Swatch::Diamond(_)
        | Swatch::Triangle(_)
        | Swatch::Up(_)
        | Swatch::Square(_) => 10.0,
        Swatch::Scale { colours, low, high } => {
            let ends = text_width_px(low, TEXT_SIZE, false) + text_width_px(high, TEXT_SIZE, false);
            ends + 2.0 * GAP + colours.len() as f64 * SCALE_STEP
        }
        _ => SWATCH_WIDTH,
    }
}

fn entry_width(entry: &LegendEntry) -> f64 {
    swatch_width(&entry.swatch) + GAP + text_width_px(&entry.text, TEXT_SIZE, false)
}

/// Splits the entries into rows no wider than `width`.
fn rows(entries: &[LegendEntry], width: f64) -> Vec<Vec<&LegendEntry>> {
    let mut rows: Vec<Vec<&LegendEntry>> = Vec::new();
    let mut used = f64::INFINITY;
    for entry in entries {
        let wanted = entry_width(entry);
        match rows.last_mut() {
            Some(row) if used + BETWEEN + wanted <= width => {
                used += BETWEEN + wanted;
                row.push(entry);
            }
            _ => {
                used = wanted;
                rows.push(vec![entry]);
            }
        }
    }
    rows
}

/// Height that the entries need at a width.
pub(super) fn height(entries: &[LegendEntry], width: f64) -> f64 {
    ROW_HEIGHT * rows(entries, width).len() as f64
}

/// Draws the entries with their upper left corner at `at`.
pub(super) fn draw(entries: &[LegendEntry], at: [f64; 2], width: f64, out: &mut Vec<Shape>) {
    for (index, row) in rows(entries, width).into_iter().enumerate() {
        let middle = at[1] + ROW_HEIGHT * (index as f64 + 0.5);
        let mut x = at[0];
        for entry in row {
            draw_swatch(&entry.swatch, [x, middle], out);
            let text_x = x + swatch_width(&entry.swatch) + GAP;
            out.push(label(&entry.text, [text_x, middle]));
            x += entry_width(entry) + BETWEEN;
        }
    }
}

fn label(text: &str, [x, middle]: [f64; 2]) -> Shape {
    Shape::Text(Text {
        content: text.to_owned(),
        at: [x, middle + 0.36 * TEXT_SIZE],
        size: TEXT_SIZE,
        bold: false,
        colour: INK,
        anchor: Anchor::Start,
        upright: false,
        halo: false,
    })
}

fn draw_swatch(swatch: &Swatch, [x, y]: [f64; 2], out: &mut Vec<Shape>) {
    let opaque = |colour| Some(Fill { colour, opacity: 1.0 });
    let square = |height: f64, width: f64| Rect { x, y: y - height / 2.0, width, height };
    match swatch {
        Swatch::Line(colour) | Swatch::Dashed(colour) => out.push(Shape::Path {
            points: vec![[x, y], [x + SWATCH_WIDTH, y]],
            fill: None,
            stroke: Some(Pen {
                colour: *colour,
                width: 2.2,
                dash: matches!(swatch, Swatch::Dashed(_)).then_some([5.0, 3.0]),
            }),
        }),
        Swatch::Band(colour) => out.push(Shape::Rect {
            rect: square(11.0, SWATCH_WIDTH),
            fill: Some(Fill { colour: *colour, opacity: 0.25 }),
            stroke: None,
        }),
        Swatch::Dot(colour) => {
            out.push(Shape::Circle { centre: [x + 5.0, y], radius: 3.5, fill: opaque(*colour), stroke: None });
        }
        Swatch::Ring(colour) => out.push(Shape::Circle {
            centre: [x + 5.0, y],
            radius: 3.2,
            fill: opaque(Colour(255, 255, 255)),
            stroke: Some(Pen::solid(*colour, 1.6)),
        }),
        Swatch::Diamond(colour) => {
            let (middle, r) = (x + 5.0, 5.2);
            let points = vec![[middle, y - r], [middle + r, y], [middle, y + r], [middle - r, y]];
            out.push(Shape::Path { points, fill: opaque(*colour), stroke: None });
        }
        Swatch::Triangle(colour) => out.push(marks::triangle([x + 5.0, y], *colour, 3.6, false)),
        Swatch::Up(colour) => out.push(marks::triangle([x + 5.0, y], *colour, 3.6, true)),
        Swatch::Square(colour) => {
            out.push(Shape::Rect { rect: square(10.0, 10.0), fill: opaque(*colour), stroke: None });
        }
        Swatch::Scale { colours, low, high } => {
            out.push(label(low, [x, y]));
            let mut left = x + text_width_px(low, TEXT_SIZE, false) + GAP;
            for colour in colours {
                let rect = Rect { x: left, y: y - 5.5, width: SCALE_STEP, height: 11.0 };
                out.push(Shape::Rect { rect, fill: opaque(*colour), stroke: None });
                left += SCALE_STEP;
            }
            out.push(label(high, [left + GAP, y]));
        }
    }
}
