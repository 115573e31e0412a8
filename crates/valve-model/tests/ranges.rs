//! The ranges of the effects on valves of every kind: a typical size shows, and lets the valve work.

mod common;

use common::{close_at, nodes_of, open_at, run_of, testbed, valve_of};
use valve_model::effects::DefaultValue;
use valve_model::stroke::strokes;
use valve_model::{Effect, EffectKind, Orientation, Outcome, Parameters, Valve};

/// A needle valve with a stroke of 4 mm.
fn needle() -> Parameters {
    Parameters {
        moving_mass_kg: 0.05,
        stroke_m: 4e-3,
        piston_area_m2: 3e-4,
        dead_volume_m3: 0.5e-6,
        viscous_friction_n_s_per_m: 15.0,
        spring_stiffness_n_per_m: 8e3,
        preload_compression_m: 6e-3,
        supply_pressure_pa: 7e5,
        pipe_volume_m3: 2e-6,
        solenoid_orifice_area_m2: 1e-6,
        port_orifice_area_m2: 2e-6,
        ..testbed()
    }
}

/// A gate with a stroke of 300 mm.
fn gate() -> Parameters {
    Parameters {
        moving_mass_kg: 60.0,
        stroke_m: 0.3,
        piston_area_m2: 0.05,
        dead_volume_m3: 1e-3,
        viscous_friction_n_s_per_m: 5e3,
        spring_stiffness_n_per_m: 25e3,
        preload_compression_m: 0.25,
        contact_stiffness_n_per_m: 1e7,
        pipe_volume_m3: 0.5e-3,
        solenoid_orifice_area_m2: 60e-6,
        port_orifice_area_m2: 90e-6,
        ..testbed()
    }
}

/// The gate behind an orifice with which a stroke takes many seconds.
fn slow() -> Parameters {
    Parameters { solenoid_orifice_area_m2: 10e-6, ..gate() }
}

/// A vertical cylinder without a spring: 45 psig on 8 cm² lift it, it falls by its weight of 12 N.
fn springless() -> Parameters {
    Parameters {
        moving_mass_kg: 1.2,
        stroke_m: 80e-3,
        piston_area_m2: 8.04e-4,
        dead_volume_m3: 8e-6,
        viscous_friction_n_s_per_m: 20.0,
        spring_stiffness_n_per_m: 0.0,
        preload_compression_m: 0.0,
        supply_pressure_pa: 45.0 * 6894.757 + 101_325.0,
        pipe_volume_m3: 15e-6,
        solenoid_orifice_area_m2: 1.744e-6,
        port_orifice_area_m2: 1.047e-6,
        orientation: Orientation::Inverted,
        ..testbed()
    }
}

fn valves() -> Vec<(&'static str, Parameters, f64)> {
    vec![
        ("test bed", testbed(), 6.0),
        ("needle", needle(), 1.0),
        ("gate", gate(), 30.0),
        ("slow gate", slow(), 60.0),
        ("springless", springless(), 3.0),
    ]
}

fn typical(kind: EffectKind, parameters: &Parameters) -> Effect {
    let values: Vec<_> = kind.parameters().iter().map(|p| Some((p.range)(parameters).typical)).collect();
    Effect::new(kind, &values).expect("typical values are possible")
}

/// Closing and opening time, s, each with so much time for it.
fn times(valve: &Valve, stroke_s: f64) -> Option<[f64; 2]> {
    let run = run_of(valve, vec![close_at(0.0), open_at(stroke_s)], 3.0 * stroke_s);
    let nodes = nodes_of(valve, &run);
    assert_eq!(nodes.outcome, Outcome::Complete);
    let found = strokes(valve, &run.commands, &nodes);
    Some([found[0].time_s?, found[1].time_s?])
}

