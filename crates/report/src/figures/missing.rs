//! The force (or flow) that the model lacks, with its band, against position,
//! pressure or time; closing and opening apart.

use chart::theme::{BLUE, GREY, VERMILLION};
use chart::{Axis, Figure, Layer, LineDirection, Panel, Swatch};

/// A bin of the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MissingPoint {
    /// Place on the axis, in the unit of its label.
    pub at: f64,
    /// What is missing there.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// What is missing against one or more axes, side by side.
#[derive(Debug, Clone, Default)]
pub struct MissingFigure {
    /// Headline.
    pub title: String,
    /// What it says in a sentence.
    pub subtitle: String,
    /// Quantity and unit of the vertical axis, such as `missing force (N)`.
    pub quantity: String,
    /// Label of the axis, bins while closing, bins while opening.
    pub axes: Vec<(String, Vec<MissingPoint>, Vec<MissingPoint>)>,
}

impl MissingFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let mut figure = Figure::new(&self.title, &self.subtitle);
        figure.columns = self.axes.len().clamp(1, 2);
        for (index, (label, closing, opening)) in self.axes.iter().enumerate() {
            let quantity = if index % figure.columns == 0 { self.quantity.as_str() } else { "" };
            let mut panel =
                Panel::new(Axis::linear(label), Axis::linear(quantity).showing(0.0), 220.0).with(Layer::Level {
                    at: 0.0,
                    direction: LineDirection::Horizontal,
                    colour: GREY,
                    dashed: false,
                    text: String::new(),
                });
            // Told apart without colour too.
            for (name, bins, colour, dashed) in
                [("closing", closing, BLUE, false), ("opening", opening, VERMILLION, true)]
            {
                let band = bins
                    .iter()
                    .map(|bin| {
                        let half = 1.645 * bin.standard_error;
                        [bin.at, bin.value - half, bin.value + half]
                    })
                    .collect();
                let points = bins.iter().map(|bin| [bin.at, bin.value]).collect();
                let swatch = if dashed { Swatch::Dashed(colour) } else { Swatch::Line(colour) };
                panel = panel
                    .with(Layer::band(band, colour))
                    .with(Layer::Line { points, colour, width: 2.0, dashed })
                    .keyed(swatch, name);
            }
            figure.panels.push(panel.keyed(Swatch::Band(GREY), "5 to 95 %"));
        }
        figure
    }
}
