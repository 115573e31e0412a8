//! From predictions to figures of merit.

use leak_table::Fault;
use serde::Serialize;

use super::bound::LifeBound;
use super::life::Prediction;

/// Fractions of life at which figures are given.
pub(crate) const QUARTERS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// 10, 50 and 90 % of a quantity over lives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    /// 10 %.
    pub p10: f64,
    /// The median.
    pub p50: f64,
    /// 90 %.
    pub p90: f64,
}

impl Percentiles {
    /// Of a list, by linear interpolation between its ordered values.
    pub(crate) fn of(values: &mut [f64]) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| percentile(values, share);
        Self { p10: at(0.1), p50: at(0.5), p90: at(0.9) }
    }
}

fn percentile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let (below, above) = (place.floor(), place.ceil());
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the place is between zero and the length"
    )]
    let value = |at: f64| sorted[at as usize];
    value(below) + (place - below) * (value(above) - value(below))
}

/// How one method did on the lives of one fault at one noise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyResult {
    /// The fault.
    pub fault: Fault,
    /// Variance of the timings' noise in s2.
    pub noise_variance_s2: f64,
    /// "bayes" or "ols".
    pub method: &'static str,
    /// Number of lives.
    pub lives: usize,
    /// True end of life, in cycles.
    pub end_cycle: f64,
    /// Mean relative accuracy of a life, over lives, as a fraction.
    pub relative_accuracy: Percentiles,
    /// Cycle of convergence into the alpha cone.
    pub convergence_cycle: Percentiles,
    /// Share of all predictions whose 90 % interval holds the end; none for a
    /// method without intervals.
    pub coverage_90: Option<f64>,
    /// The same at each of [`quarters`](Self::quarters).
    pub coverage_90_at_quarters: Option<Vec<f64>>,
    /// Fractions of life at which the lists are given; the last one is the
    /// last prediction before the end.
    pub quarters: Vec<f64>,
    /// Root mean square error of the end over its bound for a start known to
    /// be zero, at each of the quarters; none without noise.
    pub eol_error_to_bound: Option<Vec<f64>>,
    /// The same over the bound for an unknown start.
    pub eol_error_to_bound_unknown_start: Option<Vec<f64>>,
    /// Share of lives inside the alpha cone at each of the quarters.
    pub alpha_lambda_accuracy: Vec<f64>,
    /// Cycles before the end from which on the predicted end stays within
    /// alpha of it.
    pub prognostic_horizon: Percentiles,
    /// Cycle from which on the right fault is isolated, its median.
    pub isolation_cycle: f64,
    /// The same, not exceeded by 95 % of the lives.
    pub isolation_cycle_p95: f64,
    /// Share of lives in which the right fault is isolated at cycle 3.
    pub isolated_at_cycle_3: f64,
    /// Share of lives in which a wrong fault was ever named.
    pub false_call_share: f64,
}

/// What a set of lives was about.
pub(crate) struct Frame<'a> {
    pub fault: Fault,
    pub noise_variance_s2: f64,
    pub method: &'static str,
    pub end_cycle: f64,
    pub alpha: f64,
    pub first_prediction: u64,
    pub bounds: &'a [LifeBound],
}

