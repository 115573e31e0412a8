//! Stroke times over the leak area: what a table of a fault holds.

use crate::chart::theme::{BLUE, GREEN, VERMILLION};
use crate::chart::{Axis, Direction, Figure, Layer, Marker, Panel, Swatch};

/// A row of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TablePoint {
    /// Leak area, mm2.
    pub leak_area_mm2: f64,
    /// Closing time, s; none where the valve does not close.
    pub close_time_s: Option<f64>,
    /// Opening time, s; none where the valve does not open.
    pub open_time_s: Option<f64>,
}

/// A table of one fault.
#[derive(Debug, Clone)]
pub struct TableFigure {
    /// Name of the fault.
    pub fault: String,
    /// The rows, by area.
    pub points: Vec<TablePoint>,
    /// The interpolation between them, close enough to be drawn as a line; where it
    /// is empty, the rows are joined.
    pub interpolated: Vec<TablePoint>,
    /// Longest closing time allowed, s, where this fault can pass it.
    pub close_limit_s: Option<f64>,
    /// Longest opening time allowed, s, where this fault can pass it.
    pub open_limit_s: Option<f64>,
    /// Area at which the first limit is passed, mm2.
    pub area_at_limit_mm2: Option<f64>,
}

impl TableFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let title = format!("Stroke times over the leak area: {}", self.fault);
        let [close, open] = self.panels();
        Figure::new(title, self.summary()).with(close).with(open)
    }

    /// The pictures of several faults side by side.
    pub fn side_by_side(title: impl Into<String>, subtitle: impl Into<String>, faults: &[Self]) -> Figure {
        let mut figure = Figure::new(title, subtitle);
        figure.columns = faults.len().max(1);
        figure.width = 460.0 * figure.columns as f64;
        let (closing, opening): (Vec<Panel>, Vec<Panel>) = faults
            .iter()
            .map(|fault| {
                let [close, open] = fault.panels();
                (close.titled(&fault.fault), open)
            })
            .unzip();
        figure.panels = closing.into_iter().chain(opening).collect();
        figure
    }

    fn summary(&self) -> String {
        match self.area_at_limit_mm2 {
            Some(area) => format!("end of life at {area:.4} mm²; {} points", self.points.len()),
            None => format!("no limit is reached in this range; {} points", self.points.len()),
        }
    }

    fn panels(&self) -> [Panel; 2] {
        [
            self.panel("closing time (s)", |point| point.close_time_s, self.close_limit_s, false),
            self.panel("opening time (s)", |point| point.open_time_s, self.open_limit_s, true),
        ]
    }

    fn panel(
        &self,
        label: &str,
        time_s: impl Fn(&TablePoint) -> Option<f64>,
        limit_s: Option<f64>,
        last: bool,
    ) -> Panel {
        let path = |rows: &[TablePoint]| -> Vec<[f64; 2]> {
            rows.iter().filter_map(|row| Some([row.leak_area_mm2, time_s(row)?])).collect()
        };
        let points = path(&self.points);
        let line = if self.interpolated.is_empty() { points.clone() } else { path(&self.interpolated) };
        let end = self.points.iter().map(|point| point.leak_area_mm2).fold(0.0, f64::max);
        let x = Axis::linear("leak area (mm²)").over(0.0, if end > 0.0 { 1.01 * end } else { 1.0 });
        let x = if last { x } else { Axis { label: String::new(), ..x.bare() } };
        let mut panel = Panel::new(x, Axis::linear(label), 200.0);
        if let Some(area) = self.area_at_limit_mm2 {
            panel = panel.with(Layer::Level {
                at: area,
                direction: Direction::Vertical,
                colour: GREEN,
                dashed: true,
                text: if last { String::new() } else { format!("limit at {area:.3} mm²") },
            });
        }
        if let Some(limit) = limit_s {
            panel = panel.with(Layer::Level {
                at: limit,
                direction: Direction::Horizontal,
                colour: VERMILLION,
                dashed: true,
                text: format!("limit {limit} s"),
            });
        }
        panel = panel.with(Layer::line(line, BLUE)).with(Layer::Points {
            points,
            colour: BLUE,
            radius: 2.2,
            marker: Marker::Dot,
        });
        if !last {
            panel = panel.keyed(Swatch::Line(BLUE), "table, interpolated");
            panel = panel.keyed(Swatch::Dot(BLUE), "simulated");
        }
        panel
    }
}
