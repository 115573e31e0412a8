//! What the estimator says after a cycle.

use serde::Serialize;

use super::ending::Quantiles;
use super::part::Cause;
use super::plant::Plant;
use crate::record::FaultCall;

/// What has changed at a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The wear fell.
    Repaired,
    /// It stepped up.
    Stepped,
}

/// Probability of each hypothesis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FaultProbability {
    /// Nothing wears.
    pub none: f64,
    /// A growing leak to atmosphere.
    pub atmosphere: f64,
    /// A growing leak from the supply.
    pub supply: f64,
    /// Friction that rises.
    pub friction: f64,
    /// A spring that weakens.
    pub spring: f64,
    /// An exhaust that clogs.
    pub exhaust: f64,
    /// A supply line that clogs.
    #[serde(rename = "supply-line")]
    pub supply_line: f64,
    /// Leaks of both kinds.
    #[serde(rename = "both-leaks")]
    pub both_leaks: f64,
    /// A drift that no table has.
    pub other: f64,
}

impl FaultProbability {
    /// The probability of one fault; of "undecided", nothing.
    pub fn of(&self, fault: FaultCall) -> f64 {
        match fault {
            FaultCall::None => self.none,
            FaultCall::Atmosphere => self.atmosphere,
            FaultCall::Supply => self.supply,
            FaultCall::Friction => self.friction,
            FaultCall::Spring => self.spring,
            FaultCall::Exhaust => self.exhaust,
            FaultCall::SupplyLine => self.supply_line,
            FaultCall::BothLeaks => self.both_leaks,
            FaultCall::Other => self.other,
            FaultCall::Undecided => 0.0,
        }
    }

    pub(crate) fn add(&mut self, fault: FaultCall, share: f64) {
        let slot = match fault {
            FaultCall::None | FaultCall::Undecided => &mut self.none,
            FaultCall::Atmosphere => &mut self.atmosphere,
            FaultCall::Supply => &mut self.supply,
            FaultCall::Friction => &mut self.friction,
            FaultCall::Spring => &mut self.spring,
            FaultCall::Exhaust => &mut self.exhaust,
            FaultCall::SupplyLine => &mut self.supply_line,
            FaultCall::BothLeaks => &mut self.both_leaks,
            FaultCall::Other => &mut self.other,
        };
        *slot += share;
    }

    /// The same with something done to each.
    pub(crate) fn map(mut self, change: impl Fn(f64) -> f64) -> Self {
        for value in [
            &mut self.none,
            &mut self.atmosphere,
            &mut self.supply,
            &mut self.friction,
            &mut self.spring,
            &mut self.exhaust,
            &mut self.supply_line,
            &mut self.both_leaks,
            &mut self.other,
        ] {
            *value = change(*value);
        }
        self
    }

    /// All faults, likeliest first.
    pub(crate) fn ranked(&self) -> [(FaultCall, f64); 8] {
        let mut all = FaultCall::FAULTS.map(|fault| (fault, self.of(fault)));
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        all
    }
}

/// The name of a cause.
pub(crate) fn fault_call(cause: Cause, plant: &Plant) -> FaultCall {
    match cause {
        Cause::None => FaultCall::None,
        Cause::Wear(wear) => plant.fault_call(wear),
        Cause::Both => FaultCall::BothLeaks,
        Cause::Other => FaultCall::Other,
    }
}

/// The estimate after a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BayesEstimate {
    /// Probability of each hypothesis.
    pub probability: FaultProbability,
    /// The most probable fault; severity, growth and end of life hold given it.
    pub leading: FaultCall,
    /// Severity now: 1 at the limit. Of a free drift, the share of the way to
    /// the limit.
    pub severity: f64,
    /// Growth of the severity a cycle, now.
    pub growth: f64,
    /// Best single estimate of the cycle at end of life, the one with the
    /// smallest expected relative error, with its distribution; none while
    /// nothing wears.
    pub end: Option<EndEstimate>,
    /// Number of readings so far.
    pub readings: u64,
    /// Estimated standard deviation of the timings' noise, in s.
    pub noise_sd_s: f64,
    /// By how much a reading counts less because noise goes on.
    pub inflation: f64,
    /// Relative errors of the tables for this valve, closing and opening, with
    /// their standard deviations.
    pub unit: [(f64, f64); 2],
    /// Probability that the closing and the opening time of this cycle were
    /// proper readings.
    pub inlier: [f64; 2],
    /// Residuals of this cycle's times against what was expected of them, in s.
    pub residual_s: [Option<f64>; 2],
    /// What has changed at this cycle.
    pub change: Option<Change>,
    /// Given the fault: probability that its growth is curved, varies from
    /// cycle to cycle, and rests.
    pub curved: f64,
    /// See [`curved`](Self::curved).
    pub rough: f64,
    /// See [`curved`](Self::curved).
    pub resting: f64,
}

/// The end of life.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndEstimate {
    /// The best single estimate, a cycle.
    pub cycle: f64,
    /// The distribution.
    pub quantiles: Quantiles,
    /// The cycle before which the end comes with the configured risk.
    pub at_risk: f64,
}
