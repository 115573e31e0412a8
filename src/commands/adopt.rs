//! `valve adopt`: effects added to a valve file, everything refitted.

use std::fmt::Write;

use model_lab::calibrate::{Settled, polished};
use model_lab::explain::Watch;
use model_lab::explain::candidate::{Effort, add_effect};
use model_lab::explain::held_out::held_out_rms;
use model_lab::explain::report::{FittedParameter, StepReport, fitted_parameters};
use model_lab::explain::view::View;
use model_lab::explain::{Calibrated, calibrated};
use model_lab::fit::{self, Fit, FitOptions};
use model_lab::space::Target;
use model_lab::{Dataset, Space};
use serde_json::json;
use valve_file::{HistoryEntry, ValveFile};
use valve_model::custom::CustomEffect;
use valve_model::{EffectKind, ParameterId};

use super::adopt_life::Lives;
use super::campaign_input::CampaignInput;
use super::ladder;
use crate::cli::{AdoptArgs, Format};
use crate::failure::{Answer, Hinted};
use crate::output::{self, PlotFile};

/// Something to add.
enum Addition {
    Catalogue(EffectKind),
    Own(CustomEffect),
}

/// Adds, refits, writes and prints the ladder.
pub fn run(args: &AdoptArgs) -> anyhow::Result<Answer> {
    let input = CampaignInput::read(&args.valve, &args.campaign)?;
    if !args.force && args.out.exists() {
        return Err(Hinted::error(
            format!("{}: exists already", args.out.display()),
            "choose another name, or replace it with --force",
        ));
    }
    let plot = PlotFile::create(args.plot.as_deref())?;
    let (additions, without) = additions(&input.file, &args.effects)?;
    let data = &input.data;
    let Calibrated { datasheet, fit, scatter } = calibrated(data, &Space::tolerated(&without)).ok_or_else(|| {
        Hinted::error(
            format!("{}: its strokes cannot be simulated", input.file.file_name()),
            "look at the valve with `valve simulate`",
        )
    })?;
    let mut climb = Climb::new(&additions, data, View::new(data.clone(), scatter), &datasheet, fit)?;
    // Strokes of which none was repeated may differ for all that.
    if !climb.view.explains(climb.best())
        && let Some(settled) = Settled::supposed(data, &climb.view.scatter, climb.best())
    {
        let view = View::new(settled.data, settled.scatter);
        let calibrated = view.finely(&climb.rungs[1].1);
        let again = Climb::new(&additions, data, view, &datasheet, calibrated)?;
        if again.view.explains(again.best()) {
            climb = again;
        }
    }
    let scatter = &climb.view.scatter;
    let mut steps = Vec::new();
    let mut models = Vec::new();
    for (step, fit) in &climb.rungs {
        steps.push(step.clone());
        models.push((step.step.clone(), adopted(&without, fit)?));
    }
    let best = climb.best();
    let lives = args.log.as_deref().map(|log| Lives::read(log, &models)).transpose()?;
    let names: Vec<&str> = additions.iter().map(name).collect();
    let action = format!("added {}", names.join(" and "));
    let last = &steps[steps.len() - 1];
    let entry = HistoryEntry::new(&action, &input.campaign.name, steps[0].normalised_rms, last.normalised_rms);
    adopted(&input.file, best)?.with_history(entry)?.write(&args.out, args.force)?;
    let kinds: Vec<EffectKind> = additions
        .iter()
        .filter_map(|addition| match addition {
            Addition::Catalogue(kind) => Some(*kind),
            Addition::Own(_) => None,
        })
        .collect();
    let parameters = fitted_parameters(best, &kinds, scatter);
    match args.format {
        Format::Text => {
            let mut text = format!("{action} on {}\n\n{}\n", input.campaign.name, ladder::table(&steps));
            text.push_str(&parameter_lines(&parameters));
            for effect in best.space.custom_at(&best.u) {
                for parameter in effect.parameters() {
                    let (value, unit) = scaled(parameter.value, &parameter.unit);
                    let _ = writeln!(text, "{}: {} = {value:.6} {unit}", effect.name(), parameter.name);
                }
            }
            if let Some(lives) = &lives {
                let _ = write!(text, "\n{}", lives.table());
            }
            let _ = writeln!(text, "\nwritten: {}", args.out.display());
            output::print_text(&text)?;
        }
        Format::Json => output::print_json(&json!({
            "effects": names,
            "steps": ladder::value(&steps),
            "parameters": super::explain_json::parameters(&parameters),
            "end_of_life": lives.as_ref().map(Lives::value),
            "out": args.out.display().to_string(),
        }))?,
    }
    if let Some(plot) = plot {
        plot.write(&ladder::figure(&input.campaign.name, &action, &steps, scatter).figure())?;
    }
    Ok(Answer::Fine)
}

