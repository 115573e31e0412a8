//! Readings of a coarse recorder with little noise are rounded alike at one place, however many they are: no reason for an effect.

mod recorded;

use campaign::Campaign;
use identify::Stop;
use model_lab::diagnosis::{DiagnoseOptions, Verdict, explain};
use recorded::{NOISE_M, Noise, Off, campaign, stroke};
use valve_file::ValveFile;

/// The step of the recorder, m: six times the noise.
const STEP_M: f64 = 6.0 * NOISE_M;

/// Strokes of a sound valve under one condition, the sensor's zero creeping by a good part of a step.
fn strokes(file: &ValveFile, seed: u64, count: usize) -> Campaign {
    let mut noise = Noise(seed);
    let creeping = |_| Off { drift_m: 0.7 * STEP_M, zero_m: 0.3 * STEP_M, ..Off::default() };
    let runs = (0..count).map(creeping).map(|off| stroke(file.valve(), 5.6e5, &off, &mut noise)).collect();
    let mut rounded = campaign(runs);
    for (number, run) in rounded.runs.iter_mut().enumerate() {
        run.file = format!("run-{number}.csv");
        for position_m in &mut run.trace.position_m {
            *position_m = (*position_m / STEP_M).round() * STEP_M;
        }
    }
    rounded
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn a_sound_valve_on_a_coarse_recorder_lacks_nothing() {
    let file = ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve");
    for seed in 1..=3 {
        let found = explain(&file, &strokes(&file, seed, 12), &DiagnoseOptions::default(), &|_| (), Stop::never())
            .expect("it strokes");
        assert_eq!((found.verdict, found.recommended), (Verdict::Adequate, Vec::new()), "seed {seed}");
        // As if rounding were noise, 1.1 to 1.2 times that were left, which strokes enough would make an effect of.
        let left = found.steps.last().expect("calibrated").errors.normalised_rms;
        assert!((0.5..1.0).contains(&left), "seed {seed}: {left}");
    }
}
