//! Rows that follow the motion: short where a channel moves, long where it rests.

use identify::Row;

use super::rounded::Rounded;
use crate::data::ChannelData;

/// Rows at rest are this many times longer.
const LONGER_AT_REST: f64 = 10.0;

/// The model error at rest as a share of that at full speed.
const ACTIVITY_AT_REST: f64 = 0.03;
/// A change between neighbouring rows from which something moves: in deviations of its noise, and as a share of
/// the whole travel.
const MOVING: (f64, f64) = (5.0, 2e-3);

/// Rows about a moving one that stay short.
const ABOUT: usize = 3;

/// Rows of a channel, the samples of each, and what these were rounded alike by.
pub(super) struct Cut {
    pub rows: Vec<Row>,
    pub ranges: Vec<(usize, usize)>,
    pub rounded: Vec<Rounded>,
}

/// The rows of some samples of a channel.
pub(super) fn rows(times: &[f64], samples: &[f64], channel: &ChannelData, scale: f64, fast_s: f64) -> Cut {
    let noise = channel.noise;
    let short = cut(times, samples, fast_s);
    let means: Vec<(f64, f64, f64)> = short.iter().map(|range| mean(times, samples, *range)).collect();
    let moving: Vec<bool> = (0..means.len())
        .map(|index| {
            let (before, after) = (means[index.saturating_sub(1)], means[(index + 1).min(means.len() - 1)]);
            let deviation = noise * (1.0 / before.2 + 1.0 / after.2).sqrt();
            (after.1 - before.1).abs() > (MOVING.0 * deviation).max(MOVING.1 * scale)
        })
        .collect();
    let near = |index: usize| (index.saturating_sub(ABOUT)..(index + ABOUT + 1).min(moving.len())).any(|i| moving[i]);
    let mut ranges: Vec<(usize, usize)> = Vec::new();
    let mut merged = 0.0;
    for (index, range) in short.iter().enumerate() {
        match ranges.last_mut() {
            Some(last) if !near(index) && merged > 0.0 && merged < LONGER_AT_REST => {
                last.1 = range.1;
                merged += 1.0;
            }
            _ => {
                ranges.push(*range);
                merged = if near(index) { 0.0 } else { 1.0 };
            }
        }
    }
    let means: Vec<(f64, f64, f64)> = ranges.iter().map(|range| mean(times, samples, *range)).collect();
    let rates = rates(&means, noise);
    let fastest = rates.iter().fold(0.0, |a: f64, b| a.max(*b)).max(1e-9 * scale);
    let white = (noise * noise - channel.common_variance).max(0.0).sqrt();
    let (mut rows, mut rounded) = (Vec::with_capacity(means.len()), Vec::with_capacity(means.len()));
    for (((time_s, observed, count), rate), (first, end)) in means.iter().zip(rates).zip(&ranges) {
        let row = Row {
            time_s: *time_s,
            observed: *observed,
            sigma: white / count.sqrt(),
            activity: scale * (ACTIVITY_AT_REST + rate / fastest),
            turns: 0,
        };
        rounded.push(Rounded::new(channel, &row, rate * (times[end - 1] - times[*first]), *count));
        rows.push(row);
    }
    Cut { rows, ranges, rounded }
}

/// Stretches of samples of about a duration, each with at least one that counts.
pub(super) fn cut(times: &[f64], samples: &[f64], duration_s: f64) -> Vec<(usize, usize)> {
    let mut ranges = Vec::new();
    let mut first = 0;
    while first < samples.len() {
        let mut end = first + 1;
        while end < samples.len() && times[end] - times[first] < duration_s - 1e-9 {
            end += 1;
        }
        if samples[first..end].iter().any(|sample| sample.is_finite()) {
            ranges.push((first, end));
        }
        first = end;
    }
    ranges
}

/// Mean time, mean and count of the samples of a stretch that count.
pub(super) fn mean(times: &[f64], samples: &[f64], (first, end): (usize, usize)) -> (f64, f64, f64) {
    let mut sum = (0.0, 0.0, 0.0);
    for (time, sample) in times[first..end].iter().zip(&samples[first..end]).filter(|(_, sample)| sample.is_finite()) {
        sum = (sum.0 + time, sum.1 + sample, sum.2 + 1.0);
    }
    (sum.0 / sum.2, sum.1 / sum.2, sum.2)
}

/// The speed at each row with what noise alone would show taken out.
fn rates(means: &[(f64, f64, f64)], noise: f64) -> Vec<f64> {
    (0..means.len())
        .map(|index| {
            let (before, after) = (means[index.saturating_sub(1)], means[(index + 1).min(means.len() - 1)]);
            let time = (after.0 - before.0).max(1e-9);
            let variance = noise * noise * (1.0 / before.2 + 1.0 / after.2) / (time * time);
            (((after.1 - before.1) / time).powi(2) - variance).max(0.0).sqrt()
        })
        .collect()
}

/// Times at which the model is sampled for a stretch: its own samples, or a few in their place.
pub(super) fn sample(times: &[f64], samples: &[f64], (first, end): (usize, usize), most: usize, into: &mut Vec<f64>) {
    let valid: Vec<f64> = (first..end).filter(|index| samples[*index].is_finite()).map(|index| times[index]).collect();
    if valid.len() <= most {
        into.extend(valid);
        return;
    }
    // The middles of equal parts.
    let parts = most as f64;
    into.extend((0..most).map(|part| {
        let place = (part as f64 + 0.5) / parts * valid.len() as f64 - 0.5;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place among a few samples")]
        let left = place.floor().max(0.0) as usize;
        let share = place - left as f64;
        valid[left] + share * (valid[(left + 1).min(valid.len() - 1)] - valid[left])
    }));
}
