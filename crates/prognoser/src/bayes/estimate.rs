//! What the estimator says after a cycle.

use leak_table::Fault;
use serde::Serialize;

use super::change::Change;
use super::posterior::Quantiles;

/// Probability of each hypothesis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FaultProbability {
    /// The leak does not grow.
    pub none: f64,
    /// A growing leak to atmosphere.
    pub atmosphere: f64,
    /// A growing leak from the supply.
    pub supply: f64,
}

impl FaultProbability {
    /// The probability of one fault.
    pub fn of(&self, fault: Fault) -> f64 {
        match fault {
            Fault::Atmosphere => self.atmosphere,
            Fault::Supply => self.supply,
        }
    }
}

/// The estimate after a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BayesEstimate {
    /// Probability of each hypothesis.
    pub probability: FaultProbability,
    /// The more probable of the two faults; leak, rate and end of life hold
    /// given it.
    pub leading: Fault,
    /// Leak area now, in m2.
    pub leak_area_m2: f64,
    /// Growth of the leak area now, in m2 per cycle.
    pub leak_rate_m2: f64,
    /// Best single estimate of the cycle at end of life: the one with the
    /// smallest expected relative error of the remaining life, or the median
    /// as long as it is likely that there is no fault.
    pub eol_cycle: f64,
    /// The distribution of the cycle at end of life.
    pub eol: Quantiles,
    /// Estimated standard deviation of the timings' noise, in s.
    pub noise_sd_s: f64,
    /// Probability that the closing and the opening time of this cycle were
    /// proper readings.
    pub inlier: [f64; 2],
    /// Residuals of this cycle's times against what was expected of them, in
    /// expected standard deviations.
    pub surprise: [Option<f64>; 2],
    /// The same residuals in s.
    pub residual_s: [Option<f64>; 2],
    /// What has changed at this cycle.
    pub change: Option<Change>,
    /// Whether the leak is taken to grow exponentially.
    pub exponential: bool,
}
