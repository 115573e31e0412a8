//! How well a fit predicts what it has not seen.
//!
//! Folds of records are held out in turn. The optimum without a fold is found by a few steps with the derivatives of the
//! whole fit, each judged by what the problem predicts there, and by a fit of its own where it matters; what it
//! predicts for the fold is the answer.

use rayon::prelude::*;

use crate::fit::{Fit, FitOptions, fit as fitted};
use crate::normal::{Normal, Posterior, Whitened, prior_cost};
use crate::problem::{Coordinate, Problem, Record, Request, Scope};
use crate::stop::Stop;

/// Predicted rows of records that were held out, observed minus predicted, by record.
#[derive(Debug, Clone, Default)]
pub struct HeldOut {
    /// With what is known of such records only beforehand: coordinates of the record at their prior means.
    pub at_mean: Vec<Vec<f64>>,
    /// With the record's own coordinates fitted to it and everything shared from the others, but for what is of measuring and
    /// the others do not tell.
    pub own: Vec<Vec<f64>>,
    /// Which folds had fits of their own.
    pub own_fits: OwnFits,
}

/// Which folds have a fit of their own, from cheap to dear: it costs about as much as fitting the whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum OwnFits {
    /// None: for what is only looked at beside others.
    #[default]
    None,
    /// Those where the quick steps end short of what they promise.
    WhereShort,
    /// All, since the derivatives of the whole fit can lead beside the optimum without promising anything there.
    All,
}

/// A record that was held out: its index, and its residuals with own coordinates at their means, and fitted.
type HeldOutRecord = (usize, Vec<f64>, Vec<f64>);

/// Folds at most of records of one condition: with more, those that are left hardly differ from one fold to the next, and five
/// to ten are as good as any number (Kohavi, IJCAI 1995).
const MOST_FOLDS: usize = 5;

/// Folds of records: by condition where there are several, else a few, to which records are dealt in turn; empty for one.
pub fn folds(problem: &dyn Problem) -> Vec<Vec<usize>> {
    let mut folds: Vec<Vec<usize>> = Vec::new();
    let records = problem.records();
    for (index, record) in records.iter().enumerate() {
        match folds.iter_mut().find(|fold| records[fold[0]].condition == record.condition) {
            Some(fold) => fold.push(index),
            None => folds.push(vec![index]),
        }
    }
    if folds.len() == 1 {
        let count = records.len().min(MOST_FOLDS);
        folds = (0..count).map(|first| (first..records.len()).step_by(count).collect()).collect();
    }
    if folds.len() == 1 { Vec::new() } else { folds }
}

/// Holds out fold after fold; nothing where there is only one, or where somebody asks to stop. `options` are those of the fit.
pub fn held_out(
    problem: &dyn Problem,
    fit: &Fit,
    folds: &[Vec<usize>],
    options: &FitOptions,
    own_fits: OwnFits,
) -> Option<HeldOut> {
    if folds.len() < 2 {
        return None;
    }
    let none = || vec![Vec::new(); problem.records().len()];
    let mut result = HeldOut { at_mean: none(), own: none(), own_fits };
    let of_folds: Vec<Option<Vec<HeldOutRecord>>> =
        folds.par_iter().map(|fold| hold_out(problem, fit, fold, options, own_fits)).collect();
    for (record, at_mean, own) in of_folds.into_iter().collect::<Option<Vec<_>>>()?.into_iter().flatten() {
        result.at_mean[record] = at_mean;
        result.own[record] = own;
    }
    Some(result)
}

/// Dampings of the step to the optimum without a fold: a long step along a poorly known direction ends beside it.
const DAMPINGS: [f64; 3] = [0.0, 0.01, 0.3];

/// A step that keeps this share of its promise is as good as any.
const KEPT: f64 = 0.9;

/// How often a point is corrected with the same derivatives for what was predicted there.
const CORRECTIONS: usize = 2;

