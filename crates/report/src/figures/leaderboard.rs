//! The candidates for the missing effect, by the error that remains with each of them.

use chart::draw::{Colour, text_width_px};
use chart::theme::{BLUE, GREEN, GREY, INK, SKY, VERMILLION};
use chart::{Axis, Bar, Figure, Layer, LineDirection, Marker, Panel, Swatch};

/// What the verdict says of a candidate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Standing {
    /// It is what the model lacks.
    Recommended,
    /// These data cannot tell it from what is recommended.
    Alike,
    /// Another explains the data better, or it explains nothing.
    #[default]
    Rejected,
}

/// One candidate, refitted together with the tolerated parameters. Errors are in units of the noise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Candidate {
    /// Its effects.
    pub name: String,
    /// Error that remains on the strokes fitted.
    pub fitted: f64,
    /// Error that remains on strokes that were held out, where it was measured.
    pub held_out: Option<f64>,
    /// The verdict.
    pub standing: Standing,
    /// What stands behind its bar, such as the error in mm.
    pub text: String,
}

impl Candidate {
    /// The error that counts: that on what was held out, where it is known.
    pub fn left(&self) -> f64 {
        self.held_out.unwrap_or(self.fitted)
    }
}

/// The ranking.
#[derive(Debug, Clone, Default)]
pub struct LeaderboardFigure {
    /// Headline.
    pub title: String,
    /// The verdict in a sentence.
    pub subtitle: String,
    /// The candidates, in any order.
    pub candidates: Vec<Candidate>,
    /// Error of the model without any of them, in units of the noise.
    pub without: Option<f64>,
}

/// Candidates that are drawn.
const MOST: usize = 18;
/// Share of the axis that is kept for the texts behind the longest bars.
const ROOM: f64 = 0.16;

impl LeaderboardFigure {
    /// What is recommended first, then what cannot be told from it, then the others, each by the error that it leaves.
    fn ranked(&self) -> Vec<&Candidate> {
        let mut ranked: Vec<&Candidate> = self.candidates.iter().collect();
        ranked.sort_by(|a, b| (a.standing as u8).cmp(&(b.standing as u8)).then(a.left().total_cmp(&b.left())));
        ranked.truncate(MOST);
        ranked
    }

    /// The picture.
    pub fn figure(&self) -> Figure {
        let ranked = self.ranked();
        let errors = || ranked.iter().flat_map(|one| [Some(one.fitted), one.held_out]).chain([self.without]).flatten();
        let low = 0.75 * errors().filter(|error| *error > 0.0).fold(1.0, f64::min);
        let high = 1.05 * errors().fold(1.3, f64::max);
        let high = high * (high / low).powf(ROOM);
        let colour = |standing| match standing {
            Standing::Recommended => BLUE,
            Standing::Alike => SKY,
            Standing::Rejected => GREY.towards(Colour(255, 255, 255), 0.45),
        };
        let bars = ranked.iter().enumerate().map(|(row, one)| Bar {
            at: row as f64,
            from: low,
            to: one.fitted,
            colour: colour(one.standing),
            text: one.text.clone(),
            mark: one.held_out,
        });
        let held_out: Vec<[f64; 2]> =
            ranked.iter().enumerate().filter_map(|(row, one)| Some([one.held_out?, row as f64])).collect();
        let names = ranked.iter().map(|one| one.name.clone()).collect();
        let level = |at: f64, colour: Colour| Layer::Level {
            at,
            direction: LineDirection::Vertical,
            colour,
            dashed: true,
            text: String::new(),
        };
        let x = Axis::logarithmic("rms error that remains (1 = the noise)").over(low, high);
        let mut panel = Panel::new(x, Axis::names("", names), 21.0 * ranked.len().max(2) as f64)
            .with(Layer::Bars { bars: bars.collect(), direction: LineDirection::Horizontal, thickness: 0.66 })
            .with(level(1.0, GREEN))
            .keyed(Swatch::Dashed(GREEN), "the noise");
        if let Some(without) = self.without {
            panel = panel.with(level(without, VERMILLION)).keyed(Swatch::Dashed(VERMILLION), "calibrated, no effect");
        }
        let stands = |standing| ranked.iter().position(|one| one.standing == standing);
        for (standing, text) in [
            (Standing::Recommended, "recommended"),
            (Standing::Alike, "cannot be told from it"),
            (Standing::Rejected, "other candidates"),
        ] {
            if stands(standing).is_some() {
                panel = panel.keyed(Swatch::Square(colour(standing)), text);
            }
        }
        if !held_out.is_empty() {
            panel = panel
                .with(Layer::Points { points: held_out, colour: INK, radius: 4.0, marker: Marker::Diamond })
                .keyed(Swatch::Diamond(INK), "on strokes held out");
        }
        let alike = ranked.iter().rposition(|one| one.standing == Standing::Alike);
        if let (Some(first), Some(last)) = (stands(Standing::Recommended), alike) {
            let text = "alike".to_owned();
            panel.right = panel.right.max(24.0 + text_width_px(&text, 12.0, false));
            panel = panel.with(Layer::Bracket { rows: [first as f64, last as f64], offset: 4.0, text });
        }
        Figure::new(&self.title, &self.subtitle).with(panel)
    }
}
