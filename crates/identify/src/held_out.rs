//! How well a fit predicts what it has not seen.
//!
//! Folds of records are held out in turn. The optimum without a fold is found by a few steps with the derivatives of the
//! whole fit, each judged by what the problem predicts there; what it predicts for the fold is the answer.

use rayon::prelude::*;

use crate::fit::Fit;
use crate::normal::{Normal, Posterior, Whitened, prior_cost};
use crate::problem::{Coordinate, Problem, Request, Scope};

/// Predicted rows of records that were held out, observed minus predicted, by record.
#[derive(Debug, Clone, Default)]
pub struct HeldOut {
    /// With what is known of such records only beforehand: coordinates of the record at their prior means.
    pub at_mean: Vec<Vec<f64>>,
    /// With the record's own coordinates fitted to it and everything shared from the others.
    pub own: Vec<Vec<f64>>,
}

/// A record that was held out: its index, and its residuals with own coordinates at their means, and fitted.
type HeldOutRecord = (usize, Vec<f64>, Vec<f64>);

/// Folds of records: by condition where there are several, else each record alone; empty for a single record.
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
        folds = (0..records.len()).map(|record| vec![record]).collect();
    }
    if folds.len() == 1 { Vec::new() } else { folds }
}

/// Holds out fold after fold; nothing where there is only one, or where somebody asks to stop.
pub fn held_out(problem: &dyn Problem, fit: &Fit, folds: &[Vec<usize>]) -> Option<HeldOut> {
    if folds.len() < 2 {
        return None;
    }
    let records = problem.records().len();
    let mut result = HeldOut { at_mean: vec![Vec::new(); records], own: vec![Vec::new(); records] };
    let of_folds: Vec<Option<Vec<HeldOutRecord>>> = folds.par_iter().map(|fold| hold_out(problem, fit, fold)).collect();
    for (record, at_mean, own) in of_folds.into_iter().collect::<Option<Vec<_>>>()?.into_iter().flatten() {
        result.at_mean[record] = at_mean;
        result.own[record] = own;
    }
    Some(result)
}

/// Dampings of the step to the optimum without a fold: a long step along a poorly known direction ends beside it.
const DAMPINGS: [f64; 3] = [0.0, 0.01, 0.3];

/// How often a point is corrected with the same derivatives for what was predicted there.
const CORRECTIONS: usize = 2;

/// Holds out one fold: of each of its records the residuals with own coordinates at their means, and fitted.
fn hold_out(problem: &dyn Problem, fit: &Fit, fold: &[usize]) -> Option<Vec<HeldOutRecord>> {
    if problem.stop().is_asked() {
        return None;
    }
    let kept: Vec<usize> = (0..problem.records().len()).filter(|record| !fold.contains(record)).collect();
    let whitened = Whitened::of(problem, &fit.linear, &fit.noise, &kept);
    let without = optimum(problem, &whitened, &kept, problem.coordinates(), &fit.u, true)?;
    let mut found = Vec::with_capacity(fold.len());
    for &record in fold {
        let at_mean = predicted(problem, &without, &[record])?.remove(0);
        // Shared coordinates stay: they are pinned where the others left them.
        let mut pinned = problem.coordinates().to_vec();
        let mut start = without.clone();
        for (coordinate, (u, fitted)) in pinned.iter_mut().zip(start.iter_mut().zip(&fit.u)) {
            if coordinate.scope == Scope::Shared {
                (coordinate.mean, coordinate.sigma) = (*u, PINNED);
                (coordinate.lower, coordinate.upper) = (coordinate.lower.min(*u), coordinate.upper.max(*u));
            } else {
                // Close to where it belongs, which is where the derivatives were taken.
                *u = *fitted;
            }
        }
        let whitened = Whitened::of(problem, &fit.linear, &fit.noise, &[record]);
        let own = optimum(problem, &whitened, &[record], &pinned, &start, false)?;
        let own = predicted(problem, &own, &[record])?.remove(0);
        found.push((record, at_mean, own));
    }
    Some(found)
}

/// The standard deviation of a coordinate that is not to move.
const PINNED: f64 = 1e-9;

/// Observed minus predicted of some records at a point.
fn predicted(problem: &dyn Problem, u: &[f64], records: &[usize]) -> Option<Vec<Vec<f64>>> {
    let requests: Vec<Request> = records.iter().map(|record| Request { point: 0, record: *record }).collect();
    let predicted = problem.predict(&[u.to_vec()], &requests);
    let residual = records.iter().zip(predicted).map(|(record, predicted)| {
        let rows = problem.records()[*record].rows();
        predicted.map(|predicted| rows.zip(predicted).map(|(row, value)| row.observed - value).collect())
    });
    residual.collect()
}

/// The optimum for some records near a point, by steps with derivatives taken close by; never worse than the point.
fn optimum(
    problem: &dyn Problem,
    whitened: &Whitened,
    records: &[usize],
    coordinates: &[Coordinate],
    from: &[f64],
    is_damped: bool,
) -> Option<Vec<f64>> {
    let at = |u: &[f64]| -> Option<(f64, Normal)> {
        let normal = whitened.with_residuals(&predicted(problem, u, records)?);
        Some((normal.chi2 + prior_cost(coordinates, u), normal))
    };
    let mut best = (from.to_vec(), at(from)?);
    let dampings = if is_damped { DAMPINGS.as_slice() } else { &DAMPINGS[..1] };
    for _ in 0..=CORRECTIONS {
        let posterior = Posterior::new(coordinates, &best.0, &best.1.1);
        let tried: Vec<(Vec<f64>, (f64, Normal))> = dampings
            .iter()
            .filter_map(|damping| posterior.step(*damping, f64::INFINITY))
            .filter_map(|step| at(&step.to).map(|value| (step.to, value)))
            .collect();
        let better = tried.into_iter().min_by(|a, b| a.1.0.total_cmp(&b.1.0)).filter(|one| one.1.0 < best.1.0);
        match better {
            Some(one) => best = one,
            None => break,
        }
    }
    Some(best.0)
}
