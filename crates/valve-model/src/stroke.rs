//! Stroke times: when the valve gets there after each command, located inside the step.

use crate::command::CommandEdge;
use crate::simulate::Nodes;
use crate::valve::Valve;

/// One stroke: a command and when the valve got there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// The command that began it.
    pub command: CommandEdge,
    /// From the command to the limit switch, s; nothing if it was not reached before the next
    /// command or the end of the run.
    pub time_s: Option<f64>,
}

/// Times closer than this are one instant, s: a step's end is a sum, off by its rounding.
const SAME_INSTANT_S: f64 = 1e-9;

/// The strokes of a run, one for each command. A command before the start of the run counts from when it was given.
pub fn strokes(valve: &Valve, commands: &[CommandEdge], nodes: &Nodes) -> Vec<Stroke> {
    let stroke = valve.parameters().stroke_m;
    let switches = valve.switches();
    let until = |index: usize| commands.get(index + 1).map_or(f64::INFINITY, |next| next.time_s);
    commands
        .iter()
        .enumerate()
        .map(|(index, command)| {
            let (level, sign) =
                if command.close { (switches.closed_at * stroke, 1.0) } else { (switches.open_at * stroke, -1.0) };
            let reached = first_at_or_below(nodes, command.time_s, until(index), level, sign);
            // Of a command before the run, nobody saw when a valve got there that is there at once.
            let early = nodes.time_s.first().is_some_and(|start| command.time_s < start - SAME_INSTANT_S);
            let time_s = reached.map(|time| time - command.time_s);
            let time_s = time_s.filter(|time| !early || (*time > 0.0 && time.is_finite()));
            Stroke { command: *command, time_s: time_s.map(|time| time.max(0.0)) }
        })
        .collect()
}

/// The first time in [from, until) at which sign * (x - level) <= 0.
pub fn first_at_or_below(nodes: &Nodes, from: f64, until: f64, level: f64, sign: f64) -> Option<f64> {
    let (time, x) = (&nodes.time_s, &nodes.position_m);
    let start = time.partition_point(|t| *t < from - SAME_INSTANT_S);
    let hit = (start..time.len()).take_while(|i| time[*i] < until).find(|i| sign * (x[*i] - level) <= 0.0)?;
    if hit == start {
        return Some(from);
    }
    Some(crossing(nodes, hit - 1, level))
}

/// Where the cubic through two neighbouring nodes (values and slopes) passes a level, s.
fn crossing(nodes: &Nodes, left: usize, level: f64) -> f64 {
    let (t0, t1) = (nodes.time_s[left], nodes.time_s[left + 1]);
    let value = |share: f64| nodes.hermite(left, share) - level;
    let (mut low, mut high) = (0.0, 1.0);
    let (mut at_low, mut at_high) = (value(low), value(high));
    // Regula falsi with the Illinois weight (Dowell and Jarratt 1971): bracketed and fast.
    for _ in 0..60 {
        if at_high == 0.0 || high - low < 1e-14 {
            break;
        }
        let share = high - at_high * (high - low) / (at_high - at_low);
        let here = value(share);
        if (here < 0.0) == (at_high < 0.0) {
            at_low *= 0.5;
        } else {
            (low, at_low) = (high, at_high);
        }
        (high, at_high) = (share, here);
    }
    t0 + high * (t1 - t0)
}

impl Nodes {
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
    pub fn places_at(&self, times_s: &[f64], into: &mut Vec<Place>) {
        into.clear();
        let time = &self.time_s;
        let last = time.len() - 1;
        let mut left = 0;
        into.extend(times_s.iter().map(|&at| {
            while left < last && time[left + 1] <= at {
                left += 1;
            }
            if left == last {
                Place { left: last.saturating_sub(1), share: if last == 0 { 0.0 } else { 1.0 } }
            } else {
                Place { left, share: ((at - time[left]) / (time[left + 1] - time[left])).max(0.0) }
            }
        }));
    }

    /// Positions at places, m.
    pub fn positions(&self, places: &[Place], into: &mut Vec<f64>) {
        into.clear();
        if self.time_s.len() == 1 {
            into.resize(places.len(), self.position_m[0]);
            return;
        }
        into.extend(places.iter().map(|place| self.hermite(place.left, place.share)));
    }

    /// Positions at rising times, m; held beyond the ends of the run.
    pub fn positions_at(&self, times_s: &[f64], into: &mut Vec<f64>) {
        let mut places = Vec::with_capacity(times_s.len());
        self.places_at(times_s, &mut places);
        self.positions(&places, into);
    }
}

/// A place between two nodes of a run.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    left: usize,
    share: f64,
}

/// A pressure channel of a run at places, linear between nodes, Pa.
pub fn pressures(channel_pa: &[f64], places: &[Place], into: &mut Vec<f64>) {
    into.clear();
    into.extend(places.iter().map(|Place { left, share }| {
        let (here, next) = (channel_pa[*left], channel_pa.get(left + 1).copied().unwrap_or(channel_pa[*left]));
        here + share * (next - here)
    }));
}
