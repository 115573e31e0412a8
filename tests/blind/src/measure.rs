//! From ideal strokes to what the instruments write down: scatter, noise, resolution.

use rand::rngs::StdRng;
use rand_distr::{Distribution, Normal};

use crate::campaign::{Campaign, PRESSURE_NOISE_PA, Run, TimingRow};
use crate::conditions::Plan;
use crate::hidden::Hidden;
use crate::record::{Trace, record, stroke_times};
use crate::rig::Conditions;
use crate::spool::Edge;
use crate::truth::{Channels, Scatter, Truth};
use crate::valve::Valve;

/// Time between rows of a trace.
pub const INTERVAL_S: f64 = 1e-3;
/// One sigma of stroke times taken from limit switches.
pub(crate) const TIMING_NOISE_S: f64 = 3e-3;
/// Resolution of the position sensor.
const RESOLUTION_M: f64 = 5e-6;

/// The valve and conditions of one stroke, scattered.
fn scattered(actual: &Valve, set: &Conditions, scatter: Option<Scatter>, rng: &mut StdRng) -> (Valve, Conditions) {
    let (mut valve, mut conditions) = (actual.clone(), set.clone());
    if let Some(sigma) = scatter {
        valve.preload_m *= 1.0 + sigma.preload * normal(rng);
        let flow = 1.0 + sigma.flow * normal(rng);
        valve.solenoid_area_m2 *= flow;
        valve.port_area_m2 *= flow;
        conditions.leak_to_atmosphere_m2 *= flow;
        conditions.leak_from_supply_m2 *= flow;
        conditions.supply_psig *= 1.0 + sigma.supply * normal(rng);
    }
    (valve, conditions)
}

/// Records the traces of a plan; none when a stroke was not full.
pub(crate) fn take_traces(
    campaign: &mut Campaign,
    actual: &Valve,
    hidden: &Hidden,
    plan: &Plan,
    rng: &mut StdRng,
) -> Option<()> {
    let edges = [Edge { at_s: 0.0, close: true }, Edge { at_s: campaign.valve.open_at_s, close: false }];
    for set in &plan.conditions {
        let (valve, conditions) = scattered(actual, set, campaign.truth.scatter, rng);
        let late_s = campaign.truth.scatter.map_or(0.0, |sigma| sigma.delay_s);
        // A switching comes late by its own chance, never early.
        let switched = edges.map(|edge| Edge { at_s: edge.at_s + late_s * normal(rng).abs(), ..edge });
        let ideal = record(&valve, hidden, &conditions, &edges, &switched, plan.end_s, INTERVAL_S);
        if !full_strokes(&ideal, &campaign.valve) {
            return None;
        }
        campaign.runs.push(measured(set.clone(), ideal, &campaign.truth, rng));
    }
    Some(())
}

/// Whether the valve closed before it was let go and opened again before the end, with time to
/// spare for the rests.
fn full_strokes(trace: &Trace, valve: &Valve) -> bool {
    let until = |end: f64| trace.time_s.iter().filter(|&&t| t <= end).count();
    let shut = until(0.9 * valve.open_at_s);
    let end = trace.time_s.len();
    trace.position_m[..shut].iter().any(|&x| x <= 0.0)
        && trace.position_m[end - end / 50..].iter().all(|&x| x >= valve.stroke_m)
}

/// What the sensors make of an ideal trace.
fn measured(set: Conditions, ideal: Trace, truth: &Truth, rng: &mut StdRng) -> Run {
    let position_m = ideal
        .position_m
        .iter()
        .map(|x| ((x + truth.position_noise_m * normal(rng)) / RESOLUTION_M).round() * RESOLUTION_M)
        .collect();
    let mut gauge = |pressures: &[f64]| -> Vec<f64> {
        pressures.iter().map(|p| ((p + PRESSURE_NOISE_PA * normal(rng)) / 10.0).round() * 10.0).collect()
    };
    let pressures_pa =
        (truth.channels == Channels::PositionAndPressures).then(|| (gauge(&ideal.chamber_pa), gauge(&ideal.pipe_pa)));
    Run { conditions: set, time_s: ideal.time_s, command: ideal.command, position_m, pressures_pa }
}

/// Takes the stroke times of a plan; none when a stroke was not full.
pub(crate) fn take_times(
    campaign: &mut Campaign,
    actual: &Valve,
    hidden: &Hidden,
    plan: &Plan,
    rng: &mut StdRng,
) -> Option<()> {
    for set in &plan.conditions {
        let (valve, conditions) = scattered(actual, set, campaign.truth.scatter, rng);
        let leaks = set.leak_to_atmosphere_m2 > 0.0 || set.leak_from_supply_m2 > 0.0;
        let (close, open) = stroke_times(&valve, hidden, &conditions, if leaks { 2 } else { 1 });
        let mut read = |t: f64| ((t + TIMING_NOISE_S * normal(rng)) * 1e4).round() / 1e4;
        campaign.timings.push(TimingRow {
            conditions: set.clone(),
            close_s: Some(read(close?)),
            open_s: Some(read(open?)),
        });
    }
    Some(())
}

/// A number from the standard normal distribution.
pub(crate) fn normal(rng: &mut StdRng) -> f64 {
    Normal::new(0.0, 1.0).map_or(0.0, |n| n.sample(rng))
}
