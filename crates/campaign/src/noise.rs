//! The noise of a sensor and the steps of its recorder, from the readings themselves.

use crate::types::Trace;

/// Pairs of readings at rest below which they say little.
const FEWEST_PAIRS: usize = 12;
/// Readings below which nothing is said.
const FEWEST_READINGS: usize = 8;
/// The least share of a record's span that noise is believed to be: converters of 16 bits have steps of 1.5e-5 of it.
const LEAST_SHARE: f64 = 2e-5;
/// Where third differences show less than this part of what first ones do, something moves.
const CREEP: f64 = 0.8;
/// How far from a multiple of the step a distance may be, in steps.
const OFF_GRID: f64 = 0.1;
/// How many of the distances are multiples.
const SHARE_ON_GRID: f64 = 0.9;
/// Quieter than this part of the variance of rounding no rounded reading is: a resting one can sit on a single code.
const LEAST_OF_ROUNDING: f64 = 0.5;

/// One standard deviation of the position's noise, m; see [`estimate_noise`].
#[must_use]
pub fn estimate_position_noise_m(trace: &Trace) -> Option<f64> {
    estimate_noise(&trace.position_m)
}

/// One standard deviation of a channel's noise, in its unit, rounding included. `None` where there are hardly any
/// readings, or all are one.
///
/// It comes from the differences between neighbouring readings near either end of the motion; where too few are at
/// rest, as in the records of a slow logger, from third differences, in which smooth motion cancels. Differences see
/// only noise that is independent from row to row; slow drift does not count, and a sensor with a filter of its
/// own looks quieter than it is. Readings that belong to the motion are cut off at four standard deviations, in the
/// manner of sigma clipping. Where the readings at rest are a single code they say nothing, and the error of
/// rounding in motion is taken, q/sqrt(12).
#[must_use]
pub fn estimate_noise(samples: &[f64]) -> Option<f64> {
    let finite = samples.iter().filter(|value| value.is_finite()).count();
    let (lowest, highest) = range(samples)?;
    if finite < FEWEST_READINGS || lowest == highest {
        return None;
    }
    let rounding = estimate_resolution(samples).unwrap_or(0.0) / 12f64.sqrt();
    let smooth = from_third_differences(samples);
    let seen = match at_rest(samples, lowest, highest) {
        // What creeps near an end is not at rest.
        Some(at_rest) => smooth.filter(|smooth| *smooth > 0.0 && *smooth < CREEP * at_rest).unwrap_or(at_rest),
        None => smooth.unwrap_or(0.0),
    };
    let seen = if seen > 0.0 { seen.max(LEAST_OF_ROUNDING * rounding) } else { rounding };
    Some(seen.max(LEAST_SHARE * (highest - lowest)))
}

/// One standard deviation of the noise of several recordings of one kind of channel together; `None` where none of them tells.
#[must_use]
pub fn pooled_noise<'a>(recordings: impl IntoIterator<Item = &'a [f64]>) -> Option<f64> {
    let variances: Vec<f64> = recordings.into_iter().filter_map(estimate_noise).map(|noise| noise * noise).collect();
    (!variances.is_empty()).then(|| (variances.iter().sum::<f64>() / variances.len() as f64).sqrt())
}

/// What a channel's noise is at least and at most, as one standard deviation; `None` where nothing tells.
///
/// At least: the least of what differences at rest and third differences show, for motion adds to either. At most: what
/// readings near an end scatter by about their median, drift and what a filter leaves of slow noise included.
pub(crate) fn noise_bounds(samples: &[f64]) -> Option<(f64, f64)> {
    let usual = estimate_noise(samples)?;
    let (lowest, highest) = range(samples)?;
    let least = [at_rest(samples, lowest, highest), from_third_differences(samples)];
    let least = least.into_iter().flatten().fold(usual, f64::min);
    let band = END * (highest - lowest);
    let scatter = |end: f64| {
        let near: Vec<f64> = samples.iter().copied().filter(|value| (value - end).abs() <= band).collect();
        let middle = quantile(&near, 0.5);
        let sizes: Vec<f64> = near.iter().map(|value| (value - middle).abs()).collect();
        if sizes.len() < FEWEST_PAIRS { 0.0 } else { quantile(&sizes, 0.5) / MEDIAN_SIZE }
    };
    Some((least, usual.max(scatter(lowest)).max(scatter(highest))))
}

/// Readings within this share of the span from an end may be at rest there.
const END: f64 = 0.05;
/// Differences beyond so many standard deviations are none of noise; so often they are taken out.
const INLIERS: f64 = 4.0;
const ROUNDS: usize = 4;
/// Median size of a normal deviate, in standard deviations.
pub(crate) const MEDIAN_SIZE: f64 = 0.6745;

/// From differences near either end; `None` where there are too few.
fn at_rest(samples: &[f64], lowest: f64, highest: f64) -> Option<f64> {
    let band = END * (highest - lowest);
    let at_rest = |position: f64| position <= lowest + band || position >= highest - band;
    let mut differences: Vec<f64> = samples
        .windows(2)
        .filter(|pair| at_rest(pair[0]) && at_rest(pair[1]))
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|difference| difference.is_finite() && *difference < band)
        .collect();
    if differences.len() < FEWEST_PAIRS {
        return None;
    }
    differences.sort_by(f64::total_cmp);
    let rms =
        |values: &[f64]| (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt();
    // Readings in coarse steps can have a median of 0.
    let median = differences[differences.len() / 2];
    let mut scale = if median > 0.0 { median / MEDIAN_SIZE } else { rms(&differences) };
    for _ in 0..ROUNDS {
        let inside = differences.partition_point(|difference| *difference <= INLIERS * scale);
        scale = rms(&differences[..inside]);
    }
    // A difference of two readings has twice the variance of one.
    Some(scale / std::f64::consts::SQRT_2)
}

