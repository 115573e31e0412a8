//! `valve calibrate`: the tolerated parameters fitted to a campaign.

use std::fmt::Write;
use std::path::Path;

use answers::CampaignInput;
use answers::calibration::{document, verdict_words};
use identify::Stop;
use model_lab::calibrate::{Calibration, Verdict};
use model_lab::diagnosis::MovedParameter;
use quantity::Dimension;
use serde::Serialize;
use serde_json::Value;

use super::{campaign_input, explain, steps};
use crate::cli::{CalibrateArgs, Format};
use crate::failure::Answer;
use crate::output::{self, Align, Outputs, PlotFile, ProgressLine, TextTable, free_name_beside, next_step, told_in};

/// A calibration with what became of it, for programs.
#[derive(Serialize)]
struct CalibrateDocument {
    #[serde(flatten)]
    calibration: Value,
    out: Option<String>,
}

/// Calibrates, prints and writes.
pub fn run(args: &CalibrateArgs) -> anyhow::Result<Answer> {
    let input = campaign_input::read(&args.valve, &args.campaign)?;
    let mut outputs = Outputs::new(args.force).reads(input.files());
    let out = args.out.as_deref().map(|out| outputs.file(out)).transpose()?;
    let plot = PlotFile::create(&mut outputs, args.plot.as_deref())?;
    let line = ProgressLine::new("fitting the parameters that have a tolerance");
    let calibration = Calibration::new(&input.file, &input.campaign, Stop::never())?;
    drop(line);
    // Values that only stand in for missing physics are in nobody's valve.
    let withheld = calibration.verdict.is_doubtful() && !args.force;
    let written = args.out.as_deref().filter(|_| !withheld);
    if let Some(out) = out.filter(|_| !withheld) {
        out.write_whole(calibration.adopted(&input.file, &input.campaign.name)?.text().as_bytes())?;
    }
    match args.format {
        Format::Text => {
            let mut text = text(&input, &calibration);
            text.push_str(&outcome(args, written));
            if written.is_some() {
                text.push_str(&campaign_input::temperature_words(&input));
            }
            text.push_str(&next(args, &calibration, written));
            output::print_text(&text)?;
        }
        Format::Json => {
            output::print_document(&CalibrateDocument {
                calibration: document(&input, &calibration),
                out: written.map(|out| out.display().to_string()),
            })?;
        }
    }
    if let Some(plot) = plot {
        plot.write(&answers::figures::calibration::shifts(&input, &calibration).figure())?;
    }
    Ok(if args.out.is_some() && withheld { Answer::BadNews } else { Answer::Fine })
}

/// What became of the file that was asked for.
fn outcome(args: &CalibrateArgs, written: Option<&Path>) -> String {
    match (&args.out, written) {
        (_, Some(out)) => format!("\nwritten: {}\n", out.display()),
        (Some(out), None) => format!(
            "\nnot written: {}, for its values may only stand in for what is missing; --force writes it all the same\n",
            out.display()
        ),
        (None, None) => String::new(),
    }
}

/// What to do with what was found.
fn next(args: &CalibrateArgs, calibration: &Calibration, written: Option<&Path>) -> String {
    let (valve, campaign) = (args.valve.display().to_string(), args.campaign.display().to_string());
    if calibration.verdict == Verdict::ValuesBeyondTolerance {
        return next_step("see whether an effect explains it in their place", &["explain", &valve, &campaign]);
    }
    if calibration.verdict != Verdict::Explained {
        return next_step("find the effect that is missing", &["explain", &valve, &campaign]);
    }
    if let Some(out) = written {
        let why = "build the tables that a timing log is read with";
        return next_step(
            why,
            &["build-tables", &out.display().to_string(), "--out", &free_name_beside(&args.valve, "tables")],
        );
    }
    let out = free_name_beside(&args.valve, "calibrated.toml");
    next_step("write these values into a valve file", &["calibrate", &valve, &campaign, "--out", &out])
}

fn text(input: &CampaignInput, calibration: &Calibration) -> String {
    let mut text = format!("{}: {}\n\n", input.file.file_name(), input.campaign.name);
    let _ = writeln!(text, "{}", verdict_words(calibration));
    for reason in calibration.reasons.iter().filter(|reason| *reason != verdict_words(calibration)) {
        let _ = writeln!(text, "  {reason}");
    }
    text.push('\n');
    text.push_str(&parameter_table(calibration.found()).render());
    text.push('\n');
    text.push_str(&error_words(calibration));
    for direction in &calibration.non_identifiable {
        let _ = writeln!(text, "not fixed by these data: {}", direction.words);
    }
    for (first, second, correlation) in strong_correlations(calibration) {
        let _ = writeln!(text, "errors go together: {first} and {second} ({correlation:+.3})");
    }
    text
}

/// The parameters before and after.
pub fn parameter_table<'a>(parameters: impl IntoIterator<Item = &'a MovedParameter>) -> TextTable {
    let mut table = TextTable::new(&[
        ("parameter", Align::Left),
        ("before", Align::Right),
        ("after", Align::Right),
        ("standard error", Align::Right),
        ("tolerances off", Align::Right),
    ]);
    for parameter in parameters {
        let name = told_unit(parameter.id.si_unit());
        let show = |si: f64, digits: usize| {
            let unit = quantity::Unit::parse(&name).ok();
            let value = unit.map_or(si, |unit| si / unit.difference_to_si(1.0));
            format!("{} {name}", significant(value, digits)).trim_end().to_owned()
        };
        table.row(vec![
            parameter.id.key().to_owned(),
            show(parameter.before, 5),
            show(parameter.after, 5),
            if parameter.is_at_bound { "at its bound".to_owned() } else { show(parameter.sigma, 2) },
            format!("{:+.2}", parameter.pull),
        ]);
    }
    table
}

/// The unit that a parameter is told in. No pressure or temperature that counts from a zero of its own is fitted, so that
/// values convert like differences.
fn told_unit(si_unit: &str) -> String {
    match quantity::Dimension::of_si_unit(si_unit) {
        Some(one @ (Dimension::Length | Dimension::Volume | Dimension::Pressure | Dimension::Force)) => {
            told_in(one).difference_name().to_owned()
        }
        Some(Dimension::Area) => told_in(Dimension::Area).name().replace('²', "2"),
        _ => si_unit.to_owned(),
    }
}

fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    // The decades of physical values are few.
    #[expect(clippy::cast_possible_truncation, reason = "a small whole number")]
    let decade = value.abs().log10().floor() as i32;
    let places = i32::try_from(digits).unwrap_or(5) - 1 - decade;
    let places = usize::try_from(places.max(0)).unwrap_or(0);
    format!("{value:.places$}")
}

/// How large the error is before and after, fitted and held out, and what instruments took.
pub fn error_words(calibration: &Calibration) -> String {
    steps::table(&calibration.steps) + &explain::nuisance_text(&calibration.nuisances)
}

fn strong_correlations(calibration: &Calibration) -> Vec<(&'static str, &'static str, f64)> {
    let mut found = Vec::new();
    for (row, first) in calibration.parameters.iter().enumerate() {
        for (column, second) in calibration.parameters.iter().enumerate().take(row) {
            let correlation = calibration.correlations[(row, column)];
            if correlation.abs() > 0.95 {
                found.push((second.id.key(), first.id.key(), correlation));
            }
        }
    }
    found
}
