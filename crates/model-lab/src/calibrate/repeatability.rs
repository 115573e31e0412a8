//! How far strokes repeated under the same conditions differ.

use crate::data::{Channel, Dataset, RunData};
use crate::repeats::{Repeats, repeats};
use crate::scatter::Scatter;

/// The scatter between repeated strokes: no model can be closer to a single stroke than that.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeatability {
    /// Root mean square difference of a stroke's position from the mean of its repeats, sensor noise
    /// taken out, m; nothing for stroke times.
    pub position_m: Option<f64>,
    /// The same with the sensor noise, in units of it: the error of the best possible model.
    pub normalised: f64,
    /// One standard deviation of repeated stroke times beyond the noise, s; nothing for traces.
    pub stroke_time_s: Option<f64>,
    /// What scatters, and one standard deviation of it, s or a share.
    pub sources: Vec<(&'static str, f64)>,
}

impl Repeatability {
    /// The repeatability of a dataset; nothing without repeats.
    pub fn of(data: &Dataset, scatter: &Scatter) -> Option<Self> {
        let traces = trace_variance(data);
        let times = time_variance(data);
        // Variance of the scatter in units of that of the noise.
        let ratio = match (traces, times) {
            (Some((variance, noise_m)), _) => variance / (noise_m * noise_m),
            (None, Some(variance)) => variance / data.timing_noise_s.powi(2),
            (None, None) => return None,
        };
        let normalised = (1.0 + ratio.max(0.0)).sqrt();
        let sources = scatter.sources().map(|(source, size)| (source.name(), size)).collect();
        Some(Self {
            position_m: traces.map(|(variance, _)| variance.max(0.0).sqrt()),
            normalised,
            stroke_time_s: times.map(|variance| variance.max(0.0).sqrt()),
            sources,
        })
    }
}

/// Variance of block means of the position between repeats beyond the noise, m², and the noise of a
/// sample, m.
fn trace_variance(data: &Dataset) -> Option<(f64, f64)> {
    let (mut sum, mut count) = (0.0, 0.0);
    let mut noise_m = 0.0;
    for Repeats { units, places } in repeats(data) {
        let runs: Vec<&RunData> = units.iter().filter_map(|unit| data.runs.get(*unit)).collect();
        let Some(position) = runs.first().and_then(|run| run.channels.first()) else { continue };
        if position.channel != Channel::Position {
            continue;
        }
        noise_m = position.noise;
        let strokes = runs.len() as f64;
        // The position comes first in every record.
        let compared = places[0].iter().take_while(|place| place.nearest() < position.blocks.len()).count();
        for index in 0..compared {
            let blocks = || runs.iter().map(|run| &run.channels[0].blocks).zip(places.iter().map(|all| all[index]));
            let values: Vec<f64> = blocks().map(|(blocks, place)| place.between(|i| blocks[i].mean)).collect();
            let mean = values.iter().sum::<f64>() / strokes;
            let spread = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (strokes - 1.0);
            let noise = blocks().map(|(blocks, place)| place.variance_between(|i| blocks[i].inverse_sigma.powi(-2)));
            sum += spread - noise.sum::<f64>() / strokes;
            count += 1.0;
        }
    }
    (count > 0.0).then(|| (sum / count, noise_m))
}

/// Variance of repeated stroke times beyond their noise, s².
fn time_variance(data: &Dataset) -> Option<f64> {
    let (mut sum, mut freedom) = (0.0, 0.0);
    for group in &data.timing_groups {
        for closing in [true, false] {
            let times: Vec<f64> = group
                .rows
                .iter()
                .filter_map(|row| {
                    let row = &data.timing_rows[*row];
                    if closing { row.close_time_s } else { row.open_time_s }
                })
                .collect();
            if times.len() > 1 {
                let mean = times.iter().sum::<f64>() / times.len() as f64;
                sum += times.iter().map(|time| (time - mean).powi(2)).sum::<f64>();
                freedom += times.len() as f64 - 1.0;
            }
        }
    }
    (freedom > 0.0).then(|| sum / freedom - data.timing_noise_s.powi(2))
}
