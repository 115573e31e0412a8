//! How well a calibration predicts conditions that it has not seen.

use crate::compare::Comparison;
use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, fit_with};
use crate::scatter::Scatter;
use crate::space::Space;

/// Parts into which the conditions are dealt at most.
const PARTS: usize = 3;

/// The error on runs that a fit has not seen; whole conditions are left out in turn.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOut {
    /// Normalised error of the model before, on all runs.
    pub before: f64,
    /// Normalised error of fits to the other conditions, on the runs left out.
    pub after: f64,
    /// How many parts were left out in turn.
    pub parts: usize,
}

/// Leaves out the conditions of a dataset in turn and fits the rest, beginning at `best`; nothing with
/// fewer than two conditions, or where a fit fails.
///
/// `straight` are the data with the scatter of single strokes made linear, to be fitted; the error is
/// that on the data themselves.
pub fn held_out(
    space: &Space,
    (data, straight): (&Dataset, &Dataset),
    best: &Fit,
    scatter: &Scatter,
    before: &Comparison,
) -> Option<HeldOut> {
    let conditions = data.units_by_condition();
    let parts = PARTS.min(conditions.len());
    if parts < 2 {
        return None;
    }
    let part_of =
        |unit: usize| conditions.iter().position(|group| group.contains(&unit)).map_or(0, |index| index % parts);
    let (mut sum, mut readings) = (0.0, 0.0);
    for part in 0..parts {
        let kept = straight.only(|unit| part_of(unit) != part);
        let left_out = data.only(|unit| part_of(unit) == part);
        let scatter = scatter.only(straight, |unit| part_of(unit) != part);
        // Close to where the full fit ended, with its Jacobian.
        let jacobian = best.jacobian.iter().map(|column| data.rows_of(column, |unit| part_of(unit) != part)).collect();
        let options = FitOptions { steps: 2, tolerance: 0.5, ..FitOptions::default() };
        let fitted = fit_with(&kept, &scatter, space, &best.u, jacobian, options)?;
        let score = Comparison::new(&left_out, &fitted.valve()).overall;
        sum += score.normalised_rms.powi(2) * score.readings;
        readings += score.readings;
    }
    Some(HeldOut { before: before.overall.normalised_rms, after: (sum / readings).sqrt(), parts })
}
