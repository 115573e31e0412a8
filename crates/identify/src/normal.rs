//! The problem made linear about a point: normal equations, bounded steps and the evidence by Laplace.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::envelope::{Factor, ordered};
use crate::noise::{Noise, Whitener};
use crate::problem::{Coordinate, Linear, Problem, Record, residuals};
use crate::special::ln_normal_cdf;

/// A problem linear about a point.
#[derive(Debug, Clone)]
pub struct Linearised {
    /// The point.
    pub u: Vec<f64>,
    /// Observed minus predicted, by record.
    pub residual: Vec<Vec<f64>>,
    /// Derivatives of the predictions, by record: index of the coordinate, a value for each row.
    pub columns: Vec<Vec<(usize, Vec<f64>)>>,
}

/// A linearised problem with the rows of one group of errors alone.
#[derive(Debug)]
pub(crate) struct GroupRows {
    /// The records with their series of the group.
    pub records: Vec<Record>,
    /// What those rows are linear in.
    pub linear: Linearised,
}

/// The derivatives of one record's rows, whitened.
#[derive(Debug)]
struct Jacobian {
    whitener: Whitener,
    /// The coordinate of each column.
    coordinates: Vec<usize>,
    /// A column for each coordinate that moves the record.
    columns: DMatrix<f64>,
}

impl Jacobian {
    fn new(whitener: Whitener, columns: &[(usize, Vec<f64>)]) -> Self {
        let views: Vec<&[f64]> = columns.iter().map(|(_, column)| column.as_slice()).collect();
        let columns = (columns.iter().map(|(index, _)| *index).collect(), whitener.matrix(&views));
        Self { whitener, coordinates: columns.0, columns: columns.1 }
    }

    /// The products of the columns with each other.
    fn gram(&self) -> DMatrix<f64> {
        if self.columns.is_empty() { DMatrix::zeros(0, 0) } else { self.columns.transpose() * &self.columns }
    }

    /// Adds the products of the columns with a residual, and gives its square.
    fn add_gradient(&self, residual: &[f64], gradient: &mut DVector<f64>) -> f64 {
        let residual = DVector::from_vec(self.whitener.whitened(residual));
        if !self.columns.is_empty() {
            let products = self.columns.tr_mul(&residual);
            for (index, product) in self.coordinates.iter().zip(products.iter()) {
                gradient[*index] += product;
            }
        }
        residual.norm_squared()
    }
}

/// Normal equations of the whitened rows, without priors.
#[derive(Debug, Clone)]
pub struct Normal {
    /// J' S^-1 J.
    pub matrix: DMatrix<f64>,
    /// J' S^-1 r.
    pub gradient: DVector<f64>,
    /// r' S^-1 r.
    pub chi2: f64,
    /// ln |S|.
    pub log_determinant: f64,
    /// Rows.
    pub rows: usize,
}

impl Linearised {
    /// From predictions with derivatives.
    pub fn new(problem: &dyn Problem, u: Vec<f64>, linear: Vec<Linear>) -> Self {
        let (predicted, columns): (Vec<_>, Vec<_>) =
            linear.into_iter().map(|linear| (linear.predicted, linear.columns)).unzip();
        Self { u, residual: residuals(problem, &predicted), columns }
    }

    /// At a point that a step led to, with the residuals there and derivatives that fit them (Broyden 1965): of all
    /// that agree with the step, those nearest to the ones before, coordinates counted by their weights.
    #[must_use]
    pub fn updated(mut self, u: Vec<f64>, residual: Vec<Vec<f64>>, weights: &[f64]) -> Self {
        let moved: Vec<f64> = u.iter().zip(&self.u).map(|(to, from)| to - from).collect();
        for ((columns, before), now) in self.columns.iter_mut().zip(&self.residual).zip(&residual) {
            let length: f64 = columns.iter().map(|(index, _)| weights[*index] * moved[*index] * moved[*index]).sum();
            if length <= 0.0 {
                continue;
            }
            // Observed minus predicted falls by as much as the prediction rises.
            let mut unexpected: Vec<f64> = before.iter().zip(now).map(|(before, now)| before - now).collect();
            for (index, column) in columns.iter() {
                for (value, slope) in unexpected.iter_mut().zip(column) {
                    *value -= slope * moved[*index];
                }
            }
            for (index, column) in columns.iter_mut() {
                let share = weights[*index] * moved[*index] / length;
                for (slope, value) in column.iter_mut().zip(&unexpected) {
                    *slope += share * value;
                }
            }
        }
        self.u = u;
        self.residual = residual;
        self
    }

