//! Valves that cannot be followed are refused, by name; those that can are not.

mod common;

use common::{close_at, effect, nodes_of, open_at, run_of, testbed, valve_of};
use valve_model::custom::{CustomEffect, CustomParameter, CustomTarget};
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{Conditions, Effect, EffectKind, Outcome, Parameters, Prepared, RunError, Switches, Valve};
use valve_model::{simulate, stability};

fn refusal(effects: Vec<Effect>, change: impl FnOnce(&mut Parameters)) -> Option<String> {
    let mut parameters = testbed();
    change(&mut parameters);
    let valve = valve_of(parameters, effects);
    let run = run_of(&valve, vec![close_at(0.0), open_at(4.0)], 12.0);
    let checked = stability::check(&valve, &run.conditions, run.end_s, DEFAULT_STEP_S).err();
    let prepared = Prepared::new(&valve, &run, DEFAULT_STEP_S);
    assert_eq!(prepared.check().err().cloned(), checked.clone().map(RunError::TooStiff));
    if checked.is_some() {
        let nodes = nodes_of(&valve, &run);
        assert_eq!((nodes.outcome, nodes.time_s.len()), (Outcome::Refused, 1));
    }
    checked.map(|error| format!("{}: {error}", error.key()))
}

#[test]
fn a_parameter_set_that_is_too_stiff_is_refused_by_the_name_of_the_parameter() {
    let names = |key: &str, found: Option<String>| {
        let found = found.unwrap_or_default();
        assert!(found.starts_with(key), "expected {key}, found {found:?}");
    };
    names("pneumatics.pipe_volume", refusal(vec![], |p| p.pipe_volume_m3 = 1e-12));
    names("pneumatics.pipe_volume", refusal(vec![], |p| p.pipe_volume_m3 = 1e-15));
    names("stops.contact_stiffness", refusal(vec![], |p| p.contact_stiffness_n_per_m = 1e13));
    names("actuator.moving_mass", refusal(vec![], |p| p.moving_mass_kg = 1e-9));
    names("actuator.viscous_friction", refusal(vec![], |p| p.viscous_friction_n_s_per_m = 1e7));
    names(
        "actuator.dead_volume",
        refusal(vec![], |p| {
            (p.dead_volume_m3, p.contact_stiffness_n_per_m) = (1e-13, 1e12);
            p.preload_compression_m = 0.0;
        }),
    );
    let hair = effect(EffectKind::SEAT_ADHESION, &[50.0, 1e-12]);
    names("effect.seat-adhesion.reach", refusal(vec![hair], |_| {}));
}

#[test]
fn the_bound_that_a_refusal_gives_is_enough() {
    let refused = refusal(vec![], |p| p.pipe_volume_m3 = 1e-13).expect("far too small");
    let bound = refused.split("about ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a bound");
    let bound: f64 = bound.parse().expect("a number");
    assert_eq!(refusal(vec![], |p| p.pipe_volume_m3 = bound), None);
    assert!(refusal(vec![], |p| p.pipe_volume_m3 = 0.8 * bound).is_some());
}

#[test]
fn odd_valves_that_can_be_followed_are_not_refused() {
    assert_eq!(refusal(vec![], |p| p.pipe_volume_m3 = 0.1e-6), None);
    assert_eq!(refusal(vec![], |p| p.contact_stiffness_n_per_m = 1e9), None);
    assert_eq!(refusal(vec![], |p| p.moving_mass_kg = 0.01), None);
    // An hour at its usual step is long, not stiff.
    let valve = valve_of(testbed(), vec![]);
    let conditions = Conditions::nominal(valve.parameters());
    assert_eq!(stability::check(&valve, &conditions, 20_000.0, DEFAULT_STEP_S), Ok(()));
}

#[test]
fn the_gas_in_a_tiny_chamber_is_a_spring_that_the_step_follows() {
    let mut parameters = testbed();
    (parameters.dead_volume_m3, parameters.contact_stiffness_n_per_m) = (1e-7, 1e9);
    parameters.moving_mass_kg = 0.2;
    let valve = valve_of(parameters, vec![]);
    let nodes = nodes_of(&valve, &run_of(&valve, vec![close_at(0.0), open_at(4.0)], 12.0));
    assert_eq!(nodes.outcome, Outcome::Complete);
    assert!(nodes.chamber_pressure_pa.iter().all(|p| (5e4..1.4e6).contains(p)));
}

#[test]
fn a_run_stops_where_its_state_is_no_longer_a_number() {
    let formula = CustomEffect::new("broken", CustomTarget::Force, "0*sqrt(x - 0.5*L)", Vec::new()).expect("a formula");
    let valve = Valve::new(testbed(), Switches::default(), Vec::new(), vec![formula]).expect("possible");
    let nodes = nodes_of(&valve, &run_of(&valve, vec![close_at(0.0), open_at(4.0)], 12.0));
    let Outcome::Diverged { time_s, what } = nodes.outcome else { panic!("{:?}", nodes.outcome) };
    let last = nodes.position_m.last().expect("nodes");
    assert!((0.4..1.1).contains(&time_s), "noticed at {time_s} s");
    assert!((0.45..0.55).contains(&(last / testbed().stroke_m)), "ends at {last} m");
    assert!(!what.is_empty());
    let channels = [&nodes.time_s, &nodes.velocity_m_per_s, &nodes.chamber_pressure_pa, &nodes.pipe_pressure_pa];
    for channel in channels {
        assert_eq!(channel.len(), nodes.position_m.len());
        assert!(channel.iter().all(|value| value.is_finite()));
    }
}

#[test]
fn a_run_that_stops_leaves_its_neighbours_in_the_lanes_alone() {
    let with = |x0: f64| {
        let parameter = CustomParameter { name: "a".into(), value: x0, lower: -1.0, upper: 1.0, unit: "m".into() };
        let effect = CustomEffect::new("bump", CustomTarget::Force, "10*sqrt(x + a)", vec![parameter]);
        Valve::new(testbed(), Switches::default(), Vec::new(), vec![effect.expect("a formula")]).expect("possible")
    };
    let (sound, broken) = (with(0.5), with(-0.01));
    let run = |valve: &Valve| {
        let run = run_of(valve, vec![close_at(0.0), open_at(4.0)], 12.0);
        Prepared::new(valve, &run, DEFAULT_STEP_S)
    };
    let collect = |runs: &[Prepared]| {
        let mut found = vec![(Vec::new(), Outcome::Refused); runs.len()];
        simulate(runs, false, |index, nodes, _| found[index] = (nodes.position_m.clone(), nodes.outcome));
        found
    };
    let beside = collect(&[run(&sound), run(&broken), run(&sound), run(&broken), run(&sound)]);
    let alone = collect(&[run(&sound)]);
    for index in [0, 2, 4] {
        assert!(beside[index] == alone[0], "run {index}");
    }
    assert!(matches!(beside[1].1, Outcome::Diverged { .. }) && beside[1] == beside[3]);
}
