//! The valve signature: pressure against travel, both strokes, as valve
//! engineers read it.

use chart::theme::{BLUE, GREY, VERMILLION};
use chart::{Axis, Figure, Layer, Panel, Swatch};

/// Pressure against travel.
#[derive(Debug, Clone, Default)]
pub struct SignatureFigure {
    /// Headline.
    pub title: String,
    /// Friction band, spring rate and bench set in words.
    pub subtitle: String,
    /// Travel from open, mm, and chamber pressure, kPa gauge, while closing.
    pub closing: Vec<[f64; 2]>,
    /// The same while opening.
    pub opening: Vec<[f64; 2]>,
    /// The spring line fitted between both.
    pub spring: Vec<[f64; 2]>,
}

impl SignatureFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let x = Axis::linear("travel from open (mm)");
        let panel = Panel::new(x, Axis::linear("chamber pressure (kPa gauge)"), 300.0)
            .with(Layer::Line { points: self.spring.clone(), colour: GREY, width: 1.2, dashed: false })
            .with(Layer::line(self.closing.clone(), BLUE))
            .with(Layer::Line { points: self.opening.clone(), colour: VERMILLION, width: 2.0, dashed: true })
            .keyed(Swatch::Line(BLUE), "closing")
            .keyed(Swatch::Dashed(VERMILLION), "opening")
            .keyed(Swatch::Line(GREY), "spring line");
        Figure::new(&self.title, &self.subtitle).with(panel)
    }
}
