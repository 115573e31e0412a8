//! One slip of whoever wrote a campaign down: it is named, and what is told of the valve is what would be told without it.

mod recorded;

use campaign::{Campaign, RunConditions, TimingRow};
use identify::Stop;
use model_lab::diagnosis::{Condition, DiagnoseOptions, Explanation, Verdict, explain};
use model_lab::strange_times;
use recorded::{Noise, Off, campaign, stroke};
use valve_file::ValveFile;
use valve_model::cycle::cycles;
use valve_model::{Conditions, Effect, EffectKind, Fidelity, Valve};

const AMBIENT_PA: f64 = 101_325.0;
const PSI_PA: f64 = 6894.757;

fn testbed() -> ValveFile {
    ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve")
}

fn explained(file: &ValveFile, campaign: &Campaign) -> Explanation {
    let effects = [EffectKind::DRY_FRICTION, EffectKind::PROCESS_FORCE].into();
    let options = DiagnoseOptions { effects, ..DiagnoseOptions::default() };
    explain(file, campaign, &options, &|_| (), Stop::never()).expect("it strokes")
}

/// Strokes of a valve with friction at four pressures, the third one with a leak that was opened on purpose.
fn sticking() -> Campaign {
    let file = testbed();
    let friction = Effect::new(EffectKind::DRY_FRICTION, &[Some(40.0), Some(60.0), Some(0.01)]).expect("possible");
    let (parameters, switches) = (file.valve().parameters().clone(), file.valve().switches());
    let valve = Valve::new(parameters, switches, vec![friction], Vec::new()).expect("possible");
    let mut noise = Noise(5);
    let mut of = |psig: f64, off: &Off| stroke(&valve, AMBIENT_PA + psig * PSI_PA, off, &mut noise);
    let leak = Off { leak: (0.15e-6, 0.0), ..Off::default() };
    let plain = Off::default();
    campaign(vec![of(60.0, &plain), of(85.0, &plain), of(75.0, &leak), of(95.0, &plain)])
}

#[test]
#[ignore = "takes most of a minute: a whole search for each run that may be mistyped"]
fn a_run_under_a_mistyped_pressure_is_named_with_the_right_one() {
    let mut mistyped = sticking();
    mistyped.runs[1].conditions.supply_pressure_pa = AMBIENT_PA + 58.0 * PSI_PA;
    mistyped.runs[1].file = "second.csv".into();
    let found = explained(&testbed(), &mistyped);
    assert_eq!((found.verdict, found.recommended), (Verdict::EffectFound, vec![EffectKind::DRY_FRICTION]));
    let left_out = found.left_out.expect("it is told");
    let repair = left_out.repair.expect("a pressure explains it");
    assert_eq!((left_out.run.as_str(), repair.condition), ("second.csv", Condition::SupplyPressure));
    assert!((repair.right / (AMBIENT_PA + 85.0 * PSI_PA) - 1.0).abs() < 0.03, "{repair:?}");
}

#[test]
#[ignore = "takes most of a minute: a whole search for each run that may be mistyped"]
fn a_leak_that_nobody_wrote_down_is_named() {
    let mut forgotten = sticking();
    forgotten.runs[2].conditions.leak_to_atmosphere_m2 = 0.0;
    let found = explained(&testbed(), &forgotten);
    assert_eq!((found.verdict, found.recommended), (Verdict::EffectFound, vec![EffectKind::DRY_FRICTION]));
    let left_out = found.left_out.expect("it is told");
    let repair = left_out.repair.expect("a leak explains it");
    assert_eq!((repair.condition, repair.stated), (Condition::LeakToAtmosphere, 0.0));
    assert!((repair.right / 0.15e-6 - 1.0).abs() < 0.1, "{repair:?}");
}

