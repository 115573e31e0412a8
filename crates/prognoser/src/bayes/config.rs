//! Priors and settings of the Bayesian estimate.

/// Smallest noise that can be stated, in s; a log is rounded more coarsely.
const SMALLEST_NOISE_S: f64 = 1e-6;
/// Shape of the gamma prior of the rate at which rests end.
pub(crate) const REST_SHAPE: f64 = 2.0;

/// What is known about the noise of the timings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// Its standard deviation, in s.
    Known {
        /// One sigma, in s.
        sd_s: f64,
    },
    /// Nothing but its order of magnitude: the variance has an inverse gamma
    /// prior and is estimated along with the wear.
    Estimated {
        /// How many readings the prior is worth (twice the shape parameter).
        prior_readings: f64,
        /// Standard deviation at which the prior is centred, in s.
        prior_sd_s: f64,
    },
}

impl Noise {
    /// The standard deviation at which it is expected beforehand, in s.
    pub fn expected_sd_s(self) -> f64 {
        match self {
            Self::Known { sd_s } | Self::Estimated { prior_sd_s: sd_s, .. } => sd_s.max(SMALLEST_NOISE_S),
        }
    }
}

/// What is known about the wear at the first cycle of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartPrior {
    /// The valve is known healthy: hardly ever is there any wear.
    Healthy,
    /// Any severity up to the limit.
    Unknown,
}

/// The law of growth of the wear over the cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GrowthLaw {
    /// The same amount every cycle, apart from steps, rests and repairs.
    Linear,
    /// By the same factor every cycle.
    Exponential,
    /// Any of the laws, linear growth being the likeliest beforehand.
    Auto,
}

/// How likely the kinds of growth are, before any data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrowthPrior {
    /// Shares of growth from the first cycle on: at a steady pace, with the
    /// powers 1/2, 3/2, 2 and 3, by three and by five e-foldings, and by varying
    /// increments. They sum to 1.
    pub steady: f64,
    /// See [`steady`](Self::steady).
    pub root: f64,
    /// See [`steady`](Self::steady).
    pub faster: f64,
    /// See [`steady`](Self::steady).
    pub square: f64,
    /// See [`steady`](Self::steady).
    pub cube: f64,
    /// See [`steady`](Self::steady).
    pub exponential: f64,
    /// See [`steady`](Self::steady).
    pub steep_exponential: f64,
    /// See [`steady`](Self::steady).
    pub rough: f64,
    /// Relative standard deviation by which the pace of curved growth changes
    /// in a cycle.
    pub unsteadiness: f64,
    /// The same of growth at a pace that changes little by little.
    pub wander: f64,
    /// Coefficient of variation of the increments of varying growth.
    pub roughness: f64,
    /// The same as the bounds of the end have it: larger, since leaps to come are no Gaussian.
    pub leaps: f64,
    /// Probability a cycle that wear begins on a valve of which nothing is known yet.
    pub onset: f64,
    /// Share of that which begins with a step and then rests.
    pub onset_step: f64,
    /// Probability a cycle that a second leak begins beside the one that is there.
    pub second: f64,
    /// Probability a cycle that steady growth becomes another one.
    pub turn: f64,
    /// Relative standard deviation of its new pace.
    pub new_pace: f64,
    /// Probability a cycle that growth which began late turns out to vary.
    pub roughen: f64,
    /// Probability a cycle that its pace begins to change little by little.
    pub loosen: f64,
    /// Probability a cycle that growth rests.
    pub pause: f64,
    /// Probability a cycle that it goes on, where it has just begun to rest.
    pub resume: f64,
    /// Probability a cycle of a step up or of a partial repair.
    pub step: f64,
    /// Its standard deviation, fraction of the limit.
    pub step_sd: f64,
    /// Probability a cycle that the valve is made as good as new.
    pub repair: f64,
}

