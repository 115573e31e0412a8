//! Nonlinear least squares in a [`Space`]: Levenberg (1944) and Marquardt (1963) with priors and bounds.
//!
//! The Jacobian comes from finite differences that follow the misfit at hand, because choking, contact and
//! sticking switch; all its columns are simulated side by side, and so are several dampings of each step. A
//! few steps share a Jacobian.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use valve_model::Valve;

use crate::data::Dataset;
use crate::forward::residuals;
use crate::scatter::Scatter;
use crate::space::Space;

/// When a fit ends.
#[derive(Debug, Clone, Copy)]
pub struct FitOptions {
    /// Most Jacobians; each is good for a few steps.
    pub steps: usize,
    /// It has converged when a step promises less than this (in chi-squared).
    pub tolerance: f64,
    /// It is given up when the steps of one Jacobian gain less than this share of what is above the noise; no
    /// step is tried that promises less than a tenth of that.
    pub stall: f64,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { steps: 30, tolerance: 0.02, stall: 2e-3 }
    }
}

/// The result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The space it was made in.
    pub space: Space,
    /// The best point found.
    pub u: Vec<f64>,
    /// Weighted sum of squared residuals.
    pub chi2: f64,
    /// chi-squared and priors together: what is minimised.
    pub cost: f64,
    /// Covariance of the coordinates (priors included).
    pub covariance: DMatrix<f64>,
    /// The residuals at the best point, in units of the noise.
    pub residual: Vec<f64>,
    /// Columns of the Jacobian of the residuals near the best point; none where it was not looked at.
    pub jacobian: Vec<Vec<f64>>,
    /// What a full step from the best point promises to take off the cost, to first order.
    pub promised: f64,
    /// Whether it ended because no step helps any more.
    pub converged: bool,
}

impl Fit {
    /// The valve at the best point.
    pub fn valve(&self) -> Valve {
        self.space.valve(&self.u).unwrap_or_else(|| unreachable!("a fit only visits possible valves"))
    }

    /// One standard deviation of a coordinate.
    pub fn sigma(&self, coordinate: usize) -> f64 {
        self.covariance[(coordinate, coordinate)].max(0.0).sqrt()
    }

    /// Root mean square of the residuals in units of the noise, scatter of strokes taken out.
    pub fn normalised_rms(&self, scatter: &Scatter) -> f64 {
        normalised_rms(&self.residual, scatter)
    }
}

/// Root mean square of residuals in units of the noise, scatter of strokes taken out.
pub fn normalised_rms(residual: &[f64], scatter: &Scatter) -> f64 {
    let clean = scatter.without_scatter(residual);
    (clean.iter().map(|value| value * value).sum::<f64>() / clean.len().max(1) as f64).sqrt()
}

/// The prior part of the cost at a point.
pub fn prior_cost(space: &Space, u: &[f64]) -> f64 {
    space
        .coordinates
        .iter()
        .zip(u)
        .filter_map(|(coordinate, u)| coordinate.prior.map(|(mean, sigma)| ((u - mean) / sigma).powi(2)))
        .sum()
}

/// Factors on the damping that are tried side by side in every step.
const DAMPINGS: [f64; 3] = [0.05, 1.0, 50.0];

/// Steps taken with one Jacobian, kept up to date by what the steps show (Broyden 1965).
const STEPS_PER_JACOBIAN: usize = 4;

/// Share of the promised gain from which on a Jacobian is good for another step.
const TRUSTED: f64 = 0.25;

/// Share of what a fit is given up for that a step must promise.
const NO_STEP: f64 = 0.1;

/// Damping that hardly damps.
const LEAST_DAMPING: f64 = 1e-9;

/// How much further the last move is carried on, beside the next step: along a curved valley every step
/// is as short as the last one.
const CARRIED_ON: [f64; 2] = [2.0, 8.0];

