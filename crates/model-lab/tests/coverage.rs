//! Whether the 90 % intervals of a calibration hold the truth in 90 % of cases.

use model_lab::calibrate::{CalibrateOptions, Calibration};
use model_lab::data::{Block, Channel, ChannelData, Fineness, RunData};
use model_lab::forward::record;
use model_lab::{Dataset, Space};
use rayon::prelude::*;
use valve_file::{Tolerance, ValveFile};
use valve_model::{CommandEdge, Conditions, Prepared, Run, Schedule, Valve, simulate};

/// Campaigns that are made and calibrated.
const CAMPAIGNS: u64 = 120;

/// Noise of the position, m.
const NOISE_M: f64 = 5e-5;

/// Spacing of the samples, s; each is a block of its own.
const SPACING_S: f64 = 8e-3;

/// Normal numbers by the method of Box and Muller (1958) from SplitMix64 (Steele, Lea and Flood 2014).
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * self.uniform()).cos()
    }
}

fn recorded(valve: &Valve, supply_pa: f64, noise: &mut Noise) -> RunData {
    let conditions = Conditions { supply_pressure_pa: supply_pa, ..Conditions::nominal(valve.parameters()) };
    let commands = vec![CommandEdge { time_s: 0.0, close: true }, CommandEdge { time_s: 2.5, close: false }];
    let run = Run { conditions, commands, end_s: 5.5, driven: None };
    let times_s: Vec<f64> = (0..680).map(|sample| f64::from(sample) * SPACING_S).collect();
    let mut predicted = model_lab::forward::Predicted::default();
    simulate(&[Prepared::new(valve, &run, 1e-3)], false, |_, nodes, _| {
        record(valve, nodes, &times_s, &mut predicted);
    });
    let samples: Vec<f64> = predicted.position_m.iter().map(|x| x + NOISE_M * noise.normal()).collect();
    let blocks = samples
        .iter()
        .enumerate()
        .map(|(index, mean)| Block {
            first: index,
            end: index + 1,
            mean: *mean,
            inverse_sigma: 1.0 / NOISE_M,
            time_s: times_s[index],
        })
        .collect();
    let channel = ChannelData { channel: Channel::Position, samples, noise: NOISE_M, blocks };
    RunData { name: String::new(), run, times_s, channels: vec![channel] }
}

/// A valve whose tolerated parameters were drawn from their tolerances, and those draws.
fn drawn(valve: &Valve, tolerances: &[Tolerance], noise: &mut Noise) -> (Valve, Vec<f64>) {
    let mut parameters = valve.parameters().clone();
    let mut truth = Vec::new();
    for tolerance in tolerances {
        let value = parameters.get(tolerance.parameter) * (tolerance.relative_sigma * noise.normal()).exp();
        parameters.set(tolerance.parameter, value);
        truth.push(value);
    }
    let drawn = Valve::new(parameters, valve.switches(), Vec::new(), Vec::new()).expect("a possible valve");
    (drawn, truth)
}

#[test]
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
            let runs = [5.2e5, 6.6e5].map(|supply| recorded(&valve, supply, &mut noise)).to_vec();
            let data = Dataset {
                name: String::new(),
                runs,
                timing_groups: Vec::new(),
                timing_rows: Vec::new(),
                timing_noise_s: 1e-3,
                schedule: Schedule { close_at_s: 0.0, open_at_s: 4.0, end_s: 12.0 },
                noise_is_stated: true,
                fineness: Fineness::FINE,
            };
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
