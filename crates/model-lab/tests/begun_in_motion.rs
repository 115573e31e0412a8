//! Records that begin while the valve is on its way: where it is then comes from a sensor that may be off.

mod recorded;

use campaign::{Campaign, CommandEdge};
use identify::{Difference, Problem, Request, Stop};
use model_lab::Dataset;
use model_lab::compare::Comparison;
use model_lab::diagnosis::{DiagnoseOptions, Verdict, explain};
use model_lab::identification::{Nuisance, NuisanceSizes, Subject};
use recorded::{Noise, Off, campaign, commanded, from_s};
use valve_file::ValveFile;
use valve_model::{Effect, EffectKind, Valve};

const SUPPLIES_PA: [f64; 4] = [4.8e5, 5.6e5, 6.4e5, 7.2e5];

/// Two cycles; the record begins while the first one opens, and ends when the second has opened.
const COMMANDS: [(f64, bool); 4] = [(0.2, true), (3.5, false), (6.2, true), (9.5, false)];
const END_S: f64 = 13.0;
const BEGIN_S: f64 = 4.6;

fn testbed() -> ValveFile {
    ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve")
}

fn campaign_of(valve: &Valve, off: &Off) -> Campaign {
    let mut noise = Noise(11);
    let run = |supply_pa| from_s(commanded(valve, supply_pa, (&COMMANDS, END_S), off, &mut noise), BEGIN_S);
    campaign(SUPPLIES_PA.map(run).into())
}

#[test]
fn what_the_sensor_is_off_by_moves_the_beginning_that_is_read_off_it() {
    of_the_sensor(&testbed());
}

#[test]
fn so_it_does_where_the_sensor_is_slow() {
    let slow = Effect::new(EffectKind::SENSOR_LAG, &[Some(0.3)]).expect("possible");
    of_the_sensor(&testbed().with_effect(&slow).expect("possible"));
}

