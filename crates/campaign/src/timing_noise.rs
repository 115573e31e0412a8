//! How far stroke times that were repeated under one condition are apart.

use crate::noise::MEDIAN_SIZE;
use crate::timing_doubts::groups;
use crate::types::TimingRow;

/// Strokes of a sound valve scatter by no more than this share of the longest one.
pub(crate) const MOST_SCATTER: f64 = 0.03;

/// The scatter of repeated stroke times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimingScatter {
    /// One standard deviation, s; at most three hundredths of the longest time. `None` where nothing was repeated.
    pub sigma_s: Option<f64>,
    /// How many repeats there are beyond the first of each condition and stroke.
    pub freedom: usize,
    /// The longest time, s; 0 where there are none.
    pub longest_s: f64,
}

impl TimingScatter {
    /// From the median of the deviations from the mean of each condition, so that a slip among them changes nothing.
    #[must_use]
    pub fn of(rows: &[TimingRow]) -> Self {
        let (mut sizes, mut freedom, mut longest_s) = (Vec::new(), 0, 0.0f64);
        for group in groups(rows) {
            for time in [|row: &TimingRow| row.close_time_s, |row: &TimingRow| row.open_time_s] {
                let times: Vec<f64> = group.iter().filter_map(|row| time(&rows[*row])).collect();
                longest_s = times.iter().copied().fold(longest_s, f64::max);
                if times.len() > 1 {
                    let count = times.len() as f64;
                    let mean = times.iter().sum::<f64>() / count;
                    // Deviations from a mean that they themselves make are too small.
                    sizes.extend(times.iter().map(|time| (time - mean).abs() / (1.0 - 1.0 / count).sqrt()));
                    freedom += times.len() - 1;
                }
            }
        }
        sizes.sort_by(f64::total_cmp);
        let sigma_s = sizes.get(sizes.len() / 2).map(|size| (size / MEDIAN_SIZE).min(MOST_SCATTER * longest_s));
        Self { sigma_s, freedom, longest_s }
    }
}
