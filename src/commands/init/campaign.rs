//! `valve init campaign`: a look at recordings, and a campaign file.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context;
use campaign::guess::{ColumnGuess, Conflict, DraftRun, Hints, Recording, Understanding, Unknown, draft, understand};
use campaign::{Campaign, ValveFacts};
use model_lab::data::valve_facts;
use quantity::{Dimension, Quantity, Reference, Unit, pressure_pa};
use valve_file::ValveFile;

use super::conditions::Stated;
use super::dialogue;
use crate::cli::InitCampaignArgs;
use crate::commands::valve_input;
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs};
use answers::position_error_m;
use answers::simulation::rests_m;

/// The atmosphere where no valve file says another one, Pa.
const USUAL_AMBIENT_PA: f64 = 101_325.0;
/// The channels that `--column` knows.
const CHANNELS: [&str; 6] = ["time", "command", "position", "chamber_pressure", "pipe_pressure", "supply_pressure"];
/// What `--column` says of a channel that is to be left out.
const LEFT_OUT: &str = "none";
/// A direction is the right one where the model is off by less than this share of what it is the other way round.
const FAR_BETTER: f64 = 0.5;
/// Stands for a supply pressure that nobody has said yet, where only the recordings are looked at.
const ANY_SUPPLY: &str = "1 MPa";

/// Looks, asks or refuses, checks and writes.
pub fn run(args: &InitCampaignArgs) -> anyhow::Result<Answer> {
    let out = Outputs::new(args.force).reads(&args.files).reads(&args.valve).file(&args.out)?;
    let valve = args.valve.as_deref().map(valve_input::read).transpose()?;
    let facts = valve.as_ref().map(|file| valve_facts(file.valve()));
    let mut hints =
        Hints { rests_m: valve.as_ref().and_then(|file| rests_m(file.valve())), ..hints(args, facts.as_ref())? };
    let stated = Stated::read(args, hints.ambient_pressure_pa)?;
    let recordings = recordings(&args.files)?;
    let folder = folder_of(&args.out);
    if let Some(file) = &valve {
        ask_model(file, &recordings, &stated, folder, &mut hints);
    }
    let found = settled(&recordings, &mut hints)?;
    let mut runs: Vec<DraftRun> = recordings
        .iter()
        .zip(&found.supply)
        .map(|(recording, shown)| {
            stated.run(&recording.file, shown.as_ref(), relative(Path::new(&recording.file), folder))
        })
        .collect();
    let name = args.name.clone().unwrap_or_else(|| name_of_folder(&args.out));
    let written = |runs: &[DraftRun]| {
        let text = draft(&name, &found, &recordings[0], runs);
        let facts = facts.unwrap_or_else(|| assumed_facts(&hints, runs));
        // What cannot be read back is not written.
        let shown = args.out.display().to_string();
        let read = Campaign::parse(&text, &shown, &facts, &|file| std::fs::read(folder.join(file)))
            .context("the recordings cannot be used as they were understood, and nothing was written")?;
        Ok::<_, anyhow::Error>((text, read))
    };
    if dialogue::is_possible() && runs.iter().any(|run| run.supply_pressure.is_empty()) {
        // Nobody is to answer questions about recordings that cannot be used.
        let mut tried = runs.clone();
        for run in &mut tried {
            ANY_SUPPLY.clone_into(&mut run.supply_pressure);
        }
        written(&tried)?;
    }
    stated.ask(&mut runs)?;
    let (text, read) = written(&runs)?;
    out.write_whole(text.as_bytes())?;
    for doubt in read.doubts() {
        output::note(&format!("warning: {doubt}"));
    }
    output::print_text(&summary(args, &found, &runs, &read))?;
    Ok(Answer::Fine)
}

