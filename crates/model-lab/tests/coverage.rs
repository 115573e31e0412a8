//! Calibrations of campaigns whose parameters, instruments and conditions were drawn from what is believed of them: their
//! intervals must hold the truth as often as they say.

mod recorded;

use identify::Stop;
use model_lab::calibrate::{Calibration, Verdict};
use model_lab::identification::NuisanceSizes;
use rayon::prelude::*;
use recorded::{Noise, Off, ROW_S, campaign, stroke};
use valve_file::ValveFile;
use valve_model::{Effect, EffectKind, ParameterId, Valve};

/// Campaigns that are made and calibrated, in the usual tests and in the one that takes longer.
const FEW: u64 = 24;
const MANY: u64 = 96;

fn testbed() -> ValveFile {
    ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve")
}

/// A valve whose tolerated parameters were drawn, with those draws, and the strokes of it that were recorded.
fn drawn(file: &ValveFile, effects: &[Effect], noise: &mut Noise) -> (campaign::Campaign, Vec<f64>) {
    let sizes = NuisanceSizes::default();
    let mut parameters = file.valve().parameters().clone();
    let mut truth = Vec::new();
    for tolerance in file.tolerances() {
        let value = parameters.get(tolerance.parameter) * (tolerance.relative_sigma * noise.normal()).exp();
        parameters.set(tolerance.parameter, value);
        truth.push(value);
    }
    parameters.piston_area_m2 *= 1.0 + sizes.bore * noise.normal();
    let stroke_m = parameters.stroke_m;
    let [gauge, clock_s, gain, bend] =
        [sizes.gauge, sizes.clock_s, sizes.gain, sizes.linearity].map(|size| size * noise.normal());
    let runs = [4.8e5, 5.6e5, 6.4e5, 7.2e5].map(|supply_pressure_pa| {
        let mut of_stroke = parameters.clone();
        let preload = of_stroke.get(ParameterId::PreloadCompression) * (1.0 + sizes.load * noise.normal());
        of_stroke.set(ParameterId::PreloadCompression, preload);
        let valve = Valve::new(of_stroke, file.valve().switches(), effects.to_vec(), Vec::new()).expect("possible");
        let off = Off {
            // A command is written down in the row that follows it.
            delays_s: [0, 1].map(|_| sizes.delay_s * noise.normal() - ROW_S * noise.uniform()),
            supply: (1.0 + gauge) * (1.0 + sizes.supply * noise.normal()) - 1.0,
            clock_s,
            gain,
            zero_m: sizes.zero * stroke_m * noise.normal(),
            drift_m: sizes.drift * stroke_m * noise.normal(),
            bend,
            ..Off::default()
        };
        stroke(&valve, supply_pressure_pa, &off, noise)
    });
    (campaign(runs.into()), truth)
}

/// Shares of 90 % intervals that hold the truth, and of campaigns that are told to have no missing physics.
fn held(campaigns: u64) -> [f64; 2] {
    let file = testbed();
    assert!(file.tolerances().len() >= 4);
    let counts: Vec<(usize, bool)> = (0..campaigns)
        .into_par_iter()
        .map(|seed| {
            let (campaign, truth) = drawn(&file, &[], &mut Noise(1000 + seed));
            let found = Calibration::new(&file, &campaign, Stop::never()).expect("it strokes");
            let pairs = found.parameters.iter().zip(&truth);
            let inside = pairs.filter(|(one, truth)| (one.interval_90.0..=one.interval_90.1).contains(truth)).count();
            (inside, found.verdict != Verdict::BeyondTolerance)
        })
        .collect();
    let all = counts.len() * file.tolerances().len();
    let inside = counts.iter().map(|(inside, _)| inside).sum::<usize>() as f64 / all as f64;
    let fine = counts.iter().filter(|(_, fine)| *fine).count() as f64 / counts.len() as f64;
    println!("{inside:.3} of {all} intervals, {fine:.3} of {campaigns} campaigns without missing physics");
    [inside, fine]
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn ninety_percent_intervals_hold_the_truth_in_nine_cases_of_ten() {
    // 0.89 as measured of many: where instruments pull at their bounds, a normal density is too narrow.
    let [inside, fine] = held(FEW);
    assert!((0.75..=0.97).contains(&inside) && fine >= 0.9, "{inside} and {fine}");
}

#[test]
#[ignore = "takes a minute: a hundred fits"]
fn of_many_intervals_as_many_hold_as_were_measured() {
    let [inside, fine] = held(MANY);
    assert!((0.81..=0.95).contains(&inside) && fine >= 0.94, "{inside} and {fine}");
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn missing_physics_is_not_taken_for_instruments() {
    let file = testbed();
    let rubbing = Effect::new(EffectKind::DRY_FRICTION, &[Some(35.0), Some(60.0), None]).expect("a possible effect");
    for seed in 5..7 {
        let (campaign, _) = drawn(&file, &[rubbing], &mut Noise(seed));
        let found = Calibration::new(&file, &campaign, Stop::never()).expect("it strokes");
        assert_eq!(found.verdict, Verdict::BeyondTolerance, "{:?}", found.reasons);
    }
}
