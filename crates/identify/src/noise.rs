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

impl Gain {
    /// The innovation of a value over its deviation, and the state after it; `SMOOTH` where that has a second component.
    #[inline(always)]
    fn filtered<const SMOOTH: bool>(&self, value: f64, first: &mut f64, second: &mut f64) -> f64 {
        let [a, b, c, d] = self.transition;
        if SMOOTH {
            (*first, *second) = (a * *first + b * *second, c * *first + d * *second);
        } else {
            *first *= a;
        }
        let innovation = value - self.sees * *first;
        *first += self.to_state[0] * innovation;
        if SMOOTH {
            *second += self.to_state[1] * innovation;
        }
        innovation * self.inverse_deviation
    }
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
        let gains = |series: &Series| {
            let (gains, own) = Gains::new(series, noise).of(&series.rows, noise.smoothness);
            log_determinant += own;
            gains
        };
        let series = record.series.iter().map(gains).collect();
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
            let mut rest = copies.into_iter();
            loop {
                match rest.len() {
                    0 => break,
                    1 => self.pass(next::<1>(&mut rest)),
                    2 | 3 => self.pass(next::<2>(&mut rest)),
                    4..ABREAST => self.pass(next::<4>(&mut rest)),
                    _ => self.pass(next::<ABREAST>(&mut rest)),
                }
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

/// The next columns of those that there are.
fn next<'a, const N: usize>(columns: &mut impl Iterator<Item = &'a mut [f64]>) -> [&'a mut [f64]; N] {
    std::array::from_fn(|_| columns.next().unwrap_or_default())
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
        for (column, (first, second)) in columns.iter_mut().zip(first.iter_mut().zip(&mut second)) {
            column[row] = gain.filtered::<SMOOTH>(column[row], first, second);
        }
    }
}

/// How likely residuals alone are under given errors: its logarithm up to a constant, nats.
pub fn log_likelihood(records: &[Record], residual: &[Vec<f64>], noise: &Noise) -> f64 {
    let mut independent = 0.0;
    let mut chains = Vec::new();
    for (record, residual) in records.iter().zip(residual) {
        let mut rest = residual.as_slice();
        for series in &record.series {
            let (stretch, after) = rest.split_at(series.rows.len());
            rest = after;
            let mut gains = Gains::new(series, noise);
            if gains.has_memory {
                chains.push(Chain { rows: &series.rows, residual: stretch, gains, state: [0.0; 2], chi2: 0.0 });
                continue;
            }
            for (row, residual) in series.rows.iter().zip(stretch) {
                independent += (residual * gains.independent(row).inverse_deviation).powi(2);
            }
            independent += gains.log_determinant();
        }
    }
    chains.sort_by_key(|chain| chain.rows.len());
    for together in chains.chunks_mut(CHAINS) {
        match noise.smoothness {
            Smoothness::Rough => go_along::<false>(together),
            Smoothness::Smooth => go_along::<true>(together),
        }
    }
    -0.5 * (independent + chains.iter().map(|chain| chain.chi2 + chain.gains.log_determinant()).sum::<f64>())
}

/// Series that a filter goes along side by side; each is a chain of dependent operations with a quotient in every row.
const CHAINS: usize = 4;

/// A filter on its way along the residuals of a series.
struct Chain<'a> {
    rows: &'a [Row],
    residual: &'a [f64],
    gains: Gains,
    state: [f64; 2],
    chi2: f64,
}

