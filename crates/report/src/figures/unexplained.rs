//! Where something sits that no effect of the catalogue explains: a table fitted without a law, with its
//! band, and a formula for it.

use super::MissingPoint;
use chart::theme::{BLUE, GREY, VERMILLION};
use chart::{Axis, Figure, Layer, LineDirection, Panel, Swatch};

/// What is missing along one axis.
#[derive(Debug, Clone, Default)]
pub struct UnexplainedFigure {
    /// Headline.
    pub title: String,
    /// What it says in a sentence.
    pub subtitle: String,
    /// Label of the axis.
    pub axis: String,
    /// Quantity and unit of the vertical axis.
    pub quantity: String,
    /// The table at its knots.
    pub table: Vec<MissingPoint>,
    /// The formula, in the units of the axes.
    pub formula: Vec<[f64; 2]>,
}

impl UnexplainedFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let band = self
            .table
            .iter()
            .map(|knot| {
                let half = 1.645 * knot.standard_error;
                [knot.at, knot.value - half, knot.value + half]
            })
            .collect();
        let knots: Vec<[f64; 2]> = self.table.iter().map(|knot| [knot.at, knot.value]).collect();
        let panel = Panel::new(Axis::linear(&self.axis), Axis::linear(&self.quantity).showing(0.0), 240.0)
            .with(Layer::Level {
                at: 0.0,
                direction: LineDirection::Horizontal,
                colour: GREY,
                dashed: false,
                text: String::new(),
            })
            .with(Layer::band(band, BLUE))
            .with(Layer::line(knots, BLUE))
            .with(Layer::line(self.formula.clone(), VERMILLION))
            .keyed(Swatch::Line(BLUE), "table")
            .keyed(Swatch::Band(GREY), "5 to 95 %")
            .keyed(Swatch::Line(VERMILLION), "formula");
        Figure::new(&self.title, &self.subtitle).with(panel)
    }
}
