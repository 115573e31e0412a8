//! `valve init campaign`: a look at recordings, and a campaign file.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context;
use campaign::guess::{DraftRun, Hints, Recording, Understanding, Unknown, draft, understand};
use campaign::{Campaign, ValveFacts};
use model_lab::data::valve_facts;
use quantity::{Dimension, Quantity, pressure_pa};

use super::dialogue;
use crate::cli::InitCampaignArgs;
use crate::commands::valve_input;
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs};

/// The atmosphere where no valve file says another one, Pa.
const USUAL_AMBIENT_PA: f64 = 101_325.0;

/// Looks, asks or refuses, checks and writes.
pub fn run(args: &InitCampaignArgs) -> anyhow::Result<Answer> {
    let out = Outputs::new(args.force).reads(&args.files).reads(&args.valve).file(&args.out)?;
    let valve = args.valve.as_deref().map(valve_input::read).transpose()?;
    let facts = valve.as_ref().map(|file| valve_facts(file.valve()));
    let recordings = recordings(&args.files)?;
    let mut hints = hints(args, facts.as_ref())?;
    let found = settled(&recordings, &mut hints)?;
    let runs = runs(args, &recordings, &found, facts.as_ref())?;
    let name = args.name.clone().unwrap_or_else(|| name_of_folder(&args.out));
    let text = draft(&name, &found, &recordings[0], &runs);
    let facts = facts.unwrap_or_else(|| assumed_facts(&hints, &runs));
    // What cannot be read back is not written.
    let folder = folder_of(&args.out);
    let read =
        Campaign::parse(&text, &args.out.display().to_string(), &facts, &|file| std::fs::read(folder.join(file)))
            .with_context(|| {
                "the recordings cannot be used as they were understood, and nothing was written".to_owned()
            })?;
    out.write_whole(text.as_bytes())?;
    for warning in &read.warnings {
        output::note(&format!("warning: {warning}"));
    }
    output::print_text(&summary(args, &found, &runs, &read))?;
    Ok(Answer::Fine)
}

fn recordings(files: &[PathBuf]) -> anyhow::Result<Vec<Recording>> {
    let read = |path: &PathBuf| {
        let shown = path.display().to_string();
        let bytes = std::fs::read(path).with_context(|| format!("{shown}: cannot be read"))?;
        Ok(Recording::read(&bytes, &shown)?)
    };
    files.iter().map(read).collect()
}

fn hints(args: &InitCampaignArgs, facts: Option<&ValveFacts>) -> anyhow::Result<Hints> {
    let mut columns = Vec::new();
    for column in &args.column {
        let (channel, name) = column.split_once('=').ok_or_else(|| {
            Hinted::error(format!("--column {column}: no channel and name"), "such as --column position=LVDT")
        })?;
        let known = ["time", "command", "position", "chamber_pressure", "pipe_pressure", "supply_pressure"];
        if !known.contains(&channel) {
            let hint = format!("one of {}{}", known.join(", "), quantity::suggest::did_you_mean(channel, known));
            return Err(Hinted::error(format!("--column {column}: there is no channel \"{channel}\""), hint));
        }
        columns.push((channel.to_owned(), name.to_owned()));
    }
    let stroke = args.stroke.as_ref().map(|text| {
        Quantity::parse(text, Dimension::Length)
            .map(|quantity| quantity.si())
            .map_err(|error| anyhow::anyhow!("--stroke: {error}"))
    });
    Ok(Hints {
        stroke_m: facts.map(|facts| facts.stroke_m).or(stroke.transpose()?),
        ambient_pressure_pa: facts.map_or(USUAL_AMBIENT_PA, |facts| facts.ambient_pressure_pa),
        columns,
        one_closes: args.one_means.as_deref().map(|word| word == "close"),
        grows_to_open: args.position_grows.as_deref().map(|word| word == "open"),
    })
}

/// What the recordings hold, with questions at a terminal about what they do not tell.
fn settled(recordings: &[Recording], hints: &mut Hints) -> anyhow::Result<Understanding> {
    loop {
        let found = understand(recordings, hints);
        let Some(unknown) = found.unknown.first().copied() else { return Ok(found) };
        let names = recordings[0].names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
        let (what, option) = described(unknown);
        if !dialogue::is_possible() {
            let said = found.said.iter().fold(String::new(), |text, said| text + "\n  " + said);
            return Err(Hinted::error(
                format!("the recordings do not tell {what}; their columns are {names}.\nUnderstood so far:{said}"),
                format!("say it with {option}"),
            ));
        }
        for said in &found.said {
            output::note(&format!("  {said}"));
        }
        ask(unknown, what, &names, recordings, hints)?;
    }
}

