//! Friction: what its refinements do, and that the step follows bristles of any stiffness.

mod common;

use common::{close_at, effect, nodes_of, open_at, run_of, testbed, valve_of};
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::stroke::strokes;
use valve_model::{
    ChamberStart, Effect, EffectKind, Outcome, Parameters, Prepared, Run, Start, Trajectory, Valve, simulate,
};

fn rubbing(values: &[f64]) -> Valve {
    valve_of(testbed(), vec![effect(EffectKind::DRY_FRICTION, values)])
}

fn times_at(valve: &Valve, step_s: f64) -> [f64; 2] {
    let run = run_of(valve, vec![close_at(0.0), open_at(4.0)], 12.0);
    let mut found = [f64::NAN; 2];
    simulate(&[Prepared::new(valve, &run, step_s)], false, |_, nodes, _| {
        assert_eq!(nodes.outcome, Outcome::Complete);
        for (time, stroke) in found.iter_mut().zip(strokes(valve, &run.commands, nodes)) {
            *time = stroke.time_s.expect("gets there");
        }
    });
    found
}

fn times(valve: &Valve) -> [f64; 2] {
    times_at(valve, DEFAULT_STEP_S)
}

#[test]
fn refinements_at_their_defaults_change_nothing_bit_for_bit() {
    let plain = times(&rubbing(&[30.0, 45.0, 0.01]));
    assert_eq!(times(&rubbing(&[30.0, 45.0, 0.01, 2e5, 1.0, 0.0])), plain);
    let sealed = |values: &[f64]| times(&valve_of(testbed(), vec![effect(EffectKind::SEAL_FRICTION, values)]));
    assert_eq!(sealed(&[6e-5]), sealed(&[6e-5, 6e-5, 0.01, 2e5, 1.0]));
    for parameters in [EffectKind::DRY_FRICTION.parameters(), EffectKind::SEAL_FRICTION.parameters()] {
        for parameter in parameters.iter().filter(|parameter| parameter.is_refinement()) {
            let typical = (parameter.range)(&testbed()).typical;
            assert_eq!(parameter.default, valve_model::effects::DefaultValue::Value(typical), "{}", parameter.name);
        }
    }
}

#[test]
fn halving_the_step_changes_little_with_bristles_of_any_stiffness() {
    for stiffness in [2e4, 5e4, 2e5, 5e5, 2e6, 2e7] {
        for mass_kg in [0.1, 1.5] {
            let parameters = Parameters { moving_mass_kg: mass_kg, ..testbed() };
            let valve = valve_of(parameters, vec![effect(EffectKind::DRY_FRICTION, &[40.0, 60.0, 0.01, stiffness])]);
            let (whole, half) = (times_at(&valve, DEFAULT_STEP_S), times_at(&valve, 0.5 * DEFAULT_STEP_S));
            for (a, b) in whole.iter().zip(half) {
                assert!((a - b).abs() < 0.1e-3, "{stiffness:e} N/m, {mass_kg} kg: {a} s and {b} s");
            }
        }
    }
}

/// A piston held by friction on its way, pushed with a force below its friction: how far it gives, m.
fn give(valve: &Valve, push_n: f64) -> f64 {
    let p = valve.parameters();
    let position_m = 0.5 * p.stroke_m;
    let spring = p.spring_stiffness_n_per_m * (0.5 * p.stroke_m + p.preload_compression_m);
    let balanced = p.ambient_pressure_pa + (spring - 1.5 * 9.806_65) / p.piston_area_m2;
    let pressure = balanced - push_n / p.piston_area_m2;
    let prescribed = valve_model::prescribed::Prescribed {
        time_s: vec![0.0, 0.2, 2.0],
        chamber_pressure_pa: Some(vec![balanced, pressure, pressure]),
        ..Default::default()
    };
    let start =
        Start::Moving { position_m, velocity_m_per_s: 0.0, chamber: ChamberStart::BALANCE, pipe_pressure_pa: None };
    let run = Run { prescribed: Some(std::sync::Arc::new(prescribed)), start, ..run_of(valve, vec![], 2.0) };
    let nodes: Trajectory = nodes_of(valve, &run);
    nodes.position_m[nodes.position_m.len() - 1] - position_m
}

