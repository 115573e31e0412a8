//! The base model against a converged solution, and against an independent program.

mod reference_valve;

use leak_table::Fault;
use reference_valve::plain::{Plain, TIGHT_BLEND};
use reference_valve::{CYCLE, base_valve, first_cycle, leaking, periodic, spread, testbed};
use valve_model::cycle::CycleTimes;
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{CommandEdge, Conditions, Prepared, Run, Schedule, Start, simulate};

/// Largest error of a stroke time, s.
const TIMING_S: f64 = 0.1e-3;
/// The same for strokes longer than [`LONG_STROKE_S`]: close to the leak that stalls the valve, a
/// stroke time answers to the smallest error with a large one.
const LONG_TIMING_S: f64 = 1e-3;
const LONG_STROKE_S: f64 = 6.0;
/// Largest error of a position, m.
const POSITION_M: f64 = 0.01e-3;
/// Largest error of a pressure, Pa: where it closes in on the supply's, the blend of the orifice law
/// bends its last part in a thousand.
const PRESSURE_PA: f64 = 250.0;

fn tolerance_s(time_s: f64) -> f64 {
    if time_s > LONG_STROKE_S { LONG_TIMING_S } else { TIMING_S }
}

/// Rows of numbers below the comments and the header; an empty field is none.
fn rows(text: &str) -> Vec<Vec<Option<f64>>> {
    let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    lines.map(|line| line.split(',').map(|field| field.parse().ok()).collect()).collect()
}

/// Each row of a leak sweep with what the model gives at some step.
fn leak_sweep(text: &str, fault: Fault, step_s: f64) -> Vec<(Vec<Option<f64>>, CycleTimes)> {
    let valve = base_valve(testbed());
    let rows = rows(text);
    let areas = rows.iter().map(|row| row[0].expect("every row has an area") * 1e-6);
    let runs: Vec<_> = areas.map(|area_m2| (&valve, leaking(&valve, fault, area_m2))).collect();
    let times = periodic(&runs, &CYCLE, step_s);
    rows.into_iter().zip(times).collect()
}

const LEAKS: [(&str, Fault); 2] = [
    (include_str!("data/reference/leak-to-atmosphere.csv"), Fault::Atmosphere),
    (include_str!("data/reference/leak-from-supply.csv"), Fault::Supply),
];

#[track_caller]
fn assert_time(what: &str, expected: Option<f64>, found: Option<f64>, share: f64) {
    match (expected, found) {
        (None, None) => {}
        (Some(expected), Some(found)) => {
            let error = (found - expected).abs();
            assert!(error <= share * tolerance_s(expected), "{what}: {found} s, expected {expected} s");
        }
        _ => panic!("{what}: {found:?}, expected {expected:?}"),
    }
}

#[test]
fn the_nominal_cycle() {
    let valve = base_valve(testbed());
    let times = first_cycle(&valve, Conditions::nominal(valve.parameters()), &CYCLE);
    assert_time("closing", Some(1.042_194_6), times.close_time_s, 1.0);
    assert_time("opening", Some(2.134_358_7), times.open_time_s, 1.0);
}

#[test]
fn stroke_times_over_both_leaks() {
    for (text, fault) in LEAKS {
        let sweep = leak_sweep(text, fault, DEFAULT_STEP_S);
        assert_eq!(sweep.len(), 45);
        for (row, times) in sweep {
            let area = row[0];
            assert_time(&format!("{fault} {area:?} mm2, closing"), row[1], times.close_time_s, 1.0);
            assert_time(&format!("{fault} {area:?} mm2, opening"), row[2], times.open_time_s, 1.0);
        }
    }
}

#[test]
fn halving_the_step_changes_little() {
    for (text, fault) in LEAKS {
        let whole = leak_sweep(text, fault, DEFAULT_STEP_S);
        let half = leak_sweep(text, fault, 0.5 * DEFAULT_STEP_S);
        for ((row, whole), (_, half)) in whole.into_iter().zip(half) {
            let area = row[0];
            assert_time(&format!("{fault} {area:?} mm2, closing"), half.close_time_s, whole.close_time_s, 0.5);
            assert_time(&format!("{fault} {area:?} mm2, opening"), half.open_time_s, whole.open_time_s, 0.5);
        }
    }
}

