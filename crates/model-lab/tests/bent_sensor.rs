//! A position sensor whose curve is bent is no force: it shows the same in both directions and at every pressure.

mod recorded;

use campaign::Campaign;
use identify::problem::{predict_all, residuals};
use identify::select::Level;
use identify::{Problem, Stop};
use model_lab::diagnosis::uncertainty::Certainty;
use model_lab::diagnosis::{DiagnoseOptions, Explanation, TakenBy, Verdict, explain, nuisance_reports, taken};
use model_lab::identification::{Nuisance, NuisanceSizes, Subject};
use recorded::{Noise, Off, campaign, stroke};
use valve_file::ValveFile;
use valve_model::{Effect, EffectKind, Valve};

const SUPPLIES_PA: [f64; 4] = [4.8e5, 5.6e5, 6.4e5, 7.2e5];

fn testbed() -> ValveFile {
    ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve")
}

fn campaign_of(valve: &Valve, off: &Off) -> Campaign {
    let mut noise = Noise(7);
    campaign(SUPPLIES_PA.map(|supply_pa| stroke(valve, supply_pa, off, &mut noise)).into())
}

/// What is said of a campaign on the testbed's valve where sensors are this linear.
fn explained(campaign: &Campaign, linearity: f64) -> Explanation {
    let options = DiagnoseOptions {
        effects: [EffectKind::PROGRESSIVE_SPRING, EffectKind::PROCESS_FORCE, EffectKind::VENT_RESTRICTION].into(),
        nuisances: NuisanceSizes { linearity, ..NuisanceSizes::default() },
        ..DiagnoseOptions::default()
    };
    explain(&testbed(), campaign, &options, &|_| (), Stop::never()).expect("it strokes")
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn a_bent_sensor_is_told_as_one() {
    let file = testbed();
    let bent = campaign_of(file.valve(), &Off { bend: 0.006, ..Off::default() });
    let usual = explained(&bent, NuisanceSizes::default().linearity);
    assert_eq!((usual.verdict, usual.recommended), (Verdict::Adequate, Vec::new()));
    let told = usual.nuisances.iter().find(|one| one.what.contains("bent")).expect("is told");
    assert!((told.value / file.valve().parameters().stroke_m - 0.006).abs() < 0.002, "{told:?}");
    // A sensor that is stated to be perfectly linear leaves it to the valve.
    let straight = explained(&bent, 1e-6);
    assert!(straight.verdict != Verdict::Adequate || straight.remainder.discrepancy > 3e-4, "{:?}", straight.remainder);
}

#[test]
fn what_is_slow_about_a_bent_sensor_comes_after_its_curve() {
    let (lag_s, bend) = (0.4, 0.006);
    let slow = Effect::new(EffectKind::SENSOR_LAG, &[Some(lag_s)]).expect("possible");
    let file = testbed().with_effect(&slow).expect("possible");
    let campaign = campaign_of(file.valve(), &Off { bend, ..Off::default() });
    let sizes = NuisanceSizes::default();
    let subject = Subject::new(&file, &campaign, &sizes, Stop::never());
    let problem = subject.problem(subject.space.clone(), Level::High, Stop::never());
    let mut right = problem.at_their_word();
    right[problem.place_of(Nuisance::Linearity(1)).expect("is a nuisance")] = bend / sizes.linearity;
    let predicted = predict_all(&problem, &[right]).remove(0).expect("it strokes");
    let residual = residuals(&problem, &predicted);
    let rows = problem.records().iter().zip(&residual).flat_map(|(record, residual)| record.rows().zip(residual));
    let squares: Vec<f64> = rows.map(|(row, residual)| (residual / row.sigma).powi(2)).collect();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    // The bend of these records is a parabola, not half a wave, which leaves a little. The other way round 1.5 times the noise is
    // left.
    assert!((rms - 1.0).abs() < 0.2, "{rms} times the noise");
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn a_force_that_fades_unevenly_is_found_though_in_proportion_it_would_be_a_spring() {
    let file = testbed();
    let hidden = Effect::new(EffectKind::PROCESS_FORCE, &[Some(60.0), Some(1.7)]).expect("possible");
    let parameters = file.valve().parameters().clone();
    let valve = Valve::new(parameters, file.valve().switches(), vec![hidden], Vec::new()).expect("possible");
    let found = explained(&campaign_of(&valve, &Off::default()), NuisanceSizes::default().linearity);
    // A spring that hardens does much the same: either may come first, but both must be told.
    let alike = found.indistinguishable.iter().flat_map(|group| &group.with).map(|with| &with.kind);
    let told: Vec<EffectKind> = found.recommended.iter().chain(alike).copied().collect();
    assert!(found.recommended.len() == 1 && told.contains(&EffectKind::PROCESS_FORCE), "{told:?}");
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn what_instruments_take_is_told_by_their_kind() {
    let file = testbed();
    let of = |off: &Off| {
        let campaign = campaign_of(file.valve(), off);
        let subject = Subject::new(&file, &campaign, &NuisanceSizes::default(), Stop::never());
        let stated = subject.stated(Stop::never()).expect("it strokes");
        let reports = nuisance_reports(&stated, &Certainty::of_model(&stated), &[]);
        let clock = reports.into_iter().find(|report| report.what == "clock of the recorder");
        (taken(&stated), clock.map(|clock| clock.value))
    };
    let (by, clock) = of(&Off { zero_m: 3e-4, ..Off::default() });
    let (first, errors) = by[0];
    assert!((errors.rmse_m.expect("a position") - 3e-4).abs() < 1e-5 && first == TakenBy::PositionSensor, "{by:?}");
    // Commands that are given at the very row that shows them are no clock that is off.
    assert_eq!((by.len(), clock), (1, None), "{by:?}");
    let (by, clock) = of(&Off { clock_s: 0.012, ..Off::default() });
    assert_eq!(by[0].0, TakenBy::Clock, "{by:?}");
    assert!((clock.expect("a clock") - 0.012).abs() < 1e-3, "{clock:?}");
}
