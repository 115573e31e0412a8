//! The noise of a sensor from its readings at rest.

use crate::types::Trace;

/// Pairs of readings below which an estimate means little.
const FEWEST_PAIRS: usize = 50;

/// One standard deviation of the position's noise, m, from the differences between neighbouring
/// readings near either end of the motion. `None` where too few readings are at rest, or where
/// they do not differ at all.
///
/// Differences see only noise that is independent from row to row; slow drift does not count,
/// and a sensor with a filter of its own looks quieter than it is. Readings that belong to the
/// motion are cut off at four standard deviations, in the manner of sigma clipping.
#[must_use]
pub fn estimate_position_noise_m(trace: &Trace) -> Option<f64> {
    let (lowest, highest) = range(&trace.position_m)?;
    let band = 0.05 * (highest - lowest);
    let at_rest = |position: f64| position <= lowest + band || position >= highest - band;
    let mut differences: Vec<f64> = trace
        .position_m
        .windows(2)
        .filter(|pair| at_rest(pair[0]) && at_rest(pair[1]))
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|difference| difference.is_finite() && *difference < band.max(f64::MIN_POSITIVE))
        .collect();
    if differences.len() < FEWEST_PAIRS {
        return None;
    }
    differences.sort_by(f64::total_cmp);
    let rms =
        |values: &[f64]| (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt();
    // The median of |N(0, s)| is 0.6745 s; readings in coarse steps can have a median of 0.
    let median = differences[differences.len() / 2];
    let mut scale = if median > 0.0 { median / 0.6745 } else { rms(&differences) };
    for _ in 0..4 {
        let inside = differences.partition_point(|difference| *difference <= 4.0 * scale);
        scale = rms(&differences[..inside]);
    }
    // A difference of two readings has twice the variance of one.
    let sigma = scale / std::f64::consts::SQRT_2;
    (sigma > 0.0).then_some(sigma)
}

/// Lowest and highest finite value.
pub(crate) fn range(values: &[f64]) -> Option<(f64, f64)> {
    let mut finite = values.iter().copied().filter(|value| value.is_finite());
    let first = finite.next()?;
    Some(finite.fold((first, first), |(low, high), value| (low.min(value), high.max(value))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform numbers in [0, 1) from a linear congruential generator (Knuth's MMIX constants).
    fn uniform(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64
    }

    fn stroke(sigma_m: f64, resolution_m: f64) -> Trace {
        let mut seed = 7;
        let position = |row: usize, seed: &mut u64| {
            let time = row as f64 * 1e-3;
            let clean = if time < 2.0 { 0.02 } else { 0.02 * (1.0 - (time - 2.0) / 0.3).max(0.0) };
            // The sum of twelve uniform numbers is nearly normal with variance 1.
            let noise: f64 = (0..12).map(|_| uniform(seed)).sum::<f64>() - 6.0;
            ((clean + sigma_m * noise) / resolution_m).round() * resolution_m
        };
        let position_m = (0..5000).map(|row| position(row, &mut seed)).collect();
        Trace { position_m, ..Trace::default() }
    }

    #[test]
    fn noise_is_found_under_motion_and_coarse_steps() {
        for (sigma, resolution) in [(30e-6, 5e-6), (30e-6, 1e-9), (100e-6, 5e-6), (10e-6, 5e-6)] {
            let estimate = estimate_position_noise_m(&stroke(sigma, resolution)).unwrap();
            // Rounding to steps adds a variance of a twelfth of the step squared.
            let expected = (sigma * sigma + resolution * resolution / 12.0).sqrt();
            assert!((estimate / expected - 1.0).abs() < 0.03, "{estimate} for {expected}");
        }
    }

    #[test]
    fn nothing_is_made_up_from_silence() {
        assert_eq!(estimate_position_noise_m(&stroke(0.0, 1e-12)).filter(|sigma| *sigma > 1e-5), None);
        assert_eq!(estimate_position_noise_m(&Trace::default()), None);
        let dead = Trace { position_m: vec![f64::NAN; 1000], ..Trace::default() };
        assert_eq!(estimate_position_noise_m(&dead), None);
    }
}
