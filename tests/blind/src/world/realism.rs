//! What is not ideal about instruments, conditions, records and laws, and how large it is.
//!
//! One table: each realism with the range of its size in a laboratory and in a plant, in the unit that its
//! comment tells. A laboratory has a few of them at once, a plant many and larger ones. Sizes are log-uniform.

use std::collections::BTreeMap;

use rand::RngExt;
use rand::rngs::StdRng;
use rand::seq::SliceRandom;
use serde_json::{Value, json};

use crate::effects::{log_uniform, three_digits};

/// Where campaigns are recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum World {
    /// The model is exact but for what is hidden; white noise of a stated size.
    Tidy,
    /// A few small realisms at once.
    Laboratory,
    /// Many and larger realisms at once.
    Plant,
}

impl World {
    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Tidy => "tidy",
            Self::Laboratory => "laboratory",
            Self::Plant => "plant",
        }
    }
}

/// Why words are no realisms.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum RealismError {
    /// There is none of that name.
    #[error("there is no realism {name:?}; there are: {}", names())]
    Unknown {
        /// What was asked for.
        name: String,
    },
    /// Its size is no number above zero.
    #[error("the size of {name} is {size:?}; a number above zero is right, such as {} to {} of a plant", usual.0, usual.1)]
    Size {
        /// Its name.
        name: &'static str,
        /// What was given.
        size: String,
        /// The range in a plant.
        usual: (f64, f64),
    },
}

fn names() -> String {
    TABLE.iter().map(|entry| entry.name).collect::<Vec<_>>().join(", ")
}

/// When a realism can be at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Where {
    Always,
    /// Only one of these at a time.
    Start,
    Pressures,
    DryFriction,
    Heating,
    Sprung,
}

struct Entry {
    name: &'static str,
    laboratory: (f64, f64),
    plant: (f64, f64),
    at: Where,
    /// How often it is picked, against the others.
    weight: usize,
}

const fn entry(name: &'static str, laboratory: (f64, f64), plant: (f64, f64), at: Where, weight: usize) -> Entry {
    Entry { name, laboratory, plant, at, weight }
}

const PRESENT: (f64, f64) = (1.0, 1.0);

const TABLE: [Entry; 35] = [
    // Shares of the stroke: one sigma by run, largest value over a record or over the stroke, step, amplitude.
    entry("zero-by-run", (2e-4, 4e-3), (2e-3, 15e-3), Where::Always, 3),
    entry("gain", (1e-3, 6e-3), (4e-3, 20e-3), Where::Always, 2),
    entry("drift", (2e-4, 2e-3), (1e-3, 6e-3), Where::Always, 2),
    entry("nonlinearity", (2e-4, 2e-3), (1e-3, 6e-3), Where::Always, 2),
    entry("quantised", (2e-4, 3e-3), (1e-3, 12e-3), Where::Always, 2),
    entry("hum", (2e-4, 1.5e-3), (5e-4, 5e-3), Where::Always, 1),
    // Correlation time of the noise over the closing time.
    entry("coloured-noise", (3e-3, 2e-2), (5e-3, 5e-2), Where::Always, 1),
    // Share of rows.
    entry("spikes", (1e-4, 1e-3), (3e-4, 5e-3), Where::Always, 2),
    entry("lost-rows", (1e-3, 1e-2), (5e-3, 8e-2), Where::Always, 1),
    // Share of the stroke, for a stop hit at twice the mean speed.
    entry("ringing", (5e-4, 5e-3), (2e-3, 2e-2), Where::Always, 1),
    // Share of the interval between rows.
    entry("jitter", (0.05, 0.3), (0.1, 0.45), Where::Always, 1),
    // Rows over a closing stroke.
    entry("slow-logger", (100.0, 400.0), (20.0, 120.0), Where::Always, 2),
    // Relative.
    entry("clock-rate", (1e-5, 2e-4), (1e-4, 1e-3), Where::Always, 1),
    entry("supply-by-run", (1e-3, 5e-3), (3e-3, 2e-2), Where::Always, 2),
    entry("supply-gauge", (2e-3, 1e-2), (5e-3, 4e-2), Where::Always, 2),
    entry("supply-sag", (5e-3, 2e-2), (1e-2, 8e-2), Where::Sprung, 1),
    entry("untolerated", (1e-3, 5e-3), (4e-3, 2e-2), Where::Always, 2),
    entry("leak-area", (5e-3, 3e-2), (2e-2, 8e-2), Where::Always, 1),
    entry("scatter", (1e-3, 6e-3), (4e-3, 4e-2), Where::Always, 3),
    // Pa.
    entry("pressure-zero", (3e2, 2e3), (1e3, 6e3), Where::Pressures, 3),
    // Relative.
    entry("pressure-gain", (1e-3, 5e-3), (3e-3, 2e-2), Where::Pressures, 1),
    // K.
    entry("temperature", (1.0, 4.0), (3.0, 20.0), Where::Always, 1),
    // s.
    entry("late-command", (1e-3, 8e-3), (4e-3, 5e-2), Where::Sprung, 1),
    entry("command-jitter", (3e-4, 3e-3), (1e-3, 1e-2), Where::Sprung, 2),
    entry("begins-filling", PRESENT, PRESENT, Where::Start, 1),
    entry("begins-moving", PRESENT, PRESENT, Where::Start, 1),
    entry("begins-before-rest", PRESENT, PRESENT, Where::Start, 1),
    entry("many-cycles", PRESENT, PRESENT, Where::Start, 2),
    // N/m.
    entry("bristles", (1e5, 1e6), (5e4, 2e6), Where::DryFriction, 8),
    // Relative.
    entry("friction-asymmetry", (0.02, 0.1), (0.05, 0.35), Where::DryFriction, 4),
    entry("friction-slope", (0.05, 0.2), (0.1, 0.5), Where::DryFriction, 4),
    // s/m.
    entry("damped-stops", (0.5, 5.0), (2.0, 30.0), Where::Always, 1),
    // Share of Perry's coefficient.
    entry("perry", (0.1, 0.4), (0.2, 1.0), Where::Always, 1),
    // Area of a silencer's pores over that of the vent.
    entry("silencer", (3.0, 8.0), (1.3, 4.0), Where::Sprung, 1),
    // J/K a W/K of exchange with the gas, s.
    entry("warm-walls", (30.0, 300.0), (5.0, 100.0), Where::Heating, 8),
];

