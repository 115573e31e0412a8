//! The candidates for the missing effect, best first.

use crate::chart::theme::{BLUE, GREEN, GREY, SKY, VERMILLION};
use crate::chart::{Axis, Bar, Direction, Figure, Layer, Marker, Panel, Swatch};

/// One candidate, refitted together with the tolerated parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Candidate {
    /// Its id.
    pub name: String,
    /// Misfit removed on the runs fitted (drop of chi squared).
    pub gain: f64,
    /// Misfit removed on runs held out, where it was measured.
    pub held_out_gain: Option<f64>,
    /// How many strokes agree, of how many.
    pub agreeing: Option<(usize, usize)>,
    /// True for what is recommended.
    pub recommended: bool,
}

/// Candidates that the data cannot tell apart.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TwinBracket {
    /// First and last row, counted from zero at the top.
    pub rows: [usize; 2],
    /// What it says, such as `twins`.
    pub text: String,
}

/// The ranking.
#[derive(Debug, Clone, Default)]
pub struct LeaderboardFigure {
    /// Headline.
    pub title: String,
    /// The verdict in a sentence.
    pub subtitle: String,
    /// Best first.
    pub candidates: Vec<Candidate>,
    /// Groups that belong together.
    pub brackets: Vec<TwinBracket>,
    /// Gain that a candidate must pass.
    pub acceptance_gain: f64,
}

impl LeaderboardFigure {
    /// The picture.
    pub fn figure(&self) -> Figure {
        let floor = self.acceptance_gain / 30.0;
        let shown = |gain: f64| gain.max(floor);
        let names = self.candidates.iter().map(|candidate| candidate.name.clone()).collect();
        let bars = self
            .candidates
            .iter()
            .enumerate()
            .map(|(row, candidate)| Bar {
                at: row as f64,
                from: floor,
                to: shown(candidate.gain),
                colour: if candidate.recommended {
                    BLUE
                } else if candidate.gain > self.acceptance_gain {
                    SKY
                } else {
                    GREY.towards(crate::draw::Colour(255, 255, 255), 0.45)
                },
                text: match candidate.agreeing {
                    Some((yes, all)) => format!("{yes}/{all}"),
                    None => String::new(),
                },
                mark: candidate.held_out_gain.map(shown),
            })
            .collect();
        let held_out = self
            .candidates
            .iter()
            .enumerate()
            .filter_map(|(row, candidate)| Some([shown(candidate.held_out_gain?), row as f64]))
            .collect::<Vec<_>>();
        let best = self.candidates.iter().map(|candidate| candidate.gain).fold(0.0, f64::max);
        let top = 2.2 * best.max(2.0 * self.acceptance_gain);
        let mut label = "misfit removed after full refit (\u{394}\u{3c7}²)".to_owned();
        if self.candidates.iter().any(|candidate| candidate.agreeing.is_some()) {
            label.push_str("; n/m: strokes that agree");
        }
        let x = Axis::logarithmic(label).over(floor, top);
        let height = 21.0 * self.candidates.len().max(2) as f64;
        let mut panel = Panel::new(x, Axis::names("", names), height)
            .with(Layer::Bars { bars, direction: Direction::Horizontal, thickness: 0.66 })
            .with(Layer::Level {
                at: self.acceptance_gain,
                direction: Direction::Vertical,
                colour: VERMILLION,
                dashed: true,
                text: String::new(),
            })
            .keyed(Swatch::Square(BLUE), "recommended")
            .keyed(Swatch::Square(SKY), "also above the line")
            .keyed(Swatch::Dashed(VERMILLION), "needed to be accepted");
        if !held_out.is_empty() {
            panel = panel
                .with(Layer::Points { points: held_out, colour: GREEN, radius: 4.0, marker: Marker::Diamond })
                .keyed(Swatch::Diamond(GREEN), "gain on runs held out");
        }
        for bracket in &self.brackets {
            let rows = [bracket.rows[0] as f64, bracket.rows[1] as f64];
            let layer = Layer::Bracket { rows, offset: 4.0, text: bracket.text.clone() };
            panel = panel.with(layer);
            let wanted = 24.0 + crate::draw::text_width_px(&bracket.text, 12.0, false);
            panel.right = panel.right.max(wanted);
        }
        Figure::new(&self.title, &self.subtitle).with(panel)
    }
}
