//! What really happens while a file is recorded: strokes that differ from one to the next, seen at given times.

use crate::adaptive::Accuracy;
use crate::hidden::Hidden;
use crate::rig::{Conditions, Rig, Surroundings};
use crate::spool::Edge;
use crate::valve::{PSI_PA, Valve};

/// How one stroke differs from the mean one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Change {
    pub at_s: f64,
    /// Factor on all dry friction.
    pub friction: f64,
    /// Force added to the spring's preload.
    pub load_n: f64,
    /// Factor on the supply's gauge pressure.
    pub supply: f64,
}

/// One valve among its surroundings, with everything that is switched.
#[derive(Debug, Clone)]
pub(crate) struct Play {
    pub valve: Valve,
    pub hidden: Hidden,
    pub conditions: Conditions,
    pub around: Surroundings,
    /// Edges as they reach the solenoid.
    pub edges: Vec<Edge>,
    /// In order of time.
    pub changes: Vec<Change>,
    pub accuracy: Accuracy,
}

/// A stop that was hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Impact {
    pub at_s: f64,
    pub speed_m_per_s: f64,
}

/// Values at the times that were asked for.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Seen {
    pub position_m: Vec<f64>,
    pub chamber_pa: Vec<f64>,
    pub pipe_pa: Vec<f64>,
    pub supply_pa: Vec<f64>,
    pub impacts: Vec<Impact>,
    /// Whether the valve could not be followed to the end; the last values are repeated then.
    pub is_broken: bool,
}

/// Time before the first edge and the first row in which the valve stands.
const LEAD_S: f64 = 0.02;

impl Play {
    /// Position at `position_at`, pressures at `pressure_at`; both in order of time.
    pub fn watch(&self, position_at: &[f64], pressure_at: &[f64]) -> Seen {
        let first = |times: &[f64]| times.first().copied().unwrap_or(0.0);
        let last = |times: &[f64]| times.last().copied().unwrap_or(0.0);
        let early = self.edges.iter().map(|edge| edge.at_s).fold(first(position_at), f64::min);
        let start_s = early.min(first(pressure_at)) - LEAD_S;
        let end_s = last(position_at).max(last(pressure_at));
        let mut rig =
            Rig::around(&self.valve, &self.hidden, &self.conditions, self.around.clone(), &self.edges, start_s);
        let mut seen = Seen::default();
        let mut stops = self.changes.iter().filter(|change| change.at_s < end_s).peekable();
        loop {
            let until_s = stops.peek().map_or(end_s, |change| change.at_s);
            if until_s > rig.time_s {
                let done = rig.advance_adaptively(until_s, self.accuracy, |rig, stretch| {
                    while let Some(&t) = position_at.get(seen.position_m.len()).filter(|&&t| t <= stretch.to_s) {
                        seen.position_m.push(stretch.position(t, rig.hidden.sensor_lag_s));
                    }
                    if seen.pipe_pa.len() < pressure_at.len() {
                        let (from, to) = (rig.pressures(&stretch.from), rig.pressures(&stretch.to));
                        while let Some(&t) = pressure_at.get(seen.pipe_pa.len()).filter(|&&t| t <= stretch.to_s) {
                            seen.chamber_pa.push(stretch.between(t, from.0, to.0));
                            seen.pipe_pa.push(stretch.between(t, from.1, to.1));
                            seen.supply_pa.push(rig.source_pa(t));
                        }
                    }
                    let stroke = rig.valve.stroke_m;
                    let (a, b) = (stretch.from.x, stretch.to.x);
                    if (a > 0.0 && b <= 0.0) || (a < stroke && b >= stroke) {
                        seen.impacts.push(Impact { at_s: stretch.to_s, speed_m_per_s: stretch.from.v.abs() });
                    }
                });
                if !done {
                    seen.is_broken = true;
                    break;
                }
            }
            let Some(change) = stops.next() else { break };
            let (valve, hidden) = self.changed(change);
            rig.vary(&valve, &hidden, self.conditions.supply_psig * change.supply);
        }
        if seen.position_m.is_empty() {
            seen.position_m.push(f64::NAN);
        }
        // Rounding may leave the very last row just beyond the end.
        for list in [&mut seen.chamber_pa, &mut seen.pipe_pa, &mut seen.supply_pa] {
            if let Some(&value) = list.last() {
                list.resize(pressure_at.len(), value);
            }
        }
        if let Some(&value) = seen.position_m.last() {
            seen.position_m.resize(position_at.len(), value);
        }
        seen
    }

    fn changed(&self, change: &Change) -> (Valve, Hidden) {
        let (mut valve, mut hidden) = (self.valve.clone(), self.hidden.clone());
        hidden.load_n += change.load_n;
        hidden.seal_friction_m2 *= change.friction;
        if let Some(dry) = &mut hidden.dry_friction {
            dry.coulomb_n *= change.friction;
            dry.static_n *= change.friction;
        }
        valve.supply_psig *= change.supply;
        (valve, hidden)
    }
}

/// Closing and opening time of one stroke, commanded at 0 s and at `open_at_s` and watched until `end_s`.
pub(crate) fn times_of(play: &Play, open_at_s: f64, end_s: f64, rows: usize) -> (Option<f64>, Option<f64>) {
    let grid = grid(end_s, rows);
    times_in(&play.watch(&grid, &[]).position_m, &grid, open_at_s, play.valve.stroke_m)
}

/// Evenly spaced times from 0 to `end_s`.
pub(crate) fn grid(end_s: f64, rows: usize) -> Vec<f64> {
    (0..=rows).map(|row| end_s * row as f64 / rows as f64).collect()
}

/// First times at the stops, from a sampled position.
pub(crate) fn times_in(position: &[f64], at: &[f64], open_at_s: f64, stroke: f64) -> (Option<f64>, Option<f64>) {
    let crossing = |range: std::ops::Range<usize>, level: &dyn Fn(f64) -> f64| {
        range.clone().find(|&row| level(position[row]) <= 0.0).map(|row| {
            if row == range.start {
                return at[row];
            }
            let (old, new) = (level(position[row - 1]), level(position[row]));
            at[row - 1] + (at[row] - at[row - 1]) * old / (old - new)
        })
    };
    let split = at.iter().take_while(|&&t| t <= open_at_s).count();
    let close = crossing(0..split, &|x| x);
    let open = crossing(split..at.len(), &|x| stroke - x).map(|t| t - open_at_s);
    (close, open)
}

/// A single undisturbed cycle under `conditions`.
pub(crate) fn plain_cycle(valve: &Valve, hidden: &Hidden, conditions: &Conditions, open_at_s: f64, end_s: f64) -> Play {
    Play {
        valve: valve.clone(),
        hidden: hidden.clone(),
        conditions: conditions.clone(),
        around: Surroundings::default(),
        edges: vec![Edge { at_s: 0.0, close: true }, Edge { at_s: open_at_s, close: false }],
        changes: Vec::new(),
        accuracy: Accuracy { factor: 1.0, longest_s: end_s / 400.0 },
    }
}

/// Conditions with no leak.
pub(crate) fn at(supply_psig: f64) -> Conditions {
    Conditions { supply_psig, leak_to_atmosphere_m2: 0.0, leak_from_supply_m2: 0.0 }
}

/// Gauge pressure of the supply in Pa.
pub(crate) fn gauge_pa(supply_psig: f64) -> f64 {
    supply_psig * PSI_PA
}
