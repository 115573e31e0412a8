//! `valve prognose`: a timing log through the tables to remaining useful life.

mod ends;
mod history;
mod settings;
mod shards;
mod standing;
mod writer;

use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use leak_table::TableBundle;
use prognoser::{FollowedFile, Status, TimingLog};

use self::shards::Shards;
use self::writer::{RowFormat, Writer};
use super::tables;
use crate::cli::{PrognoseArgs, StreamFormat};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs, PlotFile, free_name, next_step};

pub use ends::{End, Ends};
pub use history::{History, probability};

/// How often a growing log is looked at.
const POLL: Duration = Duration::from_millis(200);

/// Reads the log to its end and prints a line for every row, or how all valves
/// stand.
pub fn run(args: &PrognoseArgs) -> anyhow::Result<Answer> {
    let tables = Arc::new(read_tables(args)?);
    let method = settings::method(args, &tables)?;
    let mut outputs = Outputs::new(args.force).reads([&args.log, &args.tables]).reads(&args.valve).reads(&args.prior);
    let plot = PlotFile::create(&mut outputs, args.plot.as_deref())?;
    let history = plot.is_some().then(|| History::of(args.plot_valve.clone()));

    let (source, live) = open(args)?;
    let name = args.log.display().to_string();
    let mut log = TimingLog::new(name.clone(), source)?.with_empty_as_stalled(args.empty_is_stalled);
    for column in log.unknown_columns() {
        output::note(&format!(
            "{name}: column {column:?} is not understood and not used; `valve help prognose` lists those that are"
        ));
    }
    let format = RowFormat { format: args.format, rows_as_text: args.all_rows || live };
    let mut writer = Writer::new(format, output::stdout(), live)?;
    let mut shards = Shards::new(name, &tables, &method, format, live, history);
    let mut each = |row: &[u8], notes: &str| {
        notes.lines().for_each(output::note);
        writer.write(row)
    };
    while shards.step(&mut log, &mut each)? {}
    let (lasts, history) = shards.finish();
    let ends = Ends::of(lasts.into_iter());
    writer.finish(&ends)?;
    if args.format == StreamFormat::Text && !live {
        output::print_text(&next(args, &ends))?;
    }
    if let (Some(plot), Some(history)) = (plot, history) {
        let figure = history.figure(&tables, method.name(), args.true_eol);
        plot.write(&figure.ok_or_else(|| no_such_valve(args))?.figure())?;
    }
    let reached = ends.iter().any(|end| end.row().status == Status::EolReached);
    Ok(if args.fail_on_eol && reached { Answer::BadNews } else { Answer::Fine })
}

/// What to do with what was found.
fn next(args: &PrognoseArgs, ends: &Ends) -> String {
    let Some(worst) = ends.iter().next().filter(|_| args.plot.is_none()) else { return String::new() };
    let (log, tables) = (args.log.display().to_string(), args.tables.display().to_string());
    let name = worst.row().valve.as_str();
    let picture = free_name("life.svg");
    let mut words = vec!["prognose", &log, "--tables", &tables, "--plot", &picture];
    if ends.len() > 1 {
        words.extend(["--plot-valve", name]);
    }
    if log == "-" { String::new() } else { next_step(&format!("look at how {name} came to this"), &words) }
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
