//! The line that goes out for every line that comes in.

use serde::{Deserialize, Serialize};

use crate::bayes::FaultProbability;
use crate::fault_call::FaultCall;
use crate::notice::Notice;

/// How a valve stands, from good to bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Nothing grows.
    Healthy,
    /// The log does not tell yet, or not any more.
    Unknown,
    /// A fault grows; there is time.
    Watch,
    /// A replacement should be planned.
    Plan,
    /// The valve should be replaced before its next cycles.
    ActNow,
    /// The limit is reached.
    EolReached,
}

impl Status {
    /// All, from good to bad.
    pub const ALL: [Self; 6] = [Self::Healthy, Self::Unknown, Self::Watch, Self::Plan, Self::ActNow, Self::EolReached];

    /// The name used in output.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Healthy => "healthy",
            Self::Unknown => "unknown",
            Self::Watch => "watch",
            Self::Plan => "plan",
            Self::ActNow => "act-now",
            Self::EolReached => "eol-reached",
        }
    }
}

/// The estimate for one valve after one cycle, as programs get it.
///
/// Leak, growth, end of life and remaining life are those of the named fault,
/// or, while undecided, of the more probable one. They are missing if no fault
/// is likely.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prognosis {
    /// The valve's name.
    pub valve: String,
    /// The cycle.
    pub cycle: u64,
    /// The time of the row, as in the log.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<String>,
    /// The fault.
    pub fault: FaultCall,
    /// Probability of each hypothesis; none with least squares.
    pub fault_probability: Option<FaultProbability>,
    /// Leak area in mm2.
    pub leak_area_mm2: Option<f64>,
    /// Growth in mm2 per cycle.
    pub leak_rate_mm2_per_cycle: Option<f64>,
    /// How far the wear has come: 1 at the limit.
    pub severity: Option<f64>,
    /// Cycle at end of life.
    pub eol_cycle: Option<f64>,
    /// Remaining cycles, not below zero.
    pub rul_cycles: Option<f64>,
    /// Remaining cycles that are exceeded with a probability of 95 %.
    pub rul_p05: Option<f64>,
    /// Median of the remaining cycles.
    pub rul_p50: Option<f64>,
    /// Remaining cycles that are exceeded with a probability of 5 %.
    pub rul_p95: Option<f64>,
    /// Last cycle before which the end comes with no more than the stated risk.
    pub replace_by_cycle: Option<u64>,
    /// Date of the end of life, RFC 3339, where the log has dates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub eol_time: Option<String>,
    /// Date of `replace_by_cycle`, RFC 3339, where the log has dates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replace_by: Option<String>,
    /// Faults that these times cannot tell apart, the named one first; empty
    /// where there is but one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub fault_group: Vec<FaultCall>,
    /// What to be careful about, in words.
    pub caveat: Option<String>,
    /// How the valve stands.
    pub status: Status,
    /// Estimated standard deviation of the timings' noise in s; none with
    /// least squares.
    pub noise_s: Option<f64>,
    /// What else to know.
    pub notices: Vec<Notice>,
}
