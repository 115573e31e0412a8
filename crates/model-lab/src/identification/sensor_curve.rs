//! What the curve of a position sensor adds to a position.
//!
//! Linearity is stated as the largest departure from a straight line between the ends. What bends it (a potentiometer's track,
//! the ends of a coil, a lever's angle) is smooth over the stroke: half waves that vanish at both stops.

use std::f64::consts::PI;

use valve_model::Trajectory;

/// A curve as half waves over the stroke.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorCurve {
    stroke_m: f64,
    /// The height of one half wave over the stroke, of two, and so on, m.
    heights_m: Vec<f64>,
}

impl SensorCurve {
    /// The straight one of a sensor on so long a stroke, m.
    pub fn straight(stroke_m: f64) -> Self {
        Self { stroke_m, heights_m: Vec::new() }
    }

    /// The same with so many half waves higher by `height_m`.
    #[must_use]
    pub fn with(mut self, half_waves: usize, height_m: f64) -> Self {
        if self.heights_m.len() < half_waves {
            self.heights_m.resize(half_waves, 0.0);
        }
        self.heights_m[half_waves - 1] += height_m;
        self
    }

    /// Whether it has no bends.
    pub fn is_straight(&self) -> bool {
        self.heights_m.iter().all(|height| *height == 0.0)
    }

    /// What it adds at a position, m, and how that changes with the position. Nothing at the stops and beyond, where a piston is
    /// most of the time.
    pub fn at(&self, position_m: f64) -> (f64, f64) {
        if position_m <= 0.0 || position_m >= self.stroke_m {
            return (0.0, 0.0);
        }
        let per_m = PI / self.stroke_m;
        let (sine, cosine) = (per_m * position_m).sin_cos();
        let (mut added_m, mut slope) = (0.0, 0.0);
        // The sine and the cosine of each multiple follow from those of the one before.
        let (mut of_waves, mut along) = (sine, cosine);
        for (index, height_m) in self.heights_m.iter().enumerate() {
            added_m += height_m * of_waves;
            slope += height_m * (index + 1) as f64 * per_m * along;
            (of_waves, along) = (of_waves * cosine + along * sine, along * cosine - of_waves * sine);
        }
        (added_m, slope)
    }

    /// A motion as it shows it; pressures stay out.
    pub fn shown(&self, nodes: &Trajectory) -> Trajectory {
        let motion = nodes.position_m.iter().zip(&nodes.velocity_m_per_s);
        let of = |(position_m, velocity_m_per_s): (&f64, &f64)| {
            let (added_m, slope) = self.at(*position_m);
            (position_m + added_m, velocity_m_per_s * (1.0 + slope))
        };
        let (position_m, velocity_m_per_s) = motion.map(of).unzip();
        Trajectory { time_s: nodes.time_s.clone(), position_m, velocity_m_per_s, ..Trajectory::default() }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::SensorCurve;

    #[test]
    fn half_waves_add_up_and_vanish_at_the_stops() {
        let curve = SensorCurve::straight(0.05).with(1, 2e-4).with(3, -1e-4).with(1, 1e-4);
        assert!(!curve.is_straight() && SensorCurve::straight(0.05).with(2, 0.0).is_straight());
        for position_m in [-1e-6, 0.0, 0.05, 0.06] {
            assert_eq!(curve.at(position_m), (0.0, 0.0));
        }
        let sum = |position_m: f64| {
            let turn = PI * position_m / 0.05;
            3e-4 * turn.sin() - 1e-4 * (3.0 * turn).sin()
        };
        for position_m in [1e-4, 0.011, 0.025, 0.0499] {
            let (added_m, slope) = curve.at(position_m);
            assert!((added_m - sum(position_m)).abs() < 1e-15, "{added_m}");
            let difference = (sum(position_m + 1e-7) - sum(position_m - 1e-7)) / 2e-7;
            assert!((slope - difference).abs() < 1e-6, "{slope} {difference}");
        }
    }
}