/// Fits a space to a dataset from a starting point; nothing if that is no possible valve.
pub fn fit(data: &Dataset, scatter: &Scatter, space: &Space, start: &[f64], options: FitOptions) -> Option<Fit> {
    let at = Point::new(data, scatter, space, space.clamped(start))?;
    let columns = jacobian(data, space, &at.u, &at.residual, &first_differences(space, &at.u));
    Some(fit_from(data, scatter, space, at, columns, options))
}

/// The same with the Jacobian of a point close by.
pub fn fit_with(
    data: &Dataset,
    scatter: &Scatter,
    space: &Space,
    start: &[f64],
    jacobian: Vec<Vec<f64>>,
    options: FitOptions,
) -> Option<Fit> {
    let at = Point::new(data, scatter, space, space.clamped(start))?;
    Some(fit_from(data, scatter, space, at, jacobian, options))
}

/// The same in a space with more coordinates than that of a fit at hand (whose come first), and with its
/// Jacobian for those: good enough to see which of several starts is best.
pub fn fit_near(
    data: &Dataset,
    scatter: &Scatter,
    space: &Space,
    near: &Fit,
    start: &[f64],
    options: FitOptions,
) -> Option<Fit> {
    let at = Point::new(data, scatter, space, space.clamped(start))?;
    let known = near.jacobian.len();
    let mut columns = near.jacobian.clone();
    columns.extend(some_columns(data, space, &at.u, &at.residual, &first_differences(space, &at.u), known..at.u.len()));
    Some(fit_from(data, scatter, space, at, columns, options))
}

fn fit_from(
    data: &Dataset,
    scatter: &Scatter,
    space: &Space,
    mut at: Point,
    mut columns: Vec<Vec<f64>>,
    options: FitOptions,
) -> Fit {
    let mut damping = 1e-3;
    let mut converged = false;
    let mut last_move: Option<Vec<f64>> = None;
    let (mut jacobians, mut age) = (0, 0);
    let mut cost_then = at.cost;
    while jacobians < options.steps {
        let above_noise = at.cost - 1.2 * at.residual.len() as f64;
        let tolerance = options.tolerance.max(NO_STEP * options.stall * above_noise);
        let (matrix, gradient) = space.with_priors(&at.u, scatter.normal_equations(&columns, &at.residual));
        let trials = trials(space, &at.u, &matrix, &gradient, damping, last_move.as_deref(), tolerance);
        let best = best_of(data, scatter, space, &trials);
        let gain = best.as_ref().map_or(0.0, |(_, point)| at.cost - point.cost);
        let mut renew = age + 1 >= STEPS_PER_JACOBIAN;
        if let Some((index, point)) = best.filter(|_| gain > 0.0) {
            let trial = &trials[index];
            damping = trial.damping.clamp(LEAST_DAMPING, 1e6);
            let moved: Vec<f64> = point.u.iter().zip(&at.u).map(|(to, from)| to - from).collect();
            let change: Vec<f64> = point.residual.iter().zip(&at.residual).map(|(to, from)| to - from).collect();
            renew |= gain < TRUSTED * trial.promised || gain < tolerance;
            if !renew {
                update(&mut columns, &matrix, &moved, &change);
            }
            at = point;
            last_move = Some(moved);
        } else if age == 0 {
            if trials.is_empty() || damping > 1e6 {
                converged = true;
                break;
            }
            damping *= 1e3;
            jacobians += 1;
            continue;
        } else {
            renew = true;
        }
        age += 1;
        if renew {
            if age == 1 && gain < tolerance {
                converged = true;
            }
            let gained = cost_then - at.cost;
            jacobians += 1;
            if converged || gained < options.stall * above_noise {
                break;
            }
            if jacobians < options.steps {
                let differences = differences(space, &at.u, &matrix, &at.residual);
                columns = jacobian(data, space, &at.u, &at.residual, &differences);
            }
            (age, cost_then) = (0, at.cost);
        }
    }
    let (matrix, gradient) = space.with_priors(&at.u, scatter.normal_equations(&columns, &at.residual));
    let promised =
        damped_step(space, &at.u, &matrix, &gradient, LEAST_DAMPING).map_or(0.0, |(_, promised)| promised.max(0.0));
    let covariance = inverse(&matrix);
    let Point { u, residual, chi2, cost } = at;
    Fit { space: space.clone(), u, chi2, cost, covariance, residual, jacobian: columns, promised, converged }
}

