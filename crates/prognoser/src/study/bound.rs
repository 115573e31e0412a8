//! The Cramer-Rao bound of the predicted end of life.

use leak_table::{Fault, Stroke, TableBundle};

/// Smallest possible standard deviations of the predicted end of life, in
/// cycles, after some cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LifeBound {
    /// With a leak known to start at zero.
    pub known_start: f64,
    /// With an unknown start.
    pub unknown_start: f64,
}

/// The bounds after each of the cycles 0, 1, ... below `end_cycle`, for a leak
/// that starts at zero. Infinite where the end cannot be told at all.
pub fn bounds(tables: &TableBundle, fault: Fault, end_cycle: f64, noise_variance_s2: f64) -> Vec<LifeBound> {
    let growth = tables.limit_area_m2(fault) / end_cycle;
    let (mut s0, mut s1, mut s2) = (0.0, 0.0, 0.0);
    cycles_below(end_cycle)
        .map(|cycle| {
            let k = cycle as f64;
            let information: f64 = Stroke::ALL
                .into_iter()
                .map(|stroke| {
                    let curve = tables.table(fault).curve(stroke);
                    let (_, slope) = curve.extrapolated_time_and_slope(growth * k);
                    slope * slope / noise_variance_s2
                })
                .sum();
            s0 += information;
            s1 += information * k;
            s2 += information * k * k;
            let mean = s1 / s0;
            let spread = s2 - s1 * mean;
            let leverage = 1.0 / s0 + (end_cycle - mean).powi(2) / spread;
            LifeBound { known_start: end_cycle / (growth * s2.sqrt()), unknown_start: leverage.sqrt() / growth }
        })
        .collect()
}

/// The cycles 0, 1, ... below the end of life.
pub(crate) fn cycles_below(end_cycle: f64) -> impl Iterator<Item = u64> {
    (0..).take_while(move |cycle| (*cycle as f64) < end_cycle)
}
