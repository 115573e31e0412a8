//! The problem made linear about a point: normal equations, bounded steps and the evidence by Laplace.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use crate::noise::{Noise, Whitener};
use crate::problem::{Coordinate, Linear, Problem, residuals};
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

    /// Adds the products of the columns with each other.
    fn add_gram(&self, matrix: &mut DMatrix<f64>) {
        if self.columns.is_empty() {
            return;
        }
        let gram = self.columns.transpose() * &self.columns;
        for (i, row) in self.coordinates.iter().enumerate() {
            for (j, column) in self.coordinates.iter().enumerate() {
                matrix[(*row, *column)] += gram[(i, j)];
            }
        }
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
    pub fn new<P: Problem + ?Sized>(problem: &P, u: Vec<f64>, linear: Vec<Linear>) -> Self {
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

    /// The part of one record in the normal equations.
    fn normal_of(&self, record: usize, whitener: Whitener) -> Normal {
        let mut normal = Normal::empty(self.u.len());
        normal.log_determinant = whitener.log_determinant;
        normal.rows = self.residual[record].len();
        let jacobian = Jacobian::new(whitener, &self.columns[record]);
        jacobian.add_gram(&mut normal.matrix);
        normal.chi2 = jacobian.add_gradient(&self.residual[record], &mut normal.gradient);
        normal
    }

    /// The normal equations of all records, one by one.
    pub fn normals<P: Problem + ?Sized>(&self, problem: &P, noise: &Noise) -> Vec<Normal> {
        problem
            .records()
            .par_iter()
            .enumerate()
            .map(|(index, record)| self.normal_of(index, Whitener::new(record, noise)))
            .collect()
    }

    /// The normal equations of all records.
    pub fn normal<P: Problem + ?Sized>(&self, problem: &P, noise: &Noise) -> Normal {
        let mut all = self.normals(problem, noise).into_iter();
        let mut sum = all.next().unwrap_or_else(|| Normal::empty(self.u.len()));
        all.for_each(|one| sum.add(&one));
        sum
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
    pub fn new<P: Problem + ?Sized>(problem: &P, at: &Linearised, noise: &Noise) -> Self {
        let n = at.u.len();
        let all: Vec<usize> = (0..problem.records().len()).collect();
        let mut whitened = Self::of(problem, at, noise, &all);
        let (gradient, chi2) = whitened.gradient(&at.residual, n);
        whitened.normal.gradient = gradient;
        whitened.normal.chi2 = chi2;
        whitened
    }

    /// Of some records of a linearised problem, without residuals yet.
    pub fn of<P: Problem + ?Sized>(problem: &P, at: &Linearised, noise: &Noise, records: &[usize]) -> Self {
        let n = at.u.len();
        let jacobians: Vec<Jacobian> = records
            .par_iter()
            .map(|index| Jacobian::new(Whitener::new(&problem.records()[*index], noise), &at.columns[*index]))
            .collect();
        let mut whitened = Self { records: Vec::new(), normal: Normal::empty(n) };
        for jacobian in &jacobians {
            jacobian.add_gram(&mut whitened.normal.matrix);
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
    fn empty(n: usize) -> Self {
        Self { matrix: DMatrix::zeros(n, n), gradient: DVector::zeros(n), chi2: 0.0, log_determinant: 0.0, rows: 0 }
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
}

/// A step to the least of the quadratic within the bounds.
#[derive(Debug, Clone)]
pub struct Step {
    /// Where it leads.
    pub to: Vec<f64>,
    /// By how much the cost falls, to second order.
    pub promised: f64,
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
        Self { coordinates, u, precision, pull, cost, rows: normal.rows }
    }

    /// The step to the least of the quadratic within the bounds.
    pub fn newton(&self) -> Option<Step> {
        self.step(0.0, f64::INFINITY)
    }

    /// The damped step (Levenberg 1944, Marquardt 1963) within the bounds: coordinates that would leave them end
    /// there, and the others are solved anew. None moves by more than `reach` of its prior deviations. Nothing where the
    /// matrix is not positive definite.
    pub fn step(&self, damping: f64, reach: f64) -> Option<Step> {
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
        let mut step = DVector::zeros(n);
        // Every round holds one coordinate more or lets one go; a few rounds beyond all of them are plenty.
        for _ in 0..2 * n + 4 {
            step = solve_free(&matrix, &self.pull, &fixed)?;
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
                continue;
            }
            let left = &self.pull - &matrix * &step;
            let inwards = (0..n).find(|index| {
                let (lower, upper) = bounds(*index);
                let at = self.u[*index] + step[*index];
                fixed[*index].is_some()
                    && ((at <= lower && left[*index] > 1e-9 * matrix[(*index, *index)])
                        || (at >= upper && left[*index] < -1e-9 * matrix[(*index, *index)]))
            });
            match inwards {
                Some(index) => fixed[index] = None,
                None => break,
            }
        }
        let to: Vec<f64> = (0..n)
            .map(|index| {
                let (lower, upper) = bounds(index);
                (self.u[index] + step[index]).clamp(lower, upper)
            })
            .collect();
        let step = DVector::from_iterator(n, to.iter().zip(self.u).map(|(to, from)| to - from));
        let promised = 2.0 * self.pull.dot(&step) - step.dot(&(&self.precision * &step));
        let held = to.iter().zip(self.coordinates).map(|(to, coordinate)| coordinate.is_at_bound(*to)).collect();
        Some(Step { to, promised, held })
    }

    /// The logarithm of the evidence by Laplace's method about the least within the bounds, nats.
    ///
    /// Coordinates at a bound count with the integral of the density on their side of it.
    pub fn log_evidence(&self) -> Option<f64> {
        let step = self.newton()?;
        self.log_evidence_at(&step)
    }

    /// The same where the step is known.
    pub fn log_evidence_at(&self, step: &Step) -> Option<f64> {
        let n = self.u.len();
        let moved = DVector::from_iterator(n, step.to.iter().zip(self.u).map(|(to, from)| to - from));
        let pull = &self.pull - &self.precision * &moved;
        let free: Vec<usize> = (0..n).filter(|index| !step.held[*index]).collect();
        let mut value = -0.5 * (self.cost - step.promised) - 0.5 * LN_2_PI * self.rows as f64;
        value -= self.coordinates.iter().map(|coordinate| coordinate.sigma.ln()).sum::<f64>();
        let block = DMatrix::from_fn(free.len(), free.len(), |i, j| self.precision[(free[i], free[j])]);
        let factor = cholesky(block)?;
        value -= factor.l_dirty().diagonal().map(f64::ln).sum();
        let inverse = factor.inverse();
        for (place, index) in free.iter().enumerate() {
            let coordinate = &self.coordinates[*index];
            if coordinate.is_half() {
                let bound = if coordinate.lower == coordinate.mean { coordinate.lower } else { coordinate.upper };
                let distance = (step.to[*index] - bound).abs() / inverse[(place, place)].max(1e-300).sqrt();
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
        Some(value)
    }

    /// The covariance of the coordinates that are not held at a bound; rows and columns of the others are zero.
    pub fn covariance(&self, held: &[bool]) -> DMatrix<f64> {
        let n = self.u.len();
        let free: Vec<usize> = (0..n).filter(|index| !held[*index]).collect();
        let block = DMatrix::from_fn(free.len(), free.len(), |i, j| self.precision[(free[i], free[j])]);
        let mut covariance = DMatrix::zeros(n, n);
        if let Some(factor) = cholesky(block) {
            let inverse = factor.inverse();
            for (i, row) in free.iter().enumerate() {
                for (j, column) in free.iter().enumerate() {
                    covariance[(*row, *column)] = inverse[(i, j)];
                }
            }
        }
        covariance
    }
}

const LN_2_PI: f64 = 1.837_877_066_409_345_5;

/// The factor of a symmetric positive matrix.
pub fn cholesky(matrix: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    Cholesky::new(matrix)
}

/// The solution for the coordinates that are not fixed; nothing where the matrix is not positive definite.
fn solve_free(matrix: &DMatrix<f64>, right: &DVector<f64>, fixed: &[Option<f64>]) -> Option<DVector<f64>> {
    let n = fixed.len();
    let free: Vec<usize> = (0..n).filter(|index| fixed[*index].is_none()).collect();
    let mut solution = DVector::from_iterator(n, fixed.iter().map(|value| value.unwrap_or(0.0)));
    if free.is_empty() {
        return Some(solution);
    }
    let rest = right - matrix * &solution;
    let block = DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])]);
    let rest = DVector::from_iterator(free.len(), free.iter().map(|index| rest[*index]));
    let solved = cholesky(block)?.solve(&rest);
    for (place, index) in free.iter().enumerate() {
        solution[*index] = solved[place];
    }
    Some(solution)
}
