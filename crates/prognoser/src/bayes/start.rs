//! The stories that a valve's log begins with.

use super::config::{BayesConfig, GrowthLaw, StartPrior};
use super::law::Law;
use super::noise::NoiseState;
use super::part::{Cause, Mode, Part, SIZE};
use super::plant::Plant;
use super::rate_prior::WideGrowth;

/// Relative standard deviation of the healthy times where the tables are exact.
const EXACT_SD: f64 = 0.002;
/// Mean and standard deviation of an unknown severity.
const ANY_SEVERITY: (f64, f64) = (0.4, 0.4);
/// Shares among the faults: a leak of one kind, one other wear, both leaks, and
/// a drift that no table has.
const LEAK: f64 = 0.3;
const OTHER_WEAR: f64 = 0.08;
const BOTH: f64 = 0.04;
/// The same of both leaks where there is no table of them.
const ROUGH_BOTH: f64 = 0.01;
const OTHER: f64 = 0.02;
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

/// A healthy valve: what all stories begin from.
fn healthy(config: &BayesConfig, exact: bool, shape: f64, scale: f64) -> Part {
    let sd: f64 = if exact { EXACT_SD } else { config.unit_sd };
    let share = if exact { config.unit_exact } else { 1.0 - config.unit_exact };
    let mut part = Part {
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
    };
    part.set_variances([0.0, 0.0, sd * sd, sd * sd], scale / shape);
    part
}

/// A drift that begins on a healthy valve.
pub(crate) fn drifting(from: &Part, plant: &Plant, shape: f64) -> Part {
    let sigma2 = from.scale / shape;
    let mut part = Part { cause: Cause::Other, ..*from };
    let healthy_s = [0, 1].map(|stroke| plant.healthy_s(stroke));
    let offset = |stroke: usize| from.cov[2 + stroke][2 + stroke] * sigma2 * healthy_s[stroke].powi(2);
    let drift = |stroke: usize| (DRIFT_SD * healthy_s[stroke]).powi(2);
    part.mean = [healthy_s[0] * from.mean[2], healthy_s[1] * from.mean[3], 0.0, 0.0];
    part.set_variances([offset(0), offset(1), drift(0), drift(1)], sigma2);
    part
}

/// Mean and variance of the prior of each number of a story.
pub(crate) fn priors(part: &Part, plant: &Plant) -> [(f64, f64); SIZE] {
    let unit = (0.0, part.unit_variance);
    let wide = WideGrowth::of(part.mode);
    let growth = (wide.mean, wide.sd * wide.sd);
    match part.cause {
        Cause::None => [(0.0, 0.0), (0.0, 0.0), unit, unit],
        Cause::Wear(_) => [(0.0, 0.0), growth, unit, unit],
        Cause::Both => [(0.0, 0.0), (0.0, 0.0), growth, growth],
        Cause::Other => {
            let offset = |stroke: usize| (0.0, part.unit_variance * plant.healthy_s(stroke).powi(2));
            let drift = |stroke: usize| (0.0, (DRIFT_SD * plant.healthy_s(stroke)).powi(2));
            [offset(0), offset(1), drift(0), drift(1)]
        }
    }
}

/// All stories before the first reading.
pub(crate) fn parts(plant: &Plant, config: &BayesConfig, shape: f64, scale: f64) -> Vec<Part> {
    let sigma2 = scale / shape;
    let mut parts = Vec::with_capacity(48);
    let none = [true, false].map(|exact| healthy(config, exact, shape, scale));
    for part in none {
        parts.push(Part { ln_weight: part.ln_weight + config.no_fault.ln(), ..part });
    }
    let growing = (1.0 - config.no_fault) * (1.0 - config.wrong_start);
    let prior = &config.growth_prior;
    for wear in 0..plant.wears() {
        let cause = Cause::Wear(wear);
        let ln_cause = share(cause, plant).ln();
        if config.start == StartPrior::Healthy {
            let mut add = |law: Law, mode: Mode, weight: f64, from: &[Part]| {
                for part in from {
                    let part = part.with_growth(WideGrowth::ANY, sigma2);
                    let ln_weight = part.ln_weight + ln_cause + (growing * weight).ln();
                    parts.push(Part { cause, law, mode, ln_weight, ..part });
                }
            };
            let leak = wear < 2;
            if config.growth != GrowthLaw::Exponential {
                add(Law::Linear, Mode::Steady, prior.steady, &none);
                add(Law::Linear, Mode::Rough, prior.rough, &none);
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
                    add(law, Mode::Steady, share, &none[..1]);
                }
            }
        }
        let anywhere = match config.start {
            StartPrior::Healthy => (1.0 - config.no_fault) * config.wrong_start,
            StartPrior::Unknown => 1.0 - config.no_fault,
        };
        let mut part = Part::merged(&none, shape).with_growth(WideGrowth::ANY, sigma2);
        part.mean[0] = ANY_SEVERITY.0;
        part.cov[0][0] = ANY_SEVERITY.1.powi(2) / sigma2;
        let law = if config.growth == GrowthLaw::Exponential { Law::Exponential } else { Law::Linear };
        parts.push(Part { cause, law, mode: Mode::Late, ln_weight: ln_cause + anywhere.ln(), ..part });
    }
    if config.growth != GrowthLaw::Exponential && config.start == StartPrior::Healthy {
        let mut both = none[0];
        both.cause = Cause::Both;
        let WideGrowth { mean, sd } = WideGrowth::ANY;
        both.mean = [0.0, 0.0, mean, mean];
        both.set_variances([1e-8, 1e-8, sd * sd, sd * sd], sigma2);
        both.ln_weight = (growing * share(Cause::Both, plant)).ln();
        parts.push(both);
    }
    let mut other = drifting(&Part::merged(&none, shape), plant, shape);
    other.ln_weight = (growing * share(Cause::Other, plant)).ln();
    parts.push(other);
    parts
}