#[test]
#[ignore = "takes most of a minute: a whole search for each run that may be mistyped"]
fn of_three_runs_under_one_condition_the_mistyped_one_is_named() {
    let file = testbed();
    let friction = Effect::new(EffectKind::DRY_FRICTION, &[Some(40.0), Some(60.0), Some(0.01)]).expect("possible");
    let (parameters, switches) = (file.valve().parameters().clone(), file.valve().switches());
    let valve = Valve::new(parameters, switches, vec![friction], Vec::new()).expect("possible");
    let mut noise = Noise(5);
    let mut of = |psig: f64| stroke(&valve, AMBIENT_PA + psig * PSI_PA, &Off::default(), &mut noise);
    let mistyped = |campaign: &Campaign| {
        let mut mistyped = campaign.clone();
        mistyped.runs[1].conditions.supply_pressure_pa = AMBIENT_PA + 57.0 * PSI_PA;
        mistyped.runs[1].file = "second.csv".into();
        explained(&file, &mistyped).left_out
    };
    let alike = campaign(vec![of(75.0), of(75.0), of(75.0)]);
    let left_out = mistyped(&alike).expect("the two others say what it is");
    let repair = left_out.repair.expect("a pressure explains it");
    assert_eq!((left_out.run.as_str(), repair.condition), ("second.csv", Condition::SupplyPressure));
    assert!((repair.right / (AMBIENT_PA + 75.0 * PSI_PA) - 1.0).abs() < 0.03, "{repair:?}");
    // Of three that differ nobody can say which one is wrong.
    assert_eq!(mistyped(&campaign(vec![of(65.0), of(75.0), of(90.0)])), None);
}

#[test]
#[ignore = "takes half a minute: a whole search for each run that may be mistyped"]
fn a_run_whose_clock_jumps_is_named_though_no_condition_repairs_it() {
    let mut jumped = sticking();
    let trace = &mut jumped.runs[1].trace;
    let half = trace.position_m[0] / 2.0;
    let in_motion = trace.position_m.iter().position(|position| *position < half).expect("it closes");
    for time_s in &mut trace.time_s[in_motion..] {
        *time_s += 0.2;
    }
    for edge in &mut jumped.runs[1].commands[1..] {
        edge.time_s += 0.2;
    }
    jumped.runs[1].file = "second.csv".into();
    let found = explained(&testbed(), &jumped);
    assert_eq!((found.verdict, found.recommended), (Verdict::EffectFound, vec![EffectKind::DRY_FRICTION]));
    let left_out = found.left_out.expect("it is told");
    assert_eq!((left_out.run.as_str(), left_out.repair), ("second.csv", None));
    assert!(left_out.stated_rmse_m > 20.0 * left_out.others_rmse_m, "{left_out:?}");
}

