//! Runs that start anywhere continue as the run that they are a part of.

mod common;

use common::{at, close_at, effect, nodes_of, open_at, run_of, testbed, valve_of};
use valve_model::stroke::strokes;
use valve_model::{ChamberStart, Conditions, EffectKind, Outcome, Prepared, Run, RunError, Start, Trajectory, Valve};

/// A run of a part of another follows it within this, m.
const SAME_PATH_M: f64 = 20e-6;

/// A whole cycle, and a time at which its piston closes.
fn cycle(valve: &Valve) -> (Run, Trajectory) {
    let run = run_of(valve, vec![close_at(0.0), open_at(4.0)], 12.0);
    let nodes = nodes_of(valve, &run);
    (run, nodes)
}

/// The same run from a time of it on, started from what is known there.
fn rest_of(run: &Run, from_s: f64, start: Start) -> Run {
    let mut rest = Run { end_s: run.end_s - from_s, start, ..run.clone() };
    for command in &mut rest.commands {
        command.time_s -= from_s;
    }
    rest
}

/// Where the piston is at a time and how fast, with the pressures that are asked for.
fn moving(nodes: &Trajectory, time_s: f64, pressures: [bool; 2]) -> Start {
    // Substeps add up to a step but for rounding.
    let node = nodes.time_s.partition_point(|time| *time < time_s - 1e-9);
    Start::Moving {
        position_m: nodes.position_m[node],
        velocity_m_per_s: nodes.velocity_m_per_s[node],
        chamber: if pressures[0] {
            ChamberStart::Known(nodes.chamber_pressure_pa[node])
        } else {
            ChamberStart::BALANCE
        },
        pipe_pressure_pa: pressures[1].then_some(nodes.pipe_pressure_pa[node]),
    }
}

/// How far two paths are apart, the second starting `from_s` after the first, m.
fn apart(whole: &Trajectory, rest: &Trajectory, from_s: f64, until_s: f64) -> f64 {
    let times = (0..200).map(|i| f64::from(i) / 199.0 * (until_s - from_s));
    times.map(|time| (at(whole, from_s + time)[0] - at(rest, time)[0]).abs()).fold(0.0, f64::max)
}

#[test]
fn a_run_goes_on_from_any_state_of_it() {
    let cushioned = effect(EffectKind::CLOSING_CUSHION, &[2000.0, 4e-3]);
    let rubbing = effect(EffectKind::DRY_FRICTION, &[30.0, 45.0, 0.01]);
    for effects in [vec![], vec![cushioned], vec![rubbing]] {
        let valve = valve_of(testbed(), effects);
        let (run, whole) = cycle(&valve);
        for from_s in [0.8, 4.9] {
            let known = nodes_of(&valve, &rest_of(&run, from_s, moving(&whole, from_s, [true, true])));
            let off = apart(&whole, &known, from_s, 7.0);
            assert!(off < SAME_PATH_M, "{:?} from {from_s} s: {off:e} m", valve.effects());
        }
    }
}

#[test]
fn an_unknown_chamber_pressure_is_the_one_that_balances_the_piston() {
    let rubbing = effect(EffectKind::DRY_FRICTION, &[30.0, 45.0, 0.01]);
    let sealed = effect(EffectKind::SEAL_FRICTION, &[6e-5]);
    for effects in [vec![], vec![rubbing], vec![sealed]] {
        let valve = valve_of(testbed(), effects);
        let (run, whole) = cycle(&valve);
        for from_s in [0.8, 5.2] {
            let start = moving(&whole, from_s, [false, true]);
            let prepared = Prepared::new(&valve, &rest_of(&run, from_s, start.clone()), 1e-3);
            assert_eq!(prepared.check(), Ok(()));
            let guessed = nodes_of(&valve, &rest_of(&run, from_s, start));
            let (found, known) = (guessed.chamber_pressure_pa[0], at(&whole, from_s)[1]);
            // The piston's inertia is all that the balance leaves out: some newtons on 31 cm2.
            assert!((found - known).abs() < 1500.0, "{:?}: {found} Pa instead of {known} Pa", valve.effects());
            assert!(apart(&whole, &guessed, from_s, 7.0) < 0.1e-3, "{:?} from {from_s} s", valve.effects());
        }
    }
}

