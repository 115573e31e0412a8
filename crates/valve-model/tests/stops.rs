//! Stops with a damping of their own.

mod common;

use std::sync::Arc;

use common::{close_at, effect, nodes_of, open_at, run_of, testbed, valve_of};
use valve_model::prescribed::Prescribed;
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::stroke::strokes;
use valve_model::{ChamberStart, EffectKind, Outcome, Parameters, Prepared, Run, Start, Trajectory, Valve, simulate};

fn damped(damping: f64) -> Valve {
    // A light piston without friction hits its stops hard.
    valve_of(Parameters { viscous_friction_n_s_per_m: 20.0, stop_damping_n_s_per_m: damping, ..testbed() }, vec![])
}

fn cycle(valve: &Valve) -> Trajectory {
    nodes_of(valve, &run_of(valve, vec![close_at(0.0), open_at(4.0)], 12.0))
}

/// How often the piston leaves the closed stop again after it first met it, and how far, m.
fn bounces(nodes: &Trajectory) -> (usize, f64) {
    let until = nodes.time_s.partition_point(|time| *time < 3.9);
    let met = nodes.position_m.iter().position(|x| *x <= 0.0).expect("closes");
    let after = &nodes.position_m[met..until];
    let count = after.windows(2).filter(|pair| pair[0] <= 0.0 && pair[1] > 0.0).count();
    (count, after.iter().copied().fold(0.0, f64::max))
}

#[test]
fn damping_stills_the_rebound() {
    let (bare, some, much) =
        (bounces(&cycle(&damped(0.0))), bounces(&cycle(&damped(400.0))), bounces(&cycle(&damped(2500.0))));
    assert!(bare.0 > some.0 && some.1 < 0.8 * bare.1, "{bare:?} {some:?}");
    assert!(much.1 < 0.2 * bare.1, "{bare:?} {much:?}");
}

#[test]
fn a_rebound_does_not_depend_on_where_in_a_step_the_piston_hits() {
    // A piston is thrown against the closed stop from places so close together that nothing else changes.
    let valve = damped(1500.0);
    let p = valve.parameters();
    // Less pressure than would hold it on the stop.
    let spring_n = p.spring_stiffness_n_per_m * (p.stroke_m + p.preload_compression_m);
    let pressure_pa = p.ambient_pressure_pa + 0.9 * spring_n / p.piston_area_m2;
    let still = Prescribed {
        time_s: vec![0.0, 0.1],
        pipe_pressure_pa: Some(vec![pressure_pa; 2]),
        chamber_pressure_pa: Some(vec![pressure_pa; 2]),
        supply_pressure_pa: None,
    };
    let rebounds: Vec<f64> = (0..20)
        .map(|place| {
            let start = Start::Moving {
                position_m: 0.003 + 2e-5 * f64::from(place),
                velocity_m_per_s: -1.5,
                chamber: ChamberStart::BALANCE,
                pipe_pressure_pa: None,
            };
            let run = Run { prescribed: Some(Arc::new(still.clone())), start, ..run_of(&valve, vec![], 0.1) };
            let nodes = nodes_of(&valve, &run);
            let met = nodes.position_m.iter().position(|x| *x <= 0.0).expect("meets the stop");
            let speed = |at: usize| {
                (nodes.position_m[at + 1] - nodes.position_m[at]) / (nodes.time_s[at + 1] - nodes.time_s[at])
            };
            let left = met + nodes.position_m[met..].iter().position(|x| *x > 0.0).expect("leaves it again");
            -speed(left) / speed(met - 2)
        })
        .collect();
    let (least, most) = rebounds.iter().fold((f64::INFINITY, 0.0), |(a, b), x| (f64::min(a, *x), f64::max(b, *x)));
    assert!(most / least < 1.02, "{rebounds:?} of the speed");
}

#[test]
fn the_stroke_up_to_the_stop_and_where_it_rests_do_not_change() {
    let (bare, damped) = (damped(0.0), damped(1500.0));
    let (a, b) = (cycle(&bare), cycle(&damped));
    let commands = [close_at(0.0), open_at(4.0)];
    for (a, b) in strokes(&bare, &commands, &a).iter().zip(strokes(&damped, &commands, &b)) {
        let off = a.time_s.zip(b.time_s).map(|(a, b)| (a - b).abs());
        assert!(off.is_some_and(|off| off < 0.1e-3), "{a:?} {b:?}");
    }
    let end = |nodes: &Trajectory| *nodes.position_m.last().expect("nodes");
    assert!((end(&a) - end(&b)).abs() < 1e-9);
}

#[test]
fn a_stop_never_holds_the_piston_back() {
    // With any damping the piston leaves the closed stop when the pressure lets it, not later.
    let leaves = |damping: f64| {
        let nodes = cycle(&damped(damping));
        let open = nodes.time_s.partition_point(|time| *time < 4.0);
        nodes.time_s[open + nodes.position_m[open..].iter().position(|x| *x > 1e-4).expect("opens")]
    };
    assert!((leaves(0.0) - leaves(1e4)).abs() < 2e-3);
}

#[test]
fn halving_the_step_changes_little_and_nothing_runs_away() {
    let rubbing = effect(EffectKind::DRY_FRICTION, &[30.0, 45.0, 0.01]);
    for (damping, mass_kg) in [(100.0, 1.5), (1000.0, 1.5), (1e4, 1.5), (1e6, 1.5), (100.0, 0.05), (1e4, 0.05)] {
        for effects in [vec![], vec![rubbing]] {
            let parameters = Parameters { moving_mass_kg: mass_kg, ..damped(damping).parameters().clone() };
            let valve = valve_of(parameters, effects);
            let run = run_of(&valve, vec![close_at(0.0), open_at(4.0)], 12.0);
            let times = |step_s: f64| {
                let mut found = Vec::new();
                simulate(&[Prepared::new(&valve, &run, step_s)], false, |_, nodes, _| {
                    assert_eq!(nodes.outcome, Outcome::Complete);
                    let stroke = valve.parameters().stroke_m;
                    let inside = nodes.position_m.iter().position(|x| !(-0.1 * stroke..1.1 * stroke).contains(x));
                    assert_eq!(inside, None, "{damping} N s/m, {:?}: left at node", valve.effects());
                    found = strokes(&valve, &run.commands, nodes).iter().map(|s| s.time_s.expect("reached")).collect();
                });
                found
            };
            for (a, b) in times(DEFAULT_STEP_S).iter().zip(times(0.5 * DEFAULT_STEP_S)) {
                assert!((a - b).abs() < 0.1e-3, "{damping} N s/m: {a} s and {b} s");
            }
        }
    }
}
