//! `valve prognose`: a timing log through the tables to remaining useful life.

mod ends;
mod keeping;
mod rows;
mod settings;
mod shards;
mod standing;
mod writer;

use std::io::BufWriter;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use answers::figures::life::History;
use leak_table::TableBundle;
use prognoser::Status;

use self::keeping::Keeping;
use self::rows::Rows;
use self::shards::{Shards, Step, Way};
use self::writer::{RowFormat, Writer};
use crate::cli::{PrognoseArgs, StreamFormat};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs, PlotFile, free_name, next_step};

pub use ends::{End, Ends};

/// Reads the log to its end and prints a line for every row, or how all valves
/// stand.
pub fn run(args: &PrognoseArgs) -> anyhow::Result<Answer> {
    let tables = Arc::new(read_tables(args)?);
    let method = settings::method(args, &tables)?;
    let mut outputs = Outputs::new(args.force).reads([&args.log, &args.tables]).reads(&args.valve).reads(&args.prior);
    let plot = PlotFile::create(&mut outputs, args.plot.as_deref())?;
    let history = plot.is_some().then(|| History::of(args.plot_valve.clone()));

    let stop = asked_to_stop();
    let mut keeping = Keeping::open(args, &tables, &method, &mut outputs)?;
    let mut rows = Rows::open(args, keeping.as_ref().and_then(Keeping::position), &stop)?;
    let live = rows.is_live();
    let name = args.log.display().to_string();
    for column in rows.unknown_columns() {
        output::note(&format!(
            "{name}: column {column:?} is not understood and not used; `valve help prognose` lists those that are"
        ));
    }
    let until_end_of_life = args.fail_on_eol && live;
    let way = Way {
        format: RowFormat { format: args.format, rows_as_text: args.all_rows || live },
        one_by_one: rows.one_by_one() || until_end_of_life,
        strict: args.strict,
        until_end_of_life,
    };
    let mut writer = match &keeping {
        None => Writer::new(way.format, Box::new(output::stdout()))?,
        Some(keeping) => {
            let (rows, out) = keeping.output()?;
            let out = Box::new(BufWriter::new(out));
            if rows == 0 { Writer::new(way.format, out)? } else { Writer::below(way.format, out, rows) }
        }
    };
    let store = keeping.as_ref().map(|keeping| Arc::clone(keeping.store()));
    let mut shards = Shards::new(name.clone(), &tables, &method, way, history, store);
    let ended = loop {
        let each = |row: &[u8], notes: &str| {
            notes.lines().for_each(output::note);
            writer.write(row)
        };
        let step = shards.step(&mut rows, each, output::note);
        if let (Some(keeping), Ok(step)) = (&mut keeping, &step) {
            let at_once = *step != Step::More || stop.load(Ordering::Relaxed);
            keeping.step(at_once, rows.position(), &mut writer, &mut shards)?;
        } else if live {
            writer.flush()?;
        }
        match step {
            Ok(Step::More | Step::Idle) if stop.load(Ordering::Relaxed) => {
                break if live { Ended::Whole } else { Ended::Interrupted };
            }
            Ok(Step::More | Step::Idle) => {}
            Ok(Step::End) => break Ended::Whole,
            Ok(Step::EndOfLife) => break Ended::EndOfLife,
            Err(error) if live => break Ended::Failed(error),
            Err(error) => return Err(error),
        }
    };
    if shards.skipped() > 0 {
        output::note(&format!("{name}: {} lines were no rows and were skipped", shards.skipped()));
    }
    let (lasts, history) = shards.finish();
    let ends = match &keeping {
        None => Ends::of(lasts.into_iter()),
        Some(keeping) if args.format == StreamFormat::Text => Ends::of(keeping.lasts()?.into_iter()),
        Some(_) => Ends::default(),
    };
    if writer.rows() == 0 {
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
        output::print_text(&next(args, &ends))?;
    }
    if let (Some(plot), Some(history)) = (plot, history) {
        let figure = history.figure(&tables, method.name(), args.true_eol);
        plot.write(&figure.ok_or_else(|| no_such_valve(args))?.figure())?;
    }
    let reached = !live && ends.iter().any(|end| end.row().status == Status::EolReached);
    Ok(if args.fail_on_eol && reached { Answer::BadNews } else { Answer::Fine })
}

/// How a stream of rows came to its end.
enum Ended {
    Whole,
    Interrupted,
    EndOfLife,
    Failed(anyhow::Error),
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