/// Holds out one fold: of each of its records the residuals with own coordinates at their means, and fitted.
fn hold_out(
    problem: &dyn Problem,
    fit: &Fit,
    fold: &[usize],
    options: &FitOptions,
    own_fits: OwnFits,
) -> Option<Vec<HeldOutRecord>> {
    if problem.stop().is_asked() {
        return None;
    }
    let kept: Vec<usize> = (0..problem.records().len()).filter(|record| !fold.contains(record)).collect();
    let whitened = Whitened::of(problem, &fit.linear, &fit.noise, &kept);
    let mut told = vec![false; fit.u.len()];
    for (index, rows) in kept.iter().flat_map(|record| &fit.linear.columns[*record]) {
        told[*index] |= rows.iter().any(|row| *row != 0.0);
    }
    let there = kept.iter().map(|record| fit.linear.residual[*record].clone()).collect();
    let near = Near { problem, whitened: &whitened, records: &kept, coordinates: problem.coordinates() };
    let mut without = near.optimum(fit.u.clone(), there, DAMPINGS.as_slice());
    // Far from the whole fit its derivatives lead beside the optimum, and a model would be blamed for that.
    let is_short = own_fits == OwnFits::WhereShort && without.promised > fit.tolerance;
    if is_short || own_fits == OwnFits::All {
        let options = FitOptions { annealed: 0, known: Some(fit.noise.clone()), followed: 0, ..options.clone() };
        without.u = fitted(&Without::new(problem, kept), &without.u, &options)?.u;
    }
    // Shared coordinates stay: they are pinned where the others left them.
    let (mut pinned, mut start) = (problem.coordinates().to_vec(), without.u.clone());
    for ((coordinate, told), (u, fitted)) in pinned.iter_mut().zip(told).zip(start.iter_mut().zip(&fit.u)) {
        if coordinate.scope == Scope::Shared && (told || !coordinate.of_measuring) {
            (coordinate.mean, coordinate.sigma) = (*u, PINNED);
            (coordinate.lower, coordinate.upper) = (coordinate.lower.min(*u), coordinate.upper.max(*u));
        } else {
            // Close to where it belongs, which is where the derivatives were taken.
            *u = *fitted;
        }
    }
    let at_means = predicted(problem, &[without.u, start.clone()], fold)?;
    let [at_mean, at_start] = <[_; 2]>::try_from(at_means).ok()?;
    let of_record = |((record, at_mean), at_start): ((&usize, Vec<f64>), Vec<f64>)| {
        let whitened = Whitened::of(problem, &fit.linear, &fit.noise, &[*record]);
        let near = Near { problem, whitened: &whitened, records: &[*record], coordinates: &pinned };
        let own = near.optimum(start.clone(), vec![at_start], &DAMPINGS[..1]).residual.pop()?;
        Some((*record, at_mean, own))
    };
    let found: Option<Vec<HeldOutRecord>> = fold.iter().zip(at_mean).zip(at_start).map(of_record).collect();
    // What was stopped on the way to an optimum is not at it.
    found.filter(|_| !problem.stop().is_asked())
}

/// A problem without some of its records. The coordinates of these stay, and move nothing.
struct Without<'a> {
    problem: &'a dyn Problem,
    /// The records that are left, by index in the problem.
    kept: Vec<usize>,
    records: Vec<Record>,
    coordinates: Vec<Coordinate>,
}

impl<'a> Without<'a> {
    fn new(problem: &'a dyn Problem, kept: Vec<usize>) -> Self {
        let place = |record: usize| kept.iter().position(|kept| *kept == record).unwrap_or(usize::MAX);
        let renumbered = |coordinate: &Coordinate| match coordinate.scope {
            Scope::Shared => coordinate.clone(),
            Scope::Record(record) => Coordinate { scope: Scope::Record(place(record)), ..coordinate.clone() },
        };
        let coordinates = problem.coordinates().iter().map(renumbered).collect();
        let records = kept.iter().map(|record| problem.records()[*record].clone()).collect();
        Self { problem, kept, records, coordinates }
    }
}

