//! What any valve of this kind does, whatever its parameters; and odd parameters.

mod reference_valve;

use leak_table::Fault;
use proptest::prelude::*;
use reference_valve::{base_valve, first_cycle, leaking, testbed, typical, with_effect};
use valve_model::cycle::{CycleTimes, cycle_commands, cycles};
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{Conditions, Effect, EffectKind, Orientation, Parameters, Prepared, Run, Schedule, Switches, Valve};
use valve_model::{ParameterId, Start, simulate};

const SCHEDULE: Schedule = Schedule { close_at_s: 0.0, open_at_s: 5.0, end_s: 13.0 };

/// Times that differ by less are equal to the integrator, s.
const EQUAL_S: f64 = 1e-5;

/// Valves around the reference valve that close and open.
fn valves() -> impl Strategy<Value = Valve> {
    prop::collection::vec(0.8..1.25_f64, ParameterId::ALL.len()).prop_map(|factors| {
        let mut parameters = testbed();
        for (&id, factor) in ParameterId::ALL.iter().zip(factors) {
            // Gas and surroundings stay as they are.
            if !id.key().starts_with("gas.") && id != ParameterId::AmbientPressure && id != ParameterId::Temperature {
                parameters.set(id, parameters.get(id) * factor);
            }
        }
        base_valve(parameters)
    })
}

fn times(valve: &Valve, conditions: Conditions) -> (f64, f64) {
    let times = first_cycle(valve, conditions, &SCHEDULE);
    (times.close_time_s.unwrap_or(f64::INFINITY), times.open_time_s.unwrap_or(f64::INFINITY))
}

fn changed(change: impl FnOnce(&mut Parameters)) -> (f64, f64) {
    let mut parameters = testbed();
    change(&mut parameters);
    let valve = base_valve(parameters);
    times(&valve, Conditions::nominal(valve.parameters()))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_leak_to_atmosphere_closes_slower_and_opens_faster(valve in valves(), area in 0.01..0.2_f64) {
        let healthy = times(&valve, Conditions::nominal(valve.parameters()));
        let leaky = times(&valve, leaking(&valve, Fault::Atmosphere, area * 1e-6));
        prop_assert!(leaky.0 > healthy.0 || healthy.0 == f64::INFINITY);
        prop_assert!(leaky.1 < healthy.1);
    }

    #[test]
    fn a_leak_from_the_supply_closes_faster_and_opens_slower(valve in valves(), area in 0.01..0.1_f64) {
        let healthy = times(&valve, Conditions::nominal(valve.parameters()));
        let leaky = times(&valve, leaking(&valve, Fault::Supply, area * 1e-6));
        prop_assert!(leaky.0 < healthy.0 || healthy.0 == f64::INFINITY);
        // A valve that did not close before the leak may have had less far to open.
        prop_assert!(leaky.1 > healthy.1 || healthy.0 == f64::INFINITY);
    }

    #[test]
    fn more_supply_pressure_closes_faster_and_opens_slower(valve in valves(), factor in 1.02..1.5_f64) {
        let healthy = times(&valve, Conditions::nominal(valve.parameters()));
        let mut conditions = Conditions::nominal(valve.parameters());
        conditions.supply_pressure_pa *= factor;
        let stronger = times(&valve, conditions);
        prop_assert!(stronger.0 < healthy.0 || healthy.0 == f64::INFINITY);
        prop_assert!(stronger.1 > healthy.1 || healthy.0 == f64::INFINITY);
    }

    #[test]
    fn the_piston_stays_between_its_stops_and_pressures_between_atmosphere_and_supply(
        valve in valves(), out in 0.0..0.5_f64, into in 0.0..0.3_f64,
    ) {
        let mut conditions = Conditions::nominal(valve.parameters());
        conditions.leak_to_atmosphere_m2 = out * 1e-6;
        conditions.leak_from_supply_m2 = into * 1e-6;
        let run = Run { conditions, commands: cycle_commands(&SCHEDULE), end_s: SCHEDULE.end_s, prescribed: None, start: Start::Rest };
        let p = valve.parameters();
        let spring = p.spring_stiffness_n_per_m * (p.stroke_m + p.preload_compression_m);
        let push = (p.supply_pressure_pa * p.piston_area_m2 + spring) / p.contact_stiffness_n_per_m;
        simulate(&[Prepared::new(&valve, &run, DEFAULT_STEP_S)], true, |_, nodes, _| {
            assert!(nodes.position_m.iter().all(|x| *x > -2.0 * push && *x < p.stroke_m + 2.0 * push));
            for pressure in nodes.chamber_pressure_pa.iter().chain(&nodes.pipe_pressure_pa) {
                assert!(*pressure > 0.9 * p.ambient_pressure_pa && *pressure < 1.1 * p.supply_pressure_pa);
            }
        });
    }
}

