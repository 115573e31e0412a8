//! `valve adopt`: effects added to a valve file, everything refitted.

use std::fmt::Write;

use answers::CampaignInput;
use identify::Stop;
use model_lab::diagnosis::adopt::{Addition, Rung, sequence};
use model_lab::diagnosis::{DiagnoseOptions, FittedParameter};
use model_lab::errors::StepReport;
use model_lab::space::Target;
use quantity::Dimension;
use serde_json::json;
use valve_file::{HistoryEntry, ValveFile};
use valve_model::{EffectKind, ParameterId};

use super::adopt_life::Lives;
use super::{campaign_input, explain, ladder};
use crate::cli::{AdoptArgs, Format};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs, PlotFile, ProgressLine, free_name_beside, next_step, told_in};

/// Name of the formula that a search finds where no effect explains the data.
const UNEXPLAINED: &str = "unexplained";

/// Adds, refits, writes and prints the model sequence.
pub fn run(args: &AdoptArgs) -> anyhow::Result<Answer> {
    let input = campaign_input::read(&args.valve, &args.campaign)?;
    let mut outputs = Outputs::new(args.force).reads(input.files()).reads(&args.log);
    let out = outputs.file(&args.out)?;
    let plot = PlotFile::create(&mut outputs, args.plot.as_deref())?;
    let file = with_formula(&input, &args.effects)?;
    let (additions, without) = additions(&file, &args.effects)?;
    let line = ProgressLine::new("refitting everything");
    let sequence = sequence(&without, &input.campaign, &additions, Stop::never()).ok_or_else(|| {
        Hinted::error(
            format!("{}: its strokes cannot be simulated", input.file.file_name()),
            "look at the valve with `valve simulate`, and at the effects' parameters with `valve effects`",
        )
    })?;
    drop(line);
    let steps: Vec<StepReport> = sequence.rungs.iter().map(|rung| rung.step.clone()).collect();
    let mut models = Vec::new();
    for rung in &sequence.rungs {
        models.push((rung.step.step.clone(), adopted(&without, rung)?));
    }
    let best = &sequence.rungs[sequence.rungs.len() - 1];
    let lives = args.log.as_deref().map(|log| Lives::read(log, &models)).transpose()?;
    let names: Vec<&str> = additions.iter().map(Addition::name).collect();
    let action = if names.is_empty() { "calibrated".to_owned() } else { format!("added {}", names.join(" and ")) };
    let [before, after] = [&steps[0], &steps[steps.len() - 1]].map(|step| step.errors.normalised_rms);
    let entry = HistoryEntry::new(&action, &input.campaign.name, before, after);
    out.write_whole(adopted(&file, best)?.with_history(entry)?.text().as_bytes())?;
    match args.format {
        Format::Text => {
            let mut text = format!("{action} on {}\n\n{}\n", input.campaign.name, ladder::table(&steps));
            text.push_str(&parameter_lines(&sequence.parameters));
            for effect in best.space.custom_at(&best.u) {
                for parameter in effect.parameters() {
                    let (value, unit) = scaled(parameter.value, &parameter.unit);
                    let _ = writeln!(text, "{}: {} = {value:.6} {unit}", effect.name(), parameter.name);
                }
            }
            if let Some(lives) = &lives {
                let _ = write!(text, "\n{}", lives.table());
            }
            let out = args.out.display().to_string();
            let _ = writeln!(text, "\nwritten: {out}");
            let tables = free_name_beside(&args.out, "tables");
            text.push_str(&next_step(
                "build the tables that a timing log is read with",
                &["build-tables", &out, "--out", &tables],
            ));
            output::print_text(&text)?;
        }
        Format::Json => output::print_json(&json!({
            "schema": answers::SCHEMA,
            "effects": names,
            "steps": answers::steps::value(&steps),
            "parameters": answers::explanation::parameters(&sequence.parameters),
            "end_of_life": lives.as_ref().map(Lives::value),
            "out": args.out.display().to_string(),
        }))?,
    }
    if let Some(plot) = plot {
        plot.write(&ladder::figure(&input.campaign.name, &action, &steps).figure())?;
    }
    Ok(Answer::Fine)
}

/// The valve file, with the formula of what no effect explains where it is asked for and not in the file yet.
fn with_formula(input: &CampaignInput, names: &[String]) -> anyhow::Result<ValveFile> {
    let has = input.file.valve().custom().iter().any(|effect| effect.name() == UNEXPLAINED);
    if has || !names.iter().any(|name| name == UNEXPLAINED) {
        return Ok(input.file.clone());
    }
    output::note("looking for the formula, as `valve explain` does");
    let answer = explain::search(input, &DiagnoseOptions::default())?;
    let Some(outside) = &answer.outside else {
        return Err(Hinted::error(
            format!("no formula is needed or found: {}", answers::explanation::headline(&answer)),
            "`valve explain` tells what was found instead",
        ));
    };
    Ok(input.file.with_custom(&outside.effect)?)
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

/// A value of an SI unit and its standard error, in the unit that people read it in.
pub fn with_error(value: f64, sigma: f64, unit: &str) -> String {
    let (shown, name) = scaled(value, unit);
    format!("{shown:.4} +- {:.2} {name}", scaled(sigma, unit).0)
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

/// What to add, and the valve file without the custom effects that are to be refitted.
fn additions(file: &ValveFile, names: &[String]) -> anyhow::Result<(Vec<Addition>, ValveFile)> {
    let mut without = file.clone();
    let mut additions = Vec::new();
    for name in names {
        let own = file.valve().custom().iter().find(|effect| effect.name() == name);
        if let Some(kind) = EffectKind::from_id(name) {
            additions.push(Addition::Catalogue(kind));
        } else if let Some(effect) = own {
            additions.push(Addition::Own(effect.clone()));
            without = without.without_custom(name)?;
        } else {
            let known: Vec<&str> = EffectKind::ALL.iter().map(|kind| kind.id()).collect();
            let hint = match quantity::suggest::nearest(name, known) {
                Some(near) => format!("did you mean {near}? `valve effects` lists the catalogue"),
                None => "`valve effects` lists the catalogue; a custom effect must stand in the valve file".into(),
            };
            return Err(Hinted::error(format!("there is no effect \"{name}\""), hint));
        }
    }
    Ok((additions, without))
}

/// The valve file with everything that a fit moved.
fn adopted(file: &ValveFile, best: &Rung) -> anyhow::Result<ValveFile> {
    let base = best.space.base_at(&best.u);
    let moved: Vec<(ParameterId, f64)> = best
        .space
        .coordinates
        .iter()
        .filter_map(|coordinate| match coordinate.target {
            Target::Base(id) => Some((id, base.get(id))),
            _ => None,
        })
        .collect();
    let mut new = file.with_parameters(&moved)?;
    for effect in best.space.effects_at(&best.u) {
        new = new.with_effect(&effect)?;
    }
    for effect in best.space.custom_at(&best.u) {
        new = new.with_custom(&effect)?;
    }
    Ok(new)
}
