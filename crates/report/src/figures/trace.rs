//! A cycle over time: position, pressures, command.

use chart::draw::Anchor;
use chart::theme::{BLUE, GREY, INK, MUTED, ORANGE};
use chart::{Axis, Figure, Layer, LineDirection, Panel, Swatch};

/// A simulated or recorded cycle.
#[derive(Debug, Clone, Default)]
pub struct TraceFigure {
    /// Headline.
    pub title: String,
    /// Conditions.
    pub subtitle: String,
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// True where the solenoid is energised.
    pub command_close: Vec<bool>,
    /// Position above the closed stop, mm.
    pub position_mm: Vec<f64>,
    /// Pressure in the chamber, kPa absolute; empty if not known.
    pub chamber_pressure_kpa: Vec<f64>,
    /// Pressure in the pipe, kPa absolute; empty if not known.
    pub pipe_pressure_kpa: Vec<f64>,
    /// Supply pressure, kPa absolute.
    pub supply_pressure_kpa: Option<f64>,
    /// Length of the stroke, mm.
    pub stroke_mm: f64,
    /// Instants at which a stroke ended, s, and what to write there.
    pub events: Vec<(f64, String)>,
}

impl TraceFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let last = self.time_s.last().copied().unwrap_or(1.0);
        let first = self.time_s.first().copied().unwrap_or(0.0);
        let time = || Axis::linear("time (s)").over(first, last);
        let quiet = || Axis::linear("").over(first, last).bare();
        let mut figure = Figure::new(&self.title, &self.subtitle);
        figure.panels.push(self.position(quiet()));
        if !(self.chamber_pressure_kpa.is_empty() && self.pipe_pressure_kpa.is_empty()) {
            figure.panels.push(self.pressures(quiet()));
        }
        figure.panels.push(self.command(time()));
        figure
    }

    fn series(&self, values: &[f64]) -> Vec<[f64; 2]> {
        self.time_s.iter().zip(values).map(|(time, value)| [*time, *value]).collect()
    }

    fn position(&self, x: Axis) -> Panel {
        let grow = 0.08 * self.stroke_mm;
        let y = Axis::linear("position (mm)").over(-grow, self.stroke_mm + grow);
        let stop = |at| Layer::Level {
            at,
            direction: LineDirection::Horizontal,
            colour: GREY,
            dashed: true,
            text: String::new(),
        };
        let mut panel = Panel::new(x, y, 190.0)
            .with(stop(0.0))
            .with(stop(self.stroke_mm))
            .with(Layer::line(self.series(&self.position_mm), BLUE))
            .keyed(Swatch::Line(BLUE), "position, 0 = closed")
            .keyed(Swatch::Dashed(GREY), "stops");
        for (time, text) in &self.events {
            let index = self.time_s.partition_point(|at| at < time);
            let position = self.position_mm.get(index).copied().unwrap_or(0.0);
            panel = panel.with(Layer::dots(vec![[*time, position]], INK)).with(Layer::Note {
                at: [*time, position],
                shift: [6.0, if position > 0.5 * self.stroke_mm { 20.0 } else { -10.0 }],
                text: text.clone(),
                colour: INK,
                anchor: Anchor::Start,
            });
        }
        panel
    }

    fn pressures(&self, x: Axis) -> Panel {
        let y = Axis::linear("pressure (kPa abs.)").showing(0.0);
        let mut panel = Panel::new(x, y, 190.0);
        if let Some(supply) = self.supply_pressure_kpa {
            panel = panel
                .with(Layer::Level {
                    at: supply,
                    direction: LineDirection::Horizontal,
                    colour: GREY,
                    dashed: true,
                    text: String::new(),
                })
                .keyed(Swatch::Dashed(GREY), "supply");
        }
        // The two pressures are often nearly one; the wider line shows beside the other.
        for (values, colour, width, name) in
            [(&self.pipe_pressure_kpa, ORANGE, 4.5, "pipe"), (&self.chamber_pressure_kpa, BLUE, 1.8, "chamber")]
        {
            if !values.is_empty() {
                let points = self.series(values);
                panel =
                    panel.with(Layer::Line { points, colour, width, dashed: false }).keyed(Swatch::Line(colour), name);
            }
        }
        panel
    }

    fn command(&self, x: Axis) -> Panel {
        let mut steps: Vec<[f64; 2]> = Vec::new();
        let mut closed: Vec<[f64; 2]> = Vec::new();
        let mut before = None;
        for (time, close) in self.time_s.iter().zip(&self.command_close) {
            if before != Some(*close) {
                if *close {
                    closed.push([*time, *time]);
                }
                if let Some(old) = before {
                    steps.push([*time, f64::from(u8::from(old))]);
                }
                before = Some(*close);
            }
            steps.push([*time, f64::from(u8::from(*close))]);
            if let Some(stretch) = closed.last_mut().filter(|_| *close) {
                stretch[1] = *time;
            }
        }
        // Names count from the top, so closing stands above opening.
        let rows = steps.into_iter().map(|[time, close]| [time, 1.0 - close]).collect();
        let names = vec!["close".to_owned(), "open".to_owned()];
        let mut panel = Panel::new(x, Axis::names("command", names), 56.0);
        for stretch in closed {
            panel = panel.with(Layer::Stretch { x: stretch, colour: BLUE, text: String::new() });
        }
        panel.with(Layer::line(rows, MUTED))
    }
}