    /// The normal equations of all records, one by one.
    pub fn normals(&self, problem: &dyn Problem, noise: &Noise) -> Vec<Normal> {
        let alone = |(part, record): (&(Jacobian, DMatrix<f64>), usize)| {
            let mut normal = Normal::empty(self.u.len());
            normal.add_record(part, &self.residual[record]);
            normal
        };
        self.whitened(problem.records(), noise).iter().zip(0..).map(alone).collect()
    }

    /// The normal equations of all records.
    pub fn normal(&self, problem: &dyn Problem, noise: &Noise) -> Normal {
        self.normal_of(problem.records(), noise)
    }

    /// The same of the records that this is linear in, where they are not all that a problem has of them.
    pub(crate) fn normal_of(&self, records: &[Record], noise: &Noise) -> Normal {
        let mut sum = Normal::empty(self.u.len());
        for (part, residual) in self.whitened(records, noise).iter().zip(&self.residual) {
            sum.add_record(part, residual);
        }
        sum
    }

    /// The rows of one group of errors alone, record by record, with the columns that are not zero there.
    pub(crate) fn rows_of_group(&self, problem: &dyn Problem, group: usize) -> GroupRows {
        let of_record = |(index, record): (usize, &Record)| {
            let mut ends = 0;
            let mut rows = Vec::new();
            let mut series = Vec::new();
            for one in &record.series {
                let first = ends;
                ends += one.rows.len();
                if one.group == group && !one.rows.is_empty() {
                    rows.push(first..ends);
                    series.push(one.clone());
                }
            }
            let picked = |values: &[f64]| rows.iter().flat_map(|rows| &values[rows.clone()]).copied().collect();
            let moves = |column: &[f64]| rows.iter().any(|rows| column[rows.clone()].iter().any(|value| *value != 0.0));
            let columns = self.columns[index].iter().filter(|(_, column)| moves(column));
            let columns = columns.map(|(index, column)| (*index, picked(column))).collect();
            (Record { series, condition: record.condition }, (picked(&self.residual[index]), columns))
        };
        let parts = problem.records().par_iter().enumerate().map(of_record);
        let (records, (residual, columns)) = parts.unzip();
        GroupRows { records, linear: Self { u: self.u.clone(), residual, columns } }
    }

    /// The whitened derivatives of each record, and their products with each other.
    fn whitened(&self, records: &[Record], noise: &Noise) -> Vec<(Jacobian, DMatrix<f64>)> {
        let records = records.par_iter().zip(&self.columns);
        let of_record = |(record, columns): (_, &Vec<(usize, Vec<f64>)>)| {
            let jacobian = Jacobian::new(Whitener::new(record, noise), columns);
            let gram = jacobian.gram();
            (jacobian, gram)
        };
        records.map(of_record).collect()
    }

    /// The residuals after a step to another point, as the derivatives foresee them.
    pub fn foreseen(&self, to: &[f64]) -> Vec<Vec<f64>> {
        let after = |(residual, columns): (&Vec<f64>, &Vec<(usize, Vec<f64>)>)| {
            let mut residual = residual.clone();
            for (index, column) in columns {
                let by = to[*index] - self.u[*index];
                residual.iter_mut().zip(column).for_each(|(value, slope)| *value -= by * slope);
            }
            residual
        };
        self.residual.iter().zip(&self.columns).map(after).collect()
    }
}

