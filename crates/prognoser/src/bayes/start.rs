//! The hypotheses that a valve's log begins with.

use super::config::{BayesConfig, GrowthLaw, StartPrior};
use super::hypothesis::{Cause, Hypothesis, Mode, SIZE};
use super::law::Law;
use super::noise::NoiseState;
use super::plant::Plant;
use super::rate_prior::WideGrowth;

/// Relative standard deviation of the healthy times where the tables are exact.
const EXACT_SD: f64 = 0.002;
/// Mean and standard deviation of an unknown severity.
const ANY_SEVERITY: (f64, f64) = (0.4, 0.4);
/// How a leak grows that was there when the log begins, and the shares of that.
const BEGUN: [(Law, Mode, f64); 3] =
    [(Law::Linear, Mode::Late, 0.8), (Law::Exponential, Mode::Steady, 0.1), (Law::SteepExponential, Mode::Steady, 0.1)];
/// Shares among the faults: a leak of one kind, one other wear, both leaks, and
/// a drift that no table has.
const LEAK: f64 = 0.3;
const OTHER_WEAR: f64 = 0.08;
const BOTH: f64 = 0.04;
/// The same of both leaks where there is no table of them.
const ROUGH_BOTH: f64 = 0.01;
const OTHER: f64 = 0.02;
/// Variance of the severities that two leaks begin with: none to speak of.
const BEGUN_VARIANCE: f64 = 1e-8;
/// Standard deviation of a free drift, share of the healthy time a cycle.
const DRIFT_SD: f64 = 0.02;

/// The share of each cause among the faults; they sum to 1.
pub(crate) fn share(cause: Cause, plant: &Plant) -> f64 {
    let others = f64::from(plant.wears().saturating_sub(2));
    let both = if plant.knows_both_leaks() { BOTH } else { ROUGH_BOTH };
    let total = 2.0 * LEAK + others * OTHER_WEAR + both + OTHER;
    let own = match cause {
        Cause::None => 0.0,
        Cause::Wear(0 | 1) => LEAK,
        Cause::Wear(_) => OTHER_WEAR,
        Cause::Both => both,
        Cause::Other => OTHER,
    };
    own / total
}

/// A healthy valve whose tables are off by a relative standard deviation, and the share of such valves: what all hypotheses
/// begin from.
fn healthy((sd, share): (f64, f64), shape: f64, scale: f64) -> Hypothesis {
    let mut hypothesis = Hypothesis {
        cause: Cause::None,
        law: Law::Linear,
        mode: Mode::Steady,
        ln_weight: share.ln(),
        mean: [0.0; SIZE],
        cov: [[0.0; SIZE]; SIZE],
        scale,
        unit_variance: sd * sd,
        tuned: scale / shape,
        unit: [0.0; 2],
        noise: NoiseState::default(),
        inflation: NoiseState::default().inflation(),
        rested: 0.0,
    };
    hypothesis.set_variances([0.0, 0.0, sd * sd, sd * sd], scale / shape);
    hypothesis
}

/// A drift that begins on a healthy valve.
pub(crate) fn drifting(from: &Hypothesis, plant: &Plant, shape: f64) -> Hypothesis {
    let sigma2 = from.scale / shape;
    let mut hypothesis = Hypothesis { cause: Cause::Other, ..*from };
    let healthy_s = [0, 1].map(|stroke| plant.healthy_s(stroke));
    let offset = |stroke: usize| from.cov[2 + stroke][2 + stroke] * sigma2 * healthy_s[stroke].powi(2);
    let drift = |stroke: usize| (DRIFT_SD * healthy_s[stroke]).powi(2);
    hypothesis.mean = [healthy_s[0] * from.mean[2], healthy_s[1] * from.mean[3], 0.0, 0.0];
    hypothesis.set_variances([offset(0), offset(1), drift(0), drift(1)], sigma2);
    hypothesis
}

/// Mean and variance of the prior of each number of a hypothesis.
pub(crate) fn priors(hypothesis: &Hypothesis, plant: &Plant) -> [(f64, f64); SIZE] {
    let unit = (0.0, hypothesis.unit_variance);
    let wide = WideGrowth::of(hypothesis.mode);
    let growth = (wide.mean, wide.sd * wide.sd);
    match hypothesis.cause {
        Cause::None => [(0.0, 0.0), (0.0, 0.0), unit, unit],
        Cause::Wear(_) => [(0.0, 0.0), growth, unit, unit],
        Cause::Both => [(0.0, 0.0), (0.0, 0.0), growth, growth],
        Cause::Other => {
            let offset = |stroke: usize| (0.0, hypothesis.unit_variance * plant.healthy_s(stroke).powi(2));
            let drift = |stroke: usize| (0.0, (DRIFT_SD * plant.healthy_s(stroke)).powi(2));
            [offset(0), offset(1), drift(0), drift(1)]
        }
    }
}