/// The model's word about the direction where the recordings do not tell it, and a doubt where what was said is far worse than its
/// contrary.
fn ask_model(file: &ValveFile, recordings: &[Recording], stated: &Stated, folder: &Path, hints: &mut Hints) {
    let given = hints.one_closes;
    let unknown = understand(recordings, hints).unknown;
    let is_open = unknown == [Unknown::Direction];
    // What the recordings tell by themselves needs no model.
    if !(is_open || given.is_some() && unknown.is_empty()) {
        return;
    }
    let with = |one_closes: bool| Hints { one_closes: Some(one_closes), ..hints.clone() };
    let usual = format!("{} Pa", file.valve().parameters().supply_pressure_pa);
    let off_m = |one_closes: bool| {
        let found = understand(recordings, &with(one_closes));
        let shown = recordings.iter().zip(&found.supply);
        let runs = shown.map(|(recording, shown)| {
            let mut run = stated.run(&recording.file, shown.as_ref(), relative(Path::new(&recording.file), folder));
            if run.supply_pressure.is_empty() {
                run.supply_pressure.clone_from(&usual);
            }
            run
        });
        let text = draft("direction", &found, &recordings[0], &runs.collect::<Vec<_>>());
        let facts = valve_facts(file.valve());
        let campaign = Campaign::parse(&text, "direction", &facts, &|file| std::fs::read(folder.join(file))).ok()?;
        position_error_m(file, &campaign)
    };
    let (Some(closing_m), Some(opening_m)) = (off_m(true), off_m(false)) else { return };
    let one_closes = closing_m < opening_m;
    let (less_m, more_m) = (closing_m.min(opening_m), closing_m.max(opening_m));
    if less_m > FAR_BETTER * more_m {
        return;
    }
    let unit = output::told_in(Dimension::Length);
    let [less, more] = [less_m, more_m].map(|off_m| format!("{} {}", unit.number(off_m, 2), unit.name()));
    let words = format!("{} is {less} off then, and {more} the other way round", file.file_name());
    if is_open {
        hints.closes_because = Some(words);
        hints.one_closes = Some(one_closes);
    } else if given != Some(one_closes) {
        let better = if one_closes { "close" } else { "open" };
        output::note(&format!(
            "warning: is it right that 1 means {}? With {better} {words}",
            if one_closes { "open" } else { "close" }
        ));
    }
}

fn recordings(files: &[PathBuf]) -> anyhow::Result<Vec<Recording>> {
    let read = |path: &PathBuf| {
        let shown = path.display().to_string();
        let bytes = std::fs::read(path).with_context(|| format!("{shown}: cannot be read"))?;
        Ok(Recording::read(&bytes, &shown)?)
    };
    files.iter().map(read).collect()
}

/// What the options say of the columns; all that is wrong with them at once.
fn hints(args: &InitCampaignArgs, facts: Option<&ValveFacts>) -> anyhow::Result<Hints> {
    let (mut columns, mut left_out, mut wrong) = (Vec::new(), Vec::new(), Vec::new());
    for column in &args.column {
        match named_column(column) {
            Ok((channel, LEFT_OUT)) => left_out.push(channel.to_owned()),
            Ok((channel, name)) => columns.push((channel.to_owned(), name.to_owned())),
            Err(reason) => wrong.push(format!("--column {column}: {reason}")),
        }
    }
    let stroke = args.stroke.as_ref().and_then(|text| {
        let stroke = Quantity::parse(text, Dimension::Length).map(|quantity| quantity.si());
        stroke.map_err(|error| wrong.push(format!("--stroke: {error}"))).ok()
    });
    if let Some(Err(error)) = args.position_noise.as_ref().map(|text| Quantity::parse(text, Dimension::Length)) {
        wrong.push(format!("--position-noise: {error}"));
    }
    dialogue::all_right(&wrong)?;
    Ok(Hints {
        position_noise: args.position_noise.clone(),
        stroke_m: facts.map(|facts| facts.stroke_m).or(stroke),
        rests_m: None,
        ambient_pressure_pa: facts.map_or(USUAL_AMBIENT_PA, |facts| facts.ambient_pressure_pa),
        columns,
        units: Vec::new(),
        left_out,
        one_closes: args.one_means.as_deref().map(|word| word == "close"),
        closes_because: None,
        grows_to_open: args.position_grows.as_deref().map(|word| word == "open"),
    })
}

/// Channel and name of a `--column`.
fn named_column(column: &str) -> Result<(&str, &str), String> {
    let example = "such as --column position=LVDT, or --column supply_pressure=none to leave a channel out";
    let (channel, name) = column.split_once('=').ok_or_else(|| format!("no channel and name; {example}"))?;
    let (channel, name) = (channel.trim(), name.trim());
    if !CHANNELS.contains(&channel) {
        let meant = quantity::suggest::did_you_mean(channel, CHANNELS);
        return Err(format!("there is no channel \"{channel}\"; expected one of {}{meant}", CHANNELS.join(", ")));
    }
    if name.is_empty() {
        return Err(format!("no name behind the channel; {example}"));
    }
    if name == LEFT_OUT && ["time", "position"].contains(&channel) {
        return Err(format!("nothing can be read without the {channel}; expected the name of its column"));
    }
    Ok((channel, name))
}

