//! Campaigns of the model's own strokes with noise.
#![allow(dead_code, reason = "each test target uses a part of it")]

use model_lab::Dataset;
use model_lab::data::{Block, Channel, ChannelData, FINE_FIT, RunData};
use model_lab::forward::record;
use valve_model::{CommandEdge, Conditions, Prepared, Run, Schedule, Start, Valve, simulate};

/// Noise of the position, m.
const NOISE_M: f64 = 5e-5;

/// Spacing of the samples, s; each is a block of its own.
const SPACING_S: f64 = 8e-3;

/// Normal numbers by the method of Box and Muller (1958) from SplitMix64 (Steele, Lea and Flood 2014).
pub struct Noise(pub u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The next number of a standard normal distribution.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * self.uniform()).cos()
    }
}

/// A stroke under these conditions, recorded from some time before its command; its solenoid is late by some time
/// to close.
pub fn recorded(valve: &Valve, conditions: Conditions, wait_s: f64, late_s: f64, noise: &mut Noise) -> RunData {
    let commands = |late_s: f64| {
        vec![CommandEdge { time_s: wait_s + late_s, close: true }, CommandEdge { time_s: wait_s + 2.5, close: false }]
    };
    let strokes = Run { conditions, commands: commands(late_s), end_s: 5.5, driven: None, start: Start::Rest };
    let times_s: Vec<f64> = (0..680).map(|sample| f64::from(sample) * SPACING_S).collect();
    let mut predicted = model_lab::forward::Predicted::default();
    simulate(&[Prepared::new(valve, &strokes, 1e-3)], false, |_, nodes, _| {
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
    let run = Run { commands: commands(0.0), ..strokes };
    RunData { name: String::new(), run, times_s, channels: vec![channel] }
}

/// A campaign of these runs.
pub fn campaign(runs: Vec<RunData>) -> Dataset {
    Dataset {
        name: String::new(),
        runs,
        timing_groups: Vec::new(),
        timing_rows: Vec::new(),
        timing_noise_s: 1e-3,
        schedule: Schedule { close_at_s: 0.0, open_at_s: 4.0, end_s: 12.0 },
        noise_is_stated: true,
        fidelity: FINE_FIT,
    }
}
