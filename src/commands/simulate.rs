//! `valve simulate`: stroke times, the trace, the picture.

use std::io::Write;

use answers::figures::simulation as pictures;
use answers::simulation::{document, times_s};
use answers::strokes::{Cycles, instants};
use anyhow::Context;
use valve_file::ValveFile;
use valve_model::cycle::outcome;
use valve_model::{Conditions, Outcome};

use super::valve_input;
use crate::cli::{Format, SimulateArgs};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Align, Outputs, PlotFile, StagedFile, TextTable};

/// Spacing of the samples in a trace, s.
const TRACE_SPACING_S: f64 = 1e-3;
/// Cycles in a trace at most: its rows would fill the memory.
const TRACE_CYCLES: u32 = 100;

/// Simulates and prints.
pub fn run(args: &SimulateArgs) -> anyhow::Result<Answer> {
    let file = valve_input::read(&args.valve)?;
    let conditions = conditions(args, &file)?;
    if let Outcome::Diverged { time_s, what } = outcome(file.valve(), conditions, &file.schedule(), args.step) {
        return Err(Hinted::error(
            format!(
                "{what} is no number any more {time_s:.3} s after the start: no stroke time is known under these conditions"
            ),
            "the formula of an effect of one's own must be a number wherever the valve goes",
        ));
    }
    let wants_path = args.trace.is_some() || args.plot.is_some();
    if wants_path && args.cycles > TRACE_CYCLES {
        return Err(Hinted::error(
            format!("a trace of {} cycles is too long", args.cycles),
            format!("ask for at most {TRACE_CYCLES} cycles, or leave --trace and --plot out"),
        ));
    }
    let mut outputs = Outputs::new(args.force).reads([&args.valve]);
    let trace = args.trace.as_deref().map(|path| outputs.file(path)).transpose()?;
    let plot = PlotFile::create(&mut outputs, args.plot.as_deref())?;

    let times = times_s(&file, conditions, args.cycles as usize, args.step);
    match args.format {
        Format::Text => print_table(&file, &times)?,
        Format::Json => output::print_json(&document(&file, &conditions, &times))?,
    }
    if wants_path {
        let path = Cycles::simulate(file.valve(), conditions, &file.schedule(), args.cycles, args.step);
        if let Some(out) = trace {
            write_trace(&file, &path, out)?;
        }
        if let Some(out) = plot {
            out.write(&pictures::trace(&file, &conditions, &path).figure())?;
        }
    }
    Ok(Answer::Fine)
}

fn conditions(args: &SimulateArgs, file: &ValveFile) -> anyhow::Result<Conditions> {
    let parameters = file.valve().parameters();
    let mut conditions = Conditions::nominal(parameters);
    conditions.leak_to_atmosphere_m2 = args.leak_to_atmosphere;
    conditions.leak_from_supply_m2 = args.leak_from_supply;
    if let Some(pressure) = &args.supply_pressure {
        conditions.supply_pressure_pa =
            pressure.absolute_pa(parameters.ambient_pressure_pa).context("--supply-pressure")?;
    }
    if let Some(temperature) = args.temperature {
        conditions.temperature_k = temperature;
    }
    conditions.check()?;
    Ok(conditions)
}

fn print_table(file: &ValveFile, times: &[[Option<f64>; 2]]) -> anyhow::Result<()> {
    let limits = file.limits();
    let mut table = TextTable::new(&[
        ("cycle", Align::Right),
        ("closing time (s)", Align::Right),
        ("opening time (s)", Align::Right),
        ("limits", Align::Left),
    ]);
    for (cycle, [close, open]) in times.iter().enumerate() {
        let over = |time: Option<f64>, limit: f64| time.is_none_or(|time| time > limit);
        let verdict = match (over(*close, limits.close_within_s), over(*open, limits.open_within_s)) {
            (false, false) => "kept",
            (true, false) => "closing too slow",
            (false, true) => "opening too slow",
            (true, true) => "both too slow",
        };
        let show = |time: Option<f64>| time.map_or_else(|| "not reached".to_owned(), |time| format!("{time:.5}"));
        table.row(vec![cycle.to_string(), show(*close), show(*open), verdict.to_owned()]);
    }
    output::print_text(&table.render())
}

/// Columns as in a recorded campaign, so that a trace can stand in for a record.
fn write_trace(file: &ValveFile, path: &Cycles, mut out: StagedFile) -> anyhow::Result<()> {
    let times = instants(path.nodes.time_s.last().copied().unwrap_or(0.0), TRACE_SPACING_S);
    let record = path.record(file.valve(), &times);
    let (position, chamber, pipe) = (&record.position_m, &record.chamber_pressure_pa, &record.pipe_pressure_pa);
    writeln!(out, "time_s,command,position_mm,chamber_pressure_kpa,pipe_pressure_kpa")?;
    for (index, time) in times.iter().enumerate() {
        let command = u8::from(path.is_closing_at(*time));
        let (x, p, q) = (position[index] * 1e3, chamber[index] / 1e3, pipe[index] / 1e3);
        writeln!(out, "{time:.3},{command},{x:.6},{p:.5},{q:.5}")?;
    }
    out.commit()
}
