//! Priors and settings of the Bayesian estimate.

/// What is known about the noise of the timings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// Its standard deviation, in s.
    Known {
        /// One sigma, in s.
        sd_s: f64,
    },
    /// Nothing but its order of magnitude: the variance has an inverse gamma
    /// prior and is estimated along with the leak.
    Estimated {
        /// How many readings the prior is worth (twice the shape parameter).
        prior_readings: f64,
        /// Standard deviation at which the prior is centred, in s.
        prior_sd_s: f64,
    },
}

/// What is known about the leak at the first cycle of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartPrior {
    /// The valve is known healthy: most likely there is no leak at all, else
    /// a small one, and hardly ever any other.
    Healthy,
    /// Any leak up to the limit.
    Unknown,
}

/// The law of growth of the leak over the cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GrowthLaw {
    /// The same amount every cycle.
    Linear,
    /// The growth itself grows, by the same factor every cycle.
    Exponential,
    /// Linear, unless the data speak clearly for exponential growth.
    Auto,
}

/// All settings of the estimate. [`Default`] gives the documented priors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BayesConfig {
    /// The noise of the timings.
    pub noise: Noise,
    /// The leak at the first cycle.
    pub start: StartPrior,
    /// With a healthy start: probability that there is no leak at all at the
    /// first cycle.
    pub no_start_leak: f64,
    /// With a healthy start: standard deviation of the leak at the first
    /// cycle if there is one, as a fraction of the leak at end of life.
    pub start_sd: f64,
    /// With a healthy start: probability that this is wrong and the first leak
    /// may be any up to the limit.
    pub wrong_start: f64,
    /// Cycles from no leak to end of life: median of a log-normal prior.
    pub life_median_cycles: f64,
    /// Standard deviation of the logarithm of those cycles.
    pub life_ln_sd: f64,
    /// Probability, before any data, that the valve does not degrade; the two
    /// faults share the rest equally.
    pub no_fault: f64,
    /// Share of timings expected to be glitches that say nothing.
    pub outlier_share: f64,
    /// The law of growth.
    pub growth: GrowthLaw,
    /// Probability from which on a fault (or none) is named instead of
    /// "undecided". With even odds at the start, a valve that stays healthy is
    /// ever called faulty with at most one minus this probability (Ville's
    /// inequality), however long it is watched.
    pub name_from: f64,
}

impl Default for BayesConfig {
    fn default() -> Self {
        Self {
            noise: Noise::Estimated { prior_readings: 2.0, prior_sd_s: 0.012 },
            start: StartPrior::Healthy,
            no_start_leak: 0.8,
            start_sd: 0.01,
            wrong_start: 0.01,
            life_median_cycles: 50.0,
            life_ln_sd: 1.25,
            no_fault: 0.5,
            outlier_share: 0.005,
            growth: GrowthLaw::Auto,
            name_from: 0.999,
        }
    }
}