/// A linearised problem whitened under given errors: normal equations for any residuals near the point.
#[derive(Debug)]
pub struct Whitened {
    records: Vec<Jacobian>,
    /// The normal equations at the point itself.
    pub normal: Normal,
}

impl Whitened {
    /// Of a linearised problem.
    pub fn new(problem: &dyn Problem, at: &Linearised, noise: &Noise) -> Self {
        let n = at.u.len();
        let all: Vec<usize> = (0..problem.records().len()).collect();
        let mut whitened = Self::of(problem, at, noise, &all);
        let (gradient, chi2) = whitened.gradient(&at.residual, n);
        whitened.normal.gradient = gradient;
        whitened.normal.chi2 = chi2;
        whitened
    }

    /// Of some records of a linearised problem, without residuals yet.
    pub fn of(problem: &dyn Problem, at: &Linearised, noise: &Noise, records: &[usize]) -> Self {
        let n = at.u.len();
        let jacobians: Vec<Jacobian> = records
            .par_iter()
            .map(|index| Jacobian::new(Whitener::new(&problem.records()[*index], noise), &at.columns[*index]))
            .collect();
        let mut whitened = Self { records: Vec::new(), normal: Normal::empty(n) };
        for jacobian in &jacobians {
            whitened.normal.add_gram(jacobian, &jacobian.gram());
            whitened.normal.log_determinant += jacobian.whitener.log_determinant;
        }
        whitened.records = jacobians;
        whitened.normal.rows = records.iter().map(|record| at.residual[*record].len()).sum();
        whitened
    }

    /// The normal equations with the same derivatives and other residuals.
    pub fn with_residuals(&self, residual: &[Vec<f64>]) -> Normal {
        let (gradient, chi2) = self.gradient(residual, self.normal.gradient.len());
        Normal { gradient, chi2, ..self.normal.clone() }
    }

    fn gradient(&self, residual: &[Vec<f64>], n: usize) -> (DVector<f64>, f64) {
        let mut gradient = DVector::zeros(n);
        let records = self.records.iter().zip(residual);
        let chi2 = records.map(|(jacobian, residual)| jacobian.add_gradient(residual, &mut gradient)).sum();
        (gradient, chi2)
    }
}

impl Normal {
    /// Of no rows.
    pub(crate) fn empty(n: usize) -> Self {
        Self { matrix: DMatrix::zeros(n, n), gradient: DVector::zeros(n), chi2: 0.0, log_determinant: 0.0, rows: 0 }
    }

    /// Adds a record: its derivatives with their products, and its residuals.
    fn add_record(&mut self, (jacobian, gram): &(Jacobian, DMatrix<f64>), residual: &[f64]) {
        self.add_gram(jacobian, gram);
        self.chi2 += jacobian.add_gradient(residual, &mut self.gradient);
        self.log_determinant += jacobian.whitener.log_determinant;
        self.rows += residual.len();
    }

    fn add_gram(&mut self, jacobian: &Jacobian, gram: &DMatrix<f64>) {
        for (i, row) in jacobian.coordinates.iter().enumerate() {
            for (j, column) in jacobian.coordinates.iter().enumerate() {
                self.matrix[(*row, *column)] += gram[(i, j)];
            }
        }
    }

    /// Adds the rows of others.
    pub fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.gradient += &other.gradient;
        self.chi2 += other.chi2;
        self.log_determinant += other.log_determinant;
        self.rows += other.rows;
    }

    /// Takes the rows of others out again.
    pub fn subtract(&mut self, other: &Self) {
        self.matrix -= &other.matrix;
        self.gradient -= &other.gradient;
        self.chi2 -= other.chi2;
        self.log_determinant -= other.log_determinant;
        self.rows -= other.rows;
    }
}

/// Squared distance of a point from the prior means, in prior deviations.
pub fn prior_cost(coordinates: &[Coordinate], u: &[f64]) -> f64 {
    coordinates.iter().zip(u).map(|(coordinate, u)| ((u - coordinate.mean) / coordinate.sigma).powi(2)).sum()
}

