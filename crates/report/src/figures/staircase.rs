//! The error staircase: how the error falls from the datasheet to the repaired
//! model, on runs fitted and on runs held out, down to the noise.

use chart::draw::Anchor;
use chart::theme::{BLUE, GREEN, INK, ORANGE};
use chart::{Axis, Figure, Layer, LineDirection, Marker, Panel, Swatch};

/// One step of the model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StaircaseStep {
    /// Its name: datasheet, calibrated, an effect.
    pub name: String,
    /// Error on the runs fitted, in units of the noise.
    pub fitted: f64,
    /// Error on runs held out, in units of the noise.
    pub held_out: Option<f64>,
}

/// The steps in order.
#[derive(Debug, Clone, Default)]
pub struct StaircaseFigure {
    /// Headline.
    pub title: String,
    /// What was gained, in a sentence.
    pub subtitle: String,
    /// The steps.
    pub steps: Vec<StaircaseStep>,
}

impl StaircaseFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let names = self.steps.iter().map(|step| step.name.clone()).collect();
        let y = Axis::logarithmic("rms error (1 = the noise)").showing(0.7);
        let top = self.steps.iter().map(|step| step.fitted.max(step.held_out.unwrap_or(0.0)));
        let y = y.showing(1.6 * top.fold(1.0, f64::max));
        let mut panel = Panel::new(Axis::names("", names), y, 260.0).with(Layer::Level {
            at: 1.0,
            direction: LineDirection::Horizontal,
            colour: GREEN,
            dashed: true,
            text: "noise".to_owned(),
        });
        let stairs = self
            .steps
            .iter()
            .enumerate()
            .flat_map(|(index, step)| {
                let middle = index as f64;
                [[middle - 0.5, step.fitted], [middle + 0.5, step.fitted]]
            })
            .collect();
        let fitted = |(index, step): (usize, &StaircaseStep)| [index as f64, step.fitted];
        let held_out = |(index, step): (usize, &StaircaseStep)| {
            Some([index as f64, step.held_out.filter(|error| error.is_finite())?])
        };
        panel = panel
            .with(Layer::line(stairs, BLUE))
            .with(Layer::dots(self.steps.iter().enumerate().map(fitted).collect(), BLUE))
            .with(Layer::Points {
                points: self.steps.iter().enumerate().filter_map(held_out).collect(),
                colour: ORANGE,
                radius: 4.5,
                marker: Marker::Diamond,
            })
            .keyed(Swatch::Line(BLUE), "runs fitted")
            .keyed(Swatch::Diamond(ORANGE), "runs held out");
        for (index, step) in self.steps.iter().enumerate() {
            let note = |value: f64, down: f64, colour| Layer::Note {
                at: [index as f64, value],
                shift: [0.0, down],
                text: figure_text(value),
                colour,
                anchor: Anchor::Middle,
            };
            panel = panel.with(note(step.fitted, 18.0, BLUE));
            if let Some(held_out) = step.held_out {
                panel = panel.with(note(held_out, -9.0, INK));
            }
        }
        Figure::new(&self.title, &self.subtitle).with(panel)
    }
}

/// Three significant digits.
fn figure_text(value: f64) -> String {
    if value >= 100.0 {
        format!("{value:.0}")
    } else if value >= 10.0 {
        format!("{value:.1}")
    } else {
        format!("{value:.2}")
    }
}
