//! `valve prognose`: a timing log through the tables to remaining useful life.

mod history;
mod settings;
mod writer;

use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use leak_table::TableBundle;
use prognoser::{FollowedFile, Prognoser, Status, TimingLog};

use super::tables;
use crate::cli::PrognoseArgs;
use crate::failure::{Answer, Hinted};
use crate::output::{self, PlotFile};

pub use history::{End, Ends, History, probability};
pub use writer::Writer;

/// How often a growing log is looked at.
const POLL: Duration = Duration::from_millis(200);

/// Reads the log to its end and prints a line for every row.
pub fn run(args: &PrognoseArgs) -> anyhow::Result<Answer> {
    let tables = Arc::new(read_tables(args)?);
    let method = settings::method(args)?;
    let plot = PlotFile::create(args.plot.as_deref())?;
    let mut history = plot.is_some().then(|| History::of(args.plot_valve.clone()));
    let mut ends = Ends::default();

    let (source, live) = open(args)?;
    let mut log = TimingLog::new(args.log.display().to_string(), source)?;
    let mut prognoser = Prognoser::new(Arc::clone(&tables), method);
    let mut writer = Writer::new(args.format, output::stdout(), live)?;
    while let Some(row) = log.next_row()? {
        let (prognosis, reading) = (prognoser.push(&row), row.reading);
        for notice in &prognosis.notices {
            output::note(&format!(
                "{}:{}: valve {}, cycle {}: {notice}",
                args.log.display(),
                row.line,
                prognosis.valve,
                prognosis.cycle
            ));
        }
        writer.write(&prognosis)?;
        ends.add(&prognosis);
        if let Some(history) = &mut history {
            history.add(&reading, &prognosis);
        }
    }
    writer.finish(&ends)?;
    if let (Some(plot), Some(history)) = (plot, history) {
        let figure = history.figure(&tables, method.name(), args.true_eol);
        plot.write(&figure.ok_or_else(|| no_such_valve(args))?.figure())?;
    }
    let reached = ends.iter().any(|end| end.status == Status::EolReached);
    Ok(if args.fail_on_eol && reached { Answer::BadNews } else { Answer::Fine })
}

fn read_tables(args: &PrognoseArgs) -> anyhow::Result<TableBundle> {
    let bundle = match &args.valve {
        Some(path) => {
            let file = valve_file::ValveFile::read(path)?;
            TableBundle::read_for_model(&args.tables, &tables::hash_of(&file))?
        }
        None => TableBundle::read(&args.tables)?,
    };
    Ok(bundle)
}

/// The log to read, and whether rows are to go out as soon as they come in.
fn open(args: &PrognoseArgs) -> anyhow::Result<(Box<dyn BufRead>, bool)> {
    if args.log == Path::new("-") {
        return Ok((Box::new(io::stdin().lock()), true));
    }
    let context = || format!("{}: cannot be read", args.log.display());
    if args.follow {
        let file = FollowedFile::open(&args.log, POLL).with_context(context)?;
        return Ok((Box::new(BufReader::new(file)), true));
    }
    let file = File::open(&args.log).with_context(context)?;
    Ok((Box::new(BufReader::with_capacity(1 << 16, file)), false))
}

fn no_such_valve(args: &PrognoseArgs) -> anyhow::Error {
    match &args.plot_valve {
        Some(name) => Hinted::error(
            format!("{}: has no valve {name:?} to draw", args.log.display()),
            "leave --plot-valve out to draw the first one",
        ),
        None => Hinted::error(format!("{}: has no row to draw", args.log.display()), "record a cycle first"),
    }
}
