//! Measured pressures in the place of simulated ones.

mod common;

use std::sync::Arc;

use common::{at, close_at, effect, nodes_of, open_at, run_of, testbed, valve_of};
use valve_model::prescribed::Prescribed;
use valve_model::stroke::strokes;
use valve_model::{Conditions, EffectKind, Outcome, Prepared, Run, RunError, Switches, Valve};

fn prescribed_by(valve: &Valve, prescribed: Prescribed) -> Run {
    Run { prescribed: Some(Arc::new(prescribed)), ..run_of(valve, vec![close_at(0.5), open_at(4.0)], 9.0) }
}

fn supply(times_s: &[f64], pressures_pa: &[f64]) -> Prescribed {
    Prescribed { time_s: times_s.to_vec(), supply_pressure_pa: Some(pressures_pa.to_vec()), ..Prescribed::default() }
}

fn times(valve: &Valve, run: &Run) -> Vec<f64> {
    strokes(valve, &run.commands, &nodes_of(valve, run)).iter().map(|s| s.time_s.expect("gets there")).collect()
}

/// The valves whose supply acts in different places: at the solenoid, at a standing leak, behind a line.
fn valves() -> Vec<Valve> {
    let leak = effect(EffectKind::LEAK_FROM_SUPPLY, &[0.05e-6]);
    let droop = effect(EffectKind::SUPPLY_DROOP, &[2e7]);
    [vec![], vec![leak], vec![droop], vec![leak, droop]].map(|effects| valve_of(testbed(), effects)).into()
}

#[test]
fn a_recorded_supply_that_is_constant_is_that_supply() {
    for valve in valves() {
        let low_pa = 0.9 * valve.parameters().supply_pressure_pa;
        let recorded = prescribed_by(&valve, supply(&[0.0, 9.0], &[low_pa, low_pa]));
        let conditions = Conditions { supply_pressure_pa: low_pa, ..Conditions::nominal(valve.parameters()) };
        let constant = Run { conditions, ..run_of(&valve, vec![close_at(0.5), open_at(4.0)], 9.0) };
        for (a, b) in times(&valve, &recorded).iter().zip(times(&valve, &constant)) {
            // Beside a record, steps span fewer on the stops.
            assert!((a - b).abs() < 3e-5, "{:?}: {a} s and {b} s", valve.effects());
        }
    }
}

#[test]
fn a_supply_that_sags_while_it_fills_closes_later_and_fills_less() {
    let p = testbed().supply_pressure_pa;
    for valve in valves() {
        let steady = prescribed_by(&valve, supply(&[0.0, 9.0], &[p, p]));
        let sagging = prescribed_by(&valve, supply(&[0.0, 0.5, 0.6, 9.0], &[p, p, 0.85 * p, 0.85 * p]));
        let (steady_s, sagging_s) = (times(&valve, &steady)[0], times(&valve, &sagging)[0]);
        assert!(sagging_s > 1.05 * steady_s, "{:?}: {steady_s} s and {sagging_s} s", valve.effects());
        let filled = at(&nodes_of(&valve, &sagging), 3.9)[2];
        assert!((filled / (0.85 * p) - 1.0).abs() < 0.02, "{:?}: {filled} Pa", valve.effects());
    }
}

#[test]
fn a_valve_at_rest_begins_under_the_measured_pressures() {
    let valve = valve_of(testbed(), vec![]);
    // A pipe that another vent holds above the atmosphere; the spring yields later.
    let held_pa = 1.3e5;
    let pipe = Prescribed { time_s: vec![0.0, 9.0], pipe_pressure_pa: Some(vec![held_pa; 2]), ..Prescribed::default() };
    let chamber = Prescribed { chamber_pressure_pa: Some(vec![1.2e5; 2]), ..pipe.clone() };
    for (prescribed, pressures) in [(pipe, [held_pa; 2]), (chamber, [1.2e5, held_pa])] {
        let run = Run { commands: Vec::new(), ..prescribed_by(&valve, prescribed) };
        let node = at(&nodes_of(&valve, &run), 0.0);
        for (found, expected) in [node[1], node[2]].iter().zip(pressures) {
            assert!((found / expected - 1.0).abs() < 1e-9, "{node:?}, expected {pressures:?}");
        }
    }
}

#[test]
fn a_formula_sees_the_recorded_supply() {
    use valve_model::custom::{CustomEffect, CustomTarget};
    let formula = CustomEffect::new("thrust", CustomTarget::Force, "1e-4*(p_s - 5e5)", Vec::new()).expect("a formula");
    let with = |custom| Valve::new(testbed(), Switches::default(), Vec::new(), custom).expect("possible");
    let p = testbed().supply_pressure_pa;
    // The pipe is measured as well, so that the supply acts through the formula alone.
    let record = |supply_pa: f64| Prescribed {
        time_s: vec![0.0, 1.0, 9.0],
        pipe_pressure_pa: Some(vec![101_325.0, 4.3e5, 4.3e5]),
        supply_pressure_pa: Some(vec![supply_pa; 3]),
        ..Prescribed::default()
    };
    let valve = with(vec![formula]);
    let closed = |supply_pa: f64| {
        times(&valve, &Run { commands: vec![close_at(0.0)], ..prescribed_by(&valve, record(supply_pa)) })[0]
    };
    assert!(closed(p + 5e4) > closed(p) + 1e-3);
}

#[test]
fn what_is_no_record_is_refused() {
    let valve = valve_of(testbed(), vec![]);
    let hole = supply(&[0.0, 1.0, 9.0], &[6e5, f64::NAN, 6e5]);
    for prescribed in [Prescribed::default(), supply(&[0.0, 1.0], &[6e5]), hole] {
        let run = prescribed_by(&valve, prescribed);
        assert!(matches!(Prepared::new(&valve, &run, 1e-3).check(), Err(RunError::Prescribed(_))));
        assert_eq!(nodes_of(&valve, &run).outcome, Outcome::Refused);
    }
}