/// A point of a space that was simulated.
struct Point {
    u: Vec<f64>,
    residual: Vec<f64>,
    chi2: f64,
    cost: f64,
}

impl Point {
    fn new(data: &Dataset, scatter: &Scatter, space: &Space, u: Vec<f64>) -> Option<Self> {
        let residual = residuals(data, &[space.valve(&u)?]).remove(0);
        Some(Self::with(scatter, space, u, residual))
    }

    fn with(scatter: &Scatter, space: &Space, u: Vec<f64>, residual: Vec<f64>) -> Self {
        let chi2 = scatter.dot(&residual, &residual);
        let cost = chi2 + prior_cost(space, &u);
        Self { u, residual, chi2, cost }
    }
}

/// A point to try next.
struct Trial {
    u: Vec<f64>,
    valve: Valve,
    damping: f64,
    promised: f64,
}

/// Steps of several dampings that promise enough, and the best of them with the last move carried on.
fn trials(
    space: &Space,
    u: &[f64],
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
    last_move: Option<&[f64]>,
    tolerance: f64,
) -> Vec<Trial> {
    let to = |step: &[f64], damping: f64, promised: f64| {
        let moved: Vec<f64> = u.iter().zip(step).map(|(u, step)| u + step).collect();
        let u = space.clamped(&moved);
        let valve = space.valve(&u)?;
        Some(Trial { u, valve, damping, promised })
    };
    let mut trials = Vec::new();
    for factor in DAMPINGS {
        let Some((step, promised)) = damped_step(space, u, matrix, gradient, damping * factor) else { continue };
        if promised <= tolerance {
            continue;
        }
        trials.extend(to(step.as_slice(), damping * factor, promised));
        if let (Some(last), true) = (last_move, factor == 1.0) {
            trials.extend(CARRIED_ON.iter().filter_map(|times| {
                let further: Vec<f64> = step.iter().zip(last).map(|(step, last)| step + times * last).collect();
                to(&further, damping * factor, promised)
            }));
        }
    }
    trials
}

/// The trial of the lowest cost, with its index.
fn best_of(data: &Dataset, scatter: &Scatter, space: &Space, trials: &[Trial]) -> Option<(usize, Point)> {
    let valves: Vec<Valve> = trials.iter().map(|trial| trial.valve.clone()).collect();
    residuals(data, &valves)
        .into_iter()
        .zip(trials)
        .map(|(residual, trial)| Point::with(scatter, space, trial.u.clone(), residual))
        .enumerate()
        .min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))
}

/// Broyden's update of the Jacobian, with coordinates weighed by how much the residuals feel them.
fn update(columns: &mut [Vec<f64>], matrix: &DMatrix<f64>, moved: &[f64], change: &[f64]) {
    let weight = |index: usize| matrix[(index, index)] * moved[index];
    let length: f64 = (0..moved.len()).map(|index| weight(index) * moved[index]).sum();
    if length <= 0.0 {
        return;
    }
    let mut missed = change.to_vec();
    for (column, moved) in columns.iter().zip(moved) {
        for (missed, slope) in missed.iter_mut().zip(column) {
            *missed -= slope * moved;
        }
    }
    for (index, column) in columns.iter_mut().enumerate() {
        let share = weight(index) / length;
        for (slope, missed) in column.iter_mut().zip(&missed) {
            *slope += missed * share;
        }
    }
}

/// The differences of the first Jacobian: a visible share of each coordinate's width.
pub fn first_differences(space: &Space, u: &[f64]) -> Vec<f64> {
    space.coordinates.iter().zip(u).map(|(coordinate, u)| coordinate.step_at(*u)).collect()
}

