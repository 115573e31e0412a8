//! One cycle of a timing log.

use leak_table::Stroke;
use serde::{Deserialize, Serialize};

/// The stroke times of one valve in one cycle, and the conditions if they are
/// known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// The cycle's number.
    pub cycle: u64,
    /// Closing time in s; none if it was not measured or the valve stalled.
    pub close_time_s: Option<f64>,
    /// Opening time in s; none if it was not measured or the valve stalled.
    pub open_time_s: Option<f64>,
    /// Strokes that did not arrive within the cycle, closing and opening.
    pub stalled: [bool; 2],
    /// Absolute supply pressure of the cycle in Pa; none if it is not known.
    pub supply_pressure_pa: Option<f64>,
    /// Temperature of the cycle in K; none if it is not known.
    pub temperature_k: Option<f64>,
}

impl Reading {
    /// The time of one of the strokes.
    #[inline]
    pub fn time_s(&self, stroke: Stroke) -> Option<f64> {
        match stroke {
            Stroke::Close => self.close_time_s,
            Stroke::Open => self.open_time_s,
        }
    }
}
