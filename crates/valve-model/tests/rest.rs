//! Long steps while the piston rests on a stop, and an eased port where pressures meet: far fewer steps, and nothing else
//! that anybody would see.

mod common;

use std::sync::Arc;

use common::{at, close_at, effect, open_at, run_of, testbed, valve_of};
use valve_model::custom::{CustomEffect, CustomTarget};
use valve_model::orifice::{Laminar, OrificeLaw};
use valve_model::prescribed::Prescribed;
use valve_model::stroke::strokes;
use valve_model::{
    CommandEdge, Conditions, EffectKind, Outcome, Prepared, Run, RunError, Switches, Trajectory, Valve, simulate,
};

/// Largest difference from a quarter of the step: of a stroke time, s, a position, m, a pressure, Pa.
const TIME_S: f64 = 0.1e-3;
const POSITION_M: f64 = 10e-6;
const PRESSURE_PA: f64 = 250.0;

fn nodes(valve: &Valve, run: &Run, step_s: f64) -> Trajectory {
    let mut found = Trajectory::default();
    simulate(&[Prepared::new(valve, run, step_s)], true, |_, nodes, _| found = nodes.clone());
    assert_eq!(found.outcome, Outcome::Complete);
    found
}

/// Two cycles with a leak, so that pressures start from where a cycle ends.
fn run(valve: &Valve, out_m2: f64, in_m2: f64) -> Run {
    let conditions = Conditions {
        leak_to_atmosphere_m2: out_m2,
        leak_from_supply_m2: in_m2,
        ..Conditions::nominal(valve.parameters())
    };
    let commands = vec![close_at(0.1), open_at(4.1), close_at(12.1), open_at(16.1)];
    Run { conditions, ..run_of(valve, commands, 24.0) }
}

/// The reference valve as it is, and with terms of every group.
fn valves() -> Vec<(&'static str, Valve)> {
    let with = |effects: &[(EffectKind, &[f64])]| {
        valve_of(testbed(), effects.iter().map(|(kind, values)| effect(*kind, values)).collect())
    };
    let formula = CustomEffect::new("bump", CustomTarget::Force, "-40*exp(-((x - 0.012)/0.002)^2)", Vec::new());
    let formula = formula.expect("a formula");
    vec![
        ("base", with(&[])),
        ("dry friction", with(&[(EffectKind::DRY_FRICTION, &[30.0])])),
        ("gas heating", with(&[(EffectKind::GAS_HEATING, &[0.5])])),
        ("process force", with(&[(EffectKind::PROCESS_FORCE, &[59.0])])),
        ("supply droop", with(&[(EffectKind::SUPPLY_DROOP, &[4e7])])),
        ("solenoid lag", with(&[(EffectKind::SOLENOID_LAG, &[0.02, 0.02, 0.01])])),
        ("formula", Valve::new(testbed(), Switches::default(), Vec::new(), vec![formula]).expect("possible")),
    ]
}

#[track_caller]
fn assert_close(what: &str, valve: &Valve, run: &Run) {
    let (usual, fine) = (nodes(valve, run, 1e-3), nodes(valve, run, 0.25e-3));
    let times = |nodes: &Trajectory| strokes(valve, &run.commands, nodes);
    for (a, b) in times(&usual).iter().zip(times(&fine)) {
        let off = a.time_s.zip(b.time_s).map_or(0.0, |(a, b)| (a - b).abs());
        assert!(off < TIME_S && a.time_s.is_some() == b.time_s.is_some(), "{what}: {a:?} and {b:?}");
    }
    for tick in 0..24_000 {
        let time_s = f64::from(tick) * 1e-3;
        let ([x, chamber, pipe], [x1, chamber1, pipe1]) = (at(&usual, time_s), at(&fine, time_s));
        assert!((x - x1).abs() < POSITION_M, "{what} at {time_s} s: {x} m and {x1} m");
        let off_pa = (chamber - chamber1).abs().max((pipe - pipe1).abs());
        assert!(off_pa < PRESSURE_PA, "{what} at {time_s} s: {chamber} and {chamber1}, {pipe} and {pipe1} Pa");
    }
}

