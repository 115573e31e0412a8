//! How hypotheses go on from one cycle to the next, and turn into each other.

use super::config::{BayesConfig, GrowthLaw, GrowthPrior};
use super::hypothesis::{Cause, Hypothesis, Mode, SIZE};
use super::law::Law;
use super::plant::Plant;
use super::rate_prior::{RatePrior, SLOW_BELOW, WideGrowth};
use super::special::quick_ln;
use super::start::{drifting, share};
use super::two_leaks::second_leaks;
use super::workspace::Turning;

/// Hypotheses that bring less than this share, as a logarithm, bring nothing.
const LN_NOTHING: f64 = -16.0;
/// Logarithm of the weight, over that of the likeliest, from which on a hypothesis whose wear can be told from none may
/// turn into another one.
const LN_LIKELY: f64 = -6.0;
/// Standard deviations of the pace that varying growth counts with at least, where its mean is less.
const LEAST_PACE_SIGMAS: f64 = 0.25;
/// Standard deviations by which a pace lies below [`SLOW_BELOW`] where growth that has begun late is a slow one.
const SLOW_SIGMAS: f64 = 2.0;
/// Cycles of the lives for which the chances of changes are stated.
const ORDINARY_LIFE_CYCLES: f64 = 50.0;
/// What the slowest wear, or one whose pace is not above none, keeps of them.
const LEAST_LIVELINESS: f64 = 1e-4;
/// Relative standard deviation of the pace after a rest.
const RESUMED_PACE: f64 = 0.3;
/// Of the hypotheses that begin late, the share at a steady pace.
const LATE_SHARE: f64 = 0.6;
/// Relative standard deviation by which a free drift changes in a cycle.
const DRIFT_TURN: f64 = 0.1;
/// The same of each of two leaks that grow together, where there is a table of them.
const BOTH_TURN: f64 = 0.03;

/// Relative standard deviation by which each of two paces changes in a cycle.
pub(crate) fn drift_turn(cause: Cause, plant: &Plant) -> f64 {
    match cause {
        Cause::Both if plant.knows_both_leaks() => BOTH_TURN,
        Cause::Both | Cause::Other => DRIFT_TURN,
        Cause::None | Cause::Wear(_) => 0.0,
    }
}

/// Moves one hypothesis on by some cycles.
#[inline]
pub(crate) fn advance(hypothesis: &mut Hypothesis, plant: &Plant, cycles: f64, prior: &GrowthPrior, shape: f64) {
    let unsteadiness = unsteadiness(hypothesis, prior);
    let steps: &[(usize, usize)] = match (hypothesis.cause, hypothesis.mode) {
        (Cause::None, _) => return,
        (Cause::Wear(_), Mode::Rest) => {
            hypothesis.rested += cycles;
            return;
        }
        (Cause::Wear(_), _) => &[(0, 1)],
        (Cause::Both | Cause::Other, _) => &[(0, 2), (1, 3)],
    };
    let sigma2 = hypothesis.scale / shape;
    for &(level, growth) in steps {
        hypothesis.mean[level] += cycles * hypothesis.mean[growth];
        for i in 0..SIZE {
            hypothesis.cov[level][i] += cycles * hypothesis.cov[growth][i];
        }
        for i in 0..SIZE {
            hypothesis.cov[i][level] += cycles * hypothesis.cov[i][growth];
        }
        let turns = drift_turn(hypothesis.cause, plant);
        if turns > 0.0 {
            hypothesis.cov[growth][growth] += cycles * (turns * hypothesis.mean[growth]).powi(2) / sigma2;
        }
    }
    if unsteadiness > 0.0 && matches!(hypothesis.cause, Cause::Wear(_)) {
        hypothesis.cov[1][1] += cycles * (unsteadiness * hypothesis.mean[1]).powi(2) / sigma2;
    }
    if hypothesis.mode == Mode::Rough {
        hypothesis.cov[0][0] += cycles * increment_variance(hypothesis, prior.roughness, sigma2) / sigma2;
    }
}

/// Relative standard deviation by which the pace of a hypothesis changes in a cycle.
pub(crate) fn unsteadiness(hypothesis: &Hypothesis, prior: &GrowthPrior) -> f64 {
    match (hypothesis.law, hypothesis.mode) {
        (Law::Linear, Mode::Wander) => prior.wander * liveliness(hypothesis).sqrt(),
        (Law::Linear, _) => 0.0,
        _ => prior.unsteadiness,
    }
}