/// Normal equations with the priors, about a point within the bounds.
#[derive(Debug, Clone)]
pub struct Posterior<'a> {
    coordinates: &'a [Coordinate],
    u: &'a [f64],
    /// Precision: data and priors.
    pub precision: DMatrix<f64>,
    pull: DVector<f64>,
    /// chi-squared, priors and ln |S| at the point.
    pub cost: f64,
    rows: usize,
    /// The coordinates in the order in which they are factored.
    order: Vec<usize>,
}

/// A step to the least of the quadratic within the bounds.
#[derive(Debug, Clone)]
pub struct Step {
    /// Where it leads.
    pub to: Vec<f64>,
    /// By how much the cost falls, to second order.
    pub predicted_gain: f64,
    /// Which coordinates end at a bound.
    pub held: Vec<bool>,
}

impl<'a> Posterior<'a> {
    /// From the data's normal equations.
    pub fn new(coordinates: &'a [Coordinate], u: &'a [f64], normal: &Normal) -> Self {
        let mut precision = normal.matrix.clone();
        let mut pull = normal.gradient.clone();
        for (index, coordinate) in coordinates.iter().enumerate() {
            let weight = 1.0 / (coordinate.sigma * coordinate.sigma);
            precision[(index, index)] += weight;
            pull[index] -= weight * (u[index] - coordinate.mean);
        }
        let cost = normal.chi2 + prior_cost(coordinates, u) + normal.log_determinant;
        Self { coordinates, u, precision, pull, cost, rows: normal.rows, order: ordered(coordinates) }
    }

    /// The point.
    pub fn u(&self) -> &[f64] {
        self.u
    }

    /// The step to the least of the quadratic within the bounds.
    pub fn newton(&self) -> Option<Step> {
        self.step(0.0, f64::INFINITY)
    }

    /// The damped step (Levenberg 1944, Marquardt 1963) within the bounds: coordinates that would leave them end
    /// there, and the others are solved anew. None moves by more than `reach` of its prior deviations. Nothing where the
    /// matrix is not positive definite.
    pub fn step(&self, damping: f64, reach: f64) -> Option<Step> {
        self.solved(damping, reach).map(|(step, _)| step)
    }

    /// The same with the factor of the coordinates that are free in it.
    fn solved(&self, damping: f64, reach: f64) -> Option<(Step, Factor)> {
        let n = self.u.len();
        let bounds = |index: usize| {
            let coordinate: &Coordinate = &self.coordinates[index];
            let (u, far) = (self.u[index], reach * coordinate.sigma);
            (coordinate.lower.max(u - far), coordinate.upper.min(u + far))
        };
        let mut matrix = self.precision.clone();
        for index in 0..n {
            matrix[(index, index)] *= 1.0 + damping;
        }
        let mut fixed: Vec<Option<f64>> = vec![None; n];
        let (mut step, mut factor) = self.solve_free(&matrix, &fixed)?;
        // Every round holds one coordinate more or lets one go; a few rounds beyond all of them are plenty.
        for _ in 0..2 * n + 4 {
            let beyond = (0..n)
                .filter(|index| fixed[*index].is_none())
                .filter_map(|index| {
                    let target = self.u[index] + step[index];
                    let (lower, upper) = bounds(index);
                    let bound = target.clamp(lower, upper);
                    let beyond = (target - bound).abs() / self.coordinates[index].sigma;
                    (target != bound).then(|| (index, bound - self.u[index], beyond))
                })
                .max_by(|a, b| a.2.total_cmp(&b.2));
            if let Some((index, by, _)) = beyond {
                fixed[index] = Some(by);
                (step, factor) = self.solve_free(&matrix, &fixed)?;
                continue;
            }
            let left = &self.pull - &matrix * &step;
            let inwards = (0..n).find(|index| {
                let (lower, upper) = bounds(*index);
                let at = self.u[*index] + step[*index];
                // What is bounded to a single value has no inwards.
                fixed[*index].is_some()
                    && lower < upper
                    && ((at <= lower && left[*index] > 1e-9 * matrix[(*index, *index)])
                        || (at >= upper && left[*index] < -1e-9 * matrix[(*index, *index)]))
            });
            let Some(index) = inwards else { break };
            fixed[index] = None;
            (step, factor) = self.solve_free(&matrix, &fixed)?;
        }
        let to: Vec<f64> = (0..n)
            .map(|index| {
                let (lower, upper) = bounds(index);
                (self.u[index] + step[index]).clamp(lower, upper)
            })
            .collect();
        let step = DVector::from_iterator(n, to.iter().zip(self.u).map(|(to, from)| to - from));
        let predicted_gain = 2.0 * self.pull.dot(&step) - step.dot(&(&self.precision * &step));
        let held = to.iter().zip(self.coordinates).map(|(to, coordinate)| coordinate.is_at_bound(*to)).collect();
        Some((Step { to, predicted_gain, held }, factor))
    }

