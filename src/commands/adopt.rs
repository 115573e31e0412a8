//! `valve adopt`: effects added to a valve file, everything refitted.

use std::fmt::Write;

use answers::CampaignInput;
use answers::adoption::{Adoption, AdoptionError, needs_formula, with_formula};
use answers::figures::explanation::staircase;
use model_lab::diagnosis::{FittedParameter, NuisanceReport};
use quantity::Dimension;
use serde::Serialize;
use serde_json::Value;

use super::adopt_life::{Lives, LivesDocument};
use super::log_input::LogInput;
use super::{calibrate, campaign_input, explain, steps};
use crate::cli::{AdoptArgs, Format, RuledOutArgs};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs, PlotFile, ProgressLine, free_name_beside, next_step, told_in};

/// Adds, refits, writes and prints the model sequence.
pub fn run(args: &AdoptArgs) -> anyhow::Result<Answer> {
    let input = campaign_input::read(&args.valve, &args.campaign)?;
    let mut outputs = Outputs::new(args.force).reads(input.files()).reads(&args.log);
    let out = outputs.file(&args.out)?;
    let plot = PlotFile::create(&mut outputs, args.plot.as_deref())?;
    // Whether the log can be read is known before the long work begins.
    if let Some(log) = args.log.as_deref() {
        LogInput::open(log, &args.columns, false)?.announce();
    }
    let line = ProgressLine::new("refitting everything");
    let adoption = adoption(&input, &args.effects, &args.ruled_out)?;
    drop(line);
    let (steps, best) = (adoption.steps(), adoption.best());
    let lives = args.log.as_deref().map(|log| Lives::read(log, &args.columns, &adoption.models)).transpose()?;
    let action = &adoption.action;
    out.write_whole(adoption.file.text().as_bytes())?;
    match args.format {
        Format::Text => {
            let mut text = format!("{action} on {}\n\n{}\n", input.campaign.name, steps::table(&steps));
            text.push_str(&parameter_lines(&adoption.sequence.parameters));
            for effect in best.space.custom_at(&best.u) {
                for parameter in effect.parameters() {
                    let (value, unit) = scaled(parameter.value, &parameter.unit);
                    let _ = writeln!(text, "{}: {} = {value:.6} {unit}", effect.name(), parameter.name);
                }
            }
            if !adoption.sequence.moved.is_empty() {
                let _ = write!(text, "\n{}", calibrate::parameter_table(&adoption.sequence.moved).render());
            }
            text.push_str(&beside_the_file(&adoption.sequence.nuisances));
            if let Some(words) = answers::moved::far_off(&adoption.sequence.moved) {
                let _ = write!(text, "\nwarning: {words}\n");
            }
            if !adoption.changes_valve() {
                text.push_str(ONLY_RECORDED);
            }
            if let Some(lives) = &lives {
                let _ = write!(text, "\n{}", lives.table());
            }
            let out = args.out.display().to_string();
            text.push_str(&campaign_input::temperature_words(&input));
            let _ = writeln!(text, "\nwritten: {out}");
            if adoption.sequence.leaves_much {
                text.push_str(MUCH_LEFT);
                let campaign = args.campaign.display().to_string();
                text.push_str(&next_step("look for what else is missing", &["explain", &out, &campaign]));
            } else {
                let tables = free_name_beside(&args.out, "tables");
                let why = "build the tables that a timing log is read with";
                text.push_str(&next_step(why, &["build-tables", &out, "--out", &tables]));
            }
            output::print_text(&text)?;
        }
        Format::Json => {
            output::print_document(&AdoptDocument {
                adoption: adoption.document(),
                end_of_life: lives.as_ref().map(Lives::document),
                out: args.out.display().to_string(),
            })?;
        }
    }
    if let Some(plot) = plot {
        plot.write(&staircase(&input.campaign.name, action, &steps).figure())?;
    }
    Ok(Answer::Fine)
}

/// Where what was added is of the instrument alone.
const ONLY_RECORDED: &str = "\nWhat was added is of what records the valve: where stroke times are others now, the refitted values make them so.\n";

