//! Strokes of a valve as they are recorded, made by the model itself.

#![allow(dead_code, reason = "not every test uses all of it")]

use campaign::{Campaign, Inputs, Run, RunConditions, Sensors, Trace, Uncertainty};
use valve_model::{CommandEdge, Conditions, Prepared, Start, Valve, measurement::Record, simulate};

/// Noise of the recorded position, m.
pub const NOISE_M: f64 = 5e-5;

/// The commands of every stroke, s.
const COMMANDS: [(f64, bool); 2] = [(0.2, true), (3.5, false)];

/// From row to row of a record, s.
pub const ROW_S: f64 = 0.01;

/// When every record ends, s.
pub const END_S: f64 = 7.0;

/// Normal numbers by the method of Box and Muller (1958) from SplitMix64 (Steele, Lea and Flood 2014).
pub struct Noise(pub u64);

impl Noise {
    /// The next number between 0 and 1.
    pub fn uniform(&mut self) -> f64 {
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

/// What is off in one record.
#[derive(Debug, Clone, Copy, Default)]
pub struct Off {
    /// Delays of the commands to close and to open, s.
    pub delays_s: [f64; 2],
    /// By how much the supply's gauge pressure is higher than it is said to be, relative.
    pub supply: f64,
    /// The leak to the atmosphere that was opened on purpose as it is believed to be, m2, and how much larger it is, relative.
    pub leak: (f64, f64),
    /// How much later the recorder's clock stands, s.
    pub clock_s: f64,
    /// Gain of the position sensor beyond 1.
    pub gain: f64,
    /// How far the position sensor's curve bends away from a straight line at half the stroke, as a share of the stroke.
    pub bend: f64,
    /// Zero of the position sensor, m.
    pub zero_m: f64,
    /// Its drift over the record, m.
    pub drift_m: f64,
}

/// A stroke of a valve, believed to be made at a supply pressure.
pub fn stroke(valve: &Valve, supply_pressure_pa: f64, off: &Off, noise: &mut Noise) -> Run {
    commanded(valve, supply_pressure_pa, (&COMMANDS, END_S), off, noise)
}

/// A record of such commands, each with its time and whether it is to close, up to its end.
pub fn commanded(
    valve: &Valve,
    supply_pressure_pa: f64,
    (commands, end_s): (&[(f64, bool)], f64),
    off: &Off,
    noise: &mut Noise,
) -> Run {
    let nominal = Conditions::nominal(valve.parameters());
    let ambient_pa = valve.parameters().ambient_pressure_pa;
    let true_pa = ambient_pa + (1.0 + off.supply) * (supply_pressure_pa - ambient_pa);
    let edges = commands
        .iter()
        .zip(off.delays_s.iter().cycle())
        .map(|((time_s, close), late_s)| CommandEdge::new(time_s + late_s, *close));
    let run = valve_model::Run {
        conditions: Conditions {
            supply_pressure_pa: true_pa,
            leak_to_atmosphere_m2: off.leak.0 * (1.0 + off.leak.1),
            ..nominal
        },
        commands: edges.collect(),
        end_s: end_s + 0.1,
        prescribed: None,
        start: Start::Rest,
    };
    let time_s: Vec<f64> =
        (0..100_000).map(|row| f64::from(row) * ROW_S).take_while(|time| *time < end_s - 0.5 * ROW_S).collect();
    let seen_s: Vec<f64> = time_s.iter().map(|time| time - off.clock_s).collect();
    let mut record = Record::default();
    let stroke_m = valve.parameters().stroke_m;
    simulate(&[Prepared::new(valve, &run, 1e-3)], false, |_, nodes, _| {
        // What is slow about a sensor comes after its curve.
        let mut bent = nodes.clone();
        for (x, v) in bent.position_m.iter_mut().zip(&mut bent.velocity_m_per_s) {
            *v *= 1.0 + 4.0 * off.bend * (1.0 - 2.0 * *x / stroke_m);
            *x += 4.0 * off.bend * *x * (1.0 - *x / stroke_m);
        }
        valve.measurement().record(&bent, &seen_s, &mut record);
    });
    let sensed = |(time, x): (&f64, &f64)| (1.0 + off.gain) * x + off.zero_m + off.drift_m * time / end_s;
    let trace = Trace {
        command_close: time_s
            .iter()
            .map(|time| commands.iter().rev().find(|edge| edge.0 <= *time).is_some_and(|edge| edge.1))
            .collect(),
        position_m: time_s.iter().zip(&record.position_m).map(sensed).map(|x| x + NOISE_M * noise.normal()).collect(),
        time_s,
        ..Trace::default()
    };
    Run {
        file: format!("{supply_pressure_pa}-{}.csv", off.leak.0),
        conditions: RunConditions {
            supply_pressure_pa,
            temperature_k: nominal.temperature_k,
            leak_to_atmosphere_m2: off.leak.0,
            leak_from_supply_m2: 0.0,
        },
        trace,
        commands: commands
            .iter()
            .map(|(time_s, close)| campaign::CommandEdge { time_s: *time_s, close: *close })
            .collect(),
        commands_inferred: false,
    }
}

/// A run as it is recorded by somebody who begins later.
pub fn from_s(mut run: Run, begin_s: f64) -> Run {
    let first = run.trace.time_s.partition_point(|time| *time < begin_s);
    let trace = &mut run.trace;
    let origin_s = trace.time_s[first];
    trace.time_s = trace.time_s[first..].iter().map(|time| time - origin_s).collect();
    trace.position_m.drain(..first);
    trace.command_close.drain(..first);
    run.commands.retain(|edge| edge.time_s >= origin_s);
    run.commands.iter_mut().for_each(|edge| edge.time_s -= origin_s);
    run
}

/// A campaign of these runs.
pub fn campaign(runs: Vec<Run>) -> Campaign {
    Campaign {
        name: "recorded".into(),
        sensors: Sensors { position_noise_m: Some(NOISE_M), ..Sensors::default() },
        uncertainty: Uncertainty::default(),
        inputs: Inputs::default(),
        runs,
        planned: Vec::new(),
        timings: Vec::new(),
        timings_file: None,
        warnings: Vec::new(),
    }
}
