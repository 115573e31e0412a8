//! How sure fitted values are.
//!
//! The covariance of a fit knows noise, nuisances and the model error. It is widened where single records disagree by
//! more than it says: a jackknife over records, to first order.

use identify::Fit;
use identify::normal::{Normal, Posterior};
use identify::problem::Problem;
use identify::special::t_quantile_95;
use nalgebra::DMatrix;
use valve_model::EffectKind;

use super::answer::{FittedParameter, MovedParameter};
use crate::identification::ValveProblem;
use crate::space::Target;

/// Fewer records than this say nothing of how they disagree.
const FEWEST_RECORDS: usize = 4;

/// A fit with everything that is needed for standard errors.
#[derive(Debug)]
pub struct Certainty {
    covariance: DMatrix<f64>,
    /// Points that fits without one record each would end at, to first order.
    without: Vec<Vec<f64>>,
}

impl Certainty {
    /// Of a fit.
    pub fn new(problem: &ValveProblem<'_>, fit: &Fit) -> Self {
        let normals = fit.linear.normals(problem, &fit.noise);
        let mut sum: Option<Normal> = None;
        for normal in &normals {
            match &mut sum {
                Some(sum) => sum.add(normal),
                None => sum = Some(normal.clone()),
            }
        }
        let coordinates = problem.coordinates();
        let Some(sum) = sum else { return Self { covariance: DMatrix::zeros(0, 0), without: Vec::new() } };
        let posterior = Posterior::new(coordinates, &fit.u, &sum);
        let covariance = posterior.covariance(&fit.held);
        let mut without = Vec::new();
        if normals.len() >= FEWEST_RECORDS {
            for normal in &normals {
                let mut rest = sum.clone();
                rest.subtract(normal);
                let posterior = Posterior::new(coordinates, &fit.u, &rest);
                without.extend(posterior.newton().map(|step| step.to));
            }
        }
        Self { covariance, without }
    }

    /// The covariance of the coordinates.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// One standard deviation of a function of the point.
    pub fn sigma(&self, problem: &ValveProblem<'_>, u: &[f64], of: impl Fn(&[f64]) -> f64) -> f64 {
        let [covariance, jackknife] = self.sigmas(problem, u, of);
        covariance.max(jackknife)
    }

    /// Half the width of the interval that holds a function of the point with a probability of 90 %: wider than for a
    /// normal density where what a few records disagree by decides (Student's t).
    pub fn half_width_90(&self, problem: &ValveProblem<'_>, u: &[f64], of: impl Fn(&[f64]) -> f64) -> f64 {
        let [covariance, jackknife] = self.sigmas(problem, u, of);
        let freedom = self.without.len().saturating_sub(1).max(1) as f64;
        (t_quantile_95(f64::INFINITY) * covariance).max(t_quantile_95(freedom) * jackknife)
    }

    /// One standard deviation of a function of the point: by the covariance, and by what records disagree by.
    fn sigmas(&self, problem: &ValveProblem<'_>, u: &[f64], of: impl Fn(&[f64]) -> f64) -> [f64; 2] {
        let value = of(u);
        let slopes: Vec<f64> = (0..u.len())
            .map(|index| {
                let coordinate = &problem.coordinates()[index];
                let width = self.covariance[(index, index)].max(0.0).sqrt();
                let step = 0.1 * width.clamp(1e-6, 1.0);
                let step = if u[index] + step > coordinate.upper { -step } else { step };
                let mut moved = u.to_vec();
                moved[index] += step;
                (of(&moved) - value) / step
            })
            .collect();
        let mut variance = 0.0;
        for (i, a) in slopes.iter().enumerate() {
            for (j, b) in slopes.iter().enumerate() {
                variance += a * self.covariance[(i, j)] * b;
            }
        }
        let mut jackknife = 0.0;
        if self.without.len() >= FEWEST_RECORDS {
            let values: Vec<f64> = self.without.iter().map(|u| of(u)).collect();
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            jackknife = (count - 1.0) / count * values.iter().map(|one| (one - mean).powi(2)).sum::<f64>();
        }
        [variance, jackknife].map(|variance| variance.max(0.0).sqrt())
    }
}

/// The parameters of effects at the optimum, with standard deviations.
pub fn effect_parameters(
    problem: &ValveProblem<'_>,
    fit: &Fit,
    certainty: &Certainty,
    kinds: &[EffectKind],
) -> Vec<FittedParameter> {
    let mut all = Vec::new();
    for kind in kinds {
        let Some(values) = problem.space.effect_values(*kind, &fit.u) else { continue };
        for (index, parameter) in kind.parameters().iter().enumerate() {
            let of = |u: &[f64]| problem.space.effect_values(*kind, u).map_or(values[index], |values| values[index]);
            all.push(FittedParameter {
                effect: *kind,
                name: parameter.name,
                unit: parameter.si_unit,
                value: values[index],
                sigma: certainty.sigma(problem, &fit.u, of),
            });
        }
    }
    all
}

/// The tolerated parameters at the optimum.
pub fn moved_parameters(problem: &ValveProblem<'_>, fit: &Fit, certainty: &Certainty) -> Vec<MovedParameter> {
    let space = &problem.space;
    space
        .coordinates
        .iter()
        .enumerate()
        .filter_map(|(index, coordinate)| {
            let Target::Base(id) = coordinate.target else { return None };
            let value = |u: &[f64]| coordinate.value(u[index]);
            let pull = |u: &[f64]| u[index];
            let half = certainty.half_width_90(problem, &fit.u, pull);
            let before = space.parameters().get(id);
            Some(MovedParameter {
                id,
                before,
                after: value(&fit.u),
                sigma: certainty.sigma(problem, &fit.u, value),
                interval_90: (coordinate.value(fit.u[index] - half), coordinate.value(fit.u[index] + half)),
                tolerance: (coordinate.value(1.0) / before).ln(),
                pull: fit.u[index],
                pull_sigma: certainty.sigma(problem, &fit.u, pull),
                is_at_bound: fit.held[index],
            })
        })
        .collect()
}