/// Where what was added is not what is missing.
const MUCH_LEFT: &str = "warning: this leaves more than instruments and small laws explain; something else is missing, and the \
    values in this file stand in for it\n";

/// An adoption with what became of it, for programs.
#[derive(Serialize)]
struct AdoptDocument<'a> {
    #[serde(flatten)]
    adoption: Value,
    end_of_life: Option<LivesDocument<'a>>,
    out: String,
}

/// Adds and refits, with the formula of what no effect explains where it is asked for and not in the file yet.
fn adoption(input: &CampaignInput, names: &[String], ruled_out: &RuledOutArgs) -> anyhow::Result<Adoption> {
    let hinted = |error: AdoptionError| match error.hint() {
        Some(hint) => Hinted::error(error.to_string(), hint),
        None => error.into(),
    };
    let file = if needs_formula(&input.file, names) {
        output::note("looking for the formula, as `valve explain` does");
        let answer = explain::search(input, &explain::options(ruled_out))?;
        with_formula(&input.file, &answer).map_err(hinted)?
    } else {
        input.file.clone()
    };
    Adoption::new(&file, &input.campaign, names).map_err(hinted)
}

/// One line for each fitted parameter of an effect.
pub fn parameter_lines(parameters: &[FittedParameter]) -> String {
    let mut text = String::new();
    for parameter in parameters {
        let value = with_error(parameter.value, parameter.sigma, parameter.unit);
        let _ = writeln!(text, "{}: {} = {value}", parameter.effect.id(), parameter.name);
    }
    text
}

/// A value of an SI unit and its standard error, in the unit that people read it in; what ended at its bound has none.
pub fn with_error(value: f64, sigma: f64, unit: &str) -> String {
    let (shown, name) = scaled(value, unit);
    if sigma == 0.0 {
        return format!("{}, at its bound", format!("{shown:.4} {name}").trim_end());
    }
    format!("{shown:.4} +- {:.2} {name}", scaled(sigma, unit).0).trim_end().to_owned()
}

/// A value in the unit that people read it in.
fn scaled(value: f64, unit: &str) -> (Shown, String) {
    match quantity::Dimension::of_si_unit(unit) {
        // A stiffness of bristles is a large number in every unit; it stays in that of the catalogue.
        Some(
            one @ (Dimension::Length
            | Dimension::Area
            | Dimension::Volume
            | Dimension::Time
            | Dimension::Pressure
            | Dimension::Force),
        ) => {
            let told = told_in(one);
            (Shown(told.difference_value(value)), told.difference_name().replace('²', "2"))
        }
        _ => (Shown(value), unit.to_owned()),
    }
}

/// A number with as many significant digits as the precision says, plain where that is short.
struct Shown(f64);

impl std::fmt::Display for Shown {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = i32::try_from(formatter.precision().unwrap_or(4)).unwrap_or(4);
        let size = self.0.abs();
        if self.0 == 0.0 || !(1e-3..1e6).contains(&size) {
            return write!(formatter, "{:.*e}", usize::try_from(digits - 1).unwrap_or(0), self.0);
        }
        #[expect(clippy::cast_possible_truncation, reason = "between -3 and 6")]
        let before = size.log10().floor() as i32 + 1;
        write!(formatter, "{:.*}", usize::try_from(digits - before).unwrap_or(0), self.0)
    }
}

/// What a fit took out beside what it writes down, and what that means for the file.
fn beside_the_file(nuisances: &[NuisanceReport]) -> String {
    match explain::nuisance_text(nuisances) {
        lines if lines.is_empty() => lines,
        lines => format!(
            "\n{lines}None of this is in the valve file, since it is of instruments and of how the strokes were made: simulated with \
             the file alone they differ from what was recorded by so much.\n"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::with_error;

    #[test]
    fn what_ended_at_its_bound_has_no_error() {
        assert_eq!(with_error(2.5e-3, 0.0, "m"), "2.500 mm, at its bound");
        assert_eq!(with_error(2.5e-3, 1.25e-4, "m"), "2.500 +- 0.12 mm");
    }
}
