//! How sure fitted coordinates are.
//!
//! Noise alone makes them as sure as the covariance of a fit says. But strokes differ from one to the next,
//! by more than the directions of a scatter know and even where none was repeated to show it. So strokes are
//! also left out in turn, to first order: a coordinate is no surer than the others agree on it without each
//! one (the jackknife of Tukey 1958, over clusters as by MacKinnon, Nielsen and Webb 2023).

use nalgebra::{DMatrix, DVector};

use crate::fit::{Fit, inverse};
use crate::scatter::Scatter;

/// Fewest strokes that can be left out in turn.
const FEWEST_STROKES: usize = 3;

/// The covariance of a fit's coordinates, widened where strokes agree less than `covariance` says;
/// correlations stay.
pub fn widened(scatter: &Scatter, fit: &Fit, covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let Some(variances) = left_out(scatter, fit) else { return covariance.clone() };
    let factor = |index: usize| {
        let (stated, shown) = (covariance[(index, index)], variances[index]);
        // Nobody is less sure than beforehand.
        let prior = fit.space.coordinates[index].prior.map_or(f64::INFINITY, |(_, sigma)| sigma * sigma);
        if stated > 0.0 { (shown.min(prior) / stated).sqrt().max(1.0) } else { 1.0 }
    };
    DMatrix::from_fn(covariance.nrows(), covariance.ncols(), |i, j| factor(i) * covariance[(i, j)] * factor(j))
}

/// Standard errors on either side of a value that hold the truth with a probability of 90 %: more than for noise
/// of known size where the scatter of a few strokes was estimated (Student's t, expanded as by Abramowitz and
/// Stegun 1964, 26.7.5).
pub fn quantile_90(scatter: &Scatter) -> f64 {
    const NORMAL: f64 = 1.645;
    if !scatter.is_known() {
        return NORMAL;
    }
    let freedom = scatter.stroke_count().saturating_sub(1).max(1) as f64;
    let first = (NORMAL.powi(3) + NORMAL) / 4.0;
    let second = (5.0 * NORMAL.powi(5) + 16.0 * NORMAL.powi(3) + 3.0 * NORMAL) / 96.0;
    NORMAL + first / freedom + second / freedom.powi(2)
}

/// The variance of every coordinate from leaving out one stroke after the other; nothing with too few of
/// them, or where the fit keeps no Jacobian.
fn left_out(scatter: &Scatter, fit: &Fit) -> Option<Vec<f64>> {
    let count = fit.u.len();
    if scatter.stroke_count() < FEWEST_STROKES || fit.jacobian.len() != count {
        return None;
    }
    let strokes = scatter.by_stroke(&fit.jacobian, &fit.residual);
    let nothing = (DMatrix::zeros(count, count), DVector::zeros(count));
    let (prior, _) = fit.space.with_priors(&fit.u, nothing);
    let information = strokes.iter().fold(prior.clone(), |sum, (stroke, _)| sum + stroke);
    let covariance = inverse(&information);
    let by_prior = &covariance * prior * &covariance;
    // By how much the estimate would move without each stroke.
    let moves: Vec<DVector<f64>> =
        strokes.iter().map(|(stroke, gradient)| inverse(&(&information - stroke)) * gradient).collect();
    let share = (strokes.len() as f64 - 1.0) / strokes.len() as f64;
    let variance = |index: usize| share * moves.iter().map(|moved| moved[index].powi(2)).sum::<f64>();
    Some((0..count).map(|index| variance(index) + by_prior[(index, index)]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_strokes_make_wider_intervals() {
        assert_eq!(quantile_90(&Scatter::none()), 1.645);
        // Student's t for 6 and 12 degrees of freedom: 1.943 and 1.782.
        for (strokes, exact) in [(7, 1.943), (13, 1.782)] {
            let known = Scatter::of_strokes(strokes);
            assert!((quantile_90(&known) - exact).abs() < 0.01, "{}", quantile_90(&known));
        }
    }
}
