//! Errors of a record: white noise and a model error that is a process in time, whitened in one pass.
//!
//! The model error of a row is its activity times a stationary Gaussian process of unit variance: an
//! Ornstein-Uhlenbeck process, or the smoother Matérn process of order 3/2. Both are Markov, so that a Kalman
//! filter turns a series into independent innovations in a number of operations proportional to its rows
//! (Särkkä, "Bayesian Filtering and Smoothing", 2013). The filter's gains do not depend on what was observed:
//! the same pass whitens residuals and the columns of a Jacobian.

use nalgebra::DMatrix;

use crate::problem::{Record, Row, Series};

/// Columns that pass the filter side by side: each is a chain of dependent operations, and a machine has room for about
/// this many of them at once.
const ABREAST: usize = 8;

/// How smooth the model error is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Smoothness {
    /// Ornstein-Uhlenbeck: continuous, with corners.
    #[default]
    Rough,
    /// Matérn of order 3/2: once differentiable.
    Smooth,
}

/// The errors of one group of series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupNoise {
    /// Factor on the standard deviations of the rows.
    pub multiplier: f64,
    /// Standard deviation of the model error where the activity is 1.
    pub discrepancy: f64,
    /// Its correlation time, s; zero for a model error without memory.
    pub time_s: f64,
}

/// The errors of all series of a problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// By group.
    pub groups: Vec<GroupNoise>,
    /// The kind of the model error.
    pub smoothness: Smoothness,
}

impl Noise {
    /// White noise as the rows state it.
    pub fn white(groups: usize) -> Self {
        let group = GroupNoise { multiplier: 1.0, discrepancy: 0.0, time_s: 0.0 };
        Self { groups: vec![group; groups], smoothness: Smoothness::Rough }
    }
}

/// What one row does to the filter's state and to what passes through.
#[derive(Debug, Clone, Copy)]
struct Gain {
    /// Transition of the state from the row before: [a b; c d].
    transition: [f64; 4],
    /// The row sees `activity` times the first component of the state.
    sees: f64,
    /// How far an innovation moves the state.
    to_state: [f64; 2],
    inverse_deviation: f64,
}

/// Turns the rows of a record into independent numbers of unit variance.
#[derive(Debug, Clone)]
pub struct Whitener {
    series: Vec<Vec<Gain>>,
    /// Logarithm of the determinant of the covariance.
    pub log_determinant: f64,
}

impl Whitener {
    /// For a record under given errors.
    pub fn new(record: &Record, noise: &Noise) -> Self {
        let mut log_determinant = 0.0;
        let series = record.series.iter().map(|series| gains(series, noise, &mut log_determinant)).collect();
        Self { series, log_determinant }
    }

    /// A whitened copy of a column.
    pub fn whitened(&self, column: &[f64]) -> Vec<f64> {
        let mut copy = column.to_vec();
        self.pass([&mut copy]);
        copy
    }

    /// Whitened copies of columns that have a value for each row, as columns of a matrix.
    pub fn matrix(&self, columns: &[&[f64]]) -> DMatrix<f64> {
        let rows = columns.first().map_or(0, |column| column.len());
        let mut matrix = DMatrix::zeros(rows, columns.len());
        if rows == 0 {
            return matrix;
        }
        let mut places = matrix.as_mut_slice().chunks_exact_mut(rows);
        for group in columns.chunks(ABREAST) {
            let mut copies: Vec<&mut [f64]> = places.by_ref().take(group.len()).collect();
            copies.iter_mut().zip(group).for_each(|(copy, column)| copy.copy_from_slice(column));
            match <[&mut [f64]; ABREAST]>::try_from(copies) {
                Ok(all) => self.pass(all),
                Err(few) => few.into_iter().for_each(|one| self.pass([one])),
            }
        }
        matrix
    }

    /// Whitens columns in place.
    fn pass<const N: usize>(&self, columns: [&mut [f64]; N]) {
        let mut rest = columns;
        for series in &self.series {
            let mut cut = rest.map(|column| column.split_at_mut(series.len()));
            let stretches = cut.each_mut().map(|(stretch, _)| &mut **stretch);
            if series.first().is_some_and(|gain| gain.sees == 0.0) {
                scale(series, stretches);
            } else if series.iter().all(|gain| gain.to_state[1] == 0.0) {
                filter::<N, false>(series, stretches);
            } else {
                filter::<N, true>(series, stretches);
            }
            rest = cut.map(|(_, rest)| rest);
        }
    }
}

/// Divides columns by the deviations of their rows.
fn scale<const N: usize>(gains: &[Gain], columns: [&mut [f64]; N]) {
    for column in columns {
        for (value, gain) in column.iter_mut().zip(gains) {
            *value *= gain.inverse_deviation;
        }
    }
}

