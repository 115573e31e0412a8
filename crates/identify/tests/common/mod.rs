//! Problems without a valve: functions of a point, with a count of how often they are asked.

#![allow(dead_code, reason = "not every test uses all of it")]

use std::sync::atomic::{AtomicUsize, Ordering};

use identify::{Coordinate, FitOptions, GroupPrior, Problem, Record, Request, Row, Scope, Series};

/// Rows of one record as a function of the point.
pub type Function = Box<dyn Fn(&[f64]) -> Vec<f64> + Sync + Send>;

/// A problem whose records are functions of the point.
pub struct Functions {
    pub coordinates: Vec<Coordinate>,
    pub records: Vec<Record>,
    pub of_records: Vec<Function>,
    /// Predictions of a record so far.
    pub asked: AtomicUsize,
}

impl Problem for Functions {
    fn coordinates(&self) -> &[Coordinate] {
        &self.coordinates
    }

    fn records(&self) -> &[Record] {
        &self.records
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        self.asked.fetch_add(requests.len(), Ordering::Relaxed);
        requests.iter().map(|request| Some(self.of_records[request.record](&points[request.point]))).collect()
    }
}

/// A coordinate with a normal prior that moves all records.
pub fn shared(name: &str, mean: f64, sigma: f64, far: f64) -> Coordinate {
    Coordinate {
        name: name.into(),
        scope: Scope::Shared,
        mean,
        sigma,
        lower: mean - far,
        upper: mean + far,
        step: 1e-3 * sigma,
        of_measuring: false,
    }
}

/// A record of one series, a row a second.
pub fn record(observed: &[f64], sigma: f64, is_process: bool, condition: usize) -> Record {
    let rows = observed.iter().enumerate().map(|(row, observed)| Row {
        time_s: row as f64,
        observed: *observed,
        sigma,
        activity: 1.0,
        turns: 0,
    });
    Record { series: vec![Series { rows: rows.collect(), group: 0, is_process }], condition }
}

/// Errors as large as the rows state.
pub fn stated() -> GroupPrior {
    GroupPrior { multiplier_sigma: 0.1, multiplier: (1.0, 1.0), discrepancy: (1e-6, 1e-6), time_s: (1.0, 1.0) }
}

/// The usual fit with errors as large as stated.
pub fn options() -> FitOptions {
    FitOptions { annealed: 40, settled: 40, tolerance: 1e-6, ..FitOptions::new(vec![stated()]) }
}
