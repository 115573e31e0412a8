//! The scatter that strokes would need for a model to be right, where none was repeated.
//!
//! What a model leaves of a stroke is noise, what the stroke was off by, and what the model's parameters
//! are off by, which all strokes share. The most likely variances are those of a linear model with random
//! effects (Laird and Ware 1982), the parameters integrated out with their priors as in restricted maximum
//! likelihood (Patterson and Thompson 1971), by expectation and maximisation.
//!
//! Missing physics can look like scatter as well. So variances end where those of a sound valve do, and it is
//! for the caller to ask what is left then, and whether a law explains as much.

use nalgebra::{DMatrix, DVector};

use super::directions::{directions, layout};
use super::{EM_ROUNDS, FLOWS, Origin, SOURCES, Scatter, Source, product};
use crate::data::Dataset;
use crate::fit::{Fit, inverse, prior_cost};
use crate::forward::residuals;
use crate::repeats::repeats;

/// Largest variance of a source, in its units squared: 3 ms, or one percent.
const MOST_VARIANCE: f64 = 10.0;

/// Fewest recorded strokes from which scatter is supposed: with fewer of them it explains anything.
const FEWEST_STROKES: usize = 3;

/// Cost per reading, to first order, up to which supposed scatter may explain what a model leaves.
const EXPLAINS: f64 = 2.0;

impl Scatter {
    /// The scatter that may explain what a fitted model leaves of strokes of which none was repeated; nothing
    /// where it is known already, where the strokes are too few, or where it explains too little.
    pub fn or_supposed(&self, data: &Dataset, model: &Fit) -> Option<Self> {
        if self.is_known() || data.runs.len() < FEWEST_STROKES || !repeats(data).is_empty() {
            return None;
        }
        let enough = EXPLAINS * data.residual_count() as f64;
        // No smaller scatter explains more than the largest; a rough look tells whether that is enough.
        let (_, roughly) = Problem::of(&data.rough(), model);
        if roughly.posterior(&[MOST_VARIANCE; SOURCES.len()])?.cost > enough {
            return None;
        }
        Self::supposed_within(data, model, enough)
    }

    /// The most likely scatter if a fitted model is right but for its parameters; `model` needs its Jacobian.
    pub(super) fn supposed(data: &Dataset, model: &Fit) -> Self {
        Self::supposed_within(data, model, f64::INFINITY).unwrap_or_else(|| Self::unknown(data))
    }

    /// The same, if the model then comes to no more than a cost.
    fn supposed_within(data: &Dataset, model: &Fit, most_cost: f64) -> Option<Self> {
        let (directions, problem) = Problem::of(data, model);
        let of_flow = |flow: Source| problem.likeliest(FLOWS.iter().find(|other| **other != flow));
        let [solenoid, all_orifices] = [of_flow(FLOWS[0])?, of_flow(FLOWS[1])?];
        let (variances, found) =
            if all_orifices.1.likelihood > solenoid.1.likelihood { all_orifices } else { solenoid };
        (found.cost <= most_cost).then(|| Self::assemble(&layout(data), &directions, variances, Origin::Supposed))
    }
}

/// One stroke of the linear model r + J p + D b, with p of the parameters and b of this stroke.
struct Stroke {
    /// D'D.
    gram: DMatrix<f64>,
    /// J'D.
    cross: DMatrix<f64>,
    /// D'r.
    projection: DVector<f64>,
}

struct Problem {
    strokes: Vec<Stroke>,
    /// J'J with the precision of the priors.
    information: DMatrix<f64>,
    /// J'r with the gradient of the priors.
    gradient: DVector<f64>,
    /// The cost as the model stands, without scatter.
    cost: f64,
}

/// What is known of the scatter for some variances.
struct Posterior {
    /// Mean of the squares of every source over the strokes.
    squares: Vec<f64>,
    /// Logarithm of the likelihood, up to a constant.
    likelihood: f64,
    /// What the cost of the model falls to.
    cost: f64,
}

impl Problem {
    /// What every source changes in a dataset about a fitted model, and the problem.
    fn of(data: &Dataset, model: &Fit) -> (Vec<Vec<f64>>, Self) {
        let valve = model.valve();
        let residual = residuals(data, core::slice::from_ref(&valve)).remove(0);
        let directions = directions(data, &valve, &residual);
        let problem = Self::new(&layout(data)[..data.runs.len()], &directions, model, &residual);
        (directions, problem)
    }