#[test]
fn every_range_holds_its_typical_value_and_its_default() {
    for (name, parameters, _) in valves() {
        for &kind in EffectKind::ALL {
            for parameter in kind.parameters() {
                let range = (parameter.range)(&parameters);
                let what = format!("{name}, {}.{}: {range:?}", kind.id(), parameter.name);
                assert!(range.lower <= range.typical && range.typical < range.upper, "{what}");
                assert!(range.lower.is_finite() && range.upper.is_finite(), "{what}");
                if let (true, DefaultValue::Value(default)) = (parameter.is_refinement(), parameter.default) {
                    assert!(range.lower < default && default < range.upper, "{what}");
                }
            }
        }
    }
}

#[test]
fn with_any_effect_at_its_typical_size_every_valve_works_and_feels_it() {
    for (name, parameters, stroke_s) in valves() {
        let healthy = times(&valve_of(parameters.clone(), vec![]), stroke_s);
        let healthy = healthy.unwrap_or_else(|| panic!("{name}: gets there"));
        for &kind in EffectKind::ALL.iter().filter(|kind| !kind.info().acts_on.is_measurement()) {
            let effect = typical(kind, &parameters);
            let found = times(&valve_of(parameters.clone(), vec![effect]), stroke_s);
            let found = found.unwrap_or_else(|| panic!("{name}: sticks with {effect:?}"));
            let felt: f64 = found.iter().zip(healthy).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
            // A progressive spring needs a spring.
            if !(kind == EffectKind::PROGRESSIVE_SPRING && parameters.spring_stiffness_n_per_m == 0.0) {
                assert!(felt > 1e-4, "{name}: does not feel {effect:?}");
            }
            assert!(felt < 3.0, "{name}: {effect:?} is more than an effect");
        }
    }
}

#[test]
fn on_the_test_bed_the_typical_sizes_are_those_of_its_literature() {
    // Shares of the spring force, 982 N; of the viscous friction; delays; heat of a stroke's gas per second.
    let expected = [
        (EffectKind::DRY_FRICTION, 29.5),
        (EffectKind::CLOSING_CUSHION, 1800.0),
        (EffectKind::SEAT_ADHESION, 49.1),
        (EffectKind::PROCESS_FORCE, 58.9),
        (EffectKind::GAS_HEATING, 0.5),
        (EffectKind::BACK_PRESSURE, 7757.0),
        (EffectKind::SOLENOID_LAG, 0.02),
        (EffectKind::SENSOR_LAG, 0.015),
    ];
    for (kind, expected) in expected {
        let found = typical(kind, &testbed()).values()[0];
        assert!((found / expected - 1.0).abs() < 0.01, "{}: {found}", kind.id());
    }
}

#[test]
fn a_cylinder_without_a_spring_rests_where_its_weight_leaves_it() {
    for (orientation, at_open) in [(Orientation::Inverted, true), (Orientation::Upright, false)] {
        let valve = valve_of(Parameters { orientation, ..springless() }, vec![]);
        let nodes = nodes_of(&valve, &run_of(&valve, vec![], 1.0));
        let (first, last) = (nodes.position_m[0], nodes.position_m[nodes.position_m.len() - 1]);
        let depth = 1.2 * 9.806_65 / 1e6;
        let expected = if at_open { 80e-3 + depth } else { -depth };
        assert!((first - expected).abs() < 1e-9 && (last - expected).abs() < 1e-9, "{first} m, {last} m");
    }
    // Nothing moves one that lies.
    let valve = valve_of(Parameters { orientation: Orientation::Horizontal, ..springless() }, vec![]);
    let nodes = nodes_of(&valve, &run_of(&valve, vec![], 1.0));
    assert!(nodes.position_m.iter().all(|x| (x - nodes.position_m[0]).abs() < 1e-9));
}

#[test]
fn friction_on_a_cylinder_without_a_spring_is_a_share_of_its_weight() {
    let found = typical(EffectKind::DRY_FRICTION, &springless()).values()[0];
    assert!((2.0..10.0).contains(&found), "{found} N beside a weight of 11.8 N");
    let range = (EffectKind::DRY_FRICTION.parameters()[0].range)(&springless());
    assert!(range.upper > 100.0, "{range:?}");
}