/// The Kalman filter over several columns side by side; `SMOOTH` where its state has a second component.
fn filter<const N: usize, const SMOOTH: bool>(gains: &[Gain], mut columns: [&mut [f64]; N]) {
    let mut first = [0.0; N];
    let mut second = [0.0; N];
    for (row, gain) in gains.iter().enumerate() {
        let [a, b, c, d] = gain.transition;
        for (column, (first, second)) in columns.iter_mut().zip(first.iter_mut().zip(&mut second)) {
            if SMOOTH {
                (*first, *second) = (a * *first + b * *second, c * *first + d * *second);
            } else {
                *first *= a;
            }
            let innovation = column[row] - gain.sees * *first;
            *first += gain.to_state[0] * innovation;
            if SMOOTH {
                *second += gain.to_state[1] * innovation;
            }
            column[row] = innovation * gain.inverse_deviation;
        }
    }
}

/// The gains of a series; adds to the logarithm of the determinant.
fn gains(series: &Series, noise: &Noise, log_determinant: &mut f64) -> Vec<Gain> {
    let group = noise.groups[series.group];
    let has_memory = series.is_process && group.discrepancy > 0.0 && group.time_s > 0.0;
    match noise.smoothness {
        _ if !has_memory => independent(series, &group, log_determinant),
        Smoothness::Rough => rough(series, &group, log_determinant),
        Smoothness::Smooth => smooth(series, &group, log_determinant),
    }
}

/// The gains of rows with independent errors.
fn independent(series: &Series, group: &GroupNoise, log_determinant: &mut f64) -> Vec<Gain> {
    let mut product = LogProduct::default();
    let gain = |row: &Row| {
        let sees = if series.is_process { group.discrepancy * row.activity } else { 0.0 };
        let variance = (group.multiplier * row.sigma).powi(2) + sees * sees;
        product.take(variance);
        Gain { transition: [0.0; 4], sees: 0.0, to_state: [0.0; 2], inverse_deviation: 1.0 / variance.sqrt() }
    };
    let gains = series.rows.iter().map(gain).collect();
    *log_determinant += product.logarithm();
    gains
}

/// The gains under a process with corners, whose state is one number.
fn rough(series: &Series, group: &GroupNoise, log_determinant: &mut f64) -> Vec<Gain> {
    let mut product = LogProduct::default();
    let (mut covariance, mut before) = (1.0, None);
    // Rows mostly lie equally far apart.
    let mut usual = (0.0, 1.0);
    let gain = |row: &Row| {
        let time_s = before.map_or(0.0, |before| row.time_s - before);
        if time_s != usual.0 {
            usual = (time_s, (-time_s / group.time_s).exp());
        }
        before = Some(row.time_s);
        let kept = usual.1;
        covariance = kept * kept * (covariance - 1.0) + 1.0;
        let sees = group.discrepancy * row.activity;
        let white = (group.multiplier * row.sigma).powi(2);
        let variance = sees * sees * covariance + white;
        product.take(variance);
        let precision = 1.0 / variance;
        let to_state = covariance * sees * precision;
        covariance *= white * precision;
        Gain { transition: [kept, 0.0, 0.0, 0.0], sees, to_state: [to_state, 0.0], inverse_deviation: precision.sqrt() }
    };
    let gains = series.rows.iter().map(gain).collect();
    *log_determinant += product.logarithm();
    gains
}

/// The gains under a process that is once differentiable: it and its scaled derivative.
fn smooth(series: &Series, group: &GroupNoise, log_determinant: &mut f64) -> Vec<Gain> {
    // Stationary covariance of the state: unit variance, and that of the scaled derivative.
    const STATIONARY: [f64; 3] = [1.0, 0.0, 1.0];
    let mut product = LogProduct::default();
    let (mut covariance, mut before) = (STATIONARY, None);
    let mut usual = (0.0, [1.0, 0.0, 0.0, 1.0]);
    let gain = |row: &Row| {
        let time_s = before.map_or(0.0, |before| row.time_s - before);
        if time_s != usual.0 {
            usual = (time_s, smooth_transition(time_s / group.time_s));
        }
        before = Some(row.time_s);
        let transition = usual.1;
        covariance = propagated(transition, covariance, STATIONARY);
        let [p00, p01, p11] = covariance;
        let sees = group.discrepancy * row.activity;
        let variance = sees * sees * p00 + (group.multiplier * row.sigma).powi(2);
        product.take(variance);
        let precision = 1.0 / variance;
        let gain = [p00 * sees * precision, p01 * sees * precision];
        covariance = [p00 - gain[0] * sees * p00, p01 - gain[0] * sees * p01, p11 - gain[1] * sees * p01];
        Gain { transition, sees, to_state: gain, inverse_deviation: precision.sqrt() }
    };
    let gains = series.rows.iter().map(gain).collect();
    *log_determinant += product.logarithm();
    gains
}

/// The logarithm of a product of many positive numbers, taken of several at once.
struct LogProduct {
    logarithm: f64,
    product: f64,
}

impl Default for LogProduct {
    fn default() -> Self {
        Self { logarithm: 0.0, product: 1.0 }
    }
}

impl LogProduct {
    /// Within these a further number of the size of a variance neither overflows nor loses digits.
    const RANGE: (f64, f64) = (1e-150, 1e150);

