//! What the tests of the model and of the tables have in common.
#![allow(dead_code, reason = "each test target uses a part of it")]

pub mod plain;

use std::path::Path;

use leak_table::Fault;
use lut_builder::TableModel;
use valve_file::ValveFile;
use valve_model::cycle::{CycleTimes, cycles};
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{Conditions, Effect, EffectKind, Parameters, Schedule, Switches, Valve};

/// The reference valve's file, from the package of the program as from that of its benches.
pub fn testbed_file() -> ValveFile {
    let places = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|folder| folder.join("models/testbed.toml"));
    let path = places.into_iter().find(|path| path.is_file()).expect("there is a file of the reference valve");
    ValveFile::read(&path).expect("the reference valve's file is right")
}

/// The reference valve's parameters.
pub fn testbed() -> Parameters {
    testbed_file().valve().parameters().clone()
}

/// The reference valve's cycle.
pub const CYCLE: Schedule = Schedule { close_at_s: 0.0, open_at_s: 4.0, end_s: 12.0 };

/// A valve without effects.
pub fn base_valve(parameters: Parameters) -> Valve {
    Valve::new(parameters, Switches::default(), Vec::new(), Vec::new()).expect("parameters are possible")
}

/// The reference valve with one effect of the catalogue.
pub fn with_effect(effect: Effect) -> Valve {
    Valve::new(testbed(), Switches::default(), vec![effect], Vec::new()).expect("parameters are possible")
}

/// An effect at its typical size on the reference valve.
pub fn typical(kind: EffectKind) -> Effect {
    let parameters = testbed();
    let values: Vec<_> = kind.parameters().iter().map(|p| Some((p.range)(&parameters).typical)).collect();
    Effect::new(kind, &values).expect("typical values are possible")
}

/// Conditions with a leak of one kind.
pub fn leaking(valve: &Valve, fault: Fault, area_m2: f64) -> Conditions {
    let mut conditions = Conditions::nominal(valve.parameters());
    match fault {
        Fault::Atmosphere => conditions.leak_to_atmosphere_m2 = area_m2,
        Fault::Supply => conditions.leak_from_supply_m2 = area_m2,
    }
    conditions
}

/// The periodic cycle of each valve.
pub fn periodic(valves: &[(&Valve, Conditions)], schedule: &Schedule, step_s: f64) -> Vec<CycleTimes> {
    cycles(valves, schedule, 40, step_s).into_iter().map(|times| *times.last().expect("at least one cycle")).collect()
}

/// The first cycle of a valve from rest, at the default step.
pub fn first_cycle(valve: &Valve, conditions: Conditions, schedule: &Schedule) -> CycleTimes {
    cycles(&[(valve, conditions)], schedule, 1, DEFAULT_STEP_S)[0][0]
}

/// What the tables of a valve file are built from.
pub fn table_model<'a>(file: &'a ValveFile, canonical_text: &'a str) -> TableModel<'a> {
    TableModel {
        name: file.name(),
        canonical_text,
        valve: file.valve(),
        schedule: file.schedule(),
        limits: file.limits(),
    }
}

/// A stream of numbers in 0..1 that looks random and is the same on every machine (Weyl sequence).
pub fn spread(count: usize, seed: f64) -> impl Iterator<Item = f64> {
    (1..=count).map(move |i| (seed + i as f64 * 0.618_033_988_749_895).fract())
}
