//! What is known of an effect before it has values.

use core::fmt;

use super::Assembly;
use crate::command::Solenoid;
use crate::measurement::Measurement;
use crate::params::Parameters;

/// The largest number of parameters that an effect has.
pub const MAX_EFFECT_PARAMETERS: usize = 6;

/// What stands in for a parameter that the valve file leaves out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DefaultValue {
    /// It must be given.
    Required,
    /// This value, SI.
    Value(f64),
    /// The value of the parameter with this index of the same effect.
    SameAs(usize),
}

/// The range in which a parameter is sought, and a typical size, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitRange {
    /// Smallest physical value.
    pub lower: f64,
    /// A typical size for the valve at hand, clearly visible but not dominant.
    pub typical: f64,
    /// Largest value that still makes sense.
    pub upper: f64,
}

pub(super) const fn fixed(lower: f64, typical: f64, upper: f64) -> FitRange {
    FitRange { lower, typical, upper }
}

/// What values a parameter may take, beside being finite.
#[derive(Clone, Copy)]
pub struct Allowed {
    /// Whether a value is one of them.
    pub contains: fn(f64) -> bool,
    /// The same in words, after "expected".
    pub words: &'static str,
}

impl Allowed {
    /// All.
    pub const ANY: Self = Self { contains: |_| true, words: "a finite value" };
    /// 0 or more.
    pub const NON_NEGATIVE: Self = Self { contains: |value| value >= 0.0, words: "0 or more" };
    /// More than 0.
    pub const POSITIVE: Self = Self { contains: |value| value > 0.0, words: "more than 0" };
}

impl fmt::Debug for Allowed {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.words)
    }
}

/// How a search moves a parameter: the coordinate u that it does that in, where it starts, and what is believed of
/// it beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Search {
    /// A size: linearly from neutral (u = 0) through typical (u = 1), where it starts; nothing is known of it.
    Size,
    /// A size that is neutral at infinity: typical / u, otherwise the same.
    InverseSize,
    /// A size that is absent at no value: linearly from where it does least (u = 0) through typical (u = 1), where it starts.
    SizeFrom {
        /// Where it does least, SI.
        least: f64,
    },
    /// A shape: by factors about its default, e^u with u ~ N(0, 1).
    Shape,
    /// A shape that is never less than another parameter: u is by how much it is more, relative to that, with
    /// u ~ N(0, 1) and at most 4.
    ExcessOver {
        /// The index of the other one.
        other: usize,
        /// What the other one is, after "at least".
        least: &'static str,
        /// Where it starts.
        start: f64,
    },
    /// A shape between 0 and 1: u is its value, believed to be anywhere there; fits start in the middle.
    Share,
    /// A shape that hardly anybody knows: it stays at its default until the end of a search, and a valve file that
    /// does not mention it is as if there were no such parameter. Then with a prior about its default, of which the
    /// range is eight standard deviations wide. Its typical value is its default.
    Refinement,
}

/// One parameter of an effect.
#[derive(Debug)]
pub struct EffectParameter {
    /// The key in the valve file.
    pub name: &'static str,
    /// SI unit of the value, empty for a pure number.
    pub si_unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// What values it may take.
    pub allowed: Allowed,
    /// What stands in for it where it is left out.
    pub default: DefaultValue,
    /// Where to look for it on a given valve.
    pub range: fn(&Parameters) -> FitRange,
    /// How to look for it.
    pub search: Search,
}

impl EffectParameter {
    /// Whether it is a size of the effect: with all of them neutral it is absent.
    #[must_use]
    pub fn is_size(&self) -> bool {
        matches!(self.search, Search::Size | Search::InverseSize | Search::SizeFrom { .. })
    }

    /// Whether it is a shape that hardly anybody knows.
    #[must_use]
    pub fn is_refinement(&self) -> bool {
        self.search == Search::Refinement
    }
}

/// What an effect acts on, and how. Measurement effects change the record, not the valve.
#[derive(Debug, Clone, Copy)]
pub enum ActsOn {
    /// Forces on the piston: adds them to the equations, given the effect's values.
    Mechanics(fn(&[f64], &mut Assembly<'_>)),
    /// Gas flows and pressures, in the same way.
    Pneumatics(fn(&[f64], &mut Assembly<'_>)),
    /// When and how the solenoid switches.
    Solenoid(fn(&[f64], &mut Solenoid)),
    /// Only what the recorder writes down.
    Measurement(fn(&[f64], &mut Measurement)),
}

impl ActsOn {
    /// The part in one word: "mechanics", "pneumatics", "solenoid" or "measurement".
    #[must_use]
    pub fn part(self) -> &'static str {
        match self {
            Self::Mechanics(_) => "mechanics",
            Self::Pneumatics(_) => "pneumatics",
            Self::Solenoid(_) => "solenoid",
            Self::Measurement(_) => "measurement",
        }
    }

    /// Whether it changes what is recorded, and not the valve.
    #[must_use]
    pub fn is_measurement(self) -> bool {
        matches!(self, Self::Measurement(_))
    }
}

/// What is known of an effect.
#[derive(Debug)]
pub struct EffectInfo {
    /// Id in valve files and on the command line.
    pub id: &'static str,
    /// One line: what it is.
    pub summary: &'static str,
    /// The law, in plain text.
    pub equation: &'static str,
    /// What it does to a stroke.
    pub symptom: &'static str,
    /// Sizes met in practice, in words.
    pub typical_sizes: &'static str,
    /// Ids of the effects that look most alike in stroke data.
    pub confused_with: &'static [&'static str],
    /// Author, year.
    pub source: &'static str,
    /// What it acts on, and how.
    pub acts_on: ActsOn,
    /// Its parameters; the first one is its size.
    pub parameters: &'static [EffectParameter],
    /// The value of its sizes at which the effect is absent.
    pub neutral: f64,
}

/// Names an effect: one of the catalogue, or one that a program brings along.
#[derive(Clone, Copy)]
pub struct EffectKind(&'static EffectInfo);

impl EffectKind {
    /// The effect that this describes.
    #[must_use]
    pub const fn of(info: &'static EffectInfo) -> Self {
        Self(info)
    }

    /// What is known of the effect.
    #[must_use]
    pub const fn info(self) -> &'static EffectInfo {
        self.0
    }

    /// Id in valve files and on the command line, such as "dry-friction".
    #[must_use]
    pub fn id(self) -> &'static str {
        self.0.id
    }

    /// The effect of the catalogue with this id, if it has it.
    #[must_use]
    pub fn from_id(id: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.id() == id)
    }

    /// The effect's parameters.
    #[must_use]
    pub fn parameters(self) -> &'static [EffectParameter] {
        self.0.parameters
    }
}

/// Effects are the same that have the same id.
impl PartialEq for EffectKind {
    fn eq(&self, other: &Self) -> bool {
        self.id() == other.id()
    }
}

impl Eq for EffectKind {}

impl fmt::Debug for EffectKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.id())
    }
}
