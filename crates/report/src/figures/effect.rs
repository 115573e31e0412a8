//! What an effect does to a stroke: the cycle without and with it.

use chart::theme::{BLUE, GREY, VERMILLION};
use chart::{Axis, Figure, Layer, Panel, Swatch};

/// A cycle without and with an effect.
#[derive(Debug, Clone, Default)]
pub struct EffectFigure {
    /// Headline.
    pub title: String,
    /// The size of the effect that is shown.
    pub subtitle: String,
    /// Time, s, and position, mm, without it.
    pub without: Vec<[f64; 2]>,
    /// Time, s, and position, mm, with it.
    pub with: Vec<[f64; 2]>,
}

impl EffectFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let panel = Panel::new(Axis::linear("time (s)"), Axis::linear("position (mm)"), 220.0)
            .with(Layer::Line { points: self.without.clone(), colour: GREY, width: 3.0, dashed: false })
            .with(Layer::Line { points: self.with.clone(), colour: VERMILLION, width: 1.8, dashed: false })
            .keyed(Swatch::Line(GREY), "without")
            .keyed(Swatch::Line(VERMILLION), "with");
        let differences: Vec<[f64; 2]> =
            self.without.iter().zip(&self.with).map(|(without, with)| [without[0], with[1] - without[1]]).collect();
        let apart = Panel::new(Axis::linear("time (s)"), Axis::linear("change (mm)"), 90.0)
            .with(Layer::line(differences, BLUE));
        let mut figure = Figure::new(&self.title, &self.subtitle).with(panel).with(apart);
        figure.panels[0].x = Axis { label: String::new(), ..figure.panels[0].x.clone() }.bare();
        figure
    }
}
