//! What a campaign hides, for the one who scores.

use serde_json::{Map, Value, json};

use crate::effects::Drawn;
use crate::hidden::Bristles;
use crate::valve::TOLERANCES;

/// What kind of thing is hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Category {
    /// Nothing but parameters off within their tolerances.
    Nothing,
    /// One effect of the catalogue.
    One,
    /// Two effects of the catalogue.
    Two,
    /// One effect outside the catalogue.
    Outside,
}

impl Category {
    /// The word for it in names and in `truth.json`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::One => "one",
            Self::Two => "two",
            Self::Outside => "outside",
        }
    }
}

/// What was recorded of a valve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    /// Traces of the position.
    Position,
    /// Traces of the position, of the chamber's and of the pipe's pressure.
    PositionAndPressures,
    /// Stroke times only.
    Timings,
}

/// How strokes differ from one to the next, one sigma each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// Delay of each switching, the absolute value of a normal number: never early.
    pub delay_s: f64,
    /// Relative preload.
    pub preload: f64,
    /// Relative flow through every orifice.
    pub flow: f64,
    /// Relative supply pressure (gauge).
    pub supply: f64,
}

/// The truth about a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Seed and index it was drawn from.
    pub seed: u64,
    /// Index within the seed.
    pub index: usize,
    /// Kind of thing hidden.
    pub category: Category,
    /// Hidden effects of the catalogue.
    pub effects: Vec<Drawn>,
    /// Hidden effects outside of it.
    pub outside: Vec<Drawn>,
    /// True over believed value of the parameters in [`TOLERANCES`].
    pub factors: [f64; 7],
    /// Whether the believed valve is the testbed's.
    pub testbed_valve: bool,
    /// How dry friction gives before it slides.
    pub bristles: Bristles,
    /// What was recorded.
    pub channels: Channels,
    /// One sigma of the position's noise.
    pub position_noise_m: f64,
    /// One sigma of stroke times' noise, zero where traces were recorded.
    pub timing_noise_s: f64,
    /// Scatter from stroke to stroke, where there is any.
    pub scatter: Option<Scatter>,
    /// Whether conditions were repeated.
    pub repeats: bool,
}

impl Truth {
    /// The text of `truth.json`.
    pub fn to_json(&self) -> String {
        let mut factors = Map::new();
        for ((key, _), factor) in TOLERANCES.iter().zip(self.factors) {
            if factor != 1.0 {
                let short = key.rsplit('.').next().unwrap_or(key);
                factors.insert(short.to_owned(), json!(factor));
            }
        }
        let list = |effects: &[Drawn]| {
            let mut map = Map::new();
            for effect in effects {
                let mut inner = Map::new();
                for p in &effect.parameters {
                    let text = format!("{:e} {}", p.value, p.unit);
                    inner.insert(p.name.to_owned(), json!({ "si": p.value, "text": text.trim() }));
                }
                map.insert(effect.id.to_owned(), Value::Object(inner));
            }
            Value::Object(map)
        };
        let channels = match self.channels {
            Channels::Position => "position",
            Channels::PositionAndPressures => "position+pressure",
            Channels::Timings => "timings",
        };
        let value = json!({
            "seed": self.seed,
            "index": self.index,
            "category": self.category.word(),
            "effects": list(&self.effects),
            "outside": list(&self.outside),
            "parameters_times": factors,
            "believed_valve": if self.testbed_valve { "testbed" } else { "drawn" },
            "bristles": match self.bristles {
                Bristles::Compliant => json!("compliant"),
                Bristles::Stiff => json!("stiff"),
                Bristles::Of(stiffness) => json!(stiffness),
            },
            "channels": channels,
            "repeats": self.repeats,
            "position_noise_mm": self.position_noise_m * 1e3,
            "timing_noise_ms": self.timing_noise_s * 1e3,
            "scatter_one_sigma": self.scatter.map(|s| json!({
                "delay_ms": s.delay_s * 1e3, "preload": s.preload, "flow": s.flow, "supply": s.supply,
            })),
        });
        format!("{value:#}\n")
    }
}