/// The derivatives of what a record shows with respect to what the sensor of a valve is off by.
fn of_the_sensor(file: &ValveFile) {
    let campaign = campaign_of(file.valve(), &Off { gain: 0.01, ..Off::default() });
    let subject = Subject::new(file, &campaign, &NuisanceSizes::default(), Stop::never());
    let model = subject.stated(Stop::never()).expect("it strokes");
    let problem = &model.problem;
    let mut u: Vec<f64> = problem.coordinates().iter().map(|coordinate| coordinate.mean).collect();
    // Anywhere but where everything is right.
    let of = |which| problem.place_of(which).expect("is a nuisance");
    for (which, value) in [(Nuisance::Gain, 0.7), (Nuisance::Zero(0), -0.4), (Nuisance::Linearity(1), 0.5)] {
        u[of(which)] = value;
    }
    let steps = vec![Difference { ahead: 1e-3, back: 0.0 }; u.len()];
    let linear = problem.linearise(&u, &steps).expect("it strokes");
    for which in [Nuisance::Gain, Nuisance::Zero(0), Nuisance::Linearity(1), Nuisance::Linearity(2)] {
        let place = of(which);
        let (_, column) = linear[0].columns.iter().find(|(coordinate, _)| *coordinate == place).expect("moves");
        let aside = |by: f64| {
            let mut aside = u.clone();
            aside[place] += by;
            aside
        };
        let step = 0.02;
        let requests = [0, 1].map(|point| Request { point, record: 0 });
        let rows = problem.predict(&[aside(step), aside(-step)], &requests);
        let [up, down] = [0, 1].map(|point| rows[point].as_ref().expect("it strokes"));
        let size = column.iter().fold(0.0, |most: f64, one| most.max(one.abs()));
        for (row, derivative) in column.iter().enumerate() {
            let expected = (up[row] - down[row]) / (2.0 * step);
            assert!((derivative - expected).abs() < 0.05 * size, "{which:?}, row {row}: {derivative} for {expected}");
        }
    }
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn a_gain_of_the_sensor_is_no_clock() {
    let file = testbed();
    let campaign = campaign_of(file.valve(), &Off { gain: 0.012, zero_m: 5e-5, ..Off::default() });
    let options = DiagnoseOptions {
        effects: [EffectKind::CLOCK_OFFSET, EffectKind::SOLENOID_LAG, EffectKind::SENSOR_LAG].into(),
        ..DiagnoseOptions::default()
    };
    let found = explain(&file, &campaign, &options, &|_| (), Stop::never()).expect("it strokes");
    assert_eq!((found.verdict, found.recommended), (Verdict::Adequate, Vec::new()));
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn a_slow_sensor_is_found_with_its_size() {
    let file = testbed();
    let lag_s = 0.06;
    let hidden = Effect::new(EffectKind::SENSOR_LAG, &[Some(lag_s)]).expect("possible");
    let parameters = file.valve().parameters().clone();
    let valve = Valve::new(parameters, file.valve().switches(), vec![hidden], Vec::new()).expect("possible");
    let options = DiagnoseOptions {
        effects: [EffectKind::CLOCK_OFFSET, EffectKind::SOLENOID_LAG, EffectKind::SENSOR_LAG].into(),
        ..DiagnoseOptions::default()
    };
    let found =
        explain(&file, &campaign_of(&valve, &Off::default()), &options, &|_| (), Stop::never()).expect("it strokes");
    assert_eq!(found.recommended, [EffectKind::SENSOR_LAG]);
    let size = &found.parameters[0];
    assert!((size.value / lag_s - 1.0).abs() < 0.1, "{size:?}");
}

#[test]
fn where_some_records_begin_after_their_command_none_is_taken_for_one_that_it_started() {
    let file = testbed();
    // Slower than its file says: of the first record the best time before it is none.
    let mut parameters = file.valve().parameters().clone();
    parameters.solenoid_orifice_area_m2 *= 0.93;
    let valve = Valve::new(parameters, file.valve().switches(), Vec::new(), Vec::new()).expect("possible");
    let mut noise = Noise(12);
    let after_s = [0.01, 0.2, 0.15, 0.15];
    let runs = SUPPLIES_PA.iter().zip(after_s).map(|(supply_pa, after_s)| {
        let run = commanded(&valve, *supply_pa, (&COMMANDS, END_S), &Off::default(), &mut noise);
        let mut run = from_s(run, COMMANDS[0].0 + after_s);
        run.commands.insert(0, CommandEdge { time_s: 0.0, close: true });
        run
    });
    let campaign = campaign(runs.collect());
    let subject = Subject::new(&file, &campaign, &NuisanceSizes::default(), Stop::never());
    let model = subject.stated(Stop::never()).expect("it strokes");
    // Each run holds two cycles.
    for run in 0..after_s.len() {
        let place = model.problem.place_of(Nuisance::UnseenEdge(2 * run));
        assert!(place.is_some(), "run {run} is simulated from rest at its first row");
    }
}

#[test]
fn a_leap_at_the_seat_does_not_make_the_whole_stroke_a_quick_one() {
    // It sticks to its seat, and opens by a leap that is over in a small part of a stroke.
    let stuck = Effect::new(EffectKind::SEAT_ADHESION, &[Some(600.0), Some(2e-3)]).expect("possible");
    let file = testbed().with_effect(&stuck).expect("possible");
    let valve = file.valve();
    let mut noise = Noise(13);
    let after_s = [0.6, 0.75, 0.7, 0.65];
    let runs = SUPPLIES_PA.iter().zip(after_s).map(|(supply_pa, after_s)| {
        let run = commanded(valve, *supply_pa, (&COMMANDS, END_S), &Off::default(), &mut noise);
        let mut run = from_s(run, COMMANDS[0].0 + after_s);
        run.commands.insert(0, CommandEdge { time_s: 0.0, close: true });
        run
    });
    let campaign = campaign(runs.collect());
    let subject = Subject::new(&file, &campaign, &NuisanceSizes::default(), Stop::never());
    let setup = subject.setup(identify::select::Level::High);
    assert!(setup.whole_travel_s > 5.0 * setup.travel_s, "{} and {} s", setup.whole_travel_s, setup.travel_s);
    let model = subject.stated(Stop::never()).expect("it strokes");
    for (run, after_s) in after_s.into_iter().enumerate() {
        let place = model.problem.place_of(Nuisance::UnseenEdge(2 * run)).expect("its command was given before it");
        let found_s = setup.whole_travel_s * model.fit.u[place];
        assert!((found_s - after_s).abs() < 0.02, "run {run}: {found_s} s for {after_s} s");
    }
}

#[test]
fn a_comparison_shows_a_model_that_begins_where_its_record_does() {
    let file = testbed();
    let campaign = campaign_of(file.valve(), &Off::default());
    let subject = Subject::new(&file, &campaign, &NuisanceSizes::default(), Stop::never());
    let data = Dataset::new(&campaign, file.schedule());
    let comparison = Comparison::new(&subject, file.valve(), &data).expect("it strokes");
    for (run, compared) in data.runs.iter().zip(&comparison.runs) {
        let simulated_m = &compared.predicted.position_m;
        let apart_m =
            simulated_m.iter().zip(&run.channels[0].samples).map(|(simulated, measured)| simulated - measured);
        let most_m = apart_m.fold(0.0, |most: f64, apart| most.max(apart.abs()));
        // The whole record, from its first sample on, in the midst of an opening.
        assert!(most_m < 1e-3, "{}: {most_m} m", run.name);
    }
}