#[test]
fn stroke_times_over_the_supply_pressure() {
    let valve = base_valve(testbed());
    let schedule = Schedule { close_at_s: 0.0, open_at_s: 6.0, end_s: 12.0 };
    for row in rows(include_str!("data/reference/supply-pressure.csv")) {
        let psig = row[0].expect("every row has a pressure");
        let mut conditions = Conditions::nominal(valve.parameters());
        conditions.supply_pressure_pa = psig * 6894.757 + valve.parameters().ambient_pressure_pa;
        let times = first_cycle(&valve, conditions, &schedule);
        assert_time(&format!("{psig} psig, closing"), row[1], times.close_time_s, 1.0);
        assert_time(&format!("{psig} psig, opening"), row[2], times.open_time_s, 1.0);
    }
}

#[test]
fn the_trace() {
    let valve = base_valve(testbed());
    let run = Run {
        conditions: Conditions::nominal(valve.parameters()),
        commands: vec![CommandEdge::new(0.0, true), CommandEdge::new(4.0, false)],
        end_s: 9.0,
        prescribed: None,
        start: Start::Rest,
    };
    let expected = rows(include_str!("data/reference/trace.csv"));
    let column = |index: usize| -> Vec<f64> { expected.iter().map(|row| row[index].expect("complete")).collect() };
    let times = column(0);
    simulate(&[Prepared::new(&valve, &run, DEFAULT_STEP_S)], true, |_, nodes, _| {
        let (mut position, mut chamber, mut pipe) = (Vec::new(), Vec::new(), Vec::new());
        nodes.positions_at(&times, &mut position);
        nodes.pressures_at(&nodes.chamber_pressure_pa, &times, &mut chamber);
        nodes.pressures_at(&nodes.pipe_pressure_pa, &times, &mut pipe);
        for (found, expected, tolerance, what) in [
            (position, column(2), POSITION_M, "position"),
            (chamber, column(3), PRESSURE_PA, "chamber pressure"),
            (pipe, column(4), PRESSURE_PA, "pipe pressure"),
        ] {
            for ((found, expected), time) in found.iter().zip(expected).zip(&times) {
                assert!((found - expected).abs() < tolerance, "{what} at {time} s: {found}, expected {expected}");
            }
        }
    });
}

#[test]
fn other_valves_against_a_plain_program_with_a_tight_step() {
    for seed in [0.11, 0.37, 0.61, 0.83] {
        let mut parameters = testbed();
        let mut factor = spread(8, seed).map(|u| 0.7 + 0.6 * u);
        let mut vary = |value: &mut f64| *value *= factor.next().expect("as many as are varied");
        vary(&mut parameters.moving_mass_kg);
        vary(&mut parameters.viscous_friction_n_s_per_m);
        vary(&mut parameters.spring_stiffness_n_per_m);
        vary(&mut parameters.dead_volume_m3);
        vary(&mut parameters.pipe_volume_m3);
        vary(&mut parameters.port_orifice_area_m2);
        vary(&mut parameters.solenoid_orifice_area_m2);
        vary(&mut parameters.piston_area_m2);
        let valve = base_valve(parameters);
        let conditions = Conditions::nominal(valve.parameters());
        let schedule = Schedule { close_at_s: 0.0, open_at_s: 5.0, end_s: 11.0 };
        let found = first_cycle(&valve, conditions, &schedule);
        let [close, open] = Plain::new(valve.parameters(), &conditions, TIGHT_BLEND).cycle(&schedule, 2e-5);
        assert_time(&format!("valve {seed}, closing"), close, found.close_time_s, 1.0);
        assert_time(&format!("valve {seed}, opening"), open, found.open_time_s, 1.0);
    }
}
