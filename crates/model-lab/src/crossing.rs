//! When a recorded or simulated motion passes a level.

/// Half the width of the moving average, s. A valve moves on a straight line over so short a time.
const HALF_WIDTH_S: f64 = 8e-3;

/// The same in spacings of the readings where these are far apart: three of them are averaged at least.
const LEAST_SPACINGS: f64 = 1.5;

/// Slowest motion that a crossing is timed in, m/s.
const SLOWEST_M_PER_S: f64 = 1e-6;

/// A trace smoothed by a moving average of times and positions alike, so that a straight motion
/// stays where it is.
#[derive(Debug, Clone, Default)]
pub struct Smoothed {
    /// Mean time of each window, s.
    pub time_s: Vec<f64>,
    /// Mean position of each window, m.
    pub position_m: Vec<f64>,
    /// Readings in each window.
    pub counts: Vec<u32>,
}

impl Smoothed {
    /// Smooths a trace. Where `valid` is NaN, a sample is left out, so that a simulated trace can be
    /// smoothed just as the measured one beside it.
    pub fn new(time_s: &[f64], position_m: &[f64], valid: &[f64]) -> Self {
        let half = HALF_WIDTH_S.max(LEAST_SPACINGS * median_spacing(time_s));
        let mut smoothed = Self::default();
        let (mut from, mut to) = (0, 0);
        // Sums since the start; windows are differences of them.
        let mut sums: Vec<(f64, f64, u32)> = Vec::with_capacity(time_s.len() + 1);
        sums.push((0.0, 0.0, 0));
        for index in 0..time_s.len() {
            let (time, position, count) = sums[index];
            sums.push(if valid[index].is_finite() {
                (time + time_s[index], position + position_m[index], count + 1)
            } else {
                (time, position, count)
            });
        }
        for centre in time_s {
            while time_s[from] < centre - half {
                from += 1;
            }
            while to < time_s.len() && time_s[to] <= centre + half {
                to += 1;
            }
            let count = sums[to].2 - sums[from].2;
            if 3 * (count as usize) < to - from || count == 0 {
                continue;
            }
            smoothed.time_s.push((sums[to].0 - sums[from].0) / f64::from(count));
            smoothed.position_m.push((sums[to].1 - sums[from].1) / f64::from(count));
            smoothed.counts.push(count);
        }
        smoothed
    }

    /// The first time in [from, until) at which the motion passes a level downwards (`falling`) or
    /// upwards; nothing if it begins beyond the level or never gets there.
    pub fn crossing(&self, from_s: f64, until_s: f64, level_m: f64, falling: bool) -> Option<Crossing> {
        let sign = if falling { 1.0 } else { -1.0 };
        let beyond = |index: usize| sign * (self.position_m[index] - level_m) <= 0.0;
        let start = self.time_s.partition_point(|time| *time < from_s);
        if start >= self.time_s.len() || beyond(start) {
            return None;
        }
        let hit = (start..self.time_s.len()).take_while(|index| self.time_s[*index] < until_s).find(|i| beyond(*i))?;
        let (left, right) = (hit - 1, hit);
        let (t0, t1) = (self.time_s[left], self.time_s[right]);
        let (x0, x1) = (self.position_m[left], self.position_m[right]);
        let share = if x1 == x0 { 0.0 } else { (level_m - x0) / (x1 - x0) };
        Some(Crossing { time_s: t0 + share * (t1 - t0), speed_m_per_s: self.speed(hit), readings: self.counts[hit] })
    }

    /// Speed around a point of the smoothed trace, m/s.
    fn speed(&self, at: usize) -> f64 {
        let reach = 5;
        let (left, right) = (at.saturating_sub(reach), (at + reach).min(self.time_s.len() - 1));
        let gap = self.time_s[right] - self.time_s[left];
        if gap > 0.0 { (self.position_m[right] - self.position_m[left]).abs() / gap } else { 0.0 }
    }
}

/// Where a motion passes a level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// When, s.
    pub time_s: f64,
    /// How fast, m/s.
    pub speed_m_per_s: f64,
    /// How many readings tell it.
    pub readings: u32,
}

impl Crossing {
    /// One standard deviation of its time from the noise of a reading, s.
    pub fn standard_error_s(&self, noise_m: f64) -> f64 {
        noise_m / f64::from(self.readings.max(1)).sqrt() / self.speed_m_per_s.max(SLOWEST_M_PER_S)
    }
}

fn median_spacing(time_s: &[f64]) -> f64 {
    let mut gaps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if gaps.is_empty() {
        return 0.0;
    }
    let middle = gaps.len() / 2;
    *gaps.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Which way a stroke goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The solenoid is energised and the valve closes.
    Closing,
    /// The solenoid is de-energised and the spring opens the valve.
    Opening,
}

impl Direction {
    /// Both, closing first.
    pub const ALL: [Self; 2] = [Self::Closing, Self::Opening];

    /// Its name in words and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Closing => "closing",
            Self::Opening => "opening",
        }
    }

    /// The direction of a command.
    pub fn of(close: bool) -> Self {
        if close { Self::Closing } else { Self::Opening }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_motion_is_timed_exactly_even_with_gaps() {
        let time: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-3).collect();
        let ramp: Vec<f64> = time.iter().map(|t| 0.02 - 0.05 * (t - 0.3).max(0.0)).collect();
        let mut gappy = ramp.clone();
        for value in &mut gappy[495..501] {
            *value = f64::NAN;
        }
        let smoothed = Smoothed::new(&time, &ramp, &gappy);
        let crossing = smoothed.crossing(0.0, 1.0, 0.01, true).unwrap();
        assert!((crossing.time_s - 0.5).abs() < 1e-9, "{crossing:?}");
        assert!((crossing.speed_m_per_s - 0.05).abs() < 1e-9);
        assert_eq!(smoothed.crossing(0.6, 1.0, 0.01, true), None, "it is beyond the level already");
        assert_eq!(smoothed.crossing(0.0, 0.4, 0.01, true), None, "not reached in time");
    }
}
