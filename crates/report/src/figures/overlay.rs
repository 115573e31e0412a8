//! Measured and simulated strokes with their difference on an axis of its own.

use chart::theme::{BLUE, GREY, INK, VERMILLION};
use chart::{Axis, Figure, Layer, LineDirection, Panel, Swatch};

/// One recorded run.
#[derive(Debug, Clone, Default)]
pub struct OverlayRun {
    /// Its name and conditions.
    pub name: String,
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// Measured position, mm.
    pub measured_mm: Vec<f64>,
    /// Simulated position, mm.
    pub simulated_mm: Vec<f64>,
}

/// Runs one below the other.
#[derive(Debug, Clone, Default)]
pub struct OverlayFigure {
    /// Headline.
    pub title: String,
    /// How large the error is.
    pub subtitle: String,
    /// The runs.
    pub runs: Vec<OverlayRun>,
    /// One-sigma noise of the position, mm.
    pub noise_mm: Option<f64>,
}

/// A share of a run by which another one's ends may differ on the same axis: less than a pixel.
const SAME: f64 = 1e-3;

fn ends(run: &OverlayRun) -> [f64; 2] {
    [run.time_s.first().copied().unwrap_or(0.0), run.time_s.last().copied().unwrap_or(1.0)]
}

fn is_as_long(one: &OverlayRun, other: &OverlayRun) -> bool {
    let [from, to] = ends(one);
    ends(one).into_iter().zip(ends(other)).all(|(one, other)| (one - other).abs() <= SAME * (to - from))
}

impl OverlayFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let mut figure = Figure::new(&self.title, &self.subtitle);
        for (index, run) in self.runs.iter().enumerate() {
            let key = index == 0;
            figure.panels.push(Self::position(run, key));
            // One axis of time serves runs below each other that are as long.
            let is_last = self.runs.get(index + 1).is_none_or(|next| !is_as_long(run, next));
            figure.panels.push(self.residual(run, key, is_last));
        }
        figure
    }

    /// The same as several pictures of so many runs each, so that one fits on a sheet of paper.
    pub fn sheets(&self, runs: usize) -> Vec<Figure> {
        let part = |runs: &[OverlayRun]| Self { runs: runs.to_vec(), ..self.clone() }.figure();
        self.runs.chunks(runs.max(1)).map(part).collect()
    }

    fn time(run: &OverlayRun) -> Axis {
        let [first, last] = ends(run);
        Axis::linear("").over(first, last).bare()
    }

    fn position(run: &OverlayRun, key: bool) -> Panel {
        let pair = |values: &[f64]| -> Vec<[f64; 2]> {
            run.time_s.iter().zip(values).map(|(time, value)| [*time, *value]).collect()
        };
        let measured = Layer::Line { points: pair(&run.measured_mm), colour: INK, width: 2.6, dashed: false };
        let simulated = Layer::Line { points: pair(&run.simulated_mm), colour: BLUE, width: 1.6, dashed: false };
        let panel = Panel::new(Self::time(run), Axis::linear("position (mm)"), 130.0)
            .titled(&run.name)
            .with(measured)
            .with(simulated);
        if !key {
            return panel;
        }
        panel.keyed(Swatch::Line(INK), "measured").keyed(Swatch::Line(BLUE), "simulated")
    }

    fn residual(&self, run: &OverlayRun, key: bool, last: bool) -> Panel {
        let points: Vec<[f64; 2]> = run
            .time_s
            .iter()
            .zip(run.measured_mm.iter().zip(&run.simulated_mm))
            .map(|(time, (measured, simulated))| [*time, measured - simulated])
            .collect();
        let x = Self::time(run);
        let x = if last { Axis { labelled: true, label: "time (s)".to_owned(), ..x } } else { x };
        let mut panel = Panel::new(x, Axis::linear("error (mm)").showing(0.0), 70.0);
        if let Some(noise) = self.noise_mm {
            let [from, to] = ends(run);
            let band = vec![[from, -2.0 * noise, 2.0 * noise], [to, -2.0 * noise, 2.0 * noise]];
            panel = panel.with(Layer::Band { points: band, colour: GREY, opacity: 0.35 });
            if key {
                panel = panel.keyed(Swatch::Band(GREY), "noise, 2 sigma");
            }
        }
        if key {
            panel = panel.keyed(Swatch::Line(VERMILLION), "measured \u{2212} simulated");
        }
        panel
            .with(Layer::Level {
                at: 0.0,
                direction: LineDirection::Horizontal,
                colour: GREY,
                dashed: false,
                text: String::new(),
            })
            .with(Layer::Line { points, colour: VERMILLION, width: 1.4, dashed: false })
    }
}
