//! Measured pressures that drive the model in place of the simulated ones.

/// Measured pressures over time, interpolated linearly and held beyond the ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    /// Times, s, rising.
    pub time_s: Vec<f64>,
    /// Pipe pressure at those times, Pa, if it drives the model.
    pub pipe_pressure_pa: Option<Vec<f64>>,
    /// Chamber pressure at those times, Pa, if it drives the model.
    pub chamber_pressure_pa: Option<Vec<f64>>,
}

impl Driven {
    /// Pipe and chamber pressure at a time, Pa; 0 where a channel does not drive.
    pub(crate) fn at(&self, time_s: f64) -> (f64, f64) {
        let right = self.time_s.partition_point(|time| *time <= time_s).clamp(1, self.time_s.len().max(2) - 1);
        let (t0, t1) = (self.time_s[right - 1], self.time_s[right]);
        let share = ((time_s - t0) / (t1 - t0)).clamp(0.0, 1.0);
        let value = |channel: &Option<Vec<f64>>| {
            channel.as_ref().map_or(0.0, |values| values[right - 1] + share * (values[right] - values[right - 1]))
        };
        (value(&self.pipe_pressure_pa), value(&self.chamber_pressure_pa))
    }
}
