//! `valve demo`: the whole chain on data that the program carries.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Context;
use leak_table::TableBundle;
use prognoser::{Method, Prognoser, Prognosis, TimingLog};
use quantity::Dimension;
use serde::Serialize;
use valve_model::Conditions;
use valve_model::simulate::DEFAULT_STEP_S;

use super::build_tables::TableDir;
use super::prognose::Ends;
use super::{build_tables, tables};
use crate::cli::{DemoArgs, Format};
use crate::failure::Answer;
use crate::output::{self, Align, Outputs, PlotFile, StagedFile, TextTable, told_in};
use answers::SCHEMA;
use answers::figures::life::{History, probability};
use answers::samples::{LEAKING_LOG, reference_valve};
use answers::strokes::Cycles;

/// Growth of the leak with which the log was made, mm2 per cycle; see `data/README.md`.
const TRUE_GROWTH_MM2: f64 = 0.0231;
/// Cycles after which the state is shown.
const SHOWN: [u64; 9] = [1, 2, 3, 5, 8, 12, 14, 18, 24];

/// What the demonstration found, for programs.
#[derive(Serialize)]
struct DemoDocument<'a> {
    schema: u32,
    valve: &'a str,
    close_time_s: Option<f64>,
    open_time_s: Option<f64>,
    close_within_s: f64,
    open_within_s: f64,
    leak_to_atmosphere_at_limit_mm2: f64,
    true_eol_cycle: f64,
    prognoses: Vec<Prognosis>,
}

/// Simulates the valve, builds its tables, reads the log.
pub fn run(args: &DemoArgs) -> anyhow::Result<Answer> {
    let mut outputs = Outputs::new(args.force);
    let plot = PlotFile::create(&mut outputs, args.plot.as_deref())?;
    let files = args.files.as_deref().map(|dir| DemoFiles::create(&mut outputs, dir, args.force)).transpose()?;
    let file = reference_valve();
    let start = Instant::now();

    let conditions = Conditions::nominal(file.valve().parameters());
    let healthy = Cycles::simulate(file.valve(), conditions, &file.schedule(), 1, DEFAULT_STEP_S).times_s[0];
    let text = |time: Option<f64>| time.map_or_else(|| "not at all".to_owned(), |time| format!("in {time:.4} s"));
    let limits = file.limits();
    let tell = |text: &str| if args.format == Format::Text { output::print_text(text) } else { Ok(()) };
    tell(&format!(
        "1. The valve file describes {:?}. Simulated healthy, it closes {} and opens {}; \
         its life ends where a closing takes more than {} s or an opening more than {} s.\n\n",
        file.name(),
        text(healthy[0]),
        text(healthy[1]),
        limits.close_within_s,
        limits.open_within_s
    ))?;

    let built = tables::build(&file)?;
    let bundle = Arc::new(built.bundle);
    tell(&format!(
        "2. Tables from leak area to stroke times, for a pipe that leaks to the atmosphere and one \
         that leaks from the supply ({} cycles simulated until periodic):\n\n{}\n",
        built.simulated,
        indented(&build_tables::summary(&bundle).render_beside(INDENT))
    ))?;

    let limit_mm2 = leak_table::mm2_from_m2(bundle.limit_area_m2(leak_table::Fault::Atmosphere));
    let true_eol_cycle = limit_mm2 / TRUE_GROWTH_MM2;
    let Chain { table, last, figure, prognoses } = prognose(&bundle, true_eol_cycle)?;
    tell(&format!(
        "3. A timing log of 25 cycles, with a missing cycle and a mistyped time, read through the tables. \
         Its leak was made to grow to the limit at cycle {true_eol_cycle:.1}; what was said on the way:\n\n{}\n{last}\n\n",
        indented(&table)
    ))?;
    tell(&format!("Done in {:.2} s. The same with your own files:\n{NEXT}", start.elapsed().as_secs_f64()))?;

    if args.format == Format::Json {
        output::print_document(&DemoDocument {
            schema: SCHEMA,
            valve: file.name(),
            close_time_s: healthy[0],
            open_time_s: healthy[1],
            close_within_s: limits.close_within_s,
            open_within_s: limits.open_within_s,
            leak_to_atmosphere_at_limit_mm2: limit_mm2,
            true_eol_cycle,
            prognoses,
        })?;
    }
    if let (Some(plot), Some(figure)) = (plot, figure) {
        plot.write(&figure.figure())?;
    }
    if let (Some(files), Some(dir)) = (files, &args.files) {
        files.valve.write_whole(file.text().as_bytes())?;
        files.log.write_whole(LEAKING_LOG.as_bytes())?;
        files.tables.write(&bundle)?;
        output::note(&format!("written: {0}/valve.toml, {0}/log.csv, {0}/tables", dir.display()));
    }
    Ok(Answer::Fine)
}