/// Realisms that are a campaign's, each with its size and the sign it has where it has one.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Realisms {
    sizes: BTreeMap<&'static str, f64>,
}

impl Realisms {
    /// Draws a world's realisms among those that can be under the `circumstances`.
    pub(crate) fn draw(world: World, circumstances: &[Where], rng: &mut StdRng) -> Self {
        let count = match world {
            World::Tidy => return Self::default(),
            World::Laboratory => rng.random_range(2..=4),
            World::Plant => rng.random_range(6..=12),
        };
        let mut hat: Vec<&Entry> = TABLE
            .iter()
            .filter(|entry| circumstances.contains(&entry.at))
            .flat_map(|entry| std::iter::repeat_n(entry, entry.weight))
            .collect();
        hat.shuffle(rng);
        let mut drawn = Self::default();
        for entry in hat {
            if drawn.sizes.len() == count {
                break;
            }
            let starts = entry.at == Where::Start && TABLE.iter().any(|e| e.at == Where::Start && drawn.has(e.name));
            if starts || drawn.has(entry.name) {
                continue;
            }
            let (low, high) = if world == World::Plant { entry.plant } else { entry.laboratory };
            let size = if low == high { low } else { three_digits(log_uniform(rng, low, high)) };
            drawn.sizes.insert(entry.name, size);
        }
        drawn
    }

    /// Just one realism of a size, for studies.
    pub fn only(name: &'static str, size: f64) -> Self {
        Self { sizes: BTreeMap::from([(name, size)]) }
    }

    /// From words such as `gain=0.01`; the word `none` alone is no realism at all.
    pub fn from_words(words: &[String]) -> Result<Self, RealismError> {
        let mut chosen = Self::default();
        for word in words.iter().filter(|word| *word != "none") {
            let (name, size) = word.split_once('=').unwrap_or((word, "1"));
            let entry = TABLE.iter().find(|entry| entry.name == name);
            let Some(entry) = entry else { return Err(RealismError::Unknown { name: name.to_owned() }) };
            match size.parse::<f64>() {
                Ok(value) if value.is_finite() && value > 0.0 => chosen.sizes.insert(entry.name, value),
                _ => return Err(RealismError::Size { name: entry.name, size: size.to_owned(), usual: entry.plant }),
            };
        }
        Ok(chosen)
    }

    /// The size of a realism, 0 where it is not there.
    pub fn size(&self, name: &str) -> f64 {
        debug_assert!(TABLE.iter().any(|entry| entry.name == name), "{name} is no realism");
        self.sizes.get(name).copied().unwrap_or(0.0)
    }

    /// Whether a realism is there.
    pub fn has(&self, name: &str) -> bool {
        self.size(name) != 0.0
    }

    /// For the truth.
    pub(crate) fn to_json(&self) -> Value {
        json!(self.sizes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_become_realisms_and_unknown_ones_are_refused() {
        let words = |list: &[&str]| list.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
        let some = Realisms::from_words(&words(&["gain=0.01", "begins-moving"])).unwrap();
        assert_eq!((some.size("gain"), some.size("begins-moving"), some.has("hum")), (0.01, 1.0, false));
        assert_eq!(Realisms::from_words(&words(&["none"])), Ok(Realisms::default()));
        let unknown = Realisms::from_words(&words(&["gian=0.01"])).unwrap_err().to_string();
        assert!(unknown.contains("zero-by-run") && unknown.contains("gian"), "{unknown}");
        assert!(Realisms::from_words(&words(&["gain=-1"])).unwrap_err().to_string().contains("0.004 to 0.02"));
    }
}
