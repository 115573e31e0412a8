//! Small campaigns of a known valve, simulated with noise of a seeded generator.

use std::fmt::Write;

use valve_file::ValveFile;
use valve_model::{CommandEdge, Conditions, ParameterId, Prepared, Run, Start, Trajectory, Valve, simulate};

use crate::support::Sandbox;

/// Spacing of the rows, s.
const SPACING_S: f64 = 2e-3;

/// A source of numbers that are the same in every test run (SplitMix64; Steele, Lea and Flood 2014).
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A normal number by the method of Box and Muller (1958).
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * self.uniform()).cos()
    }
}

/// What to record of a valve.
pub struct Recording {
    /// Gauge supply pressures, one run each, psi.
    pub supplies_psig: Vec<f64>,
    /// One standard deviation of the position, mm.
    pub noise_mm: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// By how much single strokes differ: times 1 ms of delay, and 0.3 % of preload, flow and supply pressure (one
    /// standard deviation).
    pub scatter: f64,
}

impl Default for Recording {
    fn default() -> Self {
        Self { supplies_psig: vec![60.0, 75.0, 90.0], noise_mm: 0.03, seed: 7, scatter: 0.0 }
    }
}

impl Recording {
    /// Writes `campaign.toml` and its traces into a sandbox, recorded on the valve of a text.
    pub fn write(&self, sandbox: &Sandbox, valve_text: &str) {
        let file = ValveFile::parse(valve_text, "recorded").expect("a valid valve");
        let mut noise = Noise(self.seed);
        let mut differences = Noise(!self.seed);
        let mut campaign = format!("name = \"recorded\"\n\n[sensors]\nposition_noise = \"{} mm\"\n", self.noise_mm);
        for (index, supply) in self.supplies_psig.iter().enumerate() {
            let name = format!("run-{}.csv", index + 1);
            sandbox.write(&name, &self.trace(file.valve(), *supply, &mut noise, &mut differences));
            let _ = write!(
                campaign,
                "\n[[run]]\nfile = \"{name}\"\nsupply_pressure = \"{supply} psig\"\ntemperature = \"293.15 K\"\n"
            );
        }
        sandbox.write("campaign.toml", &campaign);
    }

    /// One stroke, as it differs from the others.
    fn trace(&self, valve: &Valve, supply_psig: f64, noise: &mut Noise, differences: &mut Noise) -> String {
        let mut parameters = valve.parameters().clone();
        let mut share = || 1.0 + 3e-3 * self.scatter * differences.normal();
        let supply_pressure_pa = supply_psig * share() * 6894.757 + parameters.ambient_pressure_pa;
        for id in [ParameterId::PreloadCompression, ParameterId::FlowCoefficient] {
            parameters.set(id, parameters.get(id) * share());
        }
        let [closes_s, opens_s] = [0.0, 3.0].map(|at_s| at_s + 1e-3 * self.scatter * differences.normal().abs());
        let conditions = Conditions { supply_pressure_pa, ..Conditions::nominal(&parameters) };
        let stroke = Valve::new(parameters, valve.switches(), valve.effects().to_vec(), valve.custom().to_vec());
        let commands = vec![CommandEdge::new(closes_s, true), CommandEdge::new(opens_s, false)];
        let run = Run { conditions, commands, end_s: 6.5, prescribed: None, start: Start::Rest };
        let mut nodes = Trajectory::default();
        let stroke = stroke.expect("a possible valve");
        simulate(&[Prepared::new(&stroke, &run, 5e-4)], false, |_, path, _| nodes = path.clone());
        let times: Vec<f64> = (0..=3250).map(|row| f64::from(row) * SPACING_S).collect();
        let mut positions = Vec::new();
        nodes.positions_at(&times, &mut positions);
        let mut text = String::from("time_s,command,position_mm\n");
        for (time, position) in times.iter().zip(&positions) {
            let command = u8::from(*time < 3.0);
            let _ = writeln!(text, "{time:.3},{command},{:.4}", position * 1e3 + self.noise_mm * noise.normal());
        }
        text
    }
}
