//! Noise-free recordings: what ideal instruments beside the rig would write down.

use crate::hidden::Hidden;
use crate::rig::{Conditions, Rig, State};
use crate::spool::Edge;
use crate::valve::Valve;

/// How long before the first row the rig stands by, so that early edges and clocks have a past.
const LEAD_S: f64 = 0.02;

/// Samples of one stroke pair, as the position sensor and the gauges show them, without noise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// Recorded times.
    pub time_s: Vec<f64>,
    /// Command as recorded, true closes.
    pub command: Vec<bool>,
    /// Position as shown, sensor lag and clock offset included.
    pub position_m: Vec<f64>,
    /// Absolute chamber pressure.
    pub chamber_pa: Vec<f64>,
    /// Absolute pipe pressure.
    pub pipe_pa: Vec<f64>,
}

/// Records a run from 0 s to `end_s` every `interval_s`. `commanded` is the command as
/// recorded; `switched` the edges as they reached the solenoid, none before the first row.
pub fn record(
    valve: &Valve,
    hidden: &Hidden,
    conditions: &Conditions,
    commanded: &[Edge],
    switched: &[Edge],
    end_s: f64,
    interval_s: f64,
) -> Trace {
    let offset = hidden.clock_offset_s;
    let mut rig = Rig::new(valve, hidden, conditions, switched, -LEAD_S.max(offset + LEAD_S));
    let mut trace = Trace::default();
    let mut instants: Vec<(f64, bool)> = Vec::new();
    let mut row = 0.0;
    while row * interval_s <= end_s + 1e-9 {
        let t = row * interval_s;
        trace.time_s.push(t);
        trace.command.push(commanded.iter().rev().find(|e| e.at_s <= t + 1e-9).is_some_and(|e| e.close));
        instants.push((t - offset, true));
        instants.push((t, false));
        row += 1.0;
    }
    instants.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (t, is_position) in instants {
        rig.advance(t, |_, _| true);
        if is_position {
            trace.position_m.push(rig.state.seen);
        } else {
            let (chamber, pipe) = rig.pressures_pa();
            trace.chamber_pa.push(chamber);
            trace.pipe_pa.push(pipe);
        }
    }
    trace
}

/// Closing and opening time of the last of `cycles` equal cycles of the valve's schedule: first
/// times at or beyond the stops, none where a stop was not reached in time.
pub fn stroke_times(
    valve: &Valve,
    hidden: &Hidden,
    conditions: &Conditions,
    cycles: usize,
) -> (Option<f64>, Option<f64>) {
    let mut edges = Vec::new();
    let mut last = 0.0;
    for cycle in 0..cycles {
        last = cycle as f64 * valve.cycle_end_s;
        edges.push(Edge { at_s: last, close: true });
        edges.push(Edge { at_s: last + valve.open_at_s, close: false });
    }
    let mut rig = Rig::new(valve, hidden, conditions, &edges, -LEAD_S);
    rig.advance(last, |_, _| true);
    let before = (rig.time_s, rig.state);
    let close = first_crossing(&mut rig, before, last + valve.open_at_s, true, |s| s.x);
    let before = (rig.time_s, rig.state);
    let stroke = valve.stroke_m;
    let open = first_crossing(&mut rig, before, last + valve.cycle_end_s, false, |s| stroke - s.x);
    (close.map(|t| t - last), open.map(|t| t - last - valve.open_at_s))
}

/// The first time up to `until_s` at which `level` is not above zero. The rig goes on to `until_s`
/// only where it is needed there.
fn first_crossing(
    rig: &mut Rig,
    mut before: (f64, State),
    until_s: f64,
    go_on: bool,
    level: impl Fn(&State) -> f64,
) -> Option<f64> {
    let mut found = (level(&before.1) <= 0.0).then_some(before.0);
    rig.advance(until_s, |t, state| {
        if found.is_none() {
            let (old, new) = (level(&before.1), level(state));
            if new <= 0.0 {
                found = Some(before.0 + (t - before.0) * old / (old - new));
            }
            before = (t, *state);
        }
        go_on || found.is_none()
    });
    found
}
