//! All hypotheses of a valve, weighed cycle by cycle.

use super::assimilate::{Meeting, Observation, Update, assimilate, assimilate_all};
use super::config::BayesConfig;
use super::estimate::Change;
use super::hypothesis::{Cause, Hypothesis, Mode, SIZE};
use super::law::Law;
use super::motion::{advance, late, turn};
use super::noise::NoiseState;
use super::plant::Plant;
use super::rate_prior::{RatePrior, WideGrowth};
use super::special::{normal_tail, quick_ln};
use super::start::{drifting, share};
use super::state::Baseline;
use super::workspace::Turning;

/// Most hypotheses kept.
pub(crate) const MOST_HYPOTHESES: usize = 44;
/// Hypotheses below this share of the likeliest, as a logarithm, are dropped.
const LN_DROP: f64 = -12.0;
/// The same of a free drift, which on a valve that was healthy for long is far less likely to begin.
const LN_DROP_OTHER: f64 = -14.0;
/// The same for steady growth since the first cycle once there were
/// [`SETTLED`] readings: it then goes into the growth since later.
const LN_SETTLED: f64 = -7.0;
const SETTLED: f64 = 30.0;
/// Probability of white noise below which what a hypothesis leaves is believed to go on from cycle to cycle.
const CORRELATED: f64 = 0.5;
/// Weight below which one of two ways to meet a reading is forgotten.
const LN_MINOR: f64 = -9.0;

/// Probability that a surprising row of a valve that nothing explained is one where the times are again what they were before: what
/// changes them at once is often found and put right.
const AS_BEFORE: f64 = 0.05;

/// What a cycle did to the hypotheses.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Outcome {
    /// How the likeliest hypothesis met the reading.
    pub update: Update,
    /// Whether the likeliest hypothesis stepped, and by how much.
    pub step: Option<f64>,
    /// Whether the likeliest hypothesis is a valve that was made as good as new.
    pub renewed: bool,
    /// Whether it is a healthy valve with the times that it had while it was surely healthy.
    pub as_before: bool,
}

impl Outcome {
    /// What has changed.
    pub(crate) fn change(&self) -> Option<Change> {
        match self.step {
            _ if self.renewed => Some(Change::Repaired),
            _ if self.as_before => Some(Change::AsBefore),
            step => step.map(|by| if by < 0.0 { Change::Repaired } else { Change::Stepped }),
        }
    }
}

/// What lies before a reading.
pub(crate) struct Past {
    /// Cycles since the one before, in units of the record.
    pub cycles: f64,
    /// Readings so far.
    pub readings: f64,
    /// Times while it was last surely healthy.
    pub healthy: Option<Baseline>,
    /// Those before the estimate began anew.
    pub before: Option<Baseline>,
}

