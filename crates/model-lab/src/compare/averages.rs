//! Whether residuals are white: white noise averages out, a wrong model does not.

use crate::data::{Channel, RunData};

/// Times over which residuals are averaged, s.
pub const AVERAGES_S: [f64; 5] = [4e-3, 16e-3, 64e-3, 256e-3, 1.024];

/// Averages of residuals over a time, in units of the noise of such an average.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LongAverage {
    /// The time, s.
    pub average_s: f64,
    /// Mean square: 1 where residuals are white noise of the stated size.
    pub mean_square: f64,
    /// How many averages there are.
    pub count: usize,
}

impl LongAverage {
    /// Its distance from 1 in standard deviations of a chi-squared of that many degrees of freedom.
    pub fn excess_sigmas(&self) -> f64 {
        (self.mean_square - 1.0) / (2.0 / self.count.max(1) as f64).sqrt()
    }
}

/// The averages of block residuals (in units of their noise, runs and channels one after the other).
pub fn long_averages(runs: &[&RunData], residual: &[f64]) -> Vec<LongAverage> {
    AVERAGES_S
        .iter()
        .filter_map(|average_s| {
            let (mut sum, mut count) = (0.0, 0);
            let mut start = 0;
            for channel in runs.iter().flat_map(|run| &run.channels) {
                let part = &residual[start..start + channel.blocks.len()];
                start += channel.blocks.len();
                let mut first = 0;
                while first < part.len() {
                    let begin = channel.blocks[first].time_s;
                    let mut end = first + 1;
                    while end < part.len() && channel.blocks[end].time_s - begin < average_s - 1e-3 {
                        end += 1;
                    }
                    // A block weighs as much as it is certain.
                    let weights = || channel.blocks[first..end].iter().map(|block| block.inverse_sigma);
                    let norm: f64 = weights().map(|weight| weight * weight).sum();
                    let mean: f64 = part[first..end].iter().zip(weights()).map(|(r, weight)| r * weight).sum();
                    sum += mean * mean / norm;
                    count += 1;
                    first = end;
                }
            }
            (count > 0).then(|| LongAverage { average_s: *average_s, mean_square: sum / count as f64, count })
        })
        .collect()
}

/// Correlation of neighbouring block residuals of the position.
pub fn neighbour_correlation(run: &RunData, residual: &[f64]) -> f64 {
    let blocks = run.channels.iter().find(|channel| channel.channel == Channel::Position);
    let count = blocks.map_or(0, |channel| channel.blocks.len());
    let part = &residual[..count.min(residual.len())];
    let mean = part.iter().sum::<f64>() / part.len().max(1) as f64;
    let variance: f64 = part.iter().map(|r| (r - mean).powi(2)).sum();
    let product: f64 = part.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum();
    if variance > 0.0 { product / variance } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{Block, ChannelData};
    use valve_model::{Conditions, Run, Start};

    #[test]
    fn a_constant_error_grows_with_the_average() {
        let block = |i: usize| Block { first: i, end: i + 1, mean: 0.0, inverse_sigma: 1.0, time_s: i as f64 * 4e-3 };
        let channel = ChannelData {
            channel: Channel::Position,
            samples: Vec::new(),
            noise: 1.0,
            blocks: (0..1024).map(block).collect(),
        };
        let conditions = Conditions {
            supply_pressure_pa: 6e5,
            temperature_k: 293.0,
            leak_to_atmosphere_m2: 0.0,
            leak_from_supply_m2: 0.0,
        };
        let run = Run { conditions, commands: Vec::new(), end_s: 4.0, driven: None, start: Start::Rest };
        let data = RunData { name: String::new(), run, times_s: Vec::new(), channels: vec![channel] };
        let averages = long_averages(&[&data], &vec![0.5; 1024]);
        assert!((averages[0].mean_square - 0.25).abs() < 1e-12);
        assert!((averages[2].mean_square - 4.0).abs() < 1e-9, "{averages:?}");
        let alternating: Vec<f64> = (0..1024).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert!(long_averages(&[&data], &alternating)[2].mean_square < 1e-9);
        assert!(neighbour_correlation(&data, &alternating) < -0.99);
    }
}
