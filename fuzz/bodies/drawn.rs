//! Valves and conditions drawn from bytes: within a decade of a real valve, effects of the catalogue at any size that they have.

use valve_file::ValveFile;
use valve_model::cycle::cycle_commands;
use valve_model::params::Domain;
use valve_model::{Conditions, Effect, EffectKind, ParameterError, ParameterId, Run, Schedule, Start, Switches, Valve};

/// The valve in the middle.
const MIDDLE: &str = include_str!("../../models/testbed.toml");
/// Decades to either side.
const DECADES: f64 = 1.0;
/// A byte below this adds an effect.
const ADDS: u8 = 24;
/// What is simulated.
const SCHEDULE: Schedule = Schedule { close_at_s: 0.0, open_at_s: 4.0, end_s: 8.0 };

/// Bytes that are used up one after the other; then all are in the middle.
pub struct Bytes<'a>(std::slice::Iter<'a, u8>);

impl<'a> Bytes<'a> {
    /// All bytes of an input.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes.iter())
    }

    fn next(&mut self) -> u8 {
        self.0.next().copied().unwrap_or(128)
    }

    /// A number from 0 to 1.
    fn share(&mut self) -> f64 {
        f64::from(u16::from_le_bytes([self.next(), self.next()])) / f64::from(u16::MAX)
    }
}

/// A valve, or why it is none.
pub fn valve(bytes: &mut Bytes<'_>) -> Result<Valve, ParameterError> {
    let file = ValveFile::parse(MIDDLE, "middle.toml").expect("is a valve file");
    let middle = file.valve().parameters();
    let mut parameters = middle.clone();
    for &id in ParameterId::ALL {
        let factor = 10_f64.powf(DECADES * (2.0 * bytes.share() - 1.0));
        let value = middle.get(id);
        parameters.set(id, if id.domain() == Domain::AboveOne { 1.0 + (value - 1.0) * factor } else { value * factor });
    }
    let mut effects = Vec::new();
    for &kind in EffectKind::ALL {
        if bytes.next() >= ADDS {
            continue;
        }
        let ranges = kind.parameters().iter().map(|parameter| (parameter.range)(&parameters));
        let values: Vec<_> =
            ranges.map(|range| Some(range.lower + bytes.share() * (range.upper - range.lower))).collect();
        effects.extend(Effect::new(kind, &values));
    }
    Valve::new(parameters, Switches::default(), effects, Vec::new())
}

/// Conditions of a run: leaks of up to 0.5 mm2.
pub fn conditions(valve: &Valve, bytes: &mut Bytes<'_>) -> Conditions {
    let mut conditions = Conditions::nominal(valve.parameters());
    for leak in [&mut conditions.leak_to_atmosphere_m2, &mut conditions.leak_from_supply_m2] {
        if bytes.next() < 64 {
            *leak = 0.5e-6 * bytes.share();
        }
    }
    conditions
}

/// One cycle.
pub fn run(conditions: Conditions) -> Run {
    Run { conditions, commands: cycle_commands(&SCHEDULE), end_s: SCHEDULE.end_s, prescribed: None, start: Start::Rest }
}