/// Moves all hypotheses on and lets them meet a reading, in the memory for what they turn into.
pub(crate) fn step(
    (hypotheses, turning, meeting): (&mut Vec<Hypothesis>, &mut Turning, &mut Meeting),
    plant: &Plant,
    config: &BayesConfig,
    rates: &RatePrior,
    observed: &Observation,
    &Past { cycles, readings, healthy: known, before }: &Past,
) -> Outcome {
    if cycles > 0.0 {
        turn(hypotheses, turning, plant, config, rates, readings, observed.shape);
    }
    let prior = &config.growth_prior;
    let mut outcome = Outcome::default();
    let mut best = f64::NEG_INFINITY;
    let mut renewed: Option<Hypothesis> = None;
    let mut healthy: Option<Hypothesis> = None;
    let mut likeliest: Option<Hypothesis> = None;
    if cycles > 0.0 {
        for hypothesis in hypotheses.iter_mut() {
            advance(hypothesis, plant, cycles, prior, observed.shape);
        }
    }
    meeting.before.clear();
    meeting.before.extend_from_slice(hypotheses);
    assimilate_all(hypotheses, meeting, plant, observed);
    for ((after, hypothesis), update) in hypotheses.iter_mut().zip(&meeting.before).zip(&meeting.updates) {
        let update = *update;
        if matches!(hypothesis.cause, Cause::Wear(_)) && hypothesis.mode != Mode::Steady {
            after.keep_positive(0, observed.shape);
        }
        if hypothesis.cause == Cause::Both {
            for leak in 0..2 {
                // Cut row by row, what lies below none of leaks that grow from the first row on would count again and again.
                if hypothesis.mode == Mode::Late || after.is_below_none(leak, observed.shape) {
                    after.keep_positive(leak, observed.shape);
                }
            }
        }
        let mut jumped = None;
        if update.is_outlying && cycles > 0.0 && matches!(hypothesis.cause, Cause::Wear(_)) {
            let (stepped, by) = with_step(hypothesis, plant, config, observed);
            let gain = stepped.ln_weight - after.ln_weight;
            if gain > LN_MINOR {
                let merged =
                    if gain > -LN_MINOR { stepped } else { Hypothesis::merged(&[*after, stepped], observed.shape) };
                *after = merged;
                jumped = (gain > 0.0).then_some(by);
            }
            if renewed.is_none_or(|other| other.ln_weight < hypothesis.ln_weight) {
                renewed = Some(*hypothesis);
            }
        }
        if update.is_outlying
            && cycles > 0.0
            && hypothesis.cause == Cause::None
            && healthy.is_none_or(|other| other.ln_weight < hypothesis.ln_weight)
        {
            healthy = Some(*hypothesis);
        }
        if after.ln_weight > best {
            best = after.ln_weight;
            outcome = Outcome { update, step: jumped, ..Outcome::default() };
            likeliest = Some(*hypothesis);
        }
    }
    let surprised = likeliest.filter(|_| outcome.update.is_outlying && cycles > 0.0);
    if let Some(hypothesis) = renewed.filter(|_| hypotheses.iter().all(|hypothesis| hypothesis.cause != Cause::None)) {
        let mut after = as_good_as_new(&hypothesis, prior.repair);
        let before = after;
        let update = assimilate(&mut after, &before, plant, observed);
        if after.ln_weight > best {
            best = after.ln_weight;
            outcome = Outcome { update, renewed: true, ..Outcome::default() };
        }
        hypotheses.push(after);
    }
    for (healthy, wear) in healthy.iter().flat_map(|healthy| (0..plant.wears()).map(move |wear| (healthy, wear))) {
        let (after, update) = begun_by_step(healthy, wear, plant, config, observed, readings);
        if after.ln_weight > best {
            best = after.ln_weight;
            outcome = Outcome { update, step: Some(after.mean[0]), ..Outcome::default() };
        }
        hypotheses.push(after);
    }
    // Also where no table explains what came between, and that is not given up yet. Wear that a table explains is repaired.
    let as_known = |likeliest: &Hypothesis| match likeliest.cause {
        Cause::None => before,
        Cause::Other => before.or(known),
        Cause::Wear(_) | Cause::Both => None,
    };
    if let Some((likeliest, before)) = surprised.and_then(|likeliest| Some((likeliest, as_known(&likeliest)?))) {
        let sigma2 = likeliest.scale / observed.shape;
        let noise = NoiseState::default();
        let new = as_good_as_new(&likeliest, AS_BEFORE);
        let mut after = before.healthy(Hypothesis { noise, inflation: noise.inflation(), ..new }, sigma2);
        let prior = after;
        let update = assimilate(&mut after, &prior, plant, observed);
        if after.ln_weight > best {
            outcome = Outcome { update, as_before: true, ..Outcome::default() };
        }
        hypotheses.push(after);
    }
    if cycles > 0.0 {
        reconsider(hypotheses, plant, config, observed.shape, readings);
    }
    prune(hypotheses, observed.shape, readings);
    outcome
}

/// Brings back what was given up, where what is believed now speaks for it: nothing where the wear of the likeliest hypothesis
/// can no longer be told from none, and a drift that no table has where what it leaves goes on from cycle to cycle. Wear that noise
/// once looked like would else be believed for good, since other wear begins on a healthy valve.
fn reconsider(hypotheses: &mut Vec<Hypothesis>, plant: &Plant, config: &BayesConfig, shape: f64, readings: f64) {
    let prior = &config.growth_prior;
    let heaviest = hypotheses.iter().max_by(|a, b| a.ln_weight.total_cmp(&b.ln_weight));
    let Some(heaviest) = heaviest.filter(|heaviest| matches!(heaviest.cause, Cause::Wear(_))).copied() else { return };
    let has = |cause: Cause| hypotheses.iter().any(|hypothesis| hypothesis.cause == cause);
    let (has_none, has_other) = (has(Cause::None), has(Cause::Other));
    if !has_none && !heaviest.is_seen(shape) {
        hypotheses.push(as_good_as_new(&heaviest, prior.repair));
    }
    if !has_other && heaviest.noise.weight[0] < CORRELATED {
        let probability = prior.onset_after(readings) * share(Cause::Other, plant);
        hypotheses.push(drifting_from(&heaviest, plant, probability, shape, config.noise.expected_sd_s()));
    }
}

/// A drift that no table has, from where a hypothesis of wear stands, with the noise that is expected of any valve: what the
/// hypothesis had to take for noise may have been the drift.
fn drifting_from(hypothesis: &Hypothesis, plant: &Plant, probability: f64, shape: f64, noise_sd_s: f64) -> Hypothesis {
    let Cause::Wear(wear) = hypothesis.cause else { return *hypothesis };
    let times = plant.times_and_slopes(wear, hypothesis.law.severity(hypothesis.mean[0]).0);
    let noise = NoiseState::default();
    let mut healthy = as_good_as_new(hypothesis, probability);
    // The times may be as far off what it expects as what it takes for noise.
    let off_s2 = hypothesis.inflation * hypothesis.scale / shape;
    let sigma2 = noise_sd_s * noise_sd_s;
    healthy.scale = shape * sigma2;
    healthy.cov = [[0.0; SIZE]; SIZE];
    for (stroke, (time_s, _)) in times.into_iter().enumerate() {
        let healthy_s = plant.healthy_s(stroke);
        healthy.mean[2 + stroke] = time_s * (1.0 + hypothesis.mean[2 + stroke]) / healthy_s - 1.0;
        healthy.cov[2 + stroke][2 + stroke] = off_s2 / (sigma2 * healthy_s * healthy_s);
    }
    drifting(&Hypothesis { noise, inflation: noise.inflation(), ..healthy }, plant, shape)
}

