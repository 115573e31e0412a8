//! The severity at which a table over conditions ends, as a smooth function of the conditions.
//!
//! At the extremes and in the middle of each condition the severity is found at which a stroke is no longer
//! finished. The logarithm of the end is the parabola through these: smooth, whatever stroke fails first where.

use leak_table::{Condition, ConditionRange, Conditions, SeverityPoint, SeverityTable, Stroke};

use crate::chebyshev::extrema;
use crate::error::BuildError;
use crate::simulation::Simulation;
use crate::ticks::{self, Ticks};

/// Severities tried at first, as powers of two times the end under the valve's own conditions.
const FIRST_OCTAVES: [f64; 2] = [-1.0, 1.0];
/// How many of them.
const FIRST: u32 = 16;
/// Severities tried inside a bracket.
const INSIDE: u64 = 7;
/// The end is located to this share of it.
const RESOLUTION: f64 = 1e-3;

/// The end over the conditions.
#[derive(Clone)]
pub(crate) struct End {
    nodes: [Vec<f64>; 2],
    logarithms: Vec<f64>,
    simulated: usize,
    /// What was left of the ends found after drawing them in; 0 if some are no stalls.
    left: f64,
}

impl End {
    /// The severity under some conditions, SI.
    pub(crate) fn at(&self, conditions: &Conditions) -> f64 {
        let [pressures, temperatures] = Condition::ALL.map(|c| weights(&self.nodes[c as usize], conditions.get(c)));
        let logarithm = |(i, pressure): (usize, &f64)| {
            let row = &self.logarithms[i * temperatures.len()..(i + 1) * temperatures.len()];
            pressure * row.iter().zip(&temperatures).map(|(l, w)| l * w).sum::<f64>()
        };
        pressures.iter().enumerate().map(logarithm).sum::<f64>().exp()
    }

    /// The severity at which a stroke is no longer finished, as a share of the end; none if that is not known
    /// everywhere.
    pub(crate) fn stall_share(&self) -> Option<f64> {
        (self.left > 0.0).then(|| 1.0 / self.left)
    }

    /// Draws the end in everywhere.
    pub(crate) fn shrink(&mut self, factor: f64) {
        self.left *= factor;
        for logarithm in &mut self.logarithms {
            *logarithm += factor.ln();
        }
    }

    /// How many severities were simulated to find it.
    pub(crate) fn simulated(&self) -> usize {
        self.simulated
    }
}

/// Lagrange's weights of up to three nodes.
fn weights(nodes: &[f64], x: f64) -> Vec<f64> {
    let weight = |j: usize| {
        let others = nodes.iter().enumerate().filter(|(k, _)| *k != j);
        others.map(|(_, other)| (x - other) / (nodes[j] - other)).product()
    };
    (0..nodes.len()).map(weight).collect()
}

/// Finds the ends.
pub(crate) fn find(
    simulation: &Simulation<'_>,
    table: &SeverityTable,
    range: &ConditionRange,
) -> Result<End, BuildError> {
    let nodes =
        Condition::ALL.map(|condition| extrema(range.get(condition), if range.varies(condition) { 3 } else { 1 }));
    let mut end = End { nodes, logarithms: Vec::new(), simulated: 0, left: 1.0 };
    let [pressures, temperatures] = end.nodes.clone();
    for &supply_pressure_pa in &pressures {
        for &temperature_k in &temperatures {
            let at = Conditions { supply_pressure_pa, temperature_k };
            let found = end_at(simulation, table, &at)?;
            end.logarithms.push(found.severity.ln());
            end.simulated += found.simulated;
            if !found.stalls {
                end.left = 0.0;
            }
        }
    }
    Ok(end)
}

/// The end under some conditions.
struct Found {
    /// The largest severity found with which both strokes are finished.
    severity: f64,
    /// Whether one is not finished just beyond.
    stalls: bool,
    /// How many severities were tried.
    simulated: usize,
}

fn end_at(simulation: &Simulation<'_>, table: &SeverityTable, at: &Conditions) -> Result<Found, BuildError> {
    let finished = |point: &SeverityPoint| point.close_time_s.is_some() && point.open_time_s.is_some();
    let own = Stroke::ALL.map(|stroke| table.curve(stroke).range().1);
    let own = own[0].min(own[1]);
    let reach = (simulation.wear.reach)(simulation.model.valve);
    let most = reach.last().map_or(Ticks::MAX, |most| simulation.nearest(*most));
    let octave =
        |k: u32| FIRST_OCTAVES[0] + (FIRST_OCTAVES[1] - FIRST_OCTAVES[0]) * f64::from(k) / f64::from(FIRST - 1);
    let mut tried: Vec<Ticks> = (0..FIRST).map(|k| simulation.nearest(own * octave(k).exp2()).min(most)).collect();
    tried.dedup();
    tried.insert(0, 0);
    let conditions = simulation.under(at);
    let simulate = |tried: &[Ticks]| {
        let wanted: Vec<_> = tried.iter().map(|ticks| (conditions, *ticks)).collect();
        simulation.points(&wanted)
    };
    let mut points = simulate(&tried)?;
    let mut count = tried.len();
    if !finished(&points[0]) {
        let stroke = if points[0].close_time_s.is_none() { Stroke::Close } else { Stroke::Open };
        let (supply_pressure_pa, temperature_k) = (at.supply_pressure_pa, at.temperature_k);
        return Err(BuildError::SoundNotFinished { stroke, supply_pressure_pa, temperature_k });
    }
    loop {
        let Some(stall) = points.iter().position(|point| !finished(point)) else {
            let severity = points[points.len() - 1].severity;
            return Ok(Found { severity, stalls: false, simulated: count });
        };
        let (low, high) = (tried[stall - 1], tried[stall]);
        let inside = ticks::between(low, high, INSIDE);
        if inside.is_empty() || ((high - low) as f64) < RESOLUTION * high as f64 {
            return Ok(Found { severity: points[stall - 1].severity, stalls: true, simulated: count });
        }
        points = [vec![points[stall - 1]], simulate(&inside)?, vec![points[stall]]].concat();
        count += inside.len();
        tried = [vec![low], inside, vec![high]].concat();
    }
}