impl Problem for Without<'_> {
    fn coordinates(&self) -> &[Coordinate] {
        &self.coordinates
    }

    fn records(&self) -> &[Record] {
        &self.records
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        let of_whole = |request: &Request| Request { record: self.kept[request.record], ..*request };
        self.problem.predict(points, &requests.iter().map(of_whole).collect::<Vec<_>>())
    }

    fn stop(&self) -> &Stop {
        self.problem.stop()
    }
}

/// The standard deviation of a coordinate that is not to move.
const PINNED: f64 = 1e-9;

/// Observed minus predicted of some records at points, point by point; nothing where one is impossible.
fn predicted(problem: &dyn Problem, points: &[Vec<f64>], records: &[usize]) -> Option<Vec<Vec<Vec<f64>>>> {
    let of_point = |point| records.iter().map(move |record| Request { point, record: *record });
    let requests: Vec<Request> = (0..points.len()).flat_map(of_point).collect();
    let predicted = problem.predict(points, &requests);
    let residual = requests.iter().zip(predicted).map(|(request, predicted)| {
        let rows = problem.records()[request.record].rows();
        predicted.map(|predicted| rows.zip(predicted).map(|(row, value)| row.observed - value).collect())
    });
    let residuals = residual.collect::<Option<Vec<Vec<f64>>>>()?;
    Some(residuals.chunks(records.len()).map(<[_]>::to_vec).collect())
}

/// What is not worth another step, nats: it moves nothing by more than a seventh of its standard deviation.
const NOT_WORTH: f64 = 0.01;

/// Some records of a problem near a point, with derivatives taken there.
struct Near<'a> {
    problem: &'a dyn Problem,
    whitened: &'a Whitened,
    records: &'a [usize],
    coordinates: &'a [Coordinate],
}

/// An optimum that steps with the same derivatives led to.
struct Optimum {
    u: Vec<f64>,
    /// Observed minus predicted there, by record.
    residual: Vec<Vec<f64>>,
    /// What another such step still promises, nats.
    promised: f64,
}

impl Near<'_> {
    /// The optimum near a point and what is left there, `residual`; never worse than the point. Where a step does not keep
    /// what it promised, more damped ones are tried beside it.
    fn optimum(&self, from: Vec<f64>, residual: Vec<Vec<f64>>, dampings: &[f64]) -> Optimum {
        let cost = |u: &[f64], normal: &Normal| normal.chi2 + prior_cost(self.coordinates, u);
        let normal = self.whitened.with_residuals(&residual);
        let mut best = (cost(&from, &normal), from, residual, normal);
        for _ in 0..=CORRECTIONS {
            let posterior = Posterior::new(self.coordinates, &best.1, &best.3);
            let mut better = None;
            for damping in dampings {
                let Some(step) = posterior.step(*damping, f64::INFINITY) else { continue };
                if 0.5 * step.predicted_gain < NOT_WORTH {
                    break;
                }
                let points = std::slice::from_ref(&step.to);
                let Some(residual) = predicted(self.problem, points, self.records).and_then(|mut all| all.pop()) else {
                    continue;
                };
                let normal = self.whitened.with_residuals(&residual);
                let there = cost(&step.to, &normal);
                if there < better.as_ref().map_or(best.0, |(least, ..): &(f64, _, _, _)| *least) {
                    better = Some((there, step.to, residual, normal));
                }
                if better.as_ref().is_some_and(|(least, ..)| best.0 - least > KEPT * step.predicted_gain) {
                    break;
                }
            }
            match better {
                Some(better) => best = better,
                None => break,
            }
        }
        let newton = Posterior::new(self.coordinates, &best.1, &best.3).newton();
        let promised = newton.map_or(f64::INFINITY, |step| 0.5 * step.predicted_gain);
        Optimum { u: best.1, residual: best.2, promised }
    }
}