/// From the median size of third differences, whose variance is 1 + 9 + 9 + 1 times that of a reading.
fn from_third_differences(samples: &[f64]) -> Option<f64> {
    let sizes: Vec<f64> = samples
        .windows(4)
        .map(|four| (four[3] - four[0] - 3.0 * (four[2] - four[1])).abs())
        .filter(|size| size.is_finite())
        .collect();
    (!sizes.is_empty()).then(|| quantile(&sizes, 0.5) / (MEDIAN_SIZE * 20f64.sqrt()))
}

/// Readings closer than this share of the span are equal.
const EQUAL: f64 = 1e-9;
/// The quantile of the gaps that is a small one as a rule, and into how many steps of the recorder it is cut at most.
const USUAL_GAP: f64 = 0.05;
const MOST_PARTS: u8 = 5;

/// The step of the recorder, in the channel's unit; `None` where the readings show none.
///
/// It is the distance of which all but a few of the distances between different readings are multiples. Rounded
/// readings repeat; of unrounded ones hardly two are equal.
#[must_use]
pub fn estimate_resolution(samples: &[f64]) -> Option<f64> {
    let mut values: Vec<f64> = samples.iter().copied().filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let (first, last) = (values.first()?, values.last()?);
    let equal = EQUAL * (last - first).abs();
    let gaps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > equal).collect();
    if gaps.is_empty() || gaps.len() + 1 > values.len() / 2 {
        return None;
    }
    let usual = quantile(&gaps, USUAL_GAP);
    let on_grid = |step: f64| {
        let on = gaps.iter().filter(|gap| (**gap / step - (**gap / step).round()).abs() < OFF_GRID).count();
        on as f64 >= SHARE_ON_GRID * gaps.len() as f64
    };
    // Of a slow logger, neighbouring codes may never have been seen.
    (1..=MOST_PARTS).map(|part| usual / f64::from(part)).find(|step| on_grid(*step))
}

/// Lowest and highest finite value.
pub(crate) fn range(values: &[f64]) -> Option<(f64, f64)> {
    let mut finite = values.iter().copied().filter(|value| value.is_finite());
    let first = finite.next()?;
    Some(finite.fold((first, first), |(low, high), value| (low.min(value), high.max(value))))
}

/// The value below which this share of the values lies; NaN of none.
pub(crate) fn quantile(values: &[f64], share: f64) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let mut values = values.to_vec();
    // The share is between 0 and 1: the index stays within the values.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
    let index = (share * (values.len() - 1) as f64).round() as usize;
    *values.select_nth_unstable_by(index, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform numbers in [0, 1) from a linear congruential generator (Knuth's MMIX constants).
    fn uniform(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64
    }

    fn stroke_at(sigma_m: f64, resolution_m: f64, rows: usize, step_s: f64) -> Trace {
        let mut seed = 7;
        let position = |row: usize, seed: &mut u64| {
            let time = row as f64 * step_s;
            let clean = if time < 2.0 { 0.02 } else { 0.02 * (1.0 - ((time - 2.0) / 0.3).min(1.0).powi(2)) };
            // The sum of twelve uniform numbers is nearly normal with variance 1.
            let noise: f64 = (0..12).map(|_| uniform(seed)).sum::<f64>() - 6.0;
            ((clean + sigma_m * noise) / resolution_m).round() * resolution_m
        };
        let position_m = (0..rows).map(|row| position(row, &mut seed)).collect();
        Trace { position_m, ..Trace::default() }
    }

    fn stroke(sigma_m: f64, resolution_m: f64) -> Trace {
        stroke_at(sigma_m, resolution_m, 5000, 1e-3)
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
    fn a_slow_logger_has_honest_noise() {
        for rows in [30, 50, 200] {
            let estimate = estimate_position_noise_m(&stroke_at(30e-6, 5e-6, rows, 0.1)).unwrap();
            assert!((12e-6..60e-6).contains(&estimate), "{estimate} from {rows} rows");
        }
        // All of it in motion, as of a piston that falls throughout.
        let mut seed = 3;
        let falling = |row: usize| 0.05 - 1e-4 * row as f64 + 2e-4 * (uniform(&mut seed) - 0.5);
        let samples: Vec<f64> = (0..400).map(falling).collect();
        let (estimate, expected) = (estimate_noise(&samples).unwrap(), 2e-4 / 12f64.sqrt());
        assert!((estimate / expected - 1.0).abs() < 0.25, "{estimate} for {expected}");
    }

    #[test]
    fn coarse_steps_are_never_called_silence() {
        for sigma in [0.0, 10e-6, 30e-6, 80e-6] {
            let step = 0.5e-3;
            let estimate = estimate_position_noise_m(&stroke(sigma, step)).unwrap();
            let rounding = step / 12f64.sqrt();
            assert!((0.499 * rounding..1.5 * rounding).contains(&estimate), "{estimate} at {sigma}");
        }
        assert!((estimate_resolution(&stroke(30e-6, 0.2e-3).position_m).unwrap() / 0.2e-3 - 1.0).abs() < 1e-6);
        assert_eq!(estimate_resolution(&stroke(30e-6, 1e-12).position_m), None);
    }

    #[test]
    fn nothing_is_made_up_from_silence() {
        let silent = estimate_position_noise_m(&stroke(0.0, 1e-12)).unwrap();
        assert!((1e-7..1e-6).contains(&silent), "{silent}");
        assert_eq!(estimate_position_noise_m(&Trace::default()), None);
        for value in [f64::NAN, 0.02] {
            assert_eq!(estimate_noise(&vec![value; 1000]), None);
        }
    }
}