    /// From beside the floor of a bent valley back to it: where only a share of the pull at `from` is left, which is what a
    /// straight valley would leave there (the second-order part of geodesic acceleration, Transtrum and Sethna,
    /// arXiv:1201.5885, 2012). Coordinates that are `held` stay. Nothing where the matrix is not positive definite.
    pub fn led_back(&self, from: &Self, share: f64, held: &[bool]) -> Option<Vec<f64>> {
        let fixed: Vec<Option<f64>> = held.iter().map(|held| held.then_some(0.0)).collect();
        let beside = Self { pull: &self.pull - share * &from.pull, ..self.clone() };
        let (step, _) = beside.solve_free(&self.precision, &fixed)?;
        let to = self.coordinates.iter().zip(self.u.iter().zip(step.iter()));
        Some(to.map(|(coordinate, (u, by))| (u + by).clamp(coordinate.lower, coordinate.upper)).collect())
    }

    /// The step in which some coordinates move by what is fixed and the others as is best, and the factor of those.
    fn solve_free(&self, matrix: &DMatrix<f64>, fixed: &[Option<f64>]) -> Option<(DVector<f64>, Factor)> {
        let by = DVector::from_iterator(fixed.len(), fixed.iter().map(|value| value.unwrap_or(0.0)));
        let free: Vec<usize> = self.order.iter().copied().filter(|index| fixed[*index].is_none()).collect();
        let is_any_fixed = free.len() < fixed.len();
        let factor = Factor::new(matrix, free)?;
        let right = if is_any_fixed { &self.pull - matrix * &by } else { self.pull.clone() };
        Some((factor.solve(&right) + by, factor))
    }

    /// The logarithm of the evidence by Laplace's method about the least within the bounds, nats.
    ///
    /// Coordinates at a bound count with the integral of the density on their side of it.
    pub fn log_evidence(&self) -> Option<f64> {
        self.least().map(|(_, log_evidence)| log_evidence)
    }

    /// The step to the least within the bounds, and the logarithm of the evidence about it.
    pub fn least(&self) -> Option<(Step, f64)> {
        let n = self.u.len();
        let (step, mut factor) = self.solved(0.0, f64::INFINITY)?;
        let moved = DVector::from_iterator(n, step.to.iter().zip(self.u).map(|(to, from)| to - from));
        let pull = &self.pull - &self.precision * &moved;
        if factor.indices().iter().any(|index| step.held[*index]) {
            let free = self.order.iter().copied().filter(|index| !step.held[*index]);
            factor = Factor::new(&self.precision, free.collect())?;
        }
        let mut value = -0.5 * (self.cost - step.predicted_gain) - 0.5 * LN_2_PI * self.rows as f64;
        value -= self.coordinates.iter().map(|coordinate| coordinate.sigma.ln()).sum::<f64>();
        value -= factor.half_log_determinant();
        for index in factor.indices() {
            let coordinate = &self.coordinates[*index];
            if coordinate.is_half() {
                let bound = if coordinate.lower == coordinate.mean { coordinate.lower } else { coordinate.upper };
                let variance = factor.inverse_column(*index, n)[*index];
                let distance = (step.to[*index] - bound).abs() / variance.max(1e-300).sqrt();
                value += std::f64::consts::LN_2 + ln_normal_cdf(distance);
            }
        }
        for index in (0..n).filter(|index| step.held[*index]) {
            let precision = self.precision[(index, index)];
            // Half a normal density whose slope at the bound is not zero.
            let slope = pull[index].abs() / precision.sqrt();
            value += 0.5 * slope * slope + ln_normal_cdf(-slope) - 0.5 * precision.ln();
            if self.coordinates[index].is_half() {
                value += std::f64::consts::LN_2;
            }
        }
        Some((step, value))
    }