/// The hypothesis with a step in this cycle, and the size of it.
fn with_step(
    hypothesis: &Hypothesis,
    plant: &Plant,
    config: &BayesConfig,
    observed: &Observation,
) -> (Hypothesis, f64) {
    let prior = &config.growth_prior;
    let mut after = *hypothesis;
    after.cov[0][0] += prior.step_sd * prior.step_sd * observed.shape / hypothesis.scale;
    after.ln_weight += prior.step.ln();
    let before = after;
    assimilate(&mut after, &before, plant, observed);
    // There is no negative severity.
    let sd = (after.cov[0][0] * after.scale / observed.shape).sqrt();
    after.ln_weight += quick_ln(normal_tail(-after.mean[0] / sd.max(1e-9)).max(1e-12));
    (after, after.mean[0] - hypothesis.mean[0])
}

/// A healthy valve on which wear begins with a step in this cycle and then rests, at any pace if it goes on.
fn begun_by_step(
    healthy: &Hypothesis,
    wear: u8,
    plant: &Plant,
    config: &BayesConfig,
    observed: &Observation,
    readings: f64,
) -> (Hypothesis, Update) {
    let prior = &config.growth_prior;
    let cause = Cause::Wear(wear);
    let sigma2 = healthy.scale / observed.shape;
    let mut after = Hypothesis { cause, mode: Mode::Rest, ..*healthy };
    after.begin_growth(WideGrowth::ANY, sigma2);
    after.cov[0][0] = prior.step_sd * prior.step_sd / sigma2;
    // Half of that Gaussian is below none, which is cut off.
    after.ln_weight += quick_ln(2.0 * prior.onset_after(readings) * prior.onset_step * share(cause, plant));
    let before = after;
    let update = assimilate(&mut after, &before, plant, observed);
    after.keep_positive(0, observed.shape);
    (after, update)
}

/// The valve of a hypothesis, without its wear.
fn as_good_as_new(hypothesis: &Hypothesis, probability: f64) -> Hypothesis {
    let mut new = *hypothesis;
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
fn join_healthy(hypotheses: &mut Vec<Hypothesis>, shape: f64) {
    let of_healthy =
        |from: usize, hypotheses: &[Hypothesis]| (from..hypotheses.len()).find(|i| hypotheses[*i].cause == Cause::None);
    let Some(first) = of_healthy(0, hypotheses) else { return };
    while let Some(other) = of_healthy(first + 1, hypotheses) {
        hypotheses[first] = Hypothesis::merged(&[hypotheses[first], hypotheses[other]], shape);
        hypotheses.swap_remove(other);
    }
}

/// Scales the weights so that the largest is 1 and drops what does not count.
fn prune(hypotheses: &mut Vec<Hypothesis>, shape: f64, readings: f64) {
    let top = hypotheses.iter().map(|hypothesis| hypothesis.ln_weight).fold(f64::NEG_INFINITY, f64::max);
    for hypothesis in hypotheses.iter_mut() {
        hypothesis.ln_weight -= top;
    }
    hypotheses.retain(|hypothesis| {
        hypothesis.ln_weight > if hypothesis.cause == Cause::Other { LN_DROP_OTHER } else { LN_DROP }
    });
    if readings > SETTLED {
        join_healthy(hypotheses, shape);
        let mut index = 0;
        while index < hypotheses.len() {
            let hypothesis = &hypotheses[index];
            let since_start = matches!(hypothesis.cause, Cause::Wear(_)) && hypothesis.mode == Mode::Steady;
            if since_start && hypothesis.ln_weight < LN_SETTLED {
                let hypothesis = hypotheses.swap_remove(index);
                let late = Hypothesis { mode: late(&hypothesis, shape), ..hypothesis };
                if hypothesis.law == Law::Linear
                    && let Some(other) = hypotheses.iter_mut().find(|other| other.same_kind(&late))
                {
                    *other = Hypothesis::merged(&[*other, late], shape);
                }
            } else {
                index += 1;
            }
        }
    }
    if hypotheses.len() > MOST_HYPOTHESES {
        hypotheses.sort_by(|a, b| b.ln_weight.total_cmp(&a.ln_weight));
        hypotheses.truncate(MOST_HYPOTHESES);
    }
}
