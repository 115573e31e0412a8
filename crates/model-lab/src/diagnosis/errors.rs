//! The one definition of a model's error: what is left after a fit, in units of the noise, in metres and in seconds.

use identify::problem::{Problem, predict_all, residuals};
use identify::select::Model;

use super::answer::StepReport;
use crate::identification::ValveProblem;
use crate::identification::setup::Kind;

/// The errors of residuals.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Errors {
    /// Root mean square in units of the rows' noise.
    pub normalised_rms: f64,
    /// Root mean square of the positions, m.
    pub rmse_m: Option<f64>,
    /// Root mean square of stroke times, s.
    pub time_rmse_s: Option<f64>,
}

impl Errors {
    /// Of residuals by record.
    pub fn of(problem: &ValveProblem<'_>, residual: &[Vec<f64>]) -> Self {
        let (mut noise, mut position, mut time) = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0));
        for ((record, unit), residual) in problem.records().iter().zip(&problem.setup().units).zip(residual) {
            for (row, residual) in record.rows().zip(residual) {
                noise.0 += (residual / row.sigma).powi(2);
                noise.1 += 1.0;
            }
            let sum = if matches!(unit.kind, Kind::Trace(_)) { &mut position } else { &mut time };
            for residual in residual.iter().take(record.series.first().map_or(0, |series| series.rows.len())) {
                sum.0 += residual * residual;
                sum.1 += 1.0;
            }
        }
        let root = |(sum, count): (f64, f64)| (count > 0.0).then(|| (sum / count).sqrt());
        Self { normalised_rms: root(noise).unwrap_or(0.0), rmse_m: root(position), time_rmse_s: root(time) }
    }

    /// As a step of the model sequence.
    pub fn step(self, name: String, held_out: Option<Self>, discrepancy: Option<f64>) -> StepReport {
        StepReport {
            step: name,
            normalised_rms: self.normalised_rms,
            held_out_normalised_rms: held_out.map(|errors| errors.normalised_rms),
            rmse_m: self.rmse_m,
            held_out_rmse_m: held_out.and_then(|errors| errors.rmse_m),
            time_rmse_s: self.time_rmse_s,
            discrepancy,
        }
    }
}

/// The errors of a fitted model.
pub fn fitted(model: &Model<ValveProblem<'_>>) -> Errors {
    Errors::of(&model.problem, &model.fit.linear.residual)
}

/// The errors of a fitted model on what is held out, fold by fold; nothing where there is only one record, or where it was
/// fitted cheaply.
pub fn left_out(model: &Model<ValveProblem<'_>>) -> Option<Errors> {
    model.held_out.as_ref().map(|held| Errors::of(&model.problem, &held.own))
}

/// The errors at a point that nothing was fitted to.
pub fn at(problem: &ValveProblem<'_>, u: &[f64]) -> Option<Errors> {
    let predicted = predict_all(problem, &[u.to_vec()]).pop()??;
    Some(Errors::of(problem, &residuals(problem, &predicted)))
}