#[test]
fn without_any_pressure_the_pipe_passes_on_what_enters_it() {
    let valve = valve_of(testbed(), vec![]);
    let start = Start::Moving {
        position_m: 0.5 * 25.4e-3,
        velocity_m_per_s: 0.0,
        chamber: ChamberStart::BALANCE,
        pipe_pressure_pa: None,
    };
    let nodes = nodes_of(&valve, &Run { start, ..run_of(&valve, vec![], 0.2) });
    let weight = 1.5 * 9.806_65;
    let balanced = 101_325.0 + (16e3 * (0.5 * 25.4e-3 + 36e-3) - weight) / 31.17e-4;
    assert!((nodes.chamber_pressure_pa[0] - balanced).abs() < 1.0, "{} Pa", nodes.chamber_pressure_pa[0]);
    // At rest under this pressure the chamber empties through pipe and solenoid: a millisecond later no more has gathered.
    let (first, then) = (nodes.pipe_pressure_pa[0], at(&nodes, 0.002)[2]);
    assert!(first > 101_325.0 && first < balanced, "{first} Pa");
    assert!((then - first).abs() < 0.2 * (balanced - first), "{first} Pa, then {then} Pa");
    assert!(at(&nodes, 0.2)[0] > 0.5 * 25.4e-3, "vented, it opens");
}

#[test]
fn a_balance_that_no_pressure_gives_stays_within_the_pressures_there_are() {
    let valve = valve_of(testbed(), vec![]);
    for velocity_m_per_s in [-20.0, 20.0] {
        let start = Start::Moving {
            position_m: 0.01,
            velocity_m_per_s,
            chamber: ChamberStart::BALANCE,
            pipe_pressure_pa: None,
        };
        let nodes = nodes_of(&valve, &Run { start, ..run_of(&valve, vec![], 0.01) });
        let p = valve.parameters();
        let expected = if velocity_m_per_s < 0.0 { p.supply_pressure_pa } else { p.ambient_pressure_pa };
        assert!((nodes.chamber_pressure_pa[0] / expected - 1.0).abs() < 1e-12);
    }
}

#[test]
fn closed_and_filled_is_where_a_long_closing_ends() {
    let droop = effect(EffectKind::SUPPLY_DROOP, &[2e7]);
    for effects in [vec![], vec![droop]] {
        let valve = valve_of(testbed(), effects);
        for (out, into) in [(0.0, 0.0), (0.1e-6, 0.0), (0.05e-6, 0.02e-6)] {
            let conditions = Conditions {
                leak_to_atmosphere_m2: out,
                leak_from_supply_m2: into,
                ..Conditions::nominal(valve.parameters())
            };
            let long = Run { conditions, ..run_of(&valve, vec![close_at(0.0), open_at(30.0)], 36.0) };
            let whole = nodes_of(&valve, &long);
            let rest = Run { conditions, start: Start::ClosedRest, ..run_of(&valve, vec![open_at(0.5)], 6.5) };
            let filled = nodes_of(&valve, &rest);
            for (here, there) in at(&filled, 0.0).iter().zip(at(&whole, 29.9)) {
                assert!((here - there).abs() < 2e-5 * there.abs().max(1e-2), "{out:e} {into:e}: {here} and {there}");
            }
            assert!((at(&filled, 0.4)[0] - at(&filled, 0.0)[0]).abs() < 1e-9, "it stays there");
            assert!(apart(&whole, &filled, 29.5, 35.0) < SAME_PATH_M);
            let opened =
                |nodes: &Trajectory, run: &Run| strokes(&valve, &run.commands, nodes).last().and_then(|s| s.time_s);
            let (a, b) = (opened(&whole, &long).expect("opens"), opened(&filled, &rest).expect("opens"));
            assert!((a - b).abs() < 0.1e-3, "opens in {a} s and {b} s");
        }
    }
}

#[test]
fn a_stroke_commanded_before_the_run_counts_from_its_command() {
    let valve = valve_of(testbed(), vec![]);
    let (run, whole) = cycle(&valve);
    let part = rest_of(&run, 0.5, moving(&whole, 0.5, [true, true]));
    let nodes = nodes_of(&valve, &part);
    let (all, of_part) = (strokes(&valve, &run.commands, &whole), strokes(&valve, &part.commands, &nodes));
    let closing = of_part[0].time_s.zip(all[0].time_s).map(|(a, b)| (a - b).abs());
    assert!(closing.is_some_and(|off| off < 1e-5), "{of_part:?} and {all:?}");
    // Already there when the run starts: nobody saw when.
    let late = rest_of(&run, 3.0, Start::ClosedRest);
    assert_eq!(strokes(&valve, &late.commands, &nodes_of(&valve, &late))[0].time_s, None);
}

