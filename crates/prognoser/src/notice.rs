//! What a user should know about a row besides the estimate.

use std::fmt;

use leak_table::{Condition, Stroke};
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
    /// Both times are zero: nothing moved the switches.
    DeadSwitch,
    /// A time is zero, which no stroke takes; it is not used.
    NoStroke {
        /// The stroke.
        stroke: Stroke,
    },
    /// A time is so far from all that the tables know that it must be in another unit; it is not used.
    OtherUnit {
        /// The stroke.
        stroke: Stroke,
        /// The time in s.
        found_s: f64,
        /// Shortest time in the tables, in s.
        shortest_s: f64,
        /// Longest time in the tables, in s.
        longest_s: f64,
    },
    /// The two times do not fit the tables, and would if they were exchanged; they are not used.
    Exchanged,
    /// The times are exactly those of the rows before, too often for times that are measured; they are not used.
    RepeatedTimes {
        /// Rows that repeat the one before, this one included.
        rows: u64,
        /// Cycle of the first of them.
        since: u64,
    },
    /// A condition is so far from what the tables cover that nothing is known of the times; they are not used.
    FarConditions {
        /// Which.
        condition: Condition,
        /// What the row states, Pa absolute or K.
        found: f64,
        /// Least and most that the tables cover.
        covered: (f64, f64),
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
    /// The wear fell.
    Repaired,
    /// The wear stepped up.
    GrowthChanged,
    /// Nothing that was known of the valve explains its last rows: the estimate starts anew.
    BegunAnew,
    /// The times are again what they were while the valve was healthy, after others that nothing explained.
    AsBefore,
    /// The wear grows along a curve rather than by the same amount every cycle.
    GrowthCurved,
    /// The wear rests.
    GrowthRests,
    /// The noise is larger than was stated.
    NoiseLarger {
        /// The stated standard deviation in s.
        stated_s: f64,
        /// The standard deviation found, in s.
        found_s: f64,
    },
    /// A time differs from the tables by a constant share that no wear explains.
    Offset {
        /// The stroke.
        stroke: Stroke,
        /// Found over expected, less 1.
        share: f64,
        /// Whether the valve counts as healthy at its first row.
        begins_healthy: bool,
    },
    /// Times drift as no table has it.
    Unexplained,
    /// A condition of the cycle is outside what the tables cover, or they cover
    /// none.
    ConditionsNotCovered,
    /// The time of the row is no date.
    NoDate,
    /// The date of the row does not go on from those before.
    StrangeDate,
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
            Self::DeadSwitch => "dead-switch",
            Self::NoStroke { .. } => "no-stroke",
            Self::OtherUnit { .. } => "other-unit",
            Self::Exchanged => "exchanged",
            Self::RepeatedTimes { .. } => "repeated-times",
            Self::FarConditions { .. } => "far-conditions",
            Self::AboveLimit { .. } => "above-limit",
            Self::OutsideTables { .. } => "outside-tables",
            Self::Glitch { .. } => "glitch",
            Self::Repaired => "repaired",
            Self::GrowthChanged => "growth-changed",
            Self::BegunAnew => "begun-anew",
            Self::AsBefore => "as-before",
            Self::GrowthCurved => "growth-curved",
            Self::GrowthRests => "growth-rests",
            Self::NoiseLarger { .. } => "noise-larger",
            Self::Offset { .. } => "offset",
            Self::Unexplained => "unexplained",
            Self::ConditionsNotCovered => "conditions-not-covered",
            Self::NoDate => "no-date",
            Self::StrangeDate => "strange-date",
        }
    }
}