fn described(unknown: Unknown) -> (&'static str, &'static str) {
    match unknown {
        Unknown::Time => ("which column is the time", "--column time=NAME"),
        Unknown::Position => ("which column is the position", "--column position=NAME"),
        Unknown::PositionUnit => ("in which unit the position is", "--valve valve.toml or --stroke \"25.4 mm\""),
        Unknown::Command => ("which column is the command", "--column command=NAME or --column pipe_pressure=NAME"),
        Unknown::Direction => (
            "whether a command of 1 tells the valve to close or to open",
            "--one-means close (or open), or --position-grows open (or closed)",
        ),
    }
}

fn ask(unknown: Unknown, what: &str, names: &str, recordings: &[Recording], hints: &mut Hints) -> anyhow::Result<()> {
    let column = |text: &str| {
        let known =
            recordings[0].names.iter().zip(&recordings[0].bare).any(|(name, bare)| name == text || bare == text);
        if known { Ok(text.to_owned()) } else { Err(format!("there is no such column; there are {names}")) }
    };
    let channel = match unknown {
        Unknown::Time => Some("time"),
        Unknown::Position => Some("position"),
        Unknown::Command => Some("command"),
        Unknown::PositionUnit | Unknown::Direction => None,
    };
    if let Some(channel) = channel {
        let answer = dialogue::ask(&format!("Tell {what} ({names})"), false, column)?;
        hints.columns.extend(answer.map(|(_, name)| (channel.to_owned(), name)));
    } else if unknown == Unknown::PositionUnit {
        let length = |text: &str| Quantity::parse(text, Dimension::Length).map_err(|error| error.to_string());
        let answer = dialogue::ask("The stroke between the stops, such as 25.4 mm", false, length)?;
        hints.stroke_m = answer.map(|(_, length)| length.si());
    } else {
        let word = |text: &str| match text {
            "close" => Ok(true),
            "open" => Ok(false),
            _ => Err("close or open".to_owned()),
        };
        hints.one_closes =
            dialogue::ask("What does a command of 1 mean, close or open?", false, word)?.map(|(_, closes)| closes);
    }
    Ok(())
}

/// What an option says of a file: `FILE=VALUE`, or a value of all.
fn stated(given: &[String], file: &str) -> Option<String> {
    let of_file = given.iter().find_map(|text| {
        let (name, value) = text.split_once('=')?;
        let ends = file == name || Path::new(file).ends_with(name);
        ends.then(|| value.trim().to_owned())
    });
    of_file.or_else(|| given.iter().find(|text| !text.contains('=')).cloned())
}

fn runs(
    args: &InitCampaignArgs,
    recordings: &[Recording],
    found: &Understanding,
    facts: Option<&ValveFacts>,
) -> anyhow::Result<Vec<DraftRun>> {
    let ambient_pa = facts.map_or(USUAL_AMBIENT_PA, |facts| facts.ambient_pressure_pa);
    let pressure = |text: &str| match pressure_pa(text, ambient_pa) {
        Ok(pascal) if pascal > ambient_pa => Ok(()),
        Ok(_) => Err(format!("\"{text}\" is not above the atmosphere")),
        Err(error) => Err(error.to_string()),
    };
    let temperature =
        |text: &str| Quantity::parse(text, Dimension::Temperature).map(|_| ()).map_err(|error| error.to_string());
    let (mut runs, mut missing) = (Vec::new(), Vec::new());
    for (recording, supply) in recordings.iter().zip(&found.supply) {
        let file = &recording.file;
        let mut run = DraftRun { file: relative(Path::new(file), folder_of(&args.out)), ..DraftRun::default() };
        if let Some(text) = stated(&args.supply, file) {
            pressure(&text).map_err(|reason| anyhow::anyhow!("--supply: {reason}"))?;
            (run.supply_pressure, run.supply_from) = (text, "as you said".to_owned());
        } else if let Some(supply) = supply {
            (run.supply_pressure, run.supply_from) = (supply.text.clone(), format!("from {}", supply.from));
        } else if dialogue::is_possible() {
            let question = format!("Supply pressure of {file}, such as 75 psig or 5.2 barg");
            let answer = dialogue::ask(&question, false, pressure)?;
            (run.supply_pressure, run.supply_from) =
                (answer.map(|(text, ())| text).unwrap_or_default(), "as you said".to_owned());
        } else {
            missing.push(file.clone());
        }
        if let Some(text) = stated(&args.temperature, file) {
            temperature(&text).map_err(|reason| anyhow::anyhow!("--temperature: {reason}"))?;
            run.temperature = Some(text);
        } else if dialogue::is_possible() && args.temperature.is_empty() {
            let question = format!("Temperature of {file}, such as 20 degC; empty for that of the valve file");
            run.temperature = dialogue::ask(&question, true, temperature)?.map(|(text, ())| text);
        }
        runs.push(run);
    }
    if missing.is_empty() {
        return Ok(runs);
    }
    Err(Hinted::error(
        format!("the supply pressure is not known of {}", missing.join(", ")),
        "say it with --supply \"75 psig\" (all recordings), --supply \"run-01.csv=75 psig\" (one), or in the files' names",
    ))
}

