//! Whether the noise that a campaign states can be that of its recordings.
//!
//! Noise that is stated far too large hides what a model lacks; far too small, it makes every residual a discovery. Both come of
//! a unit: mm called m, ms called s. What the recordings show of their own noise is held against what is stated; where the
//! two are an order of magnitude apart, what is stated is doubted by name and what is recorded counts.

use crate::noise::{estimate_resolution, noise_bounds, pooled_noise};
use crate::timing_noise::{MOST_SCATTER, TimingScatter};
use crate::types::{Campaign, Run, TimingRow};
use crate::warning::{Doubt, Warning};

/// How many times what is stated and what is recorded are apart before one of them must be wrong: datasheets state what a
/// sensor may do at worst, and some sensors have three times the noise of others of their kind, but units differ by more.
const FAR: f64 = 10.0;

/// Degrees of freedom of repeats from which their scatter is held against what is stated: a sound scatter looks ten times
/// smaller by chance less than once in 1e5 campaigns then.
const FEWEST_REPEATS: usize = 6;

/// Doubts about stated noise; what is doubted is taken out of the campaign, so that it counts as not stated. `line` is the
/// line of a key in the campaign file, `file` what messages call that.
pub(crate) fn doubted(campaign: &mut Campaign, file: &str, line: &dyn Fn(&str) -> usize) -> Vec<Warning> {
    let Campaign { sensors, runs, timings, .. } = campaign;
    let positions: Vec<&[f64]> = runs.iter().map(|run| run.trace.position_m.as_slice()).collect();
    let pressures: Vec<&[f64]> = runs.iter().flat_map(recorded_pressures).collect();
    let times = TimingScatter::of(timings);
    let mut warnings = Vec::new();
    let mut take_out = |key: &'static str, stated: &mut Option<f64>, doubt: Option<Doubt>| {
        if let Some(doubt) = doubt {
            *stated = None;
            warnings.push(Warning { file: file.to_owned(), line: line(key), doubt });
        }
    };
    let doubt =
        sensors.position_noise_m.and_then(|stated| of_channels(stated, &positions, ("position_noise", "mm", 1e-3)));
    take_out("position_noise", &mut sensors.position_noise_m, doubt);
    let doubt =
        sensors.pressure_noise_pa.and_then(|stated| of_channels(stated, &pressures, ("pressure_noise", "kPa", 1e3)));
    take_out("pressure_noise", &mut sensors.pressure_noise_pa, doubt);
    let doubt = sensors.timing_noise_s.and_then(|stated| of_times(stated, &times, timings));
    take_out("timing_noise", &mut sensors.timing_noise_s, doubt);
    warnings
}

fn recorded_pressures(run: &Run) -> impl Iterator<Item = &[f64]> {
    let trace = &run.trace;
    [&trace.chamber_pressure_pa, &trace.pipe_pressure_pa, &trace.supply_pressure_pa]
        .into_iter()
        .flatten()
        .map(Vec::as_slice)
}

/// A doubt where every recording of a kind of channel says that the noise is far smaller, or far larger, than is stated.
fn of_channels(
    stated: f64,
    channels: &[&[f64]],
    (key, unit, scale): (&'static str, &'static str, f64),
) -> Option<Doubt> {
    let bounds: Vec<(f64, f64)> = channels.iter().filter_map(|samples| noise_bounds(samples)).collect();
    if bounds.is_empty() {
        return None;
    }
    let rounding =
        channels.iter().filter_map(|samples| estimate_resolution(samples)).fold(0.0, f64::max) / 12f64.sqrt();
    let is_too_large = bounds.iter().all(|(_, most)| stated > FAR * most);
    // Rounding is added to what is stated.
    let is_too_small = bounds.iter().all(|(least, _)| FAR * stated.hypot(rounding) < *least);
    let found = pooled_noise(channels.iter().copied())?;
    (is_too_large || is_too_small).then(|| Doubt::StatedNoise {
        key,
        unit,
        stated: stated / scale,
        found: found / scale,
        times: if is_too_large { stated / found } else { found / stated },
        is_too_large,
    })
}

/// A doubt where stroke times that were repeated scatter by far less, or far more, than is stated, or where what is stated
/// is a good part of the times themselves.
fn of_times(stated_s: f64, scatter: &TimingScatter, rows: &[TimingRow]) -> Option<Doubt> {
    let all: Vec<f64> = rows.iter().flat_map(|row| [row.close_time_s, row.open_time_s]).flatten().collect();
    let rounding_s = estimate_resolution(&all).unwrap_or(0.0) / 12f64.sqrt();
    let found_s = scatter.sigma_s.filter(|_| scatter.freedom >= FEWEST_REPEATS).map(|sigma_s| sigma_s.max(rounding_s));
    match found_s {
        Some(found_s) if found_s > 0.0 && !(found_s / FAR..=FAR * found_s).contains(&stated_s) => {
            let is_too_large = stated_s > found_s;
            let times = if is_too_large { stated_s / found_s } else { found_s / stated_s };
            Some(Doubt::StatedTimingNoise { stated_ms: 1e3 * stated_s, found_ms: 1e3 * found_s, times, is_too_large })
        }
        _ if stated_s > FAR * MOST_SCATTER * scatter.longest_s && scatter.longest_s > 0.0 => {
            Some(Doubt::TimingNoiseLikeTimes { stated_s, longest_s: scatter.longest_s })
        }
        _ => None,
    }
}