/// Smallest share of the first difference that a later one is.
const FINEST: f64 = 0.02;

/// The differences of the next Jacobian: what the data can tell at the misfit at hand. Wider ones straddle
/// the corners of the strokes and of the cost near the optimum, narrower ones those of single steps.
fn differences(space: &Space, u: &[f64], matrix: &DMatrix<f64>, residual: &[f64]) -> Vec<f64> {
    let square: f64 = residual.iter().map(|value| value * value).sum::<f64>() / residual.len().max(1) as f64;
    let told = 2.0 * square.sqrt().max(1.0);
    first_differences(space, u)
        .iter()
        .enumerate()
        .map(|(index, first)| {
            let share = told / matrix[(index, index)].max(1e-12).sqrt() / first.abs();
            first * share.clamp(FINEST, 1.0)
        })
        .collect()
}

/// The columns of the Jacobian of the residuals, simulated side by side.
pub fn jacobian(data: &Dataset, space: &Space, u: &[f64], residual: &[f64], steps: &[f64]) -> Vec<Vec<f64>> {
    some_columns(data, space, u, residual, steps, 0..u.len())
}

fn some_columns(
    data: &Dataset,
    space: &Space,
    u: &[f64],
    residual: &[f64],
    steps: &[f64],
    which: Range<usize>,
) -> Vec<Vec<f64>> {
    let moved: Vec<Option<Valve>> = which
        .clone()
        .map(|index| {
            let mut point = u.to_vec();
            point[index] += steps[index];
            space.valve(&point)
        })
        .collect();
    let valves: Vec<Valve> = moved.iter().flatten().cloned().collect();
    let mut simulated = residuals(data, &valves).into_iter();
    moved
        .iter()
        .zip(&steps[which])
        .map(|(valve, step)| match valve.as_ref().and_then(|_| simulated.next()) {
            Some(changed) => changed.iter().zip(residual).map(|(a, b)| (a - b) / step).collect(),
            None => vec![0.0; residual.len()],
        })
        .collect()
}

/// The damped Gauss-Newton step (priors are in the matrix and the gradient); a coordinate at a bound that pushes outwards stays.
/// Returns the step and the fall of the cost that it promises.
fn damped_step(
    space: &Space,
    u: &[f64],
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
) -> Option<(DVector<f64>, f64)> {
    let n = u.len();
    let b = -gradient;
    let mut free: Vec<bool> = vec![true; n];
    for _ in 0..=n {
        let mut system = matrix.clone();
        let mut right = b.clone();
        for index in 0..n {
            system[(index, index)] += damping * matrix[(index, index)].max(1e-6);
            if !free[index] {
                for other in 0..n {
                    system[(index, other)] = 0.0;
                    system[(other, index)] = 0.0;
                }
                system[(index, index)] = 1.0;
                right[index] = 0.0;
            }
        }
        let step = system.cholesky()?.solve(&right);
        let blocked = (0..n).find(|index| {
            let coordinate = &space.coordinates[*index];
            let target = u[*index] + step[*index];
            free[*index]
                && ((u[*index] <= coordinate.lower && target < coordinate.lower)
                    || (u[*index] >= coordinate.upper && target > coordinate.upper))
        });
        let Some(index) = blocked else {
            let promised = 2.0 * b.dot(&step) - (step.transpose() * matrix * &step)[(0, 0)];
            return Some((step, promised));
        };
        free[index] = false;
    }
    None
}

/// The inverse of a symmetric matrix that may be nearly singular.
pub fn inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = matrix.clone().symmetric_eigen();
    let largest = eigen.eigenvalues.amax().max(1e-300);
    let inverted = eigen.eigenvalues.map(|value| if value > 1e-14 * largest { 1.0 / value } else { 1e14 / largest });
    &eigen.eigenvectors * DMatrix::from_diagonal(&inverted) * eigen.eigenvectors.transpose()
}
