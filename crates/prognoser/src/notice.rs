//! What a user should know about a row besides the estimate.

use std::fmt;

use leak_table::{Fault, Stroke};
use serde::Serialize;
use serde::ser::SerializeMap;

/// A remark on one row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Notice {
    /// Cycles between the last row of this valve and this one are missing.
    MissedCycles {
        /// Number of missing cycles.
        count: u64,
    },
    /// The cycle was there before; the row is not used.
    RepeatedCycle,
    /// The row comes after later cycles; it is not used.
    OutOfOrder {
        /// The latest cycle so far.
        latest: u64,
    },
    /// The cycles of this valve started again from a lower number: the
    /// estimate starts anew.
    CounterRestarted,
    /// A stroke did not finish within the cycle.
    NotFinished {
        /// The stroke.
        stroke: Stroke,
    },
    /// A time is above its limit.
    AboveLimit {
        /// The stroke.
        stroke: Stroke,
        /// The limit in s.
        limit_s: f64,
    },
    /// A time is none that the tables know for any leak of either kind.
    OutsideTables {
        /// The stroke.
        stroke: Stroke,
        /// The time in s.
        found_s: f64,
        /// Shortest time in the tables, in s.
        shortest_s: f64,
        /// Longest time in the tables, in s.
        longest_s: f64,
    },
    /// A time does not fit the others and counts as a glitch.
    Glitch {
        /// The stroke.
        stroke: Stroke,
        /// Its distance from what was expected, in s.
        residual_s: f64,
    },
    /// The valve is healthy again; the estimate starts anew.
    Repaired,
    /// The leak stepped or changed its pace; the estimate starts anew.
    GrowthChanged,
    /// The leak grows exponentially rather than linearly.
    GrowthExponential,
    /// Earlier readings are taken for proper ones or glitches other than
    /// before.
    Reread,
    /// The noise is larger than was stated.
    NoiseLarger {
        /// The stated standard deviation in s.
        stated_s: f64,
        /// The standard deviation found, in s.
        found_s: f64,
    },
    /// A time differs from the tables by a constant that no leak explains.
    Offset {
        /// The stroke.
        stroke: Stroke,
        /// Found minus expected, in s.
        offset_s: f64,
    },
    /// Times differ from what any growing leak gives, and not at random.
    Unexplained {
        /// The fault that explains them best.
        best: Fault,
    },
}

impl Notice {
    /// A name for programs.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::MissedCycles { .. } => "missed-cycles",
            Self::RepeatedCycle => "repeated-cycle",
            Self::OutOfOrder { .. } => "out-of-order",
            Self::CounterRestarted => "counter-restarted",
            Self::NotFinished { .. } => "not-finished",
            Self::AboveLimit { .. } => "above-limit",
            Self::OutsideTables { .. } => "outside-tables",
            Self::Glitch { .. } => "glitch",
            Self::Repaired => "repaired",
            Self::GrowthChanged => "growth-changed",
            Self::GrowthExponential => "growth-exponential",
            Self::Reread => "reread",
            Self::NoiseLarger { .. } => "noise-larger",
            Self::Offset { .. } => "offset",
            Self::Unexplained { .. } => "unexplained",
        }
    }
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::MissedCycles { count } => write!(f, "{count} cycles before this one are missing"),
            Self::RepeatedCycle => {
                write!(f, "this cycle was in the log before; the row is not used")
            }
            Self::OutOfOrder { latest } => {
                write!(f, "this row comes after cycle {latest}; it is not used; sort the log to use it")
            }
            Self::CounterRestarted => {
                write!(f, "the cycles start again from a lower number; the estimate starts anew")
            }
            Self::NotFinished { stroke } => {
                write!(f, "the {stroke} stroke did not finish within the cycle")
            }
            Self::AboveLimit { stroke, limit_s } => {
                write!(f, "the {stroke} time is above its limit of {limit_s} s")
            }
            Self::OutsideTables { stroke, found_s, shortest_s, longest_s } => write!(
                f,
                "the {stroke} time of {found_s:.4} s is outside the tables ({shortest_s:.4} to {longest_s:.4} s)"
            ),
            Self::Glitch { stroke, residual_s } => {
                write!(f, "the {stroke} time is {residual_s:+.3} s off and counts as a glitch")
            }
            Self::Repaired => write!(f, "the valve is healthy again; the estimate starts anew"),
            Self::GrowthChanged => {
                write!(f, "the leak stepped or changed its pace; the estimate starts anew")
            }
            Self::GrowthExponential => {
                write!(f, "the leak grows by a factor rather than an amount per cycle")
            }
            Self::Reread => write!(f, "earlier readings were judged anew"),
            Self::NoiseLarger { stated_s, found_s } => write!(
                f,
                "the noise is {found_s:.4} s, more than the stated {stated_s:.4} s; the bounds are too narrow; state it or leave it to be estimated"
            ),
            Self::Offset { stroke, offset_s } => write!(
                f,
                "the {stroke} time is off by {offset_s:+.4} s throughout, which no leak explains; run `valve compare` and `valve explain` on a recording of this valve"
            ),
            Self::Unexplained { best } => write!(
                f,
                "no leak explains these times (a leak of kind {best} comes closest); another effect is at work: run `valve compare` and `valve explain` on a recording of this valve"
            ),
        }
    }
}

impl Serialize for Notice {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(2))?;
        map.serialize_entry("kind", self.kind())?;
        map.serialize_entry("message", &self.to_string())?;
        map.end()
    }
}
