//! Whether the 90 % intervals of a calibration hold the truth in 90 % of cases.

mod drawn;
mod recorded;

use drawn::drawn;
use model_lab::Space;
use model_lab::calibrate::{CalibrateOptions, Calibration};
use rayon::prelude::*;
use recorded::{Noise, campaign, recorded};
use valve_file::ValveFile;
use valve_model::Conditions;

/// Campaigns that are made and calibrated.
const CAMPAIGNS: u64 = 120;

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn ninety_percent_intervals_hold_the_truth_in_nine_cases_of_ten() {
    let text = include_str!("../../../models/testbed.toml");
    let file = ValveFile::parse(text, "testbed.toml").expect("a valid valve");
    let tolerances = file.tolerances().to_vec();
    assert!(tolerances.len() >= 4);
    let counts: Vec<(usize, bool)> = (0..CAMPAIGNS)
        .into_par_iter()
        .map(|seed| {
            let mut noise = Noise(1000 + seed);
            let (valve, truth) = drawn(file.valve(), &tolerances, &mut noise);
            let runs = [5.2e5, 6.6e5].map(|supply_pressure_pa| {
                let nominal = Conditions::nominal(valve.parameters());
                recorded(&valve, Conditions { supply_pressure_pa, ..nominal }, 0.0, 0.0, &mut noise)
            });
            let data = campaign(runs.to_vec());
            let options = CalibrateOptions { starts: 1, candidates: 1, hold_out: false, ..CalibrateOptions::default() };
            let found = Calibration::of(&Space::new(file.valve(), &tolerances), &data, file.valve(), options);
            let inside = found
                .parameters
                .iter()
                .zip(&truth)
                .filter(|(parameter, truth)| (parameter.interval_90.0..=parameter.interval_90.1).contains(truth))
                .count();
            (inside, found.verdict == model_lab::calibrate::Verdict::Explained)
        })
        .collect();
    let all = counts.len() * tolerances.len();
    let coverage = counts.iter().map(|(inside, _)| inside).sum::<usize>() as f64 / all as f64;
    let explained = counts.iter().filter(|(_, explained)| *explained).count();
    println!("coverage {coverage:.3} over {all} intervals, {explained} of {CAMPAIGNS} campaigns explained");
    assert!((0.85..=0.95).contains(&coverage), "coverage {coverage}");
    assert!(explained >= 115, "{explained} of {CAMPAIGNS} campaigns without missing physics are told to be explained");
}