/// What the recordings hold, with questions at a terminal about what they do not tell.
fn settled(recordings: &[Recording], hints: &mut Hints) -> anyhow::Result<Understanding> {
    loop {
        let found = understand(recordings, hints);
        agreed(&found.conflicts)?;
        let Some(unknown) = found.unknown.first().copied() else { return Ok(found) };
        let names = recordings[0].listed();
        let (what, option) = described(unknown, &found);
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
        ask(unknown, &what, &names, recordings, hints)?;
    }
}

/// Refuses recordings that cannot be one campaign.
fn agreed(conflicts: &[Conflict]) -> anyhow::Result<()> {
    let Some(first) = conflicts.first() else { return Ok(()) };
    let (Conflict::NoColumn { channel, .. } | Conflict::Units { channel, .. }) = first;
    let mut hint = format!("--column {channel}=NAME names the column; its unit may be left out of the name");
    if channel.ends_with("pressure") {
        // Writing to a string cannot fail.
        let _ = write!(hint, ", and --column {channel}={LEFT_OUT} does without the channel");
    }
    Err(Hinted::error(conflicts.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"), hint))
}

/// What is not known, and the option that says it.
fn described(unknown: Unknown, found: &Understanding) -> (String, String) {
    let name_of = |channel: &str| {
        let column = found.columns.iter().find(|column| column.channel == channel);
        column.map_or("NAME", ColumnGuess::bare_name).to_owned()
    };
    let (what, option) = match unknown {
        Unknown::Time => ("which column is the time", "--column time=NAME"),
        Unknown::Position => ("which column is the position", "--column position=NAME"),
        Unknown::PositionUnit => {
            let option = format!(
                "--column \"position={} [mm]\" (or [-] where its ends are the stops), beside --valve valve.toml or \
                 --stroke \"25.4 mm\"",
                name_of("position")
            );
            return ("in which unit the position is".to_owned(), option);
        }
        Unknown::PressureUnit(channel) => {
            let what = format!("in which unit the {} is", channel.replace('_', " "));
            let option = format!(
                "--column \"{channel}={} [barg]\" (or bara, psig, psia, kPa and so on), or --column {channel}=none to \
                 do without it",
                name_of(channel)
            );
            return (what, option);
        }
        Unknown::Command => ("which column is the command", "--column command=NAME or --column pipe_pressure=NAME"),
        Unknown::Direction => (
            "whether a command of 1 tells the valve to close or to open",
            "--one-means close (or open), or --position-grows open (or closed)",
        ),
    };
    (what.to_owned(), option.to_owned())
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
        Unknown::PositionUnit | Unknown::PressureUnit(_) | Unknown::Direction => None,
    };
    if let Some(channel) = channel {
        let answer = dialogue::ask(&format!("Tell {what} ({names})"), false, column)?;
        hints.columns.extend(answer.map(|(_, name)| (channel.to_owned(), name)));
    } else if let Unknown::PressureUnit(channel) = unknown {
        let unit = |text: &str| {
            let unit = Unit::parse(text).ok().filter(|unit| unit.measures(Dimension::Pressure));
            let unit = unit.filter(|unit| unit.reference() != Reference::Ambiguous);
            unit.ok_or_else(|| {
                format!("\"{text}\" is no unit of a pressure with its zero; expected barg, bara, psig, psia, kPa")
            })
        };
        let question = format!("The unit of the {}, such as barg, bara, psig or kPa", channel.replace('_', " "));
        let answer = dialogue::ask(&question, false, unit)?;
        hints.units.extend(answer.map(|(_, unit)| (channel.to_owned(), unit)));
    } else if unknown == Unknown::PositionUnit && hints.stroke_m.is_some() {
        let unit = |text: &str| {
            let unit = Unit::parse(text.trim_matches('-')).ok();
            let unit = unit.filter(|unit| unit.measures(Dimension::Length) || unit.text().is_empty());
            unit.ok_or_else(|| {
                format!("\"{text}\" is no unit of a position; expected mm, in, or - where its ends are the stops")
            })
        };
        let question = "The unit of the position, such as mm; - where its ends are the stops";
        let answer = dialogue::ask(question, false, unit)?;
        hints.units.extend(answer.map(|(_, unit)| ("position".to_owned(), unit)));
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
        let leak = run.leak.as_ref().map_or_else(String::new, |(key, area)| format!(", {key} {area}"));
        let (supply, from) = (&run.supply_pressure, &run.supply_from);
        let _ = writeln!(text, "- {}: {supply} ({from}){leak}, {}", run.file, edges.join(", "));
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