#[test]
fn times_positions_and_pressures_are_those_of_a_quarter_of_the_step() {
    // Each valve on a thread of its own; a panic in one is that of the test.
    std::thread::scope(|scope| {
        for (name, valve) in valves() {
            scope.spawn(move || {
                let leaks = [(0.0, 0.15e-6), (0.2e-6, 0.0), (0.0, 0.0), (0.01e-6, 0.0), (0.0, 0.01e-6)];
                // What an effect changes is seen with none and with much; small leaks are those of the valve itself.
                let many = if name == "base" { leaks.len() } else { 2 };
                for (out_m2, in_m2) in leaks.into_iter().take(many) {
                    let what = format!("{name}, leaks of {out_m2:e} and {in_m2:e} m2");
                    assert_close(&what, &valve, &run(&valve, out_m2, in_m2));
                }
            });
        }
    });
}

#[test]
fn a_measured_supply_is_followed_on_the_stops() {
    let valve = valve_of(testbed(), vec![]);
    let supply_pa = testbed().supply_pressure_pa;
    let time_s: Vec<f64> = (0..=240).map(|i| 0.1 * f64::from(i)).collect();
    let pressures = time_s.iter().map(|time| supply_pa * (0.98 + 0.02 * libm::cos(1.5 * time))).collect();
    let prescribed = Prescribed { time_s, supply_pressure_pa: Some(pressures), ..Prescribed::default() };
    let run = Run { prescribed: Some(Arc::new(prescribed)), ..run(&valve, 0.0, 0.0) };
    assert_close("a supply that swings", &valve, &run);
}

#[test]
fn most_steps_are_left_for_the_motion() {
    let valve = valve_of(testbed(), vec![]);
    // Also close to the leak that stalls it, where pipe and chamber are nearly at one pressure for seconds.
    for (in_m2, most) in [(0.0, 5), (0.15e-6, 5), (0.2e-6, 5)] {
        let nodes = nodes(&valve, &run(&valve, 0.0, in_m2), 1e-3);
        let stroke = testbed().stroke_m;
        let moving = nodes.position_m.iter().filter(|x| (0.0..stroke).contains(*x)).count();
        let resting = nodes.time_s.len() - moving;
        assert!(5 * resting < most * moving, "{in_m2:e} m2: {resting} on the stops, {moving} between them");
        assert!(moving < 16_000, "{in_m2:e} m2: {moving} between the stops");
    }
}

#[test]
fn a_piston_that_swings_on_its_stop_comes_to_rest() {
    // A heavy one on hard stops, with hardly any friction: a swing that is stretched in time must not feed itself.
    let parameters = valve_model::Parameters {
        moving_mass_kg: 20.0,
        viscous_friction_n_s_per_m: 300.0,
        contact_stiffness_n_per_m: 1e7,
        ..testbed()
    };
    let valve = valve_of(parameters, vec![]);
    let nodes = nodes(&valve, &run(&valve, 0.0, 0.02e-6), 1e-3);
    for time_s in [4.0, 12.0, 16.0, 23.9] {
        let end = nodes.time_s.partition_point(|time| *time < time_s).min(nodes.time_s.len() - 1);
        assert!(nodes.velocity_m_per_s[end].abs() < 1e-4, "{} m/s at {time_s} s", nodes.velocity_m_per_s[end]);
    }
}

#[test]
fn a_spool_between_both_ends_holds_the_pressure_at_which_as_much_comes_as_goes() {
    let valve = valve_of(testbed(), vec![]);
    let p = valve.parameters();
    let (law, laminar) = (OrificeLaw::ideal_nozzle(p.ratio_of_specific_heats), Laminar::new(1e-9));
    let mut before = p.ambient_pressure_pa;
    for spool in [0.3, 0.5, 0.8] {
        let command = CommandEdge { time_s: 0.0, spool };
        let held = nodes(&valve, &run_of(&valve, vec![command], 20.0), 1e-3);
        let [_, chamber, pipe] = at(&held, 19.9);
        let comes = law.flow(p.supply_pressure_pa, pipe, spool, laminar);
        let goes = law.flow(pipe, p.ambient_pressure_pa, 1.0 - spool, laminar);
        assert!(
            (comes / goes - 1.0).abs() < 1e-3 && (chamber - pipe).abs() < PRESSURE_PA,
            "{spool}: {comes} and {goes}"
        );
        assert!(pipe > before, "{spool}: {pipe} Pa");
        before = pipe;
    }
    for spool in [-0.1, 1.5, f64::NAN] {
        let run = run_of(&valve, vec![CommandEdge { time_s: 0.0, spool }], 1.0);
        let refused = Prepared::new(&valve, &run, 1e-3);
        assert!(matches!(refused.check(), Err(RunError::Command { .. })), "{spool}");
    }
}