/// Share of the chances of a change, which are stated for a cycle of growth at the pace of an ordinary life, that a slower pace has:
/// what changes growth comes with wear and not with time.
fn liveliness(hypothesis: &Hypothesis) -> f64 {
    (ORDINARY_LIFE_CYCLES * hypothesis.mean[1]).clamp(LEAST_LIVELINESS, 1.0)
}

/// Variance of one cycle's increment under varying growth.
#[inline]
fn increment_variance(hypothesis: &Hypothesis, roughness: f64, sigma2: f64) -> f64 {
    let sd = (hypothesis.cov[1][1] * sigma2).sqrt();
    (roughness * hypothesis.mean[1].max(LEAST_PACE_SIGMAS * sd)).powi(2)
}

/// The mode of growth that has begun late at the pace of a hypothesis.
pub(crate) fn late(hypothesis: &Hypothesis, shape: f64) -> Mode {
    let sd = (hypothesis.cov[1][1] * hypothesis.scale / shape).sqrt();
    if hypothesis.mean[1] + SLOW_SIGMAS * sd < SLOW_BELOW { Mode::Slow } else { Mode::Late }
}

/// The pace of a hypothesis that has turned into another one.
#[derive(Clone, Copy, Debug)]
enum Pace {
    Same,
    /// Off by this share.
    Off(f64),
    /// Any.
    Fresh,
}

/// Logarithms of the probabilities a cycle by which hypotheses turn into each other.
struct Ways<'a> {
    prior: &'a GrowthPrior,
    slow: f64,
    quick: f64,
    loosen: f64,
    steady: f64,
    rough: f64,
    pause: f64,
    roughen: f64,
    turn: f64,
}

impl<'a> Ways<'a> {
    fn new(prior: &'a GrowthPrior, slow_share: f64) -> Self {
        Self {
            prior,
            slow: quick_ln(slow_share),
            quick: quick_ln(1.0 - slow_share),
            loosen: quick_ln(prior.loosen),
            steady: quick_ln(LATE_SHARE),
            rough: quick_ln(1.0 - LATE_SHARE),
            pause: quick_ln(prior.pause),
            roughen: quick_ln(prior.roughen),
            turn: quick_ln(0.5 * prior.turn),
        }
    }
}

/// Whether a hypothesis may turn into one of a mode: the logarithm of the probability (of a
/// healthy valve that something begins to wear: in this mode), and what becomes of its pace.
fn way(hypothesis: &Hypothesis, to: Mode, ways: &Ways, likely: bool, shape: f64) -> Option<(f64, Pace)> {
    match (hypothesis.cause, hypothesis.mode) {
        (Cause::None, _) => match to {
            Mode::Late => Some((ways.quick, Pace::Fresh)),
            Mode::Slow => Some((ways.slow, Pace::Fresh)),
            _ => None,
        },
        (_, from) if from == to => Some((0.0, Pace::Same)),
        // A pace that goes on or changes is a slow one or not.
        (_, Mode::Rest | Mode::Steady) if matches!(to, Mode::Late | Mode::Slow) && late(hypothesis, shape) != to => {
            None
        }
        (_, from) if to == Mode::Wander => {
            let may = likely && hypothesis.law == Law::Linear && matches!(from, Mode::Steady | Mode::Late | Mode::Slow);
            may.then(|| (ways.loosen + quick_ln(liveliness(hypothesis)), Pace::Same))
        }
        (_, Mode::Rest) => {
            let resumed = if to == Mode::Rough { ways.rough } else { ways.steady };
            Some((resumed + quick_ln(ways.prior.resume_after(hypothesis.rested)), Pace::Off(RESUMED_PACE)))
        }
        // What has hardly grown cannot be seen to rest or to vary.
        (_, _) if !likely || hypothesis.law != Law::Linear => None,
        (_, _) if to == Mode::Rest => Some((ways.pause + quick_ln(liveliness(hypothesis)), Pace::Same)),
        (_, Mode::Late | Mode::Slow) if to == Mode::Rough => {
            Some((ways.roughen + quick_ln(liveliness(hypothesis)), Pace::Same))
        }
        (_, Mode::Steady) => Some((ways.turn + quick_ln(liveliness(hypothesis)), Pace::Off(ways.prior.new_pace))),
        _ => None,
    }
}