/// Goes along whole series; `SMOOTH` where the state has a second component.
fn go_along<const SMOOTH: bool>(chains: &mut [Chain<'_>]) {
    let longest = chains.iter().map(|chain| chain.rows.len()).max().unwrap_or(0);
    for index in 0..longest {
        for chain in &mut *chains {
            let (Some(row), Some(residual)) = (chain.rows.get(index), chain.residual.get(index)) else { continue };
            let gain = if SMOOTH { chain.gains.smooth(row) } else { chain.gains.rough(row) };
            let [first, second] = &mut chain.state;
            chain.chi2 += gain.filtered::<SMOOTH>(*residual, first, second).powi(2);
        }
    }
}

/// The gains of a series, row by row.
struct Gains {
    group: GroupNoise,
    /// Whether there is a model error, and whether it hangs together in time.
    is_process: bool,
    has_memory: bool,
    /// Covariance of the state: of its first component, of both, of the second.
    covariance: [f64; 3],
    before_s: Option<f64>,
    /// Rows mostly lie equally far apart: the time between them, s, and the transition over it.
    usual: (f64, [f64; 4]),
    product: LogProduct,
}

impl Gains {
    fn new(series: &Series, noise: &Noise) -> Self {
        let group = noise.groups[series.group];
        let has_memory = series.is_process && group.discrepancy > 0.0 && group.time_s > 0.0;
        let usual = (0.0, [1.0, 0.0, 0.0, 1.0]);
        let product = LogProduct::default();
        Self {
            group,
            is_process: series.is_process,
            has_memory,
            covariance: STATIONARY,
            before_s: None,
            usual,
            product,
        }
    }

    /// Of all rows.
    fn of(mut self, rows: &[Row], smoothness: Smoothness) -> (Vec<Gain>, f64) {
        let gains = match smoothness {
            _ if !self.has_memory => rows.iter().map(|row| self.independent(row)).collect(),
            Smoothness::Rough => rows.iter().map(|row| self.rough(row)).collect(),
            Smoothness::Smooth => rows.iter().map(|row| self.smooth(row)).collect(),
        };
        (gains, self.log_determinant())
    }

    /// Logarithm of the determinant of the covariance of the rows so far.
    fn log_determinant(&self) -> f64 {
        self.product.logarithm()
    }

    /// Of a row whose error is independent of the others'.
    #[inline(always)]
    fn independent(&mut self, row: &Row) -> Gain {
        let sees = if self.is_process { self.group.discrepancy * row.activity } else { 0.0 };
        let variance = (self.group.multiplier * row.sigma).powi(2) + sees * sees;
        self.product.take(variance);
        Gain { transition: [0.0; 4], sees: 0.0, to_state: [0.0; 2], inverse_deviation: 1.0 / variance.sqrt() }
    }

    /// Under a process with corners, whose state is one number.
    #[inline(always)]
    fn rough(&mut self, row: &Row) -> Gain {
        let [kept, ..] = self.transition(row, |time| [(-time).exp(), 0.0, 0.0, 0.0]);
        let covariance = kept * kept * (self.covariance[0] - 1.0) + 1.0;
        let sees = self.group.discrepancy * row.activity;
        let white = (self.group.multiplier * row.sigma).powi(2);
        let variance = sees * sees * covariance + white;
        self.product.take(variance);
        let precision = 1.0 / variance;
        let to_state = covariance * sees * precision;
        self.covariance[0] = covariance * (white * precision);
        Gain { transition: [kept, 0.0, 0.0, 0.0], sees, to_state: [to_state, 0.0], inverse_deviation: precision.sqrt() }
    }

    /// Under a process that is once differentiable: it and its scaled derivative.
    #[inline(always)]
    fn smooth(&mut self, row: &Row) -> Gain {
        let transition = self.transition(row, smooth_transition);
        let [p00, p01, p11] = propagated(transition, self.covariance, STATIONARY);
        let sees = self.group.discrepancy * row.activity;
        let variance = sees * sees * p00 + (self.group.multiplier * row.sigma).powi(2);
        self.product.take(variance);
        let precision = 1.0 / variance;
        let to_state = [p00 * sees * precision, p01 * sees * precision];
        self.covariance =
            [p00 - to_state[0] * sees * p00, p01 - to_state[0] * sees * p01, p11 - to_state[1] * sees * p01];
        Gain { transition, sees, to_state, inverse_deviation: precision.sqrt() }
    }

    /// The transition of the state from the row before; `over` so many correlation times.
    #[inline(always)]
    fn transition(&mut self, row: &Row, over: impl Fn(f64) -> [f64; 4]) -> [f64; 4] {
        let time_s = self.before_s.map_or(0.0, |before_s| row.time_s - before_s);
        if time_s != self.usual.0 {
            self.usual = (time_s, over(time_s / self.group.time_s));
        }
        self.before_s = Some(row.time_s);
        self.usual.1
    }
}

/// Covariance of a state at rest: unit variance, and that of the scaled derivative.
const STATIONARY: [f64; 3] = [1.0, 0.0, 1.0];

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
            Row {
                time_s,
                observed: 0.0,
                sigma: 0.1 + 0.02 * f64::from(i % 4),
                activity: 0.3 + 0.1 * f64::from(i % 5),
                turns: 0,
            }
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
    fn residuals_are_as_likely_as_the_dense_covariance_says() {
        let record = |rows: usize| {
            let mut series = series();
            series.rows.truncate(rows);
            Record { series: vec![series], condition: 0 }
        };
        let records: Vec<Record> = [40, 17, 40, 33, 1, 40].map(record).into();
        let residual: Vec<Vec<f64>> = records
            .iter()
            .zip(0..)
            .map(|(record, j)| (0..record.series[0].rows.len()).map(|i| (0.7 * (i + 5 * j) as f64).sin()).collect())
            .collect();
        for (smoothness, discrepancy) in [(Smoothness::Rough, 0.8), (Smoothness::Smooth, 0.8), (Smoothness::Rough, 0.0)]
        {
            let noise = Noise { groups: vec![GroupNoise { multiplier: 1.3, discrepancy, time_s: 0.05 }], smoothness };
            let of = |(record, residual): (&Record, &Vec<f64>)| {
                let (chi2, log_determinant) = dense(&record.series[0], &noise, residual);
                -0.5 * (chi2 + log_determinant)
            };
            let expected: f64 = records.iter().zip(&residual).map(of).sum();
            let found = log_likelihood(&records, &residual, &noise);
            assert!((found - expected).abs() < 1e-8, "{smoothness:?}: {found} for {expected}");
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