    /// The covariance of the coordinates that are not held at a bound; rows and columns of the others are zero.
    pub fn covariance(&self, held: &[bool]) -> DMatrix<f64> {
        let n = self.u.len();
        let mut covariance = DMatrix::zeros(n, n);
        let free: Vec<usize> = self.order.iter().copied().filter(|index| !held[*index]).collect();
        if let Some(factor) = Factor::new(&self.precision, free) {
            for index in factor.indices() {
                covariance.set_column(*index, &factor.inverse_column(*index, n));
            }
        }
        covariance
    }
}

const LN_2_PI: f64 = 1.837_877_066_409_345_5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::GroupNoise;
    use crate::problem::{Request, Row, Series};

    /// Two records with series of two groups each.
    struct Recorded([Record; 2]);

    impl Recorded {
        fn new() -> Self {
            let row = |i: i32| Row { time_s: 0.1 * f64::from(i), observed: 0.0, sigma: 0.5, activity: 1.0, turns: 0 };
            let series =
                |group: usize, count: i32| Series { rows: (0..count).map(row).collect(), group, is_process: true };
            let record = |counts: [i32; 3]| Record {
                series: vec![series(0, counts[0]), series(1, counts[1]), series(0, counts[2])],
                condition: 0,
            };
            Self([record([7, 4, 3]), record([5, 6, 0])])
        }
    }

    impl Problem for Recorded {
        fn coordinates(&self) -> &[Coordinate] {
            &[]
        }

        fn records(&self) -> &[Record] {
            &self.0
        }

        fn predict(&self, _: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
            vec![None; requests.len()]
        }
    }

    #[test]
    fn the_rows_of_all_groups_make_up_the_normal_equations() {
        let problem = Recorded::new();
        let wave = |seed: f64, count: usize| (0..count).map(|i| (seed + 1.7 * i as f64).sin()).collect::<Vec<f64>>();
        let counts = [14, 11];
        // The second coordinate moves the second group of the first record alone.
        let second: Vec<f64> = (0..14).map(|i| if (7..11).contains(&i) { 0.3 * f64::from(i) } else { 0.0 }).collect();
        let columns = vec![vec![(0, wave(0.2, 14)), (1, second)], vec![(0, wave(0.9, 11))]];
        let residual = counts.map(|count| wave(2.0, count)).into();
        let at = Linearised { u: vec![0.0; 2], residual, columns };
        let group = |discrepancy| GroupNoise { multiplier: 1.2, discrepancy, time_s: 0.3 };
        let noise = Noise { groups: vec![group(0.7), group(0.2)], smoothness: crate::Smoothness::Rough };
        let whole = at.normal(&problem, &noise);
        let mut sum = Normal::empty(2);
        for (group, moved) in [(0, [1, 1]), (1, [2, 1])] {
            let part = at.rows_of_group(&problem, group);
            assert_eq!(part.linear.columns.iter().map(Vec::len).collect::<Vec<_>>(), moved);
            sum.add(&part.linear.normal_of(&part.records, &noise));
        }
        assert!((sum.matrix - &whole.matrix).amax() < 1e-12 && (sum.gradient - &whole.gradient).amax() < 1e-12);
        assert!((sum.chi2 - whole.chi2).abs() < 1e-12 && (sum.log_determinant - whole.log_determinant).abs() < 1e-12);
        assert_eq!(sum.rows, whole.rows);
    }
}
