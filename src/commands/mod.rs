//! One file a verb: read, call the crates, print.

mod adopt;
mod adopt_life;
mod build_tables;
mod calibrate;
mod campaign_input;
mod compare;
mod demo;
mod effects;
mod evaluate;
mod explain;
mod init;
mod lab;
mod learn;
mod log_input;
mod manual;
mod prognose;
mod report;
mod revert;
mod same_names;
mod simulate;
mod steps;
mod tables;
mod valve_input;
mod watch;

use crate::cli::{ToldUnits, Verb};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Units};
use valve_file::ValveFile;

/// Does what the command line asks.
pub fn run(verb: &Verb, units: Option<&ToldUnits>) -> anyhow::Result<Answer> {
    if let Some(units) = units {
        output::set_units(told_units(verb, units)?);
    }
    match verb {
        Verb::Init(args) => init::run(args),
        Verb::Simulate(args) => simulate::run(args),
        Verb::BuildTables(args) => build_tables::run(args),
        Verb::Prognose(args) => prognose::run(args),
        Verb::Learn(args) => learn::run(args),
        Verb::Evaluate(args) => evaluate::run(args),
        Verb::Demo(args) => demo::run(args),
        Verb::Compare(args) => compare::run(args),
        Verb::Calibrate(args) => calibrate::run(args),
        Verb::Explain(args) => explain::run(args),
        Verb::Adopt(args) => adopt::run(args),
        Verb::Lab(args) => lab::run(args),
        Verb::Watch(args) => watch::run(args),
        Verb::Effects(args) => effects::run(args),
        Verb::Report(args) => report::run(args),
        Verb::Revert(args) => revert::run(args),
        Verb::Help { topic } => manual::help(topic),
        Verb::Completions { shell } => manual::completions(*shell),
        Verb::Man { dir, force } => manual::pages(dir.as_deref(), *force),
    }
}

/// The units of text results; gauge pressures count from the surroundings of the valve, where there is one.
fn told_units(verb: &Verb, asked: &ToldUnits) -> anyhow::Result<Units> {
    let file = verb.valve_file().map(ValveFile::read).transpose()?;
    let units = match (asked, &file) {
        (ToldUnits::These(units), _) => units.clone(),
        (ToldUnits::OfFile, Some(file)) => Units::of_valve_file(file.text()),
        (ToldUnits::OfFile, None) => {
            return Err(Hinted::error(
                "--units file: this call reads no valve file",
                "name the units, such as --units psig,mm",
            ));
        }
    };
    Ok(match file {
        Some(file) => units.at_ambient(file.valve().parameters().ambient_pressure_pa),
        None => units,
    })
}
