//! What a fit leaves: how large it is, and what another effect could still gain on it.

use crate::fit::{Fit, FitOptions};
use crate::noise::{GroupNoise, Noise};
use crate::normal::{Posterior, prior_cost};
use crate::problem::Problem;
use crate::variance::{Effort, GroupPrior, components, evidence, log_prior};

/// What another effect could gain at most, nats: what a model error explains, and what coordinates and noise had to leave
/// their prior means for beyond what they do by chance.
pub fn left_to_explain(problem: &dyn Problem, fit: &Fit, options: &FitOptions) -> f64 {
    let coordinates = problem.coordinates();
    // By chance a coordinate leaves its mean as far as the data say where it is; one that they do not see stays there.
    let normal = fit.linear.normal(problem, &fit.noise);
    let posterior = Posterior::new(coordinates, &fit.u, &normal);
    let covariance = posterior.covariance(&fit.held);
    let seen = coordinates.iter().enumerate().map(|(index, coordinate)| {
        (1.0 - covariance[(index, index)] / (coordinate.sigma * coordinate.sigma)).clamp(0.0, 1.0)
    });
    let strain = 0.5 * (prior_cost(coordinates, &fit.u) - seen.sum::<f64>());
    left_nats(problem, fit, options).max(0.0) + strain.max(0.0) - log_prior(&options.groups, &fit.noise)
}

/// What an error in units of the noise is beyond that noise.
pub fn excess(error: f64) -> f64 {
    (error * error - 1.0).max(0.0).sqrt()
}

/// Root mean square of residuals in units of the rows' noise with its multiplier.
pub fn normalised_rms(problem: &dyn Problem, noise: &Noise, residual: &[Vec<f64>]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (record, residual) in problem.records().iter().zip(residual) {
        let mut rest = residual.as_slice();
        for series in &record.series {
            let Some(stretch) = rest.split_off(..series.rows.len()) else { continue };
            let multiplier = noise.groups[series.group].multiplier;
            for (row, residual) in series.rows.iter().zip(stretch) {
                sum += (residual / (multiplier * row.sigma)).powi(2);
                count += 1.0;
            }
        }
    }
    (sum / f64::max(count, 1.0)).sqrt()
}

/// How much more likely a model error makes the rows than noise alone does, nats: what is left to explain. Single readings
/// have no model error; of them it is what a larger noise than stated makes more likely.
pub fn left_nats(problem: &dyn Problem, fit: &Fit, options: &FitOptions) -> f64 {
    let is_process = |group: usize| {
        let mut series = problem.records().iter().flat_map(|record| &record.series);
        series.any(|series| series.group == group && series.is_process)
    };
    let none = fit.noise.groups.iter().enumerate().map(|(index, group)| {
        let multiplier = if is_process(index) { group.multiplier } else { group.multiplier.min(1.0) };
        GroupNoise { multiplier, discrepancy: 0.0, ..*group }
    });
    let none = Noise { groups: none.collect(), smoothness: fit.noise.smoothness };
    // Only multipliers of processes are refined: the discrepancy of nothing stays nothing.
    let priors: Vec<GroupPrior> = options
        .groups
        .iter()
        .enumerate()
        .map(|(index, prior)| {
            if is_process(index) {
                return *prior;
            }
            let kept = none.groups[index].multiplier;
            GroupPrior { multiplier: (kept, kept), ..*prior }
        })
        .collect();
    let none = components(problem, &fit.linear, &priors, &none, Effort::Local);
    let normal = fit.linear.normal(problem, &none);
    fit.log_evidence - evidence(problem, &fit.linear, &normal, &options.groups, &none)
}
