//! Error on runs that a fit has not seen: whole conditions are left out, one after the other.

use rayon::prelude::*;

use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, fit_with};
use crate::forward::residuals;
use crate::scatter::Scatter;

/// Root mean square of the residuals of each condition, predicted by a fit to all the others, in units
/// of the noise with the scatter of strokes taken out; nothing with fewer than two conditions.
pub fn held_out_rms(data: &Dataset, scatter: &Scatter, full: &Fit) -> Option<f64> {
    let groups = data.units_by_condition();
    if groups.len() < 2 {
        return None;
    }
    let sums: Vec<(f64, f64)> = groups
        .par_iter()
        .filter_map(|group| {
            let is_seen = |unit: usize| !group.contains(&unit);
            let is_unseen = |unit: usize| group.contains(&unit);
            let (seen, unseen) = (data.only(is_seen), data.only(is_unseen));
            // Close to where the full fit ended, with its Jacobian.
            let jacobian = full.jacobian.iter().map(|column| data.rows_of(column, is_seen)).collect();
            let options = FitOptions { steps: 1, tolerance: 0.3, stall: 1e-3 };
            let refitted = fit_with(&seen, &scatter.only(data, is_seen), &full.space, &full.u, jacobian, options)?;
            let residual = residuals(&unseen, &[refitted.valve()]).remove(0);
            let clean = scatter.only(data, is_unseen).without_scatter(&residual);
            Some((clean.iter().map(|value| value * value).sum::<f64>(), clean.len() as f64))
        })
        .collect();
    let (sum, count) = sums.into_iter().fold((0.0, 0.0), |total, part| (total.0 + part.0, total.1 + part.1));
    (count > 0.0).then(|| (sum / count).sqrt())
}