/// All hypotheses before the first reading.
pub(crate) fn hypotheses(plant: &Plant, config: &BayesConfig, shape: f64, scale: f64) -> Vec<Hypothesis> {
    let sigma2 = scale / shape;
    let mut hypotheses = Vec::with_capacity(80);
    let usual = 1.0 - config.unit_exact - config.unit_far;
    let units = [(EXACT_SD, config.unit_exact), (config.unit_sd, usual), (config.unit_far_sd, config.unit_far)];
    let none = units.map(|unit| healthy(unit, shape, scale));
    let near = &none[..2];
    for hypothesis in none {
        hypotheses.push(Hypothesis { ln_weight: hypothesis.ln_weight + config.no_fault.ln(), ..hypothesis });
    }
    let growing = (1.0 - config.no_fault) * (1.0 - config.wrong_start);
    let prior = &config.growth_prior;
    for wear in 0..plant.wears() {
        let cause = Cause::Wear(wear);
        let ln_cause = share(cause, plant).ln();
        if config.start == StartPrior::Healthy {
            let mut add = |law: Law, mode: Mode, weight: f64, from: &[Hypothesis]| {
                for hypothesis in from {
                    let hypothesis = hypothesis.with_growth(WideGrowth::ANY, sigma2);
                    let ln_weight = hypothesis.ln_weight + ln_cause + (growing * weight).ln();
                    hypotheses.push(Hypothesis { cause, law, mode, ln_weight, ..hypothesis });
                }
            };
            let leak = wear < 2;
            if config.growth != GrowthLaw::Exponential {
                add(Law::Linear, Mode::Steady, prior.steady, &none);
                add(Law::Linear, Mode::Rough, prior.rough, near);
            }
            if config.growth == GrowthLaw::Exponential {
                for law in [Law::Exponential, Law::SteepExponential, Law::SteepestExponential] {
                    add(law, Mode::Steady, 1.0 / 3.0, &none);
                }
            } else if config.growth == GrowthLaw::Auto && leak {
                for (law, share) in [
                    (Law::Root, prior.root),
                    (Law::Faster, prior.faster),
                    (Law::Square, prior.square),
                    (Law::Cube, prior.cube),
                    (Law::Exponential, prior.exponential),
                    (Law::SteepExponential, prior.steep_exponential),
                ] {
                    add(law, Mode::Steady, share, near);
                }
            }
        }
        let anywhere = match config.start {
            StartPrior::Healthy => (1.0 - config.no_fault) * config.wrong_start,
            StartPrior::Unknown => 1.0 - config.no_fault,
        };
        let mut hypothesis = Hypothesis::merged(near, shape).with_growth(WideGrowth::ANY, sigma2);
        hypothesis.mean[0] = ANY_SEVERITY.0;
        hypothesis.cov[0][0] = ANY_SEVERITY.1.powi(2) / sigma2;
        let of_any = match config.growth {
            GrowthLaw::Exponential => &[(Law::Exponential, Mode::Late, 1.0)][..],
            GrowthLaw::Auto if wear < 2 => &BEGUN,
            _ => &BEGUN[..1],
        };
        let whole: f64 = of_any.iter().map(|(.., share)| share).sum();
        for (law, mode, share) in of_any {
            let ln_weight = ln_cause + (anywhere * share / whole).ln();
            hypotheses.push(Hypothesis { cause, law: *law, mode: *mode, ln_weight, ..hypothesis });
        }
    }
    if config.growth != GrowthLaw::Exponential && config.start == StartPrior::Healthy {
        let mut both = none[0];
        both.cause = Cause::Both;
        let WideGrowth { mean, sd } = WideGrowth::ANY;
        both.mean = [0.0, 0.0, mean, mean];
        both.set_variances([BEGUN_VARIANCE, BEGUN_VARIANCE, sd * sd, sd * sd], sigma2);
        both.ln_weight = (growing * share(Cause::Both, plant)).ln();
        hypotheses.push(both);
    }
    let mut other = drifting(&Hypothesis::merged(near, shape), plant, shape);
    other.ln_weight = (growing * share(Cause::Other, plant)).ln();
    hypotheses.push(other);
    hypotheses
}
