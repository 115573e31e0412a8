//! A first guess from a few readings, by medians: no few glitches mislead it.

use leak_table::Stroke;

use super::model::FaultModel;
use super::track::SMALLEST_GROWTH;
use super::view::{NoisePrior, View};
use crate::reading::Reading;

/// Start and growth from medians of the inverted timings: not moved by a few
/// glitches.
pub(super) fn first_guess(
    model: &FaultModel,
    readings: &[Reading],
    shape: &impl Fn(u64) -> f64,
    views: &[View],
) -> (f64, f64) {
    let leaks = |reading: &Reading| {
        let reading = *reading;
        Stroke::ALL.into_iter().filter_map(move |s| reading.time_s(s).map(|t| model.leak_at(s, t)))
    };
    let healthy = views.iter().any(|view| view.sd == 0.0);
    if healthy {
        let mut rates: Vec<f64> = readings
            .iter()
            .filter(|r| shape(r.cycle) > 0.0)
            .flat_map(|r| {
                let phi = shape(r.cycle);
                leaks(r).map(move |leak| leak / phi)
            })
            .collect();
        return (0.0, median(&mut rates).unwrap_or(0.01).clamp(SMALLEST_GROWTH, 1.0));
    }
    let half = readings.len().div_ceil(2);
    let centre = |part: &[Reading]| {
        let mut values: Vec<f64> = part.iter().flat_map(leaks).collect();
        let phi = part.iter().map(|r| shape(r.cycle)).sum::<f64>() / part.len().max(1) as f64;
        median(&mut values).map(|leak| (phi, leak))
    };
    match (centre(&readings[..half]), centre(&readings[half..])) {
        (Some((p, a)), Some((q, b))) if q > p => {
            let growth = ((b - a) / (q - p)).max(SMALLEST_GROWTH);
            (a - growth * p, growth)
        }
        (Some((_, a)), _) => (a, SMALLEST_GROWTH),
        _ => (0.0, SMALLEST_GROWTH),
    }
}

/// Noise variance from the median residual about a first guess.
pub(super) fn first_variance(
    model: &FaultModel,
    readings: &[Reading],
    shape: &impl Fn(u64) -> f64,
    (start, growth): (f64, f64),
    prior: &NoisePrior,
) -> f64 {
    let residuals = readings.iter().flat_map(|reading| {
        let leak = start + growth * shape(reading.cycle);
        Stroke::ALL
            .into_iter()
            .filter_map(move |stroke| Some(model.linearise(stroke, leak, reading.time_s(stroke)?).residual))
    });
    robust_variance(residuals, prior)
}

/// Variance from the median size of residuals, with the prior's weight.
pub(crate) fn robust_variance(residuals: impl Iterator<Item = f64>, prior: &NoisePrior) -> f64 {
    let mut sizes: Vec<f64> = residuals.map(f64::abs).collect();
    let n = sizes.len() as f64;
    let sd = 1.4826 * median(&mut sizes).unwrap_or(0.0);
    (2.0 * prior.b + n * sd * sd) / (2.0 * prior.a + n)
}

fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    Some(if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) })
}
