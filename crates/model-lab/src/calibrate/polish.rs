//! The last steps of a calibration, with central differences as fine as the data can tell.
//!
//! The steps that bring a fit near its optimum are a visible share of a tolerance, many times the
//! standard error of a well-known parameter. Where the corners of a stroke move, such a secant is not the
//! slope, and what it misses would be an error of the result that no standard error shows.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use valve_model::Valve;

use crate::data::Dataset;
use crate::fit::{Fit, inverse, prior_cost};
use crate::forward::residuals;
use crate::scatter::Scatter;

/// Steps at most.
const STEPS: usize = 4;

/// It ends when a step promises less than this of chi-squared.
const TOLERANCE: f64 = 0.02;

/// Smallest and largest difference, in tolerances.
const DIFFERENCE: (f64, f64) = (1e-4, 0.02);

/// The fit with its optimum and its Jacobian made exact. Bounds are kept by clamping.
pub fn polished(data: &Dataset, scatter: &Scatter, mut fit: Fit) -> Fit {
    let (mut matrix, _) = scatter.normal_equations(&fit.jacobian, &fit.residual);
    for _ in 0..STEPS {
        // Two standard errors of each coordinate alone.
        let steps: Vec<f64> = (0..fit.u.len())
            .map(|index| (2.0 / matrix[(index, index)].max(1e-12).sqrt()).clamp(DIFFERENCE.0, DIFFERENCE.1))
            .collect();
        let Some(columns) = central(data, &fit, &steps) else { return fit };
        fit.jacobian = Arc::new(columns);
        let (information, step, promised) = newton(scatter, &fit);
        matrix = information;
        fit.covariance = inverse(&matrix);
        if promised < TOLERANCE || !advanced(data, scatter, &mut fit, &step) {
            break;
        }
    }
    fit
}

/// The normal matrix, the step of Gauss and Newton, and what it promises to take off the cost.
fn newton(scatter: &Scatter, fit: &Fit) -> (DMatrix<f64>, DVector<f64>, f64) {
    let normal = scatter.normal_equations(&fit.jacobian, &fit.residual);
    let (matrix, gradient) = fit.space.with_priors(&fit.u, normal);
    let step = -(inverse(&matrix) * &gradient);
    let promised = -gradient.dot(&step);
    (matrix, step, promised)
}

/// Moves along a step, or a part of it, if that lowers the cost.
fn advanced(data: &Dataset, scatter: &Scatter, fit: &mut Fit, step: &DVector<f64>) -> bool {
    for share in [1.0, 0.5, 0.2] {
        let moved: Vec<f64> = fit.u.iter().zip(step.iter()).map(|(u, step)| u + share * step).collect();
        let u = fit.space.clamped(&moved);
        let Some(valve) = fit.space.valve(&u) else { continue };
        let residual = residuals(data, &[valve]).remove(0);
        let chi2 = scatter.dot(&residual, &residual);
        let cost = chi2 + prior_cost(&fit.space, &u);
        if cost < fit.cost {
            (fit.u, fit.residual, fit.chi2, fit.cost) = (u, residual, chi2, cost);
            return true;
        }
    }
    false
}

/// Columns of the Jacobian by central differences, all simulated side by side.
fn central(data: &Dataset, fit: &Fit, steps: &[f64]) -> Option<Vec<Vec<f64>>> {
    let mut valves: Vec<Valve> = Vec::with_capacity(2 * steps.len());
    for (index, step) in steps.iter().enumerate() {
        for sign in [1.0, -1.0] {
            let mut u = fit.u.clone();
            u[index] += sign * step;
            valves.push(fit.space.valve(&u)?);
        }
    }
    let simulated = residuals(data, &valves);
    let difference = |pair: &[Vec<f64>], step: f64| {
        pair[0].iter().zip(&pair[1]).map(|(up, down)| (up - down) / (2.0 * step)).collect()
    };
    Some(simulated.chunks(2).zip(steps).map(|(pair, step)| difference(pair, *step)).collect())
}