impl StudyResult {
    /// Boils lives down; each has a prediction for every cycle.
    pub(crate) fn of(lives: &[Vec<Prediction>], frame: &Frame<'_>) -> Self {
        let end = frame.end_cycle;
        let skip = usize::try_from(frame.first_prediction).unwrap_or(usize::MAX);
        let counted = |life: &[Prediction]| life[skip.min(life.len())..].to_vec();
        let per_life =
            |figure: &dyn Fn(&[Prediction]) -> f64| lives.iter().map(|life| figure(life)).collect::<Vec<f64>>();
        let mut accuracy = per_life(&|life| {
            let used = counted(life);
            used.iter().map(|p| accuracy_of(p, end)).sum::<f64>() / used.len() as f64
        });
        let in_cone = |p: &Prediction| accuracy_of(p, end) >= 1.0 - frame.alpha;
        let mut convergence = per_life(&|life| settled(&counted(life), end, &in_cone));
        let near = |p: &Prediction| p.end.is_some_and(|predicted| (predicted - end).abs() <= frame.alpha * end);
        let mut horizon = per_life(&|life| end - settled(&counted(life), end, &near));
        let mut isolation = per_life(&|life| settled(life, end, &|p| p.isolated));
        isolation.sort_by(f64::total_cmp);

        let cells: Vec<usize> = QUARTERS.iter().map(|share| cell(*share, end, skip)).collect();
        let share_at = |test: &dyn Fn(&Prediction) -> bool, at: usize| {
            lives.iter().filter(|life| test(&life[at])).count() as f64 / lives.len() as f64
        };
        let has_interval = lives[0].iter().all(|p| p.covered.is_some());
        let covered = |p: &Prediction| p.covered == Some(true);
        let coverage = || {
            let all = lives.iter().flat_map(|life| counted(life));
            let (hits, count) = all.fold((0.0, 0.0), |(hits, n), p| (hits + f64::from(u8::from(covered(&p))), n + 1.0));
            hits / count
        };
        let to_bound = |bound: &dyn Fn(&LifeBound) -> f64| {
            (frame.noise_variance_s2 > 0.0)
                .then(|| cells.iter().map(|&at| error(lives, at, end) / bound(&frame.bounds[at])).collect())
        };
        Self {
            fault: frame.fault,
            noise_variance_s2: frame.noise_variance_s2,
            method: frame.method,
            lives: lives.len(),
            end_cycle: end,
            relative_accuracy: Percentiles::of(&mut accuracy),
            convergence_cycle: Percentiles::of(&mut convergence),
            coverage_90: has_interval.then(coverage),
            coverage_90_at_quarters: has_interval.then(|| cells.iter().map(|&at| share_at(&covered, at)).collect()),
            quarters: QUARTERS.to_vec(),
            eol_error_to_bound: to_bound(&|b| b.known_start),
            eol_error_to_bound_unknown_start: to_bound(&|b| b.unknown_start),
            alpha_lambda_accuracy: cells.iter().map(|&at| share_at(&in_cone, at)).collect(),
            prognostic_horizon: Percentiles::of(&mut horizon),
            isolation_cycle: percentile(&isolation, 0.5),
            isolation_cycle_p95: percentile(&isolation, 0.95),
            isolated_at_cycle_3: share_at(&|p| p.isolated, 3.min(lives[0].len() - 1)),
            false_call_share: lives.iter().filter(|life| life.iter().any(|p| p.false_call)).count() as f64
                / lives.len() as f64,
        }
    }
}

/// Relative accuracy of a prediction, not below zero.
fn accuracy_of(p: &Prediction, end: f64) -> f64 {
    let truth = end - p.cycle;
    p.remaining.map_or(0.0, |remaining| (1.0 - (truth - remaining.max(0.0)).abs() / truth).max(0.0))
}

/// The first cycle from which on all predictions pass, the end if there is
/// none.
fn settled(life: &[Prediction], end: f64, pass: &dyn Fn(&Prediction) -> bool) -> f64 {
    let failing = life.iter().rposition(|p| !pass(p));
    match failing {
        None => life.first().map_or(end, |p| p.cycle),
        Some(at) => life.get(at + 1).map_or(end, |p| p.cycle),
    }
}

/// Index of the prediction at a fraction of life.
fn cell(share: f64, end: f64, first: usize) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a fraction of a number of cycles")]
    let (at, last) = ((share * end).round() as usize, (end.ceil() - 1.0) as usize);
    at.clamp(first.min(last), last)
}

/// Root mean square error of the predicted end at one cycle. A life without a
/// prediction counts with an error of the whole life.
fn error(lives: &[Vec<Prediction>], at: usize, end: f64) -> f64 {
    let square = |life: &Vec<Prediction>| (life[at].end.unwrap_or(2.0 * end) - end).powi(2);
    (lives.iter().map(square).sum::<f64>() / lives.len() as f64).sqrt()
}
