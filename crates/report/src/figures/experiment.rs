//! The next experiment: what each surviving candidate predicts for it.

use chart::theme::{GREY, SERIES};
use chart::{Axis, Figure, Layer, Panel, Swatch};

/// What one candidate predicts.
#[derive(Debug, Clone, Default)]
pub struct Prediction {
    /// Id of the candidate.
    pub name: String,
    /// Position, mm, at the instants of the figure.
    pub position_mm: Vec<f64>,
}

/// A planned run and its predictions.
#[derive(Debug, Clone, Default)]
pub struct ExperimentFigure {
    /// Headline.
    pub title: String,
    /// The run in words and how far it separates the candidates.
    pub subtitle: String,
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// The candidates; differences are taken from the first.
    pub predictions: Vec<Prediction>,
    /// One-sigma noise of the position, mm.
    pub noise_mm: f64,
}

impl ExperimentFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let first = self.time_s.first().copied().unwrap_or(0.0);
        let last = self.time_s.last().copied().unwrap_or(1.0);
        let quiet = Axis::linear("").over(first, last).bare();
        let time = Axis::linear("time (s)").over(first, last);
        let mut position = Panel::new(quiet, Axis::linear("position (mm)"), 170.0);
        let noise =
            vec![[first, -2.0 * self.noise_mm, 2.0 * self.noise_mm], [last, -2.0 * self.noise_mm, 2.0 * self.noise_mm]];
        let mut apart = Panel::new(time, Axis::linear("apart by (mm)"), 150.0)
            .with(Layer::Band { points: noise, colour: GREY, opacity: 0.35 })
            .keyed(Swatch::Band(GREY), "noise, 2 sigma");
        let base = self.predictions.first().map_or(&[][..], |one| &one.position_mm);
        for (index, prediction) in self.predictions.iter().enumerate() {
            let colour = SERIES[index % SERIES.len()];
            let values = self.time_s.iter().zip(&prediction.position_mm);
            let line = values.clone().map(|(time, value)| [*time, *value]).collect();
            let gap = values.zip(base).map(|((time, value), zero)| [*time, value - zero]).collect();
            position = position
                .with(Layer::Line { points: line, colour, width: 1.8, dashed: index > 0 })
                .keyed(Swatch::Line(colour), &prediction.name);
            apart = apart.with(Layer::line(gap, colour));
        }
        Figure::new(&self.title, &self.subtitle).with(position).with(apart)
    }
}
