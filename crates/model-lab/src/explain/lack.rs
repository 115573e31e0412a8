//! Lack of fit: whether residuals still hold more than noise.
//!
//! The sum of squares of many residuals hardly feels a small misfit that lasts: with N residuals its
//! standard deviation is sqrt(2 N). Means over stretches of the record are more sensitive to it. For
//! each length of stretch the sum of squares of the scaled means is compared with its expectation.

use crate::data::Dataset;

/// Blocks in a stretch.
const STRETCHES: [usize; 3] = [4, 16, 64];

/// The largest excess of chi-squared over its expectation for stretches of any length, in standard
/// deviations of pure noise; about 0 to 3 where nothing is missing.
pub fn lack_of_fit(data: &Dataset, clean_residual: &[f64]) -> f64 {
    let mut worst = f64::NEG_INFINITY;
    for stretch in STRETCHES {
        let (mut sum, mut count) = (0.0, 0.0);
        let mut start = 0;
        for run in &data.runs {
            for channel in &run.channels {
                let part = &clean_residual[start..start + channel.blocks.len()];
                for piece in part.chunks_exact(stretch) {
                    sum += piece.iter().sum::<f64>().powi(2) / stretch as f64;
                    count += 1.0;
                }
                start += channel.blocks.len();
            }
        }
        if count > 0.0 {
            worst = f64::max(worst, (sum - count) / (2.0_f64 * count).sqrt());
        }
    }
    let timings = &clean_residual[clean_residual.len() - 2 * data.timing_rows.len()..];
    if !timings.is_empty() {
        let count = timings.len() as f64;
        let sum: f64 = timings.iter().map(|value| value * value).sum();
        worst = f64::max(worst, (sum - count) / (2.0 * count).sqrt());
        // Means over the rows of one condition.
        let (mut means, mut groups, mut next) = (0.0, 0.0, 0);
        for group in &data.timing_groups {
            let rows = group.rows.len();
            for direction in 0..2 {
                let total: f64 = (0..rows).map(|row| timings[2 * (next + row) + direction]).sum();
                means += total * total / rows as f64;
                groups += 1.0;
            }
            next += rows;
        }
        worst = f64::max(worst, (means - groups) / (2.0_f64 * groups).sqrt());
    }
    worst
}
