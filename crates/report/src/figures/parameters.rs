//! How far each parameter moved from its datasheet value, in units of its
//! tolerance. One that calibration drove far out and that an effect brings back
//! is the sign that the effect is right.

use chart::theme::{BLUE, GREY, ORANGE};
use chart::{Axis, Figure, Layer, LineDirection, Marker, Panel, Swatch};

/// A parameter at two steps of the model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ParameterShift {
    /// Its key in the valve file.
    pub name: String,
    /// Shift after calibration alone, tolerances.
    pub calibrated: f64,
    /// Its standard error, tolerances.
    pub calibrated_error: f64,
    /// Shift and standard error with the effects added, tolerances.
    pub repaired: Option<(f64, f64)>,
}

/// All calibrated parameters.
#[derive(Debug, Clone, Default)]
pub struct ParametersFigure {
    /// Headline.
    pub title: String,
    /// What it says in a sentence.
    pub subtitle: String,
    /// The parameters.
    pub parameters: Vec<ParameterShift>,
}

impl ParametersFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let names = self.parameters.iter().map(|one| one.name.clone()).collect();
        let x = Axis::linear("shift from the valve file (tolerances)").showing(-2.5).showing(2.5);
        let mut panel = Panel::new(x, Axis::names("", names), 30.0 * self.parameters.len().max(2) as f64)
            .with(Layer::Stretch { x: [-2.0, 2.0], colour: GREY, text: String::new() })
            .with(Layer::Level {
                at: 0.0,
                direction: LineDirection::Vertical,
                colour: GREY,
                dashed: false,
                text: String::new(),
            });
        let after = self.parameters.iter().any(|one| one.repaired.is_some());
        let shift = if after { 0.16 } else { 0.0 };
        panel = series(
            panel,
            ORANGE,
            Marker::Ring,
            self.parameters
                .iter()
                .enumerate()
                .map(|(row, one)| (row as f64 - shift, one.calibrated, one.calibrated_error)),
        )
        .keyed(Swatch::Ring(ORANGE), "calibrated");
        if after {
            panel = series(
                panel,
                BLUE,
                Marker::Dot,
                self.parameters.iter().enumerate().filter_map(|(row, one)| {
                    let (value, error) = one.repaired?;
                    Some((row as f64 + shift, value, error))
                }),
            )
            .keyed(Swatch::Dot(BLUE), "with the effects added");
        }
        Figure::new(&self.title, &self.subtitle).with(panel.keyed(Swatch::Band(GREY), "two tolerances"))
    }
}

fn series(
    panel: Panel,
    colour: chart::draw::Colour,
    marker: Marker,
    values: impl Iterator<Item = (f64, f64, f64)>,
) -> Panel {
    let mut points = Vec::new();
    let mut spans = Vec::new();
    for (row, value, error) in values {
        points.push([value, row]);
        spans.push([row, value - 1.645 * error, value + 1.645 * error]);
    }
    panel.with(Layer::Whiskers { spans, colour, direction: LineDirection::Horizontal }).with(Layer::Points {
        points,
        colour,
        radius: 4.2,
        marker,
    })
}
