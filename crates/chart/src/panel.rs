//! A panel: two axes and layers between them.

use super::axis::{Axis, AxisKind, Scale, settle_range, ticks};
use super::layer::{Layer, LineDirection};
use super::legend::{LegendEntry, Swatch};
use super::theme::{GRID, INK, TEXT_SIZE};
use super::{axis, marks};
use crate::draw::{Anchor, Pen, Rect, Shape, Text, text_width_px};

/// Two axes and what is drawn between them.
#[derive(Debug, Clone)]
pub struct Panel {
    /// A line above the panel; empty for none.
    pub title: String,
    /// Height of the plot area in pixels.
    pub height: f64,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn, from the back to the front.
    pub layers: Vec<Layer>,
    /// What it means.
    pub legend: Vec<LegendEntry>,
    /// Room right of the plot area for brackets and texts, pixels.
    pub right: f64,
}

impl Panel {
    /// An empty panel.
    pub fn new(x: Axis, y: Axis, height: f64) -> Self {
        Self { title: String::new(), height, x, y, layers: Vec::new(), legend: Vec::new(), right: 0.0 }
    }

    /// The same panel with a title.
    #[must_use]
    pub fn titled(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// The same panel with a layer more.
    #[must_use]
    pub fn with(mut self, layer: Layer) -> Self {
        self.layers.push(layer);
        self
    }

    /// The same panel with an entry more in its legend.
    #[must_use]
    pub fn keyed(mut self, swatch: Swatch, text: impl Into<String>) -> Self {
        self.legend.push(LegendEntry::new(swatch, text));
        self
    }

    fn x_range(&self) -> [f64; 2] {
        let margin = if self.layers.iter().any(|layer| matches!(layer, Layer::Points { .. })) { 0.02 } else { 0.0 };
        settle_range(&self.x, self.layers.iter().flat_map(Layer::xs), margin)
    }

    fn y_range(&self) -> [f64; 2] {
        let cells = self.layers.iter().any(|layer| matches!(layer, Layer::Cells(_)));
        let margin = if cells { 0.0 } else { 0.05 };
        settle_range(&self.y, self.layers.iter().flat_map(Layer::ys), margin)
    }

    fn y_ticks(&self) -> Vec<(f64, String)> {
        ticks(&self.y, self.y_range(), round(self.height / 42.0).max(2))
    }

    /// Room that the vertical axis needs left of the plot area.
    pub(super) fn left_margin(&self) -> f64 {
        let widest = self.y_ticks().iter().map(|tick| text_width_px(&tick.1, TEXT_SIZE, false)).fold(0.0, f64::max);
        let ticks = if self.y.labelled { widest + 10.0 } else { 4.0 };
        ticks + if self.y.label.is_empty() { 0.0 } else { TEXT_SIZE + 10.0 }
    }

    /// Room that the horizontal axis needs below the plot area.
    pub(super) fn bottom_margin(&self) -> f64 {
        if !self.x.labelled {
            return 12.0;
        }
        22.0 + if self.x.label.is_empty() { 0.0 } else { TEXT_SIZE + 6.0 }
    }

    /// Draws axes and layers into `area`.
    pub(super) fn draw(&self, area: Rect, out: &mut Vec<Shape>) {
        let (x_range, y_range) = (self.x_range(), self.y_range());
        let x = axis::scale(&self.x, x_range, [area.x, area.right()]);
        let y_ends =
            if matches!(self.y.kind, AxisKind::Names(_)) { [area.y, area.bottom()] } else { [area.bottom(), area.y] };
        let y = axis::scale(&self.y, y_range, y_ends);
        let x_ticks = ticks(&self.x, x_range, round(area.width / 75.0).max(2));
        let y_ticks = self.y_ticks();
        let covered = self.layers.iter().any(|layer| matches!(layer, Layer::Cells(_)));
        if !covered {
            self.draw_grid(area, (&x, &x_ticks), (&y, &y_ticks), out);
        }
        let mut inside = Vec::new();
        let mut above = Vec::new();
        for layer in &self.layers {
            marks::draw(layer, area, &x, &y, &mut inside, &mut above);
        }
        out.push(Shape::Clipped { window: area, shapes: inside });
        self.draw_axes(area, (&x, &x_ticks), (&y, &y_ticks), out);
        out.append(&mut above);
    }

    fn draw_grid(
        &self,
        area: Rect,
        (x, x_ticks): (&Scale, &[(f64, String)]),
        (y, y_ticks): (&Scale, &[(f64, String)]),
        out: &mut Vec<Shape>,
    ) {
        let line = |points: Vec<[f64; 2]>| Shape::Path { points, fill: None, stroke: Some(Pen::solid(GRID, 1.0)) };
        if !matches!(self.x.kind, AxisKind::Names(_)) {
            for (value, _) in x_ticks {
                let at = x.at(*value);
                out.push(line(vec![[at, area.y], [at, area.bottom()]]));
            }
        }
        if !matches!(self.y.kind, AxisKind::Names(_)) {
            for (value, _) in y_ticks {
                let at = y.at(*value);
                out.push(line(vec![[area.x, at], [area.right(), at]]));
            }
        }
    }

    fn draw_axes(
        &self,
        area: Rect,
        (x, x_ticks): (&Scale, &[(f64, String)]),
        (y, y_ticks): (&Scale, &[(f64, String)]),
        out: &mut Vec<Shape>,
    ) {
        let pen = Some(Pen::solid(INK, 1.0));
        out.push(Shape::Path {
            points: vec![[area.x, area.y], [area.x, area.bottom()], [area.right(), area.bottom()]],
            fill: None,
            stroke: pen,
        });
        for (value, text) in x_ticks {
            let at = x.at(*value);
            if !matches!(self.x.kind, AxisKind::Names(_)) {
                let points = vec![[at, area.bottom()], [at, area.bottom() + 4.0]];
                out.push(Shape::Path { points, fill: None, stroke: pen });
            }
            if self.x.labelled {
                out.push(axis_text(text, [at, area.bottom() + 17.0], Anchor::Middle, false));
            }
        }
        for (value, text) in y_ticks {
            let at = y.at(*value);
            if !matches!(self.y.kind, AxisKind::Names(_)) {
                let points = vec![[area.x - 4.0, at], [area.x, at]];
                out.push(Shape::Path { points, fill: None, stroke: pen });
            }
            if self.y.labelled {
                let place = [area.x - 7.0, at + 0.36 * TEXT_SIZE];
                out.push(axis_text(text, place, Anchor::End, false));
            }
        }
        if self.x.labelled && !self.x.label.is_empty() {
            let place = [area.x + area.width / 2.0, area.bottom() + 22.0 + TEXT_SIZE];
            out.push(axis_text(&self.x.label, place, Anchor::Middle, false));
        }
        if !self.y.label.is_empty() {
            let place = [area.x - self.left_margin() + TEXT_SIZE, area.y + area.height / 2.0];
            out.push(axis_text(&self.y.label, place, Anchor::Middle, true));
        }
    }
}

fn axis_text(text: &str, at: [f64; 2], anchor: Anchor, upright: bool) -> Shape {
    Shape::Text(Text {
        content: text.to_owned(),
        at,
        size: TEXT_SIZE,
        bold: false,
        colour: INK,
        anchor,
        upright,
        halo: false,
    })
}

fn round(count: f64) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small count")]
    let count = count.round().max(0.0) as usize;
    count
}

/// The direction across the given one.
pub(super) fn is_along_x(direction: LineDirection) -> bool {
    direction == LineDirection::Horizontal
}
