//! `valve prognose`: a timing log through the tables to remaining useful life.

mod ends;
mod keeping;
mod remarks;
mod rows;
mod settings;
mod shards;
mod standing;
mod stream;
mod subscribed;
mod vital;
mod writer;

use std::io::BufWriter;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use answers::figures::life::History;
use leak_table::TableBundle;
use prognoser::Status;

use self::keeping::Keeping;
use self::remarks::Remarks;
use self::rows::{Rows, from_broker};
use self::shards::{Shards, Way};
use self::stream::{Ended, Stream};
use self::vital::{Batch, Vital};
use self::writer::{RowFormat, Writer};
use crate::cli::{PrognoseArgs, StreamFormat};
use crate::commands::log_input;
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs, PlotFile, free_name, next_step};

pub use ends::{End, Ends, limits_words};

/// Reads the log to its end and prints a line for every row, or how all valves
/// stand.
pub fn run(args: &PrognoseArgs) -> anyhow::Result<Answer> {
    let tables = Arc::new(read_tables(args)?);
    let method = settings::method(args, &tables)?;
    settings::check_source(args)?;
    let mut outputs = Outputs::new(args.force).reads([&args.log, &args.tables]).reads(&args.valve).reads(&args.prior);
    outputs = outputs.reads(&args.broker.map).reads(&args.broker.credentials);
    let plot = PlotFile::create(&mut outputs, args.plot.as_deref())?;
    let history = plot.is_some().then(|| History::of(args.plot_valve.clone()));

    let stop = asked_to_stop();
    let keeping = Keeping::open(args, &tables, &method, &mut outputs)?;
    let store = keeping.as_ref().map(|keeping| Arc::clone(keeping.store()));
    let vital = Arc::new(Vital::new(from_broker(args)));
    let from = keeping.as_ref().and_then(Keeping::position);
    let mut rows = Rows::open(args, from, store.as_deref(), &vital, &stop)?;
    if args.listen.is_some() {
        vital.add(&stood(keeping.as_ref())?);
        vital.serve(args)?;
    }
    let live = rows.is_live();
    let publishes = rows.broker().is_some_and(|broker| broker.publishes());
    let name = rows.broker().map_or_else(|| args.log.display().to_string(), |broker| broker.name().to_owned());
    log_input::tell_unknown(&name, rows.unknown_columns());
    let until_end_of_life = args.fail_on_eol && live;
    let way = Way {
        format: RowFormat {
            format: if publishes { StreamFormat::Jsonl } else { args.format },
            rows_as_text: args.all_rows || live,
        },
        one_by_one: rows.one_by_one() || until_end_of_life,
        strict: args.strict,
        most_skips: if live { u64::MAX } else { log_input::most_skips() },
        until_end_of_life,
        unit: if from_broker(args) { "message" } else { "line" },
    };
    let writer = match keeping.as_ref().map(Keeping::output).transpose()?.flatten() {
        // What is published is not told on stdout as well, only how valves stand at the end.
        None if publishes => {
            let format = RowFormat { format: StreamFormat::Text, rows_as_text: false };
            Writer::new(format, Box::new(output::stdout()))?
        }
        None => Writer::new(way.format, Box::new(output::stdout()))?,
        Some((rows, out)) => {
            let out = Box::new(BufWriter::new(out));
            if rows == 0 { Writer::new(way.format, out)? } else { Writer::below(way.format, out, rows) }
        }
    };
    let shards = Shards::new(name.clone(), &tables, &method, way, history, store, Arc::clone(&vital));
    let remarks = Remarks::new(live);
    let mut stream = Stream { rows, shards, writer, remarks, keeping, vital, stop, live };
    let ended = stream.run()?;
    let Stream { shards, writer, remarks, keeping, .. } = stream;
    let is_backwards = remarks.finish(&name, &tables);
    if !live {
        shards.skips().refuse_all(writer.rows())?;
    }
    shards.skips().finish(&name, way.unit);
    shards.names().untold().iter().for_each(|words| output::note(&format!("{name}: {words}")));
    let (lasts, history) = shards.finish();
    let ends = match &keeping {
        None => Ends::of(lasts.into_iter()),
        Some(keeping) if writer.tells_ends() => Ends::of(keeping.lasts()?.into_iter()),
        Some(_) => Ends::default(),
    };
    if writer.rows() == 0 && !from_broker(args) {
        output::note(&format!("{name}: has no rows below its header; nothing is known of any valve"));
    }
    writer.finish(&ends)?;
    match ended {
        Ended::Whole => {}
        Ended::EndOfLife => return Ok(Answer::BadNews),
        Ended::Failed(error) => return Err(error),
        Ended::Interrupted => {
            return Err(Hinted::error(
                format!("{name}: interrupted; what was written is of the rows up to there"),
                "run it again for the whole log",
            ));
        }
    }
    if args.format == StreamFormat::Text && !live {
        if ends.iter().any(|end| end.row().fault.wears()) {
            output::print_text(&format!("\n{}\n", limits_words(&tables.manifest().limits)))?;
            if settings::begins_healthy(&method) {
                output::print_text(BEGINS_HEALTHY)?;
            }
        }
        output::print_text(&next(args, &ends))?;
    }
    if let (Some(plot), Some(history)) = (plot, history) {
        let figure = history.figure(&tables, method.name(), args.true_eol);
        plot.write(&figure.ok_or_else(|| no_such_valve(args))?.figure())?;
    }
    let reached = !live && ends.iter().any(|end| end.row().status == Status::EolReached);
    Ok(if is_backwards || args.fail_on_eol && reached { Answer::BadNews } else { Answer::Fine })
}

/// What the numbers of a named fault rest on.
const BEGINS_HEALTHY: &str =
    "Each valve counts as healthy at its first row. Of a log that begins later in life: --start unknown.\n";

/// How many valves stood where when the states were kept.
fn stood(keeping: Option<&Keeping>) -> anyhow::Result<Batch> {
    let mut stood = Batch::default();
    for last in keeping.map(Keeping::lasts).transpose()?.into_iter().flatten() {
        stood.moved(None, last.status);
    }
    Ok(stood)
}

/// A flag that Ctrl-C and SIGTERM set, so that what was begun is written to its end.
fn asked_to_stop() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    // Without the handler they end the program at once.
    let _ = ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed));
    stop
}

/// What to do with what was found.
fn next(args: &PrognoseArgs, ends: &Ends) -> String {
    let Some(worst) = ends.iter().next().filter(|_| args.plot.is_none()) else { return String::new() };
    let (log, tables) = (args.log.display().to_string(), args.tables.display().to_string());
    let name = worst.row().valve.as_str();
    let picture = free_name("life.svg");
    let options = args.estimate_words();
    let mut words = vec!["prognose", &log, "--tables", &tables, "--plot", &picture];
    words.extend(options.iter().map(String::as_str));
    if ends.len() > 1 {
        words.extend(["--plot-valve", name]);
    }
    if log == "-" { String::new() } else { next_step(&format!("look at how {name} came to this"), &words) }
}

fn read_tables(args: &PrognoseArgs) -> anyhow::Result<TableBundle> {
    let bundle = match &args.valve {
        Some(path) => {
            let file = valve_file::ValveFile::read(path)?;
            TableBundle::read_for_model(&args.tables, &answers::tables::hash_of(&file))?
        }
        None => TableBundle::read(&args.tables)?,
    };
    Ok(bundle)
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