#[test]
fn every_parameter_pulls_the_right_way() {
    let (close, open) = changed(|_| {});
    let slower = |time: f64, than: f64| time > than + EQUAL_S;
    let check = |what: &str, (c, o): (f64, f64), closes_slower: bool, opens_slower: bool| {
        assert!(slower(c, close) == closes_slower && slower(close, c) != closes_slower, "{what}: closes in {c} s");
        assert!(slower(o, open) == opens_slower && slower(open, o) != opens_slower, "{what}: opens in {o} s");
    };
    check("stiffer spring", changed(|p| p.spring_stiffness_n_per_m *= 1.1), true, false);
    check("more preload", changed(|p| p.preload_compression_m *= 1.1), true, false);
    check("more viscous friction", changed(|p| p.viscous_friction_n_s_per_m *= 1.5), true, true);
    check("larger piston", changed(|p| p.piston_area_m2 *= 1.1), false, true);
    check("larger solenoid", changed(|p| p.solenoid_orifice_area_m2 *= 1.1), false, false);
    check("larger dead volume", changed(|p| p.dead_volume_m3 *= 1.5), true, true);
    check("weight opens", changed(|p| p.orientation = Orientation::Inverted), true, false);
}

#[test]
fn effects_pull_the_right_way() {
    let (close, open) = changed(|_| {});
    let with = |kind| {
        let valve = with_effect(typical(kind));
        times(&valve, Conditions::nominal(valve.parameters()))
    };
    for kind in [EffectKind::DRY_FRICTION, EffectKind::SEAL_FRICTION, EffectKind::SOLENOID_LAG] {
        let (c, o) = with(kind);
        assert!(c > close && o > open, "{}: {c} s and {o} s", kind.id());
    }
    assert!(with(EffectKind::CLOSING_CUSHION).0 > close);
    assert!(with(EffectKind::OPENING_CUSHION).1 > open);
    assert!(with(EffectKind::SEAT_ADHESION).1 > open);
    assert!(with(EffectKind::VENT_RESTRICTION).1 > open);
    // The vent is choked until this valve is open: it feels what is behind it only when it closes again.
    let (close_s, open_s) = with(EffectKind::BACK_PRESSURE);
    assert!(close_s < close && open_s > open - EQUAL_S);
    assert!(with(EffectKind::SUPPLY_DROOP).0 > close);
}

/// The reference valve with some parameters and effects changed: a run of it must end in finite numbers.
fn survives(what: &str, effects: Vec<Effect>, change: impl FnOnce(&mut Parameters)) -> CycleTimes {
    let mut parameters = testbed();
    change(&mut parameters);
    let valve = match Valve::new(parameters, Switches::default(), effects, Vec::new()) {
        Ok(valve) => valve,
        Err(error) => panic!("{what}: {error}"),
    };
    let mut conditions = [Conditions::nominal(valve.parameters()); 3];
    conditions[1].leak_to_atmosphere_m2 = 0.4e-6;
    conditions[2].leak_from_supply_m2 = 0.15e-6;
    for conditions in conditions {
        let run = Run {
            conditions,
            commands: cycle_commands(&SCHEDULE),
            end_s: SCHEDULE.end_s,
            prescribed: None,
            start: Start::Rest,
        };
        simulate(&[Prepared::new(&valve, &run, DEFAULT_STEP_S)], true, |_, nodes, _| {
            let stroke = valve.parameters().stroke_m;
            let sane = |x: &f64| *x > -0.5 * stroke && *x < 1.5 * stroke;
            assert!(nodes.position_m.iter().all(sane), "{what}: the piston left its cylinder");
            let pressures = nodes.chamber_pressure_pa.iter().chain(&nodes.pipe_pressure_pa);
            let top = 3.0 * valve.parameters().supply_pressure_pa;
            assert!(pressures.into_iter().all(|p| *p > 0.0 && *p < top), "{what}: a pressure ran away");
        });
    }
    let coarse = cycles(&[(&valve, conditions[0])], &SCHEDULE, 1, DEFAULT_STEP_S)[0][0];
    let fine = cycles(&[(&valve, conditions[0])], &SCHEDULE, 1, 0.5 * DEFAULT_STEP_S)[0][0];
    for (a, b) in [(coarse.close_time_s, fine.close_time_s), (coarse.open_time_s, fine.open_time_s)] {
        let near = a.zip(b).map_or(a.is_none() && b.is_none(), |(a, b)| (a - b).abs() < 1e-3);
        assert!(near, "{what}: {coarse:?}, at half the step {fine:?}");
    }
    coarse
}

