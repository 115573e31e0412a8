//! One cycle of a timing log.

use leak_table::Stroke;

/// The stroke times of one valve in one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// The cycle's number.
    pub cycle: u64,
    /// Closing time in s; none if the valve did not close within the cycle.
    pub close_time_s: Option<f64>,
    /// Opening time in s; none if the valve did not open within the cycle.
    pub open_time_s: Option<f64>,
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