#[test]
fn an_open_valve_that_is_not_vented_yet_goes_on_from_its_pressure() {
    let valve = valve_of(testbed(), vec![]);
    let run = run_of(&valve, vec![close_at(0.0), open_at(4.0), close_at(7.2)], 12.0);
    let whole = nodes_of(&valve, &run);
    let stroke_m = valve.parameters().stroke_m;
    // On its open stop the chamber still holds most of a bar above the atmosphere.
    let node = (0..whole.time_s.len())
        .find(|node| {
            whole.time_s[*node] > 5.0
                && whole.position_m[*node] >= stroke_m
                && whole.chamber_pressure_pa[*node] < valve.parameters().ambient_pressure_pa + 8e4
        })
        .expect("it opens");
    let (from_s, pressure_pa) = (whole.time_s[node], whole.chamber_pressure_pa[node]);
    assert!(from_s < 7.0, "{from_s}");
    let part = nodes_of(&valve, &rest_of(&run, from_s, Start::Venting { pressure_pa }));
    let vented = nodes_of(&valve, &rest_of(&run, from_s, Start::Rest));
    let (off, of_rest) = (apart(&whole, &part, from_s, 9.0), apart(&whole, &vented, from_s, 9.0));
    assert!(off < 1e-4 && of_rest > 10.0 * off, "{off:e} m, from rest {of_rest:e} m, at {from_s} s");
}

#[test]
fn a_start_that_cannot_be_is_refused() {
    let valve = valve_of(testbed(), vec![]);
    let vacuum = Run { start: Start::Venting { pressure_pa: 0.0 }, ..run_of(&valve, vec![], 1.0) };
    assert!(matches!(Prepared::new(&valve, &vacuum, 1e-3).check(), Err(RunError::Start(_))));
    let balance = ChamberStart::BALANCE;
    for (position_m, velocity_m_per_s, chamber) in [
        (f64::NAN, 0.0, balance),
        (1.0, 0.0, balance),
        (0.01, f64::INFINITY, balance),
        (0.01, 0.0, ChamberStart::Known(-1.0)),
        (0.01, 0.0, ChamberStart::Balance { beyond_pa: f64::NAN }),
    ] {
        let start = Start::Moving { position_m, velocity_m_per_s, chamber, pipe_pressure_pa: None };
        let run = Run { start, ..run_of(&valve, vec![], 1.0) };
        let refused = Prepared::new(&valve, &run, 1e-3);
        assert!(matches!(refused.check(), Err(RunError::Start(_))), "{run:?}");
        let nodes = nodes_of(&valve, &run);
        assert_eq!((nodes.outcome, nodes.time_s.len()), (Outcome::Refused, 1));
    }
}

#[test]
fn a_piston_that_rubs_is_held_in_balance_with_its_friction() {
    let rubbing = effect(EffectKind::DRY_FRICTION, &[30.0, 45.0, 0.01]);
    let area_m2 = testbed().piston_area_m2;
    let pressure = |effects: Vec<_>, velocity_m_per_s: f64, beyond_pa: f64| {
        let valve = valve_of(testbed(), effects);
        let chamber = ChamberStart::Balance { beyond_pa };
        let start = Start::Moving { position_m: 0.01, velocity_m_per_s, chamber, pipe_pressure_pa: None };
        nodes_of(&valve, &Run { start, ..run_of(&valve, vec![], 0.01) }).chamber_pressure_pa[0]
    };
    // Far above the Stribeck velocity the Coulomb force alone is left.
    for way in [-1.0, 1.0] {
        let more = pressure(vec![rubbing], 0.1 * way, 0.0) - pressure(vec![], 0.1 * way, 0.0);
        assert!((more + way * 30.0 / area_m2).abs() < 1.0, "{more} Pa");
    }
    let beyond = pressure(vec![], 0.1, 500.0) - pressure(vec![], 0.1, 0.0);
    assert!((beyond - 500.0).abs() < 1e-6, "{beyond} Pa");
}
