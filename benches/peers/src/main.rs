//! Other people's methods beside ours: by turns, on one thread, with what each is worth beside what it takes.
//!
//! `cargo run --release` in this folder prints all tables, `cargo run --release -- NAME` those of one comparison.

use std::process::ExitCode;

use valve_model::dispatch::InstructionSet;
use valve_model::real::LANES;

#[path = "../../../tests/reference_valve/plain.rs"]
mod plain;

mod bdf;
mod cycle;
mod filter;
mod inverse;
mod lanes;
mod log;
mod markdown;
mod pace;
mod reference_valve;
mod update;

/// The comparisons by name.
const COMPARISONS: [(&str, fn()); 6] = [
    ("cycle", cycle::compare),
    ("inverse", inverse::compare),
    ("table", inverse::compare_table),
    ("update", update::compare),
    ("lanes", lanes::compare),
    ("log", log::compare),
];

fn main() -> ExitCode {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let names = COMPARISONS.map(|(name, _)| name);
    if let Some(other) = asked.iter().find(|asked| !names.contains(&asked.as_str())) {
        eprintln!("there is no comparison {other:?}; expected one of {}, or nothing for all", names.join(", "));
        return ExitCode::from(2);
    }
    println!("Lanes of {} with {}.", LANES, InstructionSet::widest().name());
    for (name, compare) in COMPARISONS {
        if asked.is_empty() || asked.iter().any(|asked| asked == name) {
            compare();
        }
    }
    ExitCode::SUCCESS
}