    fn new(layout: &[(usize, usize)], directions: &[Vec<f64>], model: &Fit, residual: &[f64]) -> Self {
        let strokes = layout.iter().map(|(start, end)| {
            let rows = *start..*end;
            let along = |a: &[f64], b: &[f64]| product(&a[rows.clone()], &b[rows.clone()]);
            let (sources, parameters) = (directions.len(), model.jacobian.len());
            Stroke {
                gram: DMatrix::from_fn(sources, sources, |i, j| along(&directions[i], &directions[j])),
                cross: DMatrix::from_fn(parameters, sources, |i, j| along(&model.jacobian[i], &directions[j])),
                projection: DVector::from_fn(sources, |i, _| along(&directions[i], residual)),
            }
        });
        let unscattered = Scatter::none().normal_equations(&model.jacobian, residual);
        let (information, gradient) = model.space.with_priors(&model.u, unscattered);
        let cost = product(residual, residual) + prior_cost(&model.space, &model.u);
        Self { strokes: strokes.collect(), information, gradient, cost }
    }

    /// The most likely variances of all sources but one, and what is known with them.
    fn likeliest(&self, without: Option<&Source>) -> Option<([f64; SOURCES.len()], Posterior)> {
        let used: Vec<usize> = (0..SOURCES.len()).filter(|source| Some(&SOURCES[*source].0) != without).collect();
        let problem = self.of_sources(&used);
        let mut variances = vec![1.0; used.len()];
        let mut posterior = problem.posterior(&variances)?;
        for _ in 0..EM_ROUNDS {
            variances = posterior.squares.iter().map(|square| square.clamp(1e-12, MOST_VARIANCE)).collect();
            posterior = problem.posterior(&variances)?;
        }
        let mut all = [0.0; SOURCES.len()];
        for (index, variance) in used.into_iter().zip(variances) {
            all[index] = variance;
        }
        Some((all, posterior))
    }

    fn of_sources(&self, used: &[usize]) -> Self {
        let strokes = self.strokes.iter().map(|stroke| Stroke {
            gram: DMatrix::from_fn(used.len(), used.len(), |i, j| stroke.gram[(used[i], used[j])]),
            cross: stroke.cross.select_columns(used),
            projection: stroke.projection.select_rows(used),
        });
        Self {
            strokes: strokes.collect(),
            information: self.information.clone(),
            gradient: self.gradient.clone(),
            cost: self.cost,
        }
    }

    fn posterior(&self, variances: &[f64]) -> Option<Posterior> {
        let precisions = DVector::from_iterator(variances.len(), variances.iter().map(|variance| 1.0 / variance));
        let mut information = self.information.clone();
        let mut gradient = self.gradient.clone();
        let (mut likelihood, mut explained) = (0.0, 0.0);
        let mut inverses = Vec::with_capacity(self.strokes.len());
        for stroke in &self.strokes {
            let decomposed = (&stroke.gram + DMatrix::from_diagonal(&precisions)).cholesky()?;
            likelihood += 0.5 * (precisions.map(f64::ln).sum() - decomposed.ln_determinant());
            let inverse = decomposed.inverse();
            explained += stroke.projection.dot(&(&inverse * &stroke.projection));
            let weighted = &stroke.cross * &inverse;
            information -= &weighted * stroke.cross.transpose();
            gradient -= &weighted * &stroke.projection;
            inverses.push((inverse, weighted));
        }
        let covariance = inverse(&information);
        let shift = -(&covariance * &gradient);
        explained -= shift.dot(&gradient);
        likelihood += 0.5 * (covariance.clone().cholesky()?.ln_determinant() + explained);
        let mut squares = vec![0.0; variances.len()];
        for (stroke, (inverse, weighted)) in self.strokes.iter().zip(&inverses) {
            let off = -(inverse * &stroke.projection) - weighted.transpose() * &shift;
            let spread = inverse + weighted.transpose() * &covariance * weighted;
            for (index, square) in squares.iter_mut().enumerate() {
                *square += (off[index].powi(2) + spread[(index, index)]) / self.strokes.len() as f64;
            }
        }
        Some(Posterior { squares, likelihood, cost: self.cost - explained })
    }
}