/// What a valve file would say, where there is none: taken from the recordings themselves.
fn assumed_facts(hints: &Hints, runs: &[DraftRun]) -> ValveFacts {
    let supply = runs.iter().find_map(|run| pressure_pa(&run.supply_pressure, hints.ambient_pressure_pa).ok());
    ValveFacts {
        ambient_pressure_pa: hints.ambient_pressure_pa,
        supply_pressure_pa: supply.unwrap_or(6e5),
        temperature_k: 293.15,
        stroke_m: hints.stroke_m.unwrap_or(0.025),
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

fn name_of_folder(out: &Path) -> String {
    let folder = std::path::absolute(out).ok();
    let name = folder.as_deref().and_then(Path::parent).and_then(Path::file_name);
    name.map_or_else(|| "campaign".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// A file's path as seen from a folder.
fn relative(file: &Path, folder: &Path) -> String {
    let whole = |path: &Path| std::path::absolute(path).ok();
    let plain = |path: &Path| path.components().filter(|part| part.as_os_str() != ".").collect::<PathBuf>();
    let seen = match (whole(file), whole(if folder.as_os_str().is_empty() { Path::new(".") } else { folder })) {
        (Some(file), Some(folder)) => {
            let (file, folder) = (plain(&file), plain(&folder));
            file.strip_prefix(&folder).map_or_else(|_| file.clone(), Path::to_owned)
        }
        _ => file.to_owned(),
    };
    seen.display().to_string().replace('\\', "/")
}

fn summary(args: &InitCampaignArgs, found: &Understanding, runs: &[DraftRun], read: &Campaign) -> String {
    let out = args.out.display();
    let mut text = String::from("Understood:\n");
    // Writing to a string cannot fail.
    for said in &found.said {
        let _ = writeln!(text, "- {said}");
    }
    for (run, recorded) in runs.iter().zip(&read.runs) {
        let edges: Vec<String> = recorded
            .commands
            .iter()
            .take(6)
            .map(|edge| format!("{} at {:.3} s", if edge.close { "close" } else { "open" }, edge.time_s))
            .collect();
        let _ = writeln!(text, "- {}: {} ({}), {}", run.file, run.supply_pressure, run.supply_from, edges.join(", "));
    }
    if runs.iter().any(|run| run.temperature.is_none()) {
        let _ = writeln!(
            text,
            "- temperature: not given, that of the valve file will be taken; --temperature \"20 degC\" states it"
        );
    }
    if let Some(run) = read.runs.first() {
        let top_mm = run.trace.position_m.iter().copied().filter(|x| x.is_finite()).fold(0.0, f64::max) * 1e3;
        let rows = || run.trace.time_s.iter().enumerate();
        let command: Vec<[f64; 2]> =
            rows().map(|(row, t)| [*t, if run.trace.command_close[row] { 0.0 } else { top_mm }]).collect();
        let position: Vec<[f64; 2]> =
            rows().map(|(row, t)| [*t, run.trace.position_m[row] * 1e3]).filter(|point| point[1].is_finite()).collect();
        let _ = writeln!(text, "\n{} (o position, . where the command sends it):", run.file);
        text.push_str(&output::sketch(&command, &position, ["s", "mm"]));
    }
    let valve = args.valve.as_ref().map_or("valve.toml".to_owned(), |path| path.display().to_string());
    let _ = writeln!(text, "\nwritten: {out}");
    if !Path::new(&valve).exists() {
        text.push_str(&output::next_step("describe the valve, by its datasheet", &["init", "--out", &valve]));
    }
    let why = "see how a model of the valve does beside the recordings";
    text.push_str(&output::next_step(why, &["compare", &valve, &out.to_string()]));
    text
}