    fn take(&mut self, number: f64) {
        self.product *= number;
        if self.product < Self::RANGE.0 || self.product > Self::RANGE.1 {
            self.logarithm += self.product.ln();
            self.product = 1.0;
        }
    }

    fn logarithm(&self) -> f64 {
        self.logarithm + self.product.ln()
    }
}

/// How the state of the smooth process goes on over so many correlation times.
fn smooth_transition(time: f64) -> [f64; 4] {
    // With the derivative scaled to unit variance.
    let t = 3.0_f64.sqrt() * time;
    let decay = (-t).exp();
    [decay * (1.0 + t), decay * t, -decay * t, decay * (1.0 - t)]
}

/// The covariance after a transition of a stationary process: A (P - S) A' + S.
fn propagated([a, b, c, d]: [f64; 4], [p00, p01, p11]: [f64; 3], [s00, s01, s11]: [f64; 3]) -> [f64; 3] {
    let (q00, q01, q11) = (p00 - s00, p01 - s01, p11 - s11);
    [
        a * a * q00 + 2.0 * a * b * q01 + b * b * q11 + s00,
        a * c * q00 + (a * d + b * c) * q01 + b * d * q11 + s01,
        c * c * q00 + 2.0 * c * d * q01 + d * d * q11 + s11,
    ]
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    fn series() -> Series {
        let row = |i: i32| {
            let time_s = 0.01 * f64::from(i) + 0.002 * f64::from(i % 3);
            Row { time_s, observed: 0.0, sigma: 0.1 + 0.02 * f64::from(i % 4), activity: 0.3 + 0.1 * f64::from(i % 5) }
        };
        Series { rows: (0..40).map(row).collect(), group: 0, is_process: true }
    }

    /// chi-squared and log determinant by the dense covariance.
    fn dense(series: &Series, noise: &Noise, residual: &[f64]) -> (f64, f64) {
        let group = noise.groups[0];
        let n = series.rows.len();
        let covariance = DMatrix::from_fn(n, n, |i, j| {
            let (one, other) = (series.rows[i], series.rows[j]);
            let time = (one.time_s - other.time_s).abs() / group.time_s;
            let correlation = match noise.smoothness {
                Smoothness::Rough => (-time).exp(),
                Smoothness::Smooth => (1.0 + 3.0_f64.sqrt() * time) * (-3.0_f64.sqrt() * time).exp(),
            };
            let process = group.discrepancy.powi(2) * one.activity * other.activity * correlation;
            process + if i == j { (group.multiplier * one.sigma).powi(2) } else { 0.0 }
        });
        let residual = DVector::from_column_slice(residual);
        let factor = covariance.cholesky().unwrap();
        let log_determinant = 2.0 * factor.l().diagonal().map(f64::ln).sum();
        (residual.dot(&factor.solve(&residual)), log_determinant)
    }

    #[test]
    fn the_filter_whitens_as_the_dense_covariance_does() {
        let series = series();
        let residual: Vec<f64> = (0..40).map(|i| (0.7 * f64::from(i)).sin() + 0.1 * f64::from(i % 7)).collect();
        let record = Record { series: vec![series.clone()], condition: 0 };
        for smoothness in [Smoothness::Rough, Smoothness::Smooth] {
            for time_s in [0.004, 0.05, 3.0] {
                let groups = vec![GroupNoise { multiplier: 1.3, discrepancy: 0.8, time_s }];
                let noise = Noise { groups, smoothness };
                let whitener = Whitener::new(&record, &noise);
                let chi2: f64 = whitener.whitened(&residual).iter().map(|value| value * value).sum();
                let (expected, log_determinant) = dense(&series, &noise, &residual);
                assert!((chi2 / expected - 1.0).abs() < 1e-9, "{smoothness:?} {time_s}: {chi2} for {expected}");
                assert!((whitener.log_determinant - log_determinant).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn columns_side_by_side_are_whitened_as_one_by_one() {
        let record = Record { series: vec![series(), series()], condition: 0 };
        let columns: Vec<Vec<f64>> =
            (0..11).map(|j| (0..80).map(|i| (0.3 * f64::from(i * j) + 0.1).sin()).collect()).collect();
        let views: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        for smoothness in [Smoothness::Rough, Smoothness::Smooth] {
            let groups = vec![GroupNoise { multiplier: 1.1, discrepancy: 0.4, time_s: 0.05 }];
            let whitener = Whitener::new(&record, &Noise { groups, smoothness });
            let matrix = whitener.matrix(&views);
            for (column, whitened) in columns.iter().zip(matrix.column_iter()) {
                assert_eq!(whitener.whitened(column), whitened.iter().copied().collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn without_a_model_error_only_the_noise_counts() {
        let record = Record { series: vec![series()], condition: 0 };
        let whitener = Whitener::new(&record, &Noise::white(1));
        let whitened = whitener.whitened(&vec![1.0; 40]);
        for (value, row) in whitened.iter().zip(&record.series[0].rows) {
            assert!((value * row.sigma - 1.0).abs() < 1e-12);
        }
    }
}