/// The files of the demo, opened before it runs.
struct DemoFiles {
    valve: StagedFile,
    log: StagedFile,
    tables: TableDir,
}

impl DemoFiles {
    fn create(outputs: &mut Outputs, dir: &Path, force: bool) -> anyhow::Result<Self> {
        fs::create_dir_all(dir).with_context(|| format!("{}: cannot be made", dir.display()))?;
        let valve = outputs.file(&dir.join("valve.toml"))?;
        let log = outputs.file(&dir.join("log.csv"))?;
        let leaks = leak_table::Fault::ALL.map(leak_table::Fault::name);
        Ok(Self { valve, log, tables: TableDir::prepare(outputs, &dir.join("tables"), force, &leaks)? })
    }
}

const NEXT: &str = "
    valve build-tables valve.toml --out tables
    valve prognose log.csv --tables tables --plot life.svg

`valve demo --files DIR` leaves these files in DIR; `valve help` lists all verbs.
";

/// Columns before a table.
const INDENT: usize = 3;

fn indented(text: &str) -> String {
    let lines: Vec<String> = text.lines().map(|line| format!("{:INDENT$}{line}", "")).collect();
    lines.join("\n") + "\n"
}

/// What the log said on the way and in the end.
struct Chain {
    table: String,
    last: String,
    figure: Option<report::figures::PrognosisFigure>,
    prognoses: Vec<Prognosis>,
}

fn prognose(tables: &Arc<TableBundle>, true_eol_cycle: f64) -> anyhow::Result<Chain> {
    let method = Method::default();
    let mut prognoser = Prognoser::new(Arc::clone(tables), method);
    let mut log = TimingLog::new("data/leaking-valve.csv", LEAKING_LOG.as_bytes())?;
    let leak = format!("leak ({})", told_in(Dimension::Area).name());
    let mut table = TextTable::new(&[
        ("cycle", Align::Right),
        ("fault", Align::Left),
        ("probability", Align::Right),
        (&leak, Align::Right),
        ("cycles left", Align::Right),
        ("5 to 95 %", Align::Right),
        ("truth", Align::Right),
        ("note", Align::Left),
    ]);
    let mut prognoses = Vec::new();
    let mut history = History::of(None);
    while let Some(row) = log.next_row()? {
        let prognosis = prognoser.push(&row);
        history.add(&row.reading, &prognosis);
        if SHOWN.contains(&prognosis.cycle) {
            table.row(cells(&prognosis, true_eol_cycle));
        }
        prognoses.push(prognosis);
    }
    let ends = Ends::of(prognoser.lasts().cloned());
    let last = ends.iter().map(super::prognose::End::sentence).collect::<Vec<_>>().join("\n");
    let figure = history.figure(tables, method.name(), Some(true_eol_cycle));
    Ok(Chain { table: table.render_beside(INDENT), last, figure, prognoses })
}

fn cells(one: &Prognosis, true_eol_cycle: f64) -> Vec<String> {
    let number =
        |value: Option<f64>, digits: usize| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"));
    let bounds = match (one.rul_p05, one.rul_p95) {
        (Some(low), Some(high)) => format!("{low:.1} to {high:.1}"),
        _ => "-".to_owned(),
    };
    let notes: Vec<&str> = one.notices.iter().map(prognoser::Notice::kind).collect();
    vec![
        one.cycle.to_string(),
        one.fault.name().to_owned(),
        number(probability(one), 3),
        one.leak_area_mm2.map_or_else(|| "-".to_owned(), |area| told_in(Dimension::Area).number(1e-6 * area, 3)),
        number(one.rul_cycles, 1),
        bounds,
        format!("{:.1}", true_eol_cycle - one.cycle as f64),
        notes.join(", "),
    ]
}
