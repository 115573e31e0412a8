//! Stroke times over the severity of a fault: what its table holds.

use super::Quantity;
use chart::theme::{BLUE, GREEN, VERMILLION};
use chart::{Axis, Figure, Layer, LineDirection, Marker, Panel, Swatch};

/// A row of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TablePoint {
    /// How far the fault has come, in the unit of [`TableFigure::quantity`].
    pub severity: f64,
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
    /// What its severity counts.
    pub quantity: Quantity,
    /// The rows, by severity.
    pub points: Vec<TablePoint>,
    /// The interpolation between them, close enough to be drawn as a line; where it
    /// is empty, the rows are joined.
    pub interpolated: Vec<TablePoint>,
    /// Longest closing time allowed, s, where this fault can pass it.
    pub close_limit_s: Option<f64>,
    /// Longest opening time allowed, s, where this fault can pass it.
    pub open_limit_s: Option<f64>,
    /// Severity at which the first limit is passed.
    pub severity_at_limit: Option<f64>,
}

/// Faults that stand beside each other.
const SIDE_BY_SIDE: usize = 2;

impl TableFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let title = format!("Stroke times over the {}: {}", self.quantity.name, self.fault);
        let [close, open] = self.panels();
        Figure::new(title, self.summary()).with(close).with(open)
    }

    /// The pictures of several faults, two side by side.
    pub fn side_by_side(title: impl Into<String>, subtitle: impl Into<String>, faults: &[Self]) -> Figure {
        let mut figure = Figure::new(title, subtitle);
        figure.columns = faults.len().clamp(1, SIDE_BY_SIDE);
        figure.width = 460.0 * figure.columns as f64;
        for row in faults.chunks(SIDE_BY_SIDE) {
            let (closing, opening): (Vec<Panel>, Vec<Panel>) = row
                .iter()
                .map(|fault| {
                    let [close, open] = fault.panels();
                    (close.titled(&fault.fault), open)
                })
                .unzip();
            figure.panels.extend(closing);
            figure.panels.extend(opening);
        }
        figure
    }

    fn summary(&self) -> String {
        match self.severity_at_limit {
            Some(limit) => format!("end of life at {}; {} points", self.quantity.text(limit, 4), self.points.len()),
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
            rows.iter().filter_map(|row| Some([row.severity, time_s(row)?])).collect()
        };
        let points = path(&self.points);
        let line = if self.interpolated.is_empty() { points.clone() } else { path(&self.interpolated) };
        let end = self.points.iter().map(|point| point.severity).fold(0.0, f64::max);
        let x = Axis::linear(self.quantity.label()).over(0.0, if end > 0.0 { 1.01 * end } else { 1.0 });
        let x = if last { x } else { Axis { label: String::new(), ..x.bare() } };
        let mut panel = Panel::new(x, Axis::linear(label), 200.0);
        if let Some(limit) = self.severity_at_limit {
            panel = panel.with(Layer::Level {
                at: limit,
                direction: LineDirection::Vertical,
                colour: GREEN,
                dashed: true,
                text: if last { String::new() } else { format!("limit at {}", self.quantity.text(limit, 3)) },
            });
        }
        if let Some(limit) = limit_s {
            panel = panel.with(Layer::Level {
                at: limit,
                direction: LineDirection::Horizontal,
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
