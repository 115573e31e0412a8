//! Evidence and variance components of linear models.

use std::sync::atomic::AtomicUsize;

use identify::{Coordinate, FitOptions, GroupPrior, Record, Scope, fit};
use nalgebra::{DMatrix, DVector};

use crate::common::{Function, Functions, options, record, shared};
use crate::drawn::{noise, regressor};

#[test]
fn the_evidence_of_a_linear_model_is_that_of_its_normal_density() {
    let (rows, n, sigma) = (60, 3, 0.4);
    let observed: Vec<f64> = noise(rows, sigma, 3)
        .iter()
        .enumerate()
        .map(|(row, noise)| noise + 0.8 * regressor(0, row as f64) - 0.5 * regressor(2, row as f64))
        .collect();
    let priors = [1.0, 0.3, 2.0];
    let mut coordinates: Vec<Coordinate> = (0..n).map(|i| shared(&format!("b{i}"), 0.0, priors[i], 100.0)).collect();
    coordinates[1].mean = 0.1;
    let problem = Functions {
        coordinates,
        records: vec![record(&observed, sigma, false, 0)],
        of_records: vec![Box::new(move |b| {
            (0..rows).map(|row| (0..n).map(|i| b[i] * regressor(i, row as f64)).sum()).collect()
        })],
        asked: AtomicUsize::new(0),
    };
    let found = fit(&problem, &[0.0; 3], &options()).expect("linear");
    // Observed ~ N(X mean, sigma^2 + X S X').
    let x = DMatrix::from_fn(rows, n, |row, i| regressor(i, row as f64));
    let s = DMatrix::from_diagonal(&DVector::from_iterator(n, priors.iter().map(|sigma| sigma * sigma)));
    let covariance = &x * s * x.transpose() + DMatrix::identity(rows, rows) * sigma * sigma;
    let mean = &x * DVector::from_vec(vec![0.0, 0.1, 0.0]);
    let off = DVector::from_vec(observed) - mean;
    let factor = covariance.cholesky().expect("positive");
    let exact = -0.5 * off.dot(&factor.solve(&off))
        - factor.l().diagonal().map(f64::ln).sum()
        - 0.5 * rows as f64 * std::f64::consts::TAU.ln();
    assert!((found.log_evidence - exact).abs() < 1e-4, "{} for {exact}", found.log_evidence);
}

#[test]
fn variance_components_of_a_mixed_model_are_those_it_was_drawn_with() {
    // Each of 40 records has a level of its own, and errors that are white and an Ornstein-Uhlenbeck process.
    let (records, rows, white, size, time) = (40, 60, 0.2, 0.5, 6.0);
    let mut all: Vec<Record> = Vec::new();
    let mut coordinates = vec![shared("mean", 0.0, 10.0, 100.0)];
    for one in 0..records {
        let steps = noise(rows, 1.0, 100 + one as u64);
        let whites = noise(rows, white, 900 + one as u64);
        let level = noise(1, 1.0, 5000 + one as u64)[0];
        let keep = (-1.0_f64 / time).exp();
        let mut state = size * steps[0];
        let mut observed = Vec::with_capacity(rows);
        for row in 0..rows {
            if row > 0 {
                state = keep * state + size * (1.0 - keep * keep).sqrt() * steps[row];
            }
            observed.push(3.0 + level + state + whites[row]);
        }
        all.push(record(&observed, 0.1, true, one));
        coordinates.push(Coordinate { scope: Scope::Record(one), ..shared("level", 0.0, 1.0, 6.0) });
    }
    let functions = (0..records).map(|one| {
        let function: Function = Box::new(move |u| vec![u[0] + u[1 + one]; rows]);
        function
    });
    let problem = Functions { coordinates, records: all, of_records: functions.collect(), asked: AtomicUsize::new(0) };
    let prior =
        GroupPrior { multiplier_sigma: 2.0, multiplier: (0.1, 20.0), discrepancy: (1e-3, 10.0), time_s: (0.5, 60.0) };
    let found = fit(&problem, &vec![0.0; records + 1], &FitOptions::new(vec![prior])).expect("linear");
    let group = found.noise.groups[0];
    // The rows state half of the white noise.
    assert!((group.multiplier / 2.0 - 1.0).abs() < 0.2, "{group:?}");
    assert!((group.discrepancy / size - 1.0).abs() < 0.15, "{group:?}");
    assert!((group.time_s / time - 1.0).abs() < 0.3, "{group:?}");
    // Without a process it is nothing.
    let plain: Vec<Record> = (0..5).map(|one| record(&noise(rows, 0.1, 70 + one), 0.1, true, 0)).collect();
    let problem = Functions {
        coordinates: vec![shared("mean", 0.0, 10.0, 100.0)],
        records: plain,
        of_records: (0..5).map(|_| Box::new(move |u: &[f64]| vec![u[0]; rows]) as Box<_>).collect(),
        asked: AtomicUsize::new(0),
    };
    let found = fit(&problem, &[0.0], &FitOptions::new(vec![prior])).expect("linear");
    assert!(found.noise.groups[0].discrepancy < 0.03, "{:?}", found.noise);
}
