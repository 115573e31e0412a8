//! What problems are drawn from.

use identify::{FitOptions, GroupPrior};
use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, Normal};

use crate::common::stated;

/// White noise.
pub fn noise(count: usize, sigma: f64, seed: u64) -> Vec<f64> {
    let mut random = StdRng::seed_from_u64(seed);
    let normal = Normal::new(0.0, sigma).expect("a width");
    (0..count).map(|_| normal.sample(&mut random)).collect()
}

/// Some functions of time that are nowhere alike.
pub fn regressor(index: usize, time: f64) -> f64 {
    ((index as f64 + 1.0) * 0.37 * time + 0.2 * index as f64).sin()
}

/// A frequency of what is observed, and one a few valleys off.
pub const RIGHT_VALLEY: f64 = 0.31;
pub const WRONG_VALLEY: f64 = 0.52;

/// Errors of fits that may end far from what is observed.
pub fn far_off() -> FitOptions {
    FitOptions::new(vec![GroupPrior {
        discrepancy: (1e-4, 3.0),
        time_s: (1.0, 20.0),
        multiplier: (0.3, 20.0),
        ..stated()
    }])
}

/// The pace that the priors believe in, rad a row, and that of the records.
pub const SLOW: f64 = 0.4;
pub const QUICK: f64 = 1.3;
