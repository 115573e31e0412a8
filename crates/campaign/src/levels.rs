//! Signals with two levels.

use crate::noise::quantile;

/// The levels of a signal that jumps between two, `None` for any other.
pub(crate) fn two_levels(values: &[f64]) -> Option<(f64, f64)> {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let (low, high) = (quantile(&finite, 0.0), quantile(&finite, 1.0));
    if finite.len() < 4 || low >= high {
        return None;
    }
    let band = 0.1 * (high - low);
    let near: Vec<bool> = finite.iter().map(|value| *value - low <= band).collect();
    let between = finite.iter().filter(|value| **value - low > band && high - **value > band).count();
    let changes = near.windows(2).filter(|pair| pair[0] != pair[1]).count();
    // A coil's voltage is hardly ever seen on its way, and does not change from row to row.
    (between * 200 <= finite.len() && changes * 20 <= finite.len())
        .then(|| (quantile_of(&finite, low, band), quantile_of(&finite, high, band)))
}

/// The median of what is near a level.
fn quantile_of(values: &[f64], level: f64, band: f64) -> f64 {
    let near: Vec<f64> = values.iter().copied().filter(|value| (value - level).abs() <= band).collect();
    quantile(&near, 0.5)
}

/// The plateaus of a signal that moves between two: its lower and upper ends without outliers.
pub(crate) fn plateaus(values: &[f64]) -> (f64, f64) {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    (quantile(&finite, 0.02), quantile(&finite, 0.98))
}

/// Whether numbers increase from row to row.
pub(crate) fn increases(values: &[f64]) -> bool {
    values.len() > 2 && values.windows(2).all(|pair| pair[1] > pair[0])
}