/// Lets hypotheses turn into each other in the course of one cycle.
pub(crate) fn turn(
    hypotheses: &mut Vec<Hypothesis>,
    Turning { made, sources }: &mut Turning,
    plant: &Plant,
    config: &BayesConfig,
    rates: &RatePrior,
    readings: f64,
    shape: f64,
) {
    if config.growth == GrowthLaw::Exponential {
        return;
    }
    let prior = &config.growth_prior;
    let onset = prior.onset_after(readings);
    let ways = Ways::new(prior, rates.slow_share);
    let top = hypotheses.iter().map(|hypothesis| hypothesis.ln_weight).fold(f64::NEG_INFINITY, f64::max);
    made.clear();
    // What goes on as it was.
    let leaves = quick_ln(1.0 - onset);
    for hypothesis in
        hypotheses.iter().filter(|hypothesis| hypothesis.mode == Mode::Steady && hypothesis.cause != Cause::Other)
    {
        let left = if hypothesis.cause == Cause::None { leaves } else { 0.0 };
        made.extend_from_slice(std::slice::from_ref(hypothesis));
        if let Some(same) = made.last_mut() {
            same.ln_weight += left;
        }
    }
    for wear in 0..plant.wears() {
        let cause = Cause::Wear(wear);
        let ln_begin = quick_ln(onset * share(cause, plant));
        sources.clear();
        for (place, hypothesis) in hypotheses.iter().enumerate() {
            if hypothesis.cause == cause || hypothesis.cause == Cause::None {
                sources.push((place, hypothesis.ln_weight > top + LN_LIKELY && hypothesis.is_seen(shape)));
            }
        }
        for mode in [Mode::Late, Mode::Slow, Mode::Rough, Mode::Wander, Mode::Rest] {
            let first = made.len();
            for &(place, likely) in sources.iter() {
                let hypothesis = &hypotheses[place];
                let Some((ln_rate, pace)) = way(hypothesis, mode, &ways, likely, shape) else {
                    continue;
                };
                let ln_weight =
                    hypothesis.ln_weight + if hypothesis.cause == Cause::None { ln_begin } else { 0.0 } + ln_rate;
                if ln_weight < top + LN_NOTHING {
                    continue;
                }
                // Copied once, and changed where it is then.
                made.extend_from_slice(std::slice::from_ref(hypothesis));
                if let Some(moved) = made.last_mut() {
                    match pace {
                        Pace::Same => {}
                        Pace::Off(by) => moved.unsettle(by, shape),
                        Pace::Fresh => moved.begin_growth(WideGrowth::of(mode), hypothesis.scale / shape),
                    }
                    if mode != hypothesis.mode {
                        moved.rested = 0.0;
                    }
                    (moved.cause, moved.law, moved.mode, moved.ln_weight) = (cause, Law::Linear, mode, ln_weight);
                }
            }
            join(made, first, shape);
        }
    }
    let first = made.len();
    let ln_drift = quick_ln(onset * share(Cause::Other, plant));
    for hypothesis in hypotheses.iter() {
        match hypothesis.cause {
            Cause::Other => made.push(*hypothesis),
            Cause::None if hypothesis.ln_weight + ln_drift > top + LN_NOTHING => {
                let drifting = drifting(hypothesis, plant, shape);
                made.push(Hypothesis { ln_weight: hypothesis.ln_weight + ln_drift, ..drifting });
            }
            _ => {}
        }
    }
    join(made, first, shape);
    if plant.knows_both_leaks() {
        second_leaks(hypotheses, made, prior, top + LN_LIKELY, shape);
    }
    std::mem::swap(hypotheses, made);
}

/// Makes one of the hypotheses from a place on, if there are any.
fn join(hypotheses: &mut Vec<Hypothesis>, first: usize, shape: f64) {
    if hypotheses.len() > first + 1 {
        hypotheses[first] = Hypothesis::merged(&hypotheses[first..], shape);
        hypotheses.truncate(first + 1);
    }
}
