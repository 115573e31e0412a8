//! What the instruments write down of a run: a slow, late, scaled and shifted position, and pressures.

use crate::trajectory::Trajectory;

/// How the recorded position differs from the true one: y = zero + gain z, with tau z' = x - z, written down
/// `offset` later than it was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Time constant tau of the sensor, s.
    pub lag_s: f64,
    /// What is added to the true time, s.
    pub offset_s: f64,
    /// Recorded travel over true travel.
    pub gain: f64,
    /// What is recorded of a valve at x = 0, m.
    pub zero_m: f64,
}

impl Default for Measurement {
    /// Instruments without fault.
    fn default() -> Self {
        Self { lag_s: 0.0, offset_s: 0.0, gain: 1.0, zero_m: 0.0 }
    }
}

/// What a recorder would have written down of a simulated run, at its sample times.
#[derive(Debug, Clone, Default)]
pub struct Record {
    /// Position, m.
    pub position_m: Vec<f64>,
    /// Chamber pressure, Pa; empty if the run has no such channel.
    pub chamber_pressure_pa: Vec<f64>,
    /// Pipe pressure, Pa; empty if the run has no such channel.
    pub pipe_pressure_pa: Vec<f64>,
}

impl Measurement {
    /// The record of a simulated run at rising sample times. Pressures are as simulated.
    pub fn record(&self, nodes: &Trajectory, times_s: &[f64], into: &mut Record) {
        self.positions(nodes, times_s, &mut into.position_m);
        for (channel_pa, into_pa) in [
            (&nodes.chamber_pressure_pa, &mut into.chamber_pressure_pa),
            (&nodes.pipe_pressure_pa, &mut into.pipe_pressure_pa),
        ] {
            into_pa.clear();
            if !channel_pa.is_empty() {
                nodes.pressures_at(channel_pa, times_s, into_pa);
            }
        }
    }

    /// The position alone of such a record, m.
    pub fn positions(&self, nodes: &Trajectory, times_s: &[f64], into: &mut Vec<f64>) {
        let slow = (self.lag_s > 0.0).then(|| lagged(nodes, self.lag_s));
        let shown = slow.as_ref().unwrap_or(nodes);
        if self.offset_s == 0.0 {
            shown.positions_at(times_s, into);
        } else {
            let shifted: Vec<f64> = times_s.iter().map(|time| time - self.offset_s).collect();
            shown.positions_at(&shifted, into);
        }
        if self.gain != 1.0 || self.zero_m != 0.0 {
            for position in into {
                *position = self.zero_m + self.gain * *position;
            }
        }
    }
}

/// Longest step between the nodes of a lagged motion, in time constants: beyond it a cubic no longer follows
/// the decay.
const LAG_STEP: f64 = 0.125;

/// No step of the integrator is longer than this, s; a longer one is a valve at rest.
const AT_REST_S: f64 = 5e-3;

/// Time constants after which nothing of a lag is left.
const LAG_IS_OVER: f64 = 40.0;

/// The motion as a first-order lag shows it, exact for straight lines between nodes. While the valve rests,
/// the sensor still comes after it; nodes are added there.
fn lagged(nodes: &Trajectory, lag: f64) -> Trajectory {
    let mut shown = Trajectory::default();
    let mut add = |time: f64, x: f64, y: f64| {
        shown.time_s.push(time);
        shown.position_m.push(y);
        shown.velocity_m_per_s.push((x - y) / lag);
    };
    let (time, x) = (&nodes.time_s, &nodes.position_m);
    // Where the run begins in motion, the sensor has followed it since long before.
    let mut y = x[0] - lag * nodes.velocity_m_per_s[0];
    add(time[0], x[0], y);
    // Most steps are of one length.
    let (mut length, mut decay) = (0.0, 1.0);
    for i in 1..x.len() {
        let (start, whole) = (time[i - 1], time[i] - time[i - 1]);
        let slope = if whole > 0.0 { (x[i] - x[i - 1]) / whole } else { 0.0 };
        let from = y;
        // x - slope lag + (y0 - x0 + slope lag) exp(-t/lag)
        let after = |t: f64, decay: f64| x[i - 1] + slope * (t - lag) + (from - x[i - 1] + slope * lag) * decay;
        if whole > AT_REST_S {
            let mut t = LAG_STEP * lag;
            while t < whole.min(LAG_IS_OVER * lag) {
                add(start + t, x[i - 1] + slope * t, after(t, (-t / lag).exp()));
                t += LAG_STEP * lag;
            }
        }
        if whole != length {
            (length, decay) = (whole, (-whole / lag).exp());
        }
        y = after(whole, decay);
        add(time[i], x[i], y);
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_sensor_still_moves_while_the_valve_rests() {
        // From rest 20 mm in 10 ms, then at rest in one step of two seconds.
        let step = |i: u32| f64::from(i) * 1e-3;
        let time_s: Vec<f64> = (0..=10).map(step).chain([2.01]).collect();
        let position_m: Vec<f64> = (0..=10).map(|i| 2.0 * step(i)).chain([0.02]).collect();
        let velocity_m_per_s = [vec![0.0], vec![2.0; 9], vec![0.0; 2]].concat();
        let nodes = Trajectory { time_s, position_m, velocity_m_per_s, ..Trajectory::default() };
        let lag: f64 = 0.09;
        let behind = 2.0 * lag * (1.0 - (-0.01 / lag).exp());
        let times: Vec<f64> = (0..400).map(|i| 0.01 + f64::from(i) * 5e-3).collect();
        let mut shown = Vec::new();
        lagged(&nodes, lag).positions_at(&times, &mut shown);
        for (time, shown) in times.iter().zip(shown) {
            let expected = 0.02 - behind * (-(time - 0.01) / lag).exp();
            assert!((shown - expected).abs() < 1e-7, "{time} s: {shown} instead of {expected}");
        }
    }

    #[test]
    fn gain_and_zero_act_on_what_the_sensor_shows() {
        let nodes = Trajectory {
            time_s: vec![0.0, 1.0],
            position_m: vec![0.0, 0.02],
            velocity_m_per_s: vec![0.02; 2],
            ..Trajectory::default()
        };
        let (mut plain, mut scaled) = (Record::default(), Record::default());
        let late = Measurement { lag_s: 0.1, offset_s: 0.05, ..Measurement::default() };
        late.record(&nodes, &[0.2, 0.7], &mut plain);
        Measurement { gain: 0.5, zero_m: 3e-3, ..late }.record(&nodes, &[0.2, 0.7], &mut scaled);
        for (plain, scaled) in plain.position_m.iter().zip(&scaled.position_m) {
            assert!((scaled - (3e-3 + 0.5 * plain)).abs() < 1e-15);
        }
        let mut alone = Vec::new();
        Measurement { gain: 0.5, zero_m: 3e-3, ..late }.positions(&nodes, &[0.2, 0.7], &mut alone);
        assert_eq!(alone, scaled.position_m);
        // 0.05 s late and 0.1 s behind on a ramp of 20 mm/s that it has followed since long before.
        let expected = 0.02 * (0.65 - 0.1);
        assert!((plain.position_m[1] - expected).abs() < 1e-6, "{}", plain.position_m[1]);
        assert!(plain.chamber_pressure_pa.is_empty());
    }
}
