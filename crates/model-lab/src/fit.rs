//! Nonlinear least squares in a [`Space`]: Levenberg (1944) and Marquardt (1963) with priors and bounds.
//!
//! The Jacobian comes from finite differences that are a visible share of a prior's width, because
//! choking, contact and sticking switch; all its columns are simulated side by side, and so are several
//! dampings of each step.

use nalgebra::{DMatrix, DVector};
use valve_model::Valve;

use crate::data::Dataset;
use crate::forward::residuals;
use crate::scatter::Scatter;
use crate::space::Space;

/// When a fit ends.
#[derive(Debug, Clone, Copy)]
pub struct FitOptions {
    /// Most steps, accepted or not.
    pub steps: usize,
    /// It has converged when a step promises less than this (in chi-squared).
    pub tolerance: f64,
    /// It is given up when a step gains less than this share of what is above the noise.
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
    /// Columns of the Jacobian of the residuals near the best point.
    pub jacobian: Vec<Vec<f64>>,
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
const DAMPINGS: [f64; 4] = [0.03, 1.0, 30.0, 1000.0];

/// Fits a space to a dataset from a starting point; nothing if that is no possible valve.
pub fn fit(data: &Dataset, scatter: &Scatter, space: &Space, start: &[f64], options: FitOptions) -> Option<Fit> {
    let mut u = space.clamped(start);
    let mut residual = residuals(data, &[space.valve(&u)?]).remove(0);
    let mut chi2 = scatter.dot(&residual, &residual);
    let mut cost = chi2 + prior_cost(space, &u);
    let mut damping = 1e-3;
    let mut converged = false;
    let mut columns = jacobian(data, space, &u, &residual);
    for _ in 0..options.steps {
        let (matrix, gradient) = scatter.normal_equations(&columns, &residual);
        let trials: Vec<(f64, Vec<f64>, Valve)> = DAMPINGS
            .iter()
            .filter_map(|factor| {
                let (step, promised) = damped_step(space, &u, &matrix, &gradient, damping * factor)?;
                let moved: Vec<f64> = u.iter().zip(step.iter()).map(|(u, step)| u + step).collect();
                let next = space.clamped(&moved);
                let valve = space.valve(&next)?;
                (promised > options.tolerance).then_some((damping * factor, next, valve))
            })
            .collect();
        if trials.is_empty() {
            converged = true;
            break;
        }
        let valves: Vec<Valve> = trials.iter().map(|(_, _, valve)| valve.clone()).collect();
        let outcomes = residuals(data, &valves);
        let costs: Vec<(f64, f64)> = outcomes
            .iter()
            .zip(&trials)
            .map(|(outcome, (_, next, _))| {
                let chi2 = scatter.dot(outcome, outcome);
                (chi2, chi2 + prior_cost(space, next))
            })
            .collect();
        let Some(best) = (0..costs.len()).min_by(|a, b| costs[*a].1.total_cmp(&costs[*b].1)) else { break };
        let gain = cost - costs[best].1;
        if gain <= 0.0 {
            damping *= DAMPINGS[3] * 10.0;
            if damping > 1e9 {
                converged = true;
                break;
            }
            continue;
        }
        damping = trials[best].0.clamp(1e-9, 1e6);
        (chi2, cost) = costs[best];
        u.clone_from(&trials[best].1);
        residual.clone_from(&outcomes[best]);
        columns = jacobian(data, space, &u, &residual);
        if gain < options.tolerance {
            converged = true;
            break;
        }
        if gain < options.stall * (cost - 1.2 * residual.len() as f64) {
            break;
        }
    }
    let (mut matrix, _) = scatter.normal_equations(&columns, &residual);
    for (index, coordinate) in space.coordinates.iter().enumerate() {
        if let Some((_, sigma)) = coordinate.prior {
            matrix[(index, index)] += 1.0 / (sigma * sigma);
        }
    }
    let covariance = inverse(&matrix);
    Some(Fit { space: space.clone(), u, chi2, cost, covariance, residual, jacobian: columns, converged })
}

/// The columns of the Jacobian of the residuals, simulated side by side.
pub fn jacobian(data: &Dataset, space: &Space, u: &[f64], residual: &[f64]) -> Vec<Vec<f64>> {
    let steps: Vec<f64> = space.coordinates.iter().zip(u).map(|(coordinate, u)| coordinate.step_at(*u)).collect();
    let moved: Vec<Option<Valve>> = (0..u.len())
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
        .zip(&steps)
        .map(|(valve, step)| match valve.as_ref().and_then(|_| simulated.next()) {
            Some(changed) => changed.iter().zip(residual).map(|(a, b)| (a - b) / step).collect(),
            None => vec![0.0; residual.len()],
        })
        .collect()
}

/// The damped Gauss-Newton step with priors; a coordinate at a bound that pushes outwards stays.
/// Returns the step and the fall of the cost that it promises.
fn damped_step(
    space: &Space,
    u: &[f64],
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
) -> Option<(DVector<f64>, f64)> {
    let n = u.len();
    let mut a = matrix.clone();
    let mut b = -gradient;
    for (index, coordinate) in space.coordinates.iter().enumerate() {
        if let Some((mean, sigma)) = coordinate.prior {
            a[(index, index)] += 1.0 / (sigma * sigma);
            b[index] -= (u[index] - mean) / (sigma * sigma);
        }
    }
    let undamped = a.clone();
    let mut free: Vec<bool> = vec![true; n];
    for _ in 0..=n {
        let mut system = undamped.clone();
        let mut right = b.clone();
        for index in 0..n {
            system[(index, index)] += damping * undamped[(index, index)].max(1e-6);
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
            let promised = 2.0 * b.dot(&step) - (step.transpose() * &undamped * &step)[(0, 0)];
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