#[test]
fn a_held_piston_gives_as_its_bristles_and_its_spring_say() {
    for stiffness in [5e4, 2e5, 2e6] {
        let valve = rubbing(&[60.0, 60.0, 0.01, stiffness]);
        let (push, spring) = (10.0, testbed().spring_stiffness_n_per_m);
        // Near the middle of its range a bristle of z' = v (1 - s z/g) gives a little more than s alone.
        let stretch = -60.0 / stiffness * f64::ln(1.0 - push / 60.0);
        let expected = push / (push / stretch + spring);
        let found = give(&valve, push);
        assert!((found / expected - 1.0).abs() < 0.06, "{stiffness:e} N/m: {found:e} m, expected {expected:e} m");
    }
}

#[test]
fn an_opening_factor_takes_from_one_direction_what_it_adds_to_the_other() {
    // At a factor of 2, 45 N are 60 N while opening and 30 N while closing; at a half it is the other way round.
    for (factor, [closing, opening]) in [(2.0, [30.0, 60.0]), (0.5, [60.0, 30.0])] {
        let [closes, opens] = times(&rubbing(&[45.0, 45.0, 0.01, 2e5, factor, 0.0]));
        let ([close, _], [_, open]) = (times(&rubbing(&[closing])), times(&rubbing(&[opening])));
        // But for how the bristles stand when it begins.
        assert!((closes - close).abs() < 2e-3, "closing {closes} s and {close} s");
        assert!((opens - open).abs() < 2e-3, "opening {opens} s and {open} s");
        let [even_close, even_open] = times(&rubbing(&[45.0]));
        assert!((opens > even_open + 5e-3) == (factor > 1.0) && (closes > even_close + 5e-3) == (factor < 1.0));
    }
    let sealed = |values: &[f64]| times(&valve_of(testbed(), vec![effect(EffectKind::SEAL_FRICTION, values)]));
    let (uneven, even) = (sealed(&[6e-5, 6e-5, 0.01, 2e5, 3.0]), sealed(&[6e-5]));
    assert!(uneven[1] > even[1] + 5e-3 && uneven[0] < even[0] - 1e-3, "{uneven:?}, even {even:?}");
}

#[test]
fn a_slope_moves_the_friction_from_one_end_to_the_other() {
    let leaves = |slope: f64| {
        let valve = rubbing(&[60.0, 60.0, 0.01, 2e5, 1.0, slope]);
        let nodes = nodes_of(&valve, &run_of(&valve, vec![close_at(0.0), open_at(4.0)], 12.0));
        let first = |from: usize, past: &dyn Fn(f64) -> bool| {
            nodes.time_s[from + nodes.position_m[from..].iter().position(|x| past(*x)).expect("moves")]
        };
        let open = nodes.time_s.partition_point(|time| *time < 4.0);
        (first(0, &|x| x < 24e-3), first(open, &|x| x > 1e-3))
    };
    let (even, more_open, more_closed) = (leaves(0.0), leaves(1.0), leaves(-1.0));
    assert!(more_open.0 > even.0 + 1e-3 && more_closed.0 < even.0 - 1e-3, "closing leaves {even:?} {more_open:?}");
    assert!(more_open.1 < even.1 - 1e-3 && more_closed.1 > even.1 + 1e-3, "opening leaves {even:?} {more_closed:?}");
}

#[test]
fn refinements_out_of_their_domain_are_refused() {
    for (values, key) in [
        ([30.0, 45.0, 0.01, 0.0, 1.0, 0.0], "bristle_stiffness"),
        ([30.0, 45.0, 0.01, 2e5, -0.1, 0.0], "opening_factor"),
        ([30.0, 45.0, 0.01, 2e5, 1.0, 2.5], "position_slope"),
        ([30.0, 45.0, 0.01, 2e5, 1.0, f64::NAN], "position_slope"),
    ] {
        let error = Effect::new(EffectKind::DRY_FRICTION, &values.map(Some)).expect_err("impossible");
        assert!(error.key().ends_with(key), "{error}");
    }
}