impl Notice {
    /// Whether it tells what happened in this very cycle. The others say the same of many rows where they say it of one, and are
    /// as well told once with how many they are.
    pub fn is_event(&self) -> bool {
        matches!(
            self,
            Self::Repaired
                | Self::GrowthChanged
                | Self::BegunAnew
                | Self::AsBefore
                | Self::CounterRestarted
                | Self::Glitch { .. }
                | Self::AboveLimit { .. }
        )
    }
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::MissedCycles { count } => {
                if count == 1 {
                    write!(f, "the cycle before this one is missing")
                } else {
                    write!(f, "{count} cycles before this one are missing")
                }
            }
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
            Self::DeadSwitch => {
                write!(
                    f,
                    "both times are 0 s, as from a switch that is dead or a valve that was not asked to move; the row tells nothing"
                )
            }
            Self::NoStroke { stroke } => {
                write!(f, "the {stroke} time is 0 s, which no stroke takes; it is not used")
            }
            Self::OtherUnit { stroke, found_s, shortest_s, longest_s } => {
                write!(
                    f,
                    "the {stroke} time of {found_s:.4} s cannot be in s, by the tables ({shortest_s:.4} to {longest_s:.4} s); it is \
                     not used (the word stalled tells a stroke that did not end)"
                )?;
                let in_ms = found_s / 1e3;
                if shortest_s <= in_ms && in_ms <= longest_s { write!(f, ": is it in ms?") } else { Ok(()) }
            }
            Self::Exchanged => {
                write!(
                    f,
                    "the closing and the opening time would fit if they were exchanged, and do not as they are; the row is not used"
                )
            }
            Self::RepeatedTimes { rows, since } => {
                let rows = if rows == 1 { "this row".to_owned() } else { format!("{rows} rows") };
                write!(
                    f,
                    "both times are exactly those of the row before, in {rows} from cycle {since} on, which measured times that \
                     wander as these did are not: did the recorder lose its source and go on with the last value? They are not used"
                )
            }
            Self::FarConditions { condition, found, covered } => write_far(f, condition, found, covered),
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
            Self::Repaired => write!(f, "the wear fell: the valve was repaired, or mended itself"),
            Self::GrowthChanged => write!(f, "the wear stepped up; the estimate goes on from there"),
            Self::BegunAnew => write!(
                f,
                "nothing that was known of this valve explains its last rows: the estimate starts anew, and takes nothing for granted of how worn it is"
            ),
            Self::AsBefore => write!(
                f,
                "the times are again what they were while the valve was healthy: what they were in between was no wear, such as a limit switch that was moved and put right"
            ),
            Self::GrowthCurved => {
                write!(f, "the wear grows along a curve rather than by the same amount every cycle")
            }
            Self::GrowthRests => write!(f, "the wear rests; when it will go on is not known"),
            Self::NoiseLarger { stated_s, found_s } => write!(
                f,
                "the noise is {found_s:.4} s, more than the stated {stated_s:.4} s; the bounds are too narrow; state it or leave it to be estimated"
            ),
            Self::Offset { stroke, share, begins_healthy } => write_offset(f, stroke, share, begins_healthy),
            Self::Unexplained => write!(
                f,
                "no table explains these times; another effect is at work: run `valve compare` and `valve explain` on a recording of this valve"
            ),
            Self::ConditionsNotCovered => write!(
                f,
                "the tables do not cover this supply pressure or temperature, which is not or not fully corrected for; build them over what the log holds (`valve build-tables` with --supply-range and --temperature-range)"
            ),
            Self::StrangeDate => {
                write!(
                    f,
                    "the date lies before those of earlier cycles, or far behind them; it is not used until others say the same"
                )
            }
            Self::NoDate => {
                write!(f, "the time is no date of RFC 3339 such as 2026-01-31T06:00:00Z; no dates are told")
            }
        }
    }
}

fn write_offset(f: &mut fmt::Formatter<'_>, stroke: Stroke, share: f64, begins_healthy: bool) -> fmt::Result {
    write!(
        f,
        "the {stroke} time of this valve is {:+.1} % off the tables from its first row on, beside what wears, which is allowed for; either it is counted from or to another moment than theirs, from the command to the stop or what [switches] says, or this valve is not as its file describes it: `valve compare` and `valve explain` on a recording tell",
        100.0 * share
    )?;
    if begins_healthy {
        f.write_str(
            "; or it was worn when the log began: a valve counts as healthy at its first row, and with `--start unknown` it does not",
        )?;
    }
    Ok(())
}

fn write_far(f: &mut fmt::Formatter<'_>, condition: Condition, found: f64, (low, high): (f64, f64)) -> fmt::Result {
    let (what, unit, scale, zero) = match condition {
        Condition::SupplyPressure => ("supply pressure", "kPa absolute", 1e-3, 0.0),
        Condition::Temperature => ("temperature", "degC", 1.0, -273.15),
    };
    let [found, low, high] = [found, low, high].map(|value| scale * value + zero);
    write!(
        f,
        "the {what} of {found:.1} {unit} is far outside the tables ({low:.1} to {high:.1}), where they tell nothing of the times; the \
         row is not used: is it mistyped, or in another unit?"
    )
}

impl Serialize for Notice {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(2))?;
        map.serialize_entry("kind", self.kind())?;
        map.serialize_entry("message", &self.to_string())?;
        map.end()
    }
}
