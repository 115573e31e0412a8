//! `valve simulate`: stroke times, the trace, the picture.

use std::io::Write;

use anyhow::Context;
use leak_table::mm2_from_m2;
use report::figures::TraceFigure;
use serde::Serialize;
use valve_file::ValveFile;
use valve_model::cycle::cycles;
use valve_model::{Conditions, Schedule};

use super::strokes::{Cycles, instants};
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

    let times = times_s(&file, conditions, args);
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
            out.write(&picture(&file, &conditions, &path).figure())?;
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

/// Closing and opening time of every cycle, s. Once cycles repeat, the later ones
/// are the same and are not simulated again.
fn times_s(file: &ValveFile, conditions: Conditions, args: &SimulateArgs) -> Vec<[Option<f64>; 2]> {
    let wanted = args.cycles as usize;
    let simulated = cycles(&[(file.valve(), conditions)], &file.schedule(), wanted, args.step);
    let mut times: Vec<[Option<f64>; 2]> =
        simulated.into_iter().flatten().map(|cycle| [cycle.close_time_s, cycle.open_time_s]).collect();
    if let Some(last) = times.last().copied() {
        times.resize(wanted, last);
    }
    times
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

#[derive(Serialize)]
struct Document<'a> {
    valve: &'a str,
    conditions: ConditionsOut,
    schedule: ScheduleOut,
    cycles: Vec<CycleOut>,
}

#[derive(Serialize)]
struct ConditionsOut {
    supply_pressure_pa: f64,
    temperature_k: f64,
    leak_to_atmosphere_mm2: f64,
    leak_from_supply_mm2: f64,
}

#[derive(Serialize)]
#[expect(clippy::struct_field_names, reason = "a raw number carries its unit in its name")]
struct ScheduleOut {
    close_at_s: f64,
    open_at_s: f64,
    end_s: f64,
}

#[derive(Serialize)]
struct CycleOut {
    cycle: usize,
    close_time_s: Option<f64>,
    open_time_s: Option<f64>,
}

fn document<'a>(file: &'a ValveFile, conditions: &Conditions, times: &[[Option<f64>; 2]]) -> Document<'a> {
    let Schedule { close_at_s, open_at_s, end_s } = file.schedule();
    let cycle = |(cycle, [close_time_s, open_time_s]): (usize, &[Option<f64>; 2])| CycleOut {
        cycle,
        close_time_s: *close_time_s,
        open_time_s: *open_time_s,
    };
    Document {
        valve: file.name(),
        conditions: ConditionsOut {
            supply_pressure_pa: conditions.supply_pressure_pa,
            temperature_k: conditions.temperature_k,
            leak_to_atmosphere_mm2: mm2_from_m2(conditions.leak_to_atmosphere_m2),
            leak_from_supply_mm2: mm2_from_m2(conditions.leak_from_supply_m2),
        },
        schedule: ScheduleOut { close_at_s, open_at_s, end_s },
        cycles: times.iter().enumerate().map(cycle).collect(),
    }
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

/// The picture of a path: strokes, pressures, commands.
pub fn picture(file: &ValveFile, conditions: &Conditions, path: &Cycles) -> TraceFigure {
    let nodes = &path.nodes;
    let mut events = Vec::new();
    let mut said = Vec::new();
    for (pair, edges) in path.times_s.iter().zip(path.commands.chunks(2)) {
        for (time, edge, done, verb) in [(pair[0], edges[0], "closed", "closes"), (pair[1], edges[1], "open", "opens")]
        {
            if let Some(time) = time {
                events.push((edge.time_s + time, format!("{done} after {time:.3} s")));
                said.push(format!("{verb} in {time:.4} s"));
            } else {
                said.push(format!("not {done} in time"));
            }
        }
    }
    said.truncate(2);
    if path.times_s.len() > 2 {
        // Texts of many cycles would lie over each other.
        events.clear();
    }
    let scaled = |values: &[f64], factor: f64| values.iter().map(|value| value * factor).collect();
    TraceFigure {
        title: format!(
            "{}: {} kPa supply, {:.0} K",
            file.name(),
            (conditions.supply_pressure_pa / 1e3).round(),
            conditions.temperature_k
        ),
        subtitle: said.join(", "),
        command_close: nodes.time_s.iter().map(|time| path.is_closing_at(*time)).collect(),
        position_mm: scaled(&nodes.position_m, 1e3),
        chamber_pressure_kpa: scaled(&nodes.chamber_pressure_pa, 1e-3),
        pipe_pressure_kpa: scaled(&nodes.pipe_pressure_pa, 1e-3),
        supply_pressure_kpa: Some(conditions.supply_pressure_pa / 1e3),
        stroke_mm: file.valve().parameters().stroke_m * 1e3,
        events,
        time_s: nodes.time_s.clone(),
    }
}