/// The datasheet's model, the calibrated one, and that with one effect after the other.
struct Climb {
    view: View,
    /// What was done with what error, and the fit after it.
    rungs: Vec<(StepReport, Fit)>,
}

impl Climb {
    fn new(
        additions: &[Addition],
        data: &Dataset,
        mut view: View,
        datasheet: &Fit,
        calibrated: Fit,
    ) -> anyhow::Result<Self> {
        let mut best = polished(&view.fine, &view.scatter, calibrated);
        let rung = |step: &str, view: &View, fit: &Fit, held_out: Option<f64>| {
            let normalised_rms = fit.normalised_rms(&view.scatter);
            (StepReport { step: step.to_owned(), normalised_rms, held_out_normalised_rms: held_out }, fit.clone())
        };
        let held_out = |view: &View, fit: &Fit| held_out_rms(&view.fine, &view.scatter, fit);
        let mut rungs =
            vec![rung("datasheet", &view, datasheet, None), rung("calibrated", &view, &best, held_out(&view, &best))];
        for addition in additions {
            let base = view.roughly(&best);
            let added = match addition {
                Addition::Catalogue(kind) => add_effect(&view, &base, *kind, Effort::THOROUGH, &Watch::nobody()),
                // A formula has values of its own to start from.
                Addition::Own(effect) => {
                    let space = base.space.with_custom(effect);
                    let own = space.start().into_iter().skip(base.u.len());
                    let start: Vec<f64> = base.u.iter().copied().chain(own).collect();
                    fit::fit(&view.rough, &view.scatter, &space, &start, FitOptions::default())
                }
            };
            let added = added.ok_or_else(|| {
                Hinted::error(
                    format!("{}: the strokes cannot be simulated with it", name(addition)),
                    "look at its parameters with `valve effects`",
                )
            })?;
            best = view.finely(&added);
            if view.scatter.is_known() {
                view = view.through(data, &best);
                best = view.finely(&best);
            }
            best = polished(&view.fine, &view.scatter, best);
            rungs.push(rung(name(addition), &view, &best, held_out(&view, &best)));
        }
        Ok(Self { view, rungs })
    }

    /// The model with all effects.
    fn best(&self) -> &Fit {
        &self.rungs[self.rungs.len() - 1].1
    }
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
fn scaled(value: f64, unit: &str) -> (Shown, &str) {
    let (factor, name) = match unit {
        "m" => (1e3, "mm"),
        "m2" => (1e6, "mm2"),
        "m3" => (1e6, "cm3"),
        "s" => (1e3, "ms"),
        "Pa" => (1e-3, "kPa"),
        other => (1.0, other),
    };
    (Shown(value * factor), name)
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

fn name(addition: &Addition) -> &str {
    match addition {
        Addition::Catalogue(kind) => kind.id(),
        Addition::Own(effect) => effect.name(),
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
fn adopted(file: &ValveFile, best: &Fit) -> anyhow::Result<ValveFile> {
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