#[test]
#[ignore = "takes half a minute: a whole search for each run that may be mistyped"]
fn a_leak_that_was_noted_as_the_other_kind_is_named_with_the_right_one() {
    let mut mistaken = sticking();
    let conditions = &mut mistaken.runs[2].conditions;
    (conditions.leak_from_supply_m2, conditions.leak_to_atmosphere_m2) = (conditions.leak_to_atmosphere_m2, 0.0);
    let found = explained(&testbed(), &mistaken);
    assert_eq!((found.verdict, found.recommended), (Verdict::EffectFound, vec![EffectKind::DRY_FRICTION]));
    let repair = found.left_out.and_then(|one| one.repair).expect("it is told");
    assert_eq!(repair.condition, Condition::LeakToAtmosphere);
    assert_eq!(repair.in_place_of.map(|(other, _)| other), Some(Condition::LeakFromSupply));
    assert!((repair.right / 0.15e-6 - 1.0).abs() < 0.1, "{repair:?}");
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn two_runs_whose_pressures_were_exchanged_are_named() {
    let mut exchanged = sticking();
    let [of_one, of_other] = [1, 2].map(|run| exchanged.runs[run].conditions.supply_pressure_pa);
    exchanged.runs[1].conditions.supply_pressure_pa = of_other;
    exchanged.runs[2].conditions.supply_pressure_pa = of_one;
    exchanged.runs[1].file = "second.csv".into();
    exchanged.runs[2].file = "third.csv".into();
    let found = explained(&testbed(), &exchanged);
    assert_eq!((found.verdict, found.recommended), (Verdict::EffectFound, vec![EffectKind::DRY_FRICTION]));
    let told = found.exchanged.expect("it is told");
    assert_eq!((told.runs, told.what), (["second.csv".to_owned(), "third.csv".to_owned()], "supply pressures"));
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn a_sound_campaign_loses_no_run() {
    let found = explained(&testbed(), &sticking());
    assert_eq!((found.verdict, found.recommended), (Verdict::EffectFound, vec![EffectKind::DRY_FRICTION]));
    assert_eq!(found.left_out, None);
}

/// Stroke times of the valve as its file has it, one at each of many pressures, and each of the last two with a leak; with noise.
fn timed(file: &ValveFile) -> Campaign {
    let nominal = Conditions::nominal(file.valve().parameters());
    let mut noise = Noise(7);
    let leaks = [0.0; 8].into_iter().chain([0.05e-6, 0.1e-6]);
    let row = |(index, leak): (usize, f64)| {
        let supply_pressure_pa = AMBIENT_PA + (55.0 + 5.0 * (index % 8) as f64) * PSI_PA;
        let conditions = Conditions { supply_pressure_pa, leak_to_atmosphere_m2: leak, ..nominal };
        let times =
            cycles(&[(file.valve(), conditions)], &file.schedule(), 2, Fidelity::FINE)[0].pop().expect("it strokes");
        TimingRow {
            line: index + 2,
            conditions: RunConditions {
                supply_pressure_pa,
                temperature_k: nominal.temperature_k,
                leak_to_atmosphere_m2: leak,
                leak_from_supply_m2: 0.0,
            },
            close_time_s: times.close_time_s.map(|time| time + 3e-3 * noise.normal()),
            open_time_s: times.open_time_s.map(|time| time + 3e-3 * noise.normal()),
        }
    };
    let timings = leaks.enumerate().map(row).collect();
    Campaign { timings, timings_file: Some("times.csv".into()), ..campaign(Vec::new()) }
}

#[test]
fn a_time_without_repeats_that_contradicts_the_model_is_left_out() {
    let file = testbed();
    let mut sound = timed(&file);
    sound.sensors.timing_noise_s = Some(3e-3);
    let mut mistyped = sound.clone();
    strange_times::leave_out(&file, &mut sound, Stop::never());
    assert_eq!(sound.warnings, []);
    let right = mistyped.timings[4].open_time_s.expect("it opened");
    mistyped.timings[4].open_time_s = Some(1.07 * right);
    strange_times::leave_out(&file, &mut mistyped, Stop::never());
    let warnings: Vec<String> = mistyped.warnings.iter().map(ToString::to_string).collect();
    assert!(warnings.len() == 1 && warnings[0].starts_with("times.csv:6: an opening time of"), "{warnings:?}");
    assert!(warnings[0].ends_with("is it mistyped, or a condition of its row? It was left out"), "{warnings:?}");
    assert_eq!((mistyped.timings[4].open_time_s, mistyped.timings[4].close_time_s.is_some()), (None, true));
}

#[test]
fn a_mistyped_condition_takes_both_times_of_its_row() {
    let file = testbed();
    let mut mistyped = timed(&file);
    mistyped.timings[9].conditions.leak_to_atmosphere_m2 = 10e-6;
    strange_times::leave_out(&file, &mut mistyped, Stop::never());
    let lines: Vec<usize> = mistyped.warnings.iter().map(|warning| warning.line).collect();
    assert!(!lines.is_empty() && lines.iter().all(|line| *line == 11), "{:?}", mistyped.warnings);
}
