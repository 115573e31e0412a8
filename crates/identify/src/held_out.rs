//! How well a fit predicts what it has not seen.
//!
//! Folds of records are left out in turn. The step to the optimum without a fold is solved in the linearised
//! problem, and what it predicts for the fold is computed by the problem itself.

use crate::fit::Fit;
use crate::noise::Whitener;
use crate::normal::{Normal, Posterior};
use crate::problem::{Problem, Request, Scope};

/// Predicted rows of records that were held out, observed minus predicted, by record.
#[derive(Debug, Clone, Default)]
pub struct HeldOut {
    /// With what is known of such records only beforehand: coordinates of the record at their prior means.
    pub at_mean: Vec<Vec<f64>>,
    /// With the record's own coordinates fitted to it and everything shared from the others.
    pub own: Vec<Vec<f64>>,
}

/// Folds of records: by condition where there are several, else each record alone; empty for a single record.
pub fn folds<P: Problem + ?Sized>(problem: &P) -> Vec<Vec<usize>> {
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

/// Leaves out fold after fold; nothing where there is only one.
pub fn held_out<P: Problem + ?Sized>(problem: &P, fit: &Fit, folds: &[Vec<usize>]) -> Option<HeldOut> {
    if folds.len() < 2 {
        return None;
    }
    let coordinates = problem.coordinates();
    let normals = fit.linear.normals(problem, &fit.noise);
    let mut points = Vec::new();
    let mut requests = Vec::new();
    for fold in folds {
        let mut sum: Option<Normal> = None;
        for (index, normal) in normals.iter().enumerate() {
            if !fold.contains(&index) {
                match &mut sum {
                    Some(sum) => sum.add(normal),
                    None => sum = Some(normal.clone()),
                }
            }
        }
        let posterior = Posterior::new(coordinates, &fit.u, &sum?);
        let without = posterior.step(0.0)?.to;
        for &record in fold {
            requests.push(Request { point: points.len(), record });
            points.push(without.clone());
            let own = own_coordinates(problem, fit, &without, record)?;
            requests.push(Request { point: points.len(), record });
            points.push(own);
        }
    }
    let predicted = problem.predict(&points, &requests);
    let mut result = HeldOut {
        at_mean: vec![Vec::new(); problem.records().len()],
        own: vec![Vec::new(); problem.records().len()],
    };
    for (place, (request, predicted)) in requests.iter().zip(predicted).enumerate() {
        let left = problem.records()[request.record].rows().zip(predicted?).map(|(row, predicted)| row.observed - predicted);
        let into = if place % 2 == 0 { &mut result.at_mean } else { &mut result.own };
        into[request.record] = left.collect();
    }
    Some(result)
}

/// A point with the coordinates of one record fitted to that record, everything shared as it is.
fn own_coordinates<P: Problem + ?Sized>(problem: &P, fit: &Fit, point: &[f64], record: usize) -> Option<Vec<f64>> {
    let whitener = Whitener::new(&problem.records()[record], &fit.noise);
    // The residual at the point, to first order.
    let mut shifted = fit.linear.clone();
    for (index, column) in &fit.linear.columns[record] {
        let by = point[*index] - fit.u[*index];
        for (residual, slope) in shifted.residual[record].iter_mut().zip(column) {
            *residual -= by * slope;
        }
    }
    shifted.u = point.to_vec();
    let mut normal = shifted.normal_of(record, &whitener);
    for (index, coordinate) in problem.coordinates().iter().enumerate() {
        if coordinate.scope == Scope::Shared {
            normal.gradient[index] = 0.0;
            for other in 0..point.len() {
                normal.matrix[(index, other)] = 0.0;
                normal.matrix[(other, index)] = 0.0;
            }
        }
    }
    // Shared coordinates stay: their prior is centred where they are.
    let mut pinned = problem.coordinates().to_vec();
    for (coordinate, u) in pinned.iter_mut().zip(point) {
        if coordinate.scope == Scope::Shared {
            coordinate.mean = *u;
        }
    }
    Some(Posterior::new(&pinned, point, &normal).step(0.0)?.to)
}
