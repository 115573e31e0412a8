//! What a run leaves behind: its motion and pressures at the start and after every step, and between those.

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Outcome {
    /// It went to its end.
    #[default]
    Complete,
    /// It was not begun: [`crate::Prepared::check`] says why. Its only node is a state of rest.
    Refused,
    /// It stopped because a state was no longer a possible one, such as a mass of gas that is not above 0 or no
    /// number: the valve is beyond what the method can follow. The nodes go as far as they are numbers.
    Diverged {
        /// When that was noticed, a few steps later than it happened, s.
        time_s: f64,
        /// What of the valve it was noticed in.
        what: &'static str,
    },
}

/// The nodes of one run: its state at the start and after every step.
#[derive(Debug, Clone, Default)]
pub struct Trajectory {
    /// Time, s, not falling.
    pub time_s: Vec<f64>,
    /// Position, m.
    pub position_m: Vec<f64>,
    /// Velocity, m/s.
    pub velocity_m_per_s: Vec<f64>,
    /// Chamber pressure, Pa; empty unless asked for.
    pub chamber_pressure_pa: Vec<f64>,
    /// Pipe pressure, Pa; empty unless asked for.
    pub pipe_pressure_pa: Vec<f64>,
    /// How the run ended.
    pub outcome: Outcome,
}

impl Trajectory {
    /// Position at a share of the way from one node to the next, m: cubic in values and velocities.
    #[inline]
    pub fn hermite(&self, left: usize, share: f64) -> f64 {
        let h = self.time_s[left + 1] - self.time_s[left];
        let (x0, x1) = (self.position_m[left], self.position_m[left + 1]);
        let (v0, v1) = (h * self.velocity_m_per_s[left], h * self.velocity_m_per_s[left + 1]);
        let rise = x1 - x0;
        x0 + share * (v0 + share * ((3.0 * rise - 2.0 * v0 - v1) + share * (v0 + v1 - 2.0 * rise)))
    }

    /// Where rising times lie; times beyond the ends of the run are put there.
    fn places<'a>(&'a self, times_s: &'a [f64]) -> impl Iterator<Item = InterpolationPoint> + 'a {
        let time = &self.time_s;
        let last = time.len() - 1;
        let mut left = 0;
        times_s.iter().map(move |&at| {
            while left < last && time[left + 1] <= at {
                left += 1;
            }
            if left == last {
                InterpolationPoint { left: last.saturating_sub(1), share: if last == 0 { 0.0 } else { 1.0 } }
            } else {
                InterpolationPoint { left, share: ((at - time[left]) / (time[left + 1] - time[left])).max(0.0) }
            }
        })
    }

    /// Positions at rising times, m; held beyond the ends of the run.
    pub fn positions_at(&self, times_s: &[f64], into: &mut Vec<f64>) {
        into.clear();
        if self.time_s.len() == 1 {
            into.resize(times_s.len(), self.position_m[0]);
            return;
        }
        into.extend(self.places(times_s).map(|place| self.hermite(place.left, place.share)));
    }

    /// A pressure channel of this run at rising times, linear between nodes and held beyond the ends of the run, Pa.
    pub fn pressures_at(&self, channel_pa: &[f64], times_s: &[f64], into: &mut Vec<f64>) {
        into.clear();
        into.extend(self.places(times_s).map(|place| pressure(channel_pa, place)));
    }
}

/// A place between two nodes of a run.
#[derive(Debug, Clone, Copy)]
struct InterpolationPoint {
    left: usize,
    share: f64,
}

fn pressure(channel_pa: &[f64], InterpolationPoint { left, share }: InterpolationPoint) -> f64 {
    let (here, next) = (channel_pa[left], channel_pa.get(left + 1).copied().unwrap_or(channel_pa[left]));
    here + share * (next - here)
}

impl Trajectory {
    /// Leaves out the nodes from the first that is no number on, but for the first of all.
    #[cold]
    pub(crate) fn keep_finite(&mut self) {
        let channels = [
            &mut self.time_s,
            &mut self.position_m,
            &mut self.velocity_m_per_s,
            &mut self.chamber_pressure_pa,
            &mut self.pipe_pressure_pa,
        ];
        let sane = |channel: &&mut Vec<f64>| {
            let first = channel.iter().position(|value| !value.is_finite()).unwrap_or(channel.len());
            if channel.is_empty() { usize::MAX } else { first }
        };
        let count = channels.iter().map(sane).min().unwrap_or(0).max(1);
        for channel in channels {
            channel.truncate(count);
        }
    }

    /// Forgets what it holds, keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.time_s.clear();
        self.position_m.clear();
        self.velocity_m_per_s.clear();
        self.chamber_pressure_pa.clear();
        self.pipe_pressure_pa.clear();
    }
}