fn effect(kind: EffectKind, values: &[f64]) -> Vec<Effect> {
    let values: Vec<_> = values.iter().map(|value| Some(*value)).collect();
    vec![Effect::new(kind, &values).expect("possible values")]
}

#[test]
fn odd_parameters_do_not_blow_up() {
    let none = Vec::new;
    survives("tiny pipe", none(), |p| p.pipe_volume_m3 = 0.1e-6);
    survives("small dead volume", none(), |p| p.dead_volume_m3 = 4e-6);
    survives("tiny dead volume, hard stops", none(), |p| {
        (p.dead_volume_m3, p.contact_stiffness_n_per_m) = (0.5e-6, 1e9);
    });
    survives("hard stops", none(), |p| p.contact_stiffness_n_per_m = 1e9);
    survives("light piston", none(), |p| p.moving_mass_kg = 0.01);
    survives("heavy piston", none(), |p| p.moving_mass_kg = 200.0);
    survives("no viscous friction", none(), |p| p.viscous_friction_n_s_per_m = 0.0);
    survives("much viscous friction", none(), |p| p.viscous_friction_n_s_per_m = 2e5);
    survives("large port", none(), |p| p.port_orifice_area_m2 = 300e-6);
    survives("large solenoid", none(), |p| p.solenoid_orifice_area_m2 = 50e-6);
    survives("tiny port", none(), |p| p.port_orifice_area_m2 = 0.05e-6);
    survives("large leaks of a small valve", none(), |p| p.solenoid_orifice_area_m2 = 0.01e-6);
    survives("light gas", none(), |p| p.specific_gas_constant_j_per_kg_k = 2077.0);
}

#[test]
fn a_dead_volume_that_the_stop_gives_away_is_refused() {
    let mut parameters = testbed();
    parameters.dead_volume_m3 = 0.3e-6;
    let error = Valve::new(parameters, Switches::default(), Vec::new(), Vec::new()).expect_err("no room for gas");
    assert_eq!(error.key(), "actuator.dead_volume");
}

#[test]
fn strong_effects_do_not_blow_up() {
    let base = |_: &mut Parameters| {};
    survives("heavy cushion", effect(EffectKind::CLOSING_CUSHION, &[1e5, 4e-3]), base);
    survives("heavy opening cushion", effect(EffectKind::OPENING_CUSHION, &[1e5, 4e-3]), base);
    survives("heavy friction", effect(EffectKind::DRY_FRICTION, &[300.0, 500.0, 1e-3]), base);
    let held = survives("friction that holds", effect(EffectKind::DRY_FRICTION, &[3000.0]), base);
    assert_eq!(held.close_time_s, None);
    survives("steep seat", effect(EffectKind::SEAT_ADHESION, &[300.0, 1e-5]), base);
    survives("adiabatic", effect(EffectKind::GAS_HEATING, &[0.0]), base);
    survives("cold walls at once", effect(EffectKind::GAS_HEATING, &[1e4]), base);
    survives("tiny line", effect(EffectKind::SUPPLY_DROOP, &[1e9, 1e-7]), base);
    survives("softening spring", effect(EffectKind::PROGRESSIVE_SPRING, &[-0.5]), base);
    survives("strong process", effect(EffectKind::PROCESS_FORCE, &[500.0, 0.5]), base);
    survives("process that closes", effect(EffectKind::PROCESS_FORCE, &[-500.0, 6.0]), base);
}
