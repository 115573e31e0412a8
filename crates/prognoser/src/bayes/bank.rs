//! All stories of a valve, weighed cycle by cycle.

use super::assimilate::{Met, Sight, assimilate};
use super::config::BayesConfig;
use super::law::Law;
use super::motion::{advance, late, turn};
use super::part::{Cause, Mode, Part, SIZE};
use super::plant::Plant;
use super::rate_prior::RatePrior;
use super::special::{normal_tail, quick_ln};

/// Most stories kept.
pub(crate) const MOST_PARTS: usize = 44;
/// Stories below this share of the likeliest, as a logarithm, are dropped.
const LN_DROP: f64 = -12.0;
/// The same of a free drift, which on a valve that was healthy for long is far less likely to begin.
const LN_DROP_OTHER: f64 = -14.0;
/// The same for steady growth since the first cycle once there were
/// [`SETTLED`] readings: it then goes into the growth since later.
const LN_SETTLED: f64 = -7.0;
const SETTLED: f64 = 30.0;
/// Weight below which one of two ways to meet a reading is forgotten.
const LN_MINOR: f64 = -9.0;

/// What a cycle did to the stories.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Outcome {
    /// How the likeliest story met the reading.
    pub met: Met,
    /// Whether the likeliest story stepped, and by how much.
    pub step: Option<f64>,
    /// Whether the likeliest story is a valve that was made as good as new.
    pub renewed: bool,
}

/// Moves all stories on and lets them meet a reading.
pub(crate) fn step(
    parts: &mut Vec<Part>,
    plant: &Plant,
    config: &BayesConfig,
    rates: &RatePrior,
    sight: &Sight,
    cycles: f64,
    readings: f64,
) -> Outcome {
    if cycles > 0.0 {
        turn(parts, plant, config, rates, readings, sight.shape);
    }
    let prior = &config.growth_prior;
    let mut outcome = Outcome::default();
    let mut best = f64::NEG_INFINITY;
    let mut renewed: Option<Part> = None;
    for part in parts.iter_mut() {
        if cycles > 0.0 {
            advance(part, plant, cycles, prior, sight.shape);
        }
        let before = *part;
        let after = part;
        let part = &before;
        let met = assimilate(after, part, plant, sight);
        if matches!(part.cause, Cause::Wear(_)) && part.mode != Mode::Steady {
            after.keep_positive(0, sight.shape);
        }
        if part.cause == Cause::Both && part.mode == Mode::Late {
            after.keep_positive(0, sight.shape);
            after.keep_positive(1, sight.shape);
        }
        let mut jumped = None;
        if met.surprise && cycles > 0.0 && matches!(part.cause, Cause::Wear(_)) {
            let (stepped, by) = with_step(part, plant, config, sight);
            let gain = stepped.ln_weight - after.ln_weight;
            if gain > LN_MINOR {
                let merged = if gain > -LN_MINOR { stepped } else { Part::merged(&[*after, stepped], sight.shape) };
                *after = merged;
                jumped = (gain > 0.0).then_some(by);
            }
            if renewed.is_none_or(|other| other.ln_weight < part.ln_weight) {
                renewed = Some(*part);
            }
        }
        if after.ln_weight > best {
            best = after.ln_weight;
            outcome = Outcome { met, step: jumped, renewed: false };
        }
    }
    if let Some(part) = renewed.filter(|_| parts.iter().all(|part| part.cause != Cause::None)) {
        let mut after = as_good_as_new(&part, prior.repair);
        let before = after;
        let met = assimilate(&mut after, &before, plant, sight);
        if after.ln_weight > best {
            outcome = Outcome { met, step: None, renewed: true };
        }
        parts.push(after);
    }
    prune(parts, sight.shape, readings);
    outcome
}

/// The story with a step in this cycle, and the size of it.
fn with_step(part: &Part, plant: &Plant, config: &BayesConfig, sight: &Sight) -> (Part, f64) {
    let prior = &config.growth_prior;
    let mut after = *part;
    after.cov[0][0] += prior.step_sd * prior.step_sd * sight.shape / part.scale;
    after.ln_weight += prior.step.ln();
    let before = after;
    assimilate(&mut after, &before, plant, sight);
    // There is no negative severity.
    let sd = (after.cov[0][0] * after.scale / sight.shape).sqrt();
    after.ln_weight += quick_ln(normal_tail(-after.mean[0] / sd.max(1e-9)).max(1e-12));
    (after, after.mean[0] - part.mean[0])
}

/// The valve of a story, without its wear.
fn as_good_as_new(part: &Part, probability: f64) -> Part {
    let mut new = *part;
    new.cause = Cause::None;
    new.law = Law::Linear;
    new.mode = Mode::Steady;
    new.ln_weight += probability.ln();
    for growth in 0..2 {
        new.mean[growth] = 0.0;
        for i in 0..SIZE {
            new.cov[growth][i] = 0.0;
            new.cov[i][growth] = 0.0;
        }
    }
    new
}

/// Once the healthy times are known, it does not matter what was thought of
/// them before.
fn join_healthy(parts: &mut Vec<Part>, shape: f64) {
    let mut healthy = (0..parts.len()).filter(|i| parts[*i].cause == Cause::None);
    if let (Some(first), Some(second)) = (healthy.next(), healthy.next()) {
        parts[first] = Part::merged(&[parts[first], parts[second]], shape);
        parts.swap_remove(second);
    }
}

/// Scales the weights so that the largest is 1 and drops what does not count.
fn prune(parts: &mut Vec<Part>, shape: f64, readings: f64) {
    let top = parts.iter().map(|part| part.ln_weight).fold(f64::NEG_INFINITY, f64::max);
    for part in parts.iter_mut() {
        part.ln_weight -= top;
    }
    parts.retain(|part| part.ln_weight > if part.cause == Cause::Other { LN_DROP_OTHER } else { LN_DROP });
    if readings > SETTLED {
        join_healthy(parts, shape);
        let mut index = 0;
        while index < parts.len() {
            let part = &parts[index];
            let since_start = matches!(part.cause, Cause::Wear(_)) && part.mode == Mode::Steady;
            if since_start && part.ln_weight < LN_SETTLED {
                let part = parts.swap_remove(index);
                let late = Part { mode: late(&part, shape), ..part };
                if part.law == Law::Linear
                    && let Some(other) = parts.iter_mut().find(|other| other.same_story(&late))
                {
                    *other = Part::merged(&[*other, late], shape);
                }
            } else {
                index += 1;
            }
        }
    }
    if parts.len() > MOST_PARTS {
        parts.sort_by(|a, b| b.ln_weight.total_cmp(&a.ln_weight));
        parts.truncate(MOST_PARTS);
    }
}