/// All settings of the estimate. [`Default`] gives the documented priors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BayesConfig {
    /// The noise of the timings.
    pub noise: Noise,
    /// The wear at the first cycle.
    pub start: StartPrior,
    /// With a healthy start: probability that this is wrong and the first
    /// severity may be any up to the limit.
    pub wrong_start: f64,
    /// Cycles from health to end of life: median of a log-normal prior.
    pub life_median_cycles: f64,
    /// Whether those cycles are the counter's, stated or learnt. Else they are rows where a log has one only every so many cycles.
    pub life_is_stated: bool,
    /// Standard deviation of the logarithm of those cycles.
    pub life_ln_sd: f64,
    /// Probability, before any data, that nothing wears at the first cycle.
    pub no_fault: f64,
    /// Share of valves whose healthy times are those of the tables.
    pub unit_exact: f64,
    /// Relative standard deviation of the healthy times of the others.
    pub unit_sd: f64,
    /// Share of valves for which the tables are far off: another valve's, or times that are counted from elsewhere.
    pub unit_far: f64,
    /// Relative standard deviation of the healthy times of those.
    pub unit_far_sd: f64,
    /// Share of timings expected to be outliers that say nothing.
    pub outlier_share: f64,
    /// The law of growth.
    pub growth: GrowthLaw,
    /// How likely the kinds of growth are.
    pub growth_prior: GrowthPrior,
    /// Probability from which on a fault is named instead of "undecided".
    pub name_from: f64,
    /// Probability from which on it is said that nothing wears.
    pub healthy_from: f64,
    /// Risk that a valve ends in service which is replaced when `replace_by` says so, whatever it said before.
    pub risk: f64,
    /// Lowest and highest supply pressure that are expected, Pa absolute: the end
    /// of life is told for the one under which it comes first. Without them, for
    /// the reference of the tables.
    pub expected_supply_pa: Option<[f64; 2]>,
}

impl GrowthPrior {
    /// Probability a cycle that wear begins on a valve that was healthy for so
    /// many cycles. How often it does on this valve is not known: with a gamma
    /// prior of shape 1/2 each healthy cycle makes it less likely.
    pub fn onset_after(&self, healthy_cycles: f64) -> f64 {
        0.5 / (0.5 / self.onset + healthy_cycles)
    }

    /// Probability a cycle that growth goes on which has rested for so many. How long rests are on this valve is not known: with a
    /// gamma prior of shape [`REST_SHAPE`] each cycle at rest makes it less likely.
    pub(crate) fn resume_after(&self, rested_cycles: f64) -> f64 {
        REST_SHAPE / (REST_SHAPE / self.resume + rested_cycles)
    }

    /// Share of growth along curves from the first cycle on.
    pub fn curved(&self) -> f64 {
        self.root + self.faster + self.square + self.cube + self.exponential + self.steep_exponential
    }

    /// The same with other shares of curved and of varying growth, neither of
    /// which may take everything.
    #[must_use]
    pub fn with_shares(self, curved: f64, rough: f64) -> Self {
        let (curved, rough) = (curved.clamp(0.01, 0.6), rough.clamp(0.01, 0.3));
        let scale = curved / self.curved();
        Self {
            steady: 1.0 - curved - rough,
            root: scale * self.root,
            faster: scale * self.faster,
            square: scale * self.square,
            cube: scale * self.cube,
            exponential: scale * self.exponential,
            steep_exponential: scale * self.steep_exponential,
            rough,
            ..self
        }
    }
}

impl Default for BayesConfig {
    fn default() -> Self {
        Self {
            noise: Noise::Estimated { prior_readings: 2.0, prior_sd_s: 0.012 },
            start: StartPrior::Healthy,
            wrong_start: 0.05,
            life_median_cycles: 50.0,
            life_is_stated: false,
            life_ln_sd: 1.25,
            no_fault: 0.5,
            unit_exact: 0.6,
            unit_sd: 0.03,
            unit_far: 0.03,
            unit_far_sd: 0.12,
            outlier_share: 0.005,
            growth: GrowthLaw::Auto,
            growth_prior: GrowthPrior::default(),
            name_from: 0.999,
            healthy_from: 0.95,
            risk: 0.05,
            expected_supply_pa: None,
        }
    }
}

impl Default for GrowthPrior {
    fn default() -> Self {
        Self {
            steady: 0.67,
            root: 0.01,
            faster: 0.015,
            square: 0.03,
            cube: 0.005,
            exponential: 0.055,
            steep_exponential: 0.065,
            rough: 0.15,
            unsteadiness: 0.1,
            wander: 0.12,
            roughness: 1.1,
            leaps: 1.5,
            onset: 0.01,
            onset_step: 0.05,
            second: 0.001,
            turn: 0.004,
            new_pace: 1.0,
            loosen: 0.002,
            roughen: 0.05,
            pause: 0.004,
            resume: 0.08,
            step: 0.002,
            step_sd: 0.25,
            repair: 0.001,
        }
    }
}
