//! TimedStroke times: when the valve gets there after each command, located inside the step.

use crate::command::CommandEdge;
use crate::trajectory::Trajectory;
use crate::valve::Valve;

/// One stroke: a command and when the valve got there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedStroke {
    /// The command that began it.
    pub command: CommandEdge,
    /// From the command to the limit switch, s; nothing if it was not reached before the next
    /// command or the end of the run.
    pub time_s: Option<f64>,
}

/// Times closer than this are one instant, s: a step's end is a sum, off by its rounding.
const SAME_INSTANT_S: f64 = 1e-9;

/// The strokes of a run, one for each command. A command before the start of the run counts from when it was given.
pub fn strokes(valve: &Valve, commands: &[CommandEdge], trajectory: &Trajectory) -> Vec<TimedStroke> {
    let stroke = valve.parameters().stroke_m;
    let switches = valve.switches();
    let until = |index: usize| commands.get(index + 1).map_or(f64::INFINITY, |next| next.time_s);
    commands
        .iter()
        .enumerate()
        .map(|(index, command)| {
            let (level, sign) =
                if command.closes() { (switches.closed_at * stroke, 1.0) } else { (switches.open_at * stroke, -1.0) };
            let reached = first_at_or_below(trajectory, command.time_s, until(index), level, sign);
            // Of a command before the run, nobody saw when a valve got there that is there at once.
            let early = trajectory.time_s.first().is_some_and(|start| command.time_s < start - SAME_INSTANT_S);
            let time_s = reached.map(|time| time - command.time_s);
            let time_s = time_s.filter(|time| !early || (*time > 0.0 && time.is_finite()));
            TimedStroke { command: *command, time_s: time_s.map(|time| time.max(0.0)) }
        })
        .collect()
}

/// The first time in [from, until) at which sign * (x - level) <= 0.
pub fn first_at_or_below(trajectory: &Trajectory, from: f64, until: f64, level: f64, sign: f64) -> Option<f64> {
    let (time, x) = (&trajectory.time_s, &trajectory.position_m);
    let start = time.partition_point(|t| *t < from - SAME_INSTANT_S);
    let hit = (start..time.len()).take_while(|i| time[*i] < until).find(|i| sign * (x[*i] - level) <= 0.0)?;
    if hit == start {
        return Some(from);
    }
    Some(crossing(trajectory, hit - 1, level))
}

/// Where the cubic through two neighbouring nodes (values and slopes) passes a level, s.
fn crossing(trajectory: &Trajectory, left: usize, level: f64) -> f64 {
    let (t0, t1) = (trajectory.time_s[left], trajectory.time_s[left + 1]);
    let value = |share: f64| trajectory.hermite(left, share) - level;
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
