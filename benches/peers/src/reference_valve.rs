//! The reference valve: its model, its cycle, its tables, and runs of it.

use std::path::{Path, PathBuf};

use leak_table::TableBundle;
use valve_file::ValveFile;
use valve_model::cycle::cycle_commands;
use valve_model::{Conditions, Run, Schedule, Start, Valve};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Its model.
pub fn valve() -> Valve {
    let path = repository().join("models/testbed.toml");
    ValveFile::read(&path).expect("the reference valve's file is right").valve().clone()
}

/// Its tables.
pub fn tables() -> TableBundle {
    TableBundle::read(&repository().join("tables")).expect("tables/ is sound")
}

/// The cycle that its tables are of.
pub const CYCLE: Schedule = Schedule { close_at_s: 0.0, open_at_s: 4.0, end_s: 12.0 };

/// Its conditions with a leak to atmosphere, m2.
pub fn leaking(valve: &Valve, area_m2: f64) -> Conditions {
    Conditions { leak_to_atmosphere_m2: area_m2, ..Conditions::nominal(valve.parameters()) }
}

/// One whole cycle from rest.
pub fn whole_cycle(conditions: Conditions, schedule: &Schedule) -> Run {
    Run { conditions, commands: cycle_commands(schedule), end_s: schedule.end_s, prescribed: None, start: Start::Rest }
}

/// A stream of numbers in 0..1 that looks random and is the same on every machine (Weyl sequence).
pub fn spread(count: usize, seed: f64) -> impl Iterator<Item = f64> {
    (1..=count).map(move |i| (seed + i as f64 * 0.618_033_988_749_895).fract())
}
