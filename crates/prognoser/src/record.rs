//! The line that goes out for every line that comes in.

use leak_table::Fault;
use serde::Serialize;

use crate::bayes::FaultProbability;
use crate::notice::Notice;

/// The fault named for a valve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum FaultCall {
    /// A leak to atmosphere.
    Atmosphere,
    /// A leak from the supply.
    Supply,
    /// The valve does not degrade.
    None,
    /// The data do not decide.
    Undecided,
}

impl FaultCall {
    /// The name used in output.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Atmosphere => "atmosphere",
            Self::Supply => "supply",
            Self::None => "none",
            Self::Undecided => "undecided",
        }
    }

    /// The fault, if one is named.
    pub const fn fault(self) -> Option<Fault> {
        match self {
            Self::Atmosphere => Some(Fault::Atmosphere),
            Self::Supply => Some(Fault::Supply),
            Self::None | Self::Undecided => None,
        }
    }
}

impl From<Fault> for FaultCall {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Atmosphere => Self::Atmosphere,
            Fault::Supply => Self::Supply,
        }
    }
}

/// How a valve stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// No fault is named.
    Healthy,
    /// A fault is named.
    Degrading,
    /// The leak has reached its limit.
    EolReached,
}

impl Status {
    /// The name used in output.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Healthy => "healthy",
            Self::Degrading => "degrading",
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
    /// How the valve stands.
    pub status: Status,
    /// Estimated standard deviation of the timings' noise in s; none with
    /// least squares.
    pub noise_s: Option<f64>,
    /// What else to know.
    pub notices: Vec<Notice>,
}
