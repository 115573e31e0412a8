//! The sections about recorded strokes: the model beside them, calibrated to them, and what it lacks.

use std::path::Path;

use answers::adoption::Adoption;
use identify::Stop;
use lab::frozen::{self, NamedModel};
use model_lab::calibrate::Calibration;
use model_lab::compare::Comparison;
use model_lab::diagnosis::{DiagnoseOptions, Explanation, Verdict};
use model_lab::errors::Errors;
use model_lab::residual_force::ResidualForce;
use quantity::Dimension;
use report::Figure;
use report::html::{Block, Point, Section, View};
use serde_json::json;
use valve_model::custom::CustomEffect;

use super::Part;
use crate::cli::{LogColumnArgs, ReportArgs, RuledOutArgs};
use crate::commands::adopt_life::Lives;
use crate::commands::{adopt, calibrate, compare, explain, steps};
use crate::output::{command, told_in};
use answers::calibration::verdict_words;
use answers::figures::{
    calibration as calibrate_figures, comparison as compare_figures, explanation as explain_figures,
};
use answers::{CampaignInput, explanation};

/// Compares, calibrates and explains; with a log, what that does to the remaining life.
pub fn part(input: &CampaignInput, args: &ReportArgs) -> anyhow::Result<Part> {
    // Without tolerances there is nothing to calibrate.
    let calibration = (!input.file.tolerances().is_empty())
        .then(|| Calibration::new(&input.file, &input.campaign, Stop::never()))
        .transpose()?;
    let answer = explain::search(input, &DiagnoseOptions::default())?;
    let lives = args.log.as_deref().map(|log| lives(input, &answer, log, &args.columns)).transpose()?.flatten();
    let mut sections = vec![compared(input, answer.verdict != Verdict::Adequate)?];
    sections.extend(calibration.as_ref().map(|calibration| calibrated(input, calibration)));
    sections.push(explained(input, &answer));
    if let Some(lives) = &lives {
        let mut blocks = vec![Block::Callout(lives.words()), Block::Table(lives.rows().into())];
        blocks.extend(lives.reasons().map(Block::Text));
        sections.push(Section { title: "What it does to the remaining life".to_owned(), blocks });
    }
    let mut models = vec![NamedModel { name: "valve file".to_owned(), valve: input.file.valve().clone() }];
    models.extend(calibration.map(|found| NamedModel { name: "calibrated".to_owned(), valve: found.valve }));
    if !answer.recommended.is_empty() || answer.discrepancy.is_some() {
        models.push(NamedModel { name: what_is_added(&answer), valve: answer.valve.clone() });
    }
    // Without traces and a model that moves there is nothing to look into.
    let frozen = frozen::campaign(input, &models, Some(&answer));
    Ok(Part {
        short: short(args, input, &answer, lives.as_ref()),
        sections,
        data: frozen.map(|data| ("campaign", json!(data).to_string())).into_iter().collect(),
    })
}

fn what_is_added(answer: &Explanation) -> String {
    let effects = answer.recommended.iter().map(|kind| kind.id());
    let names: Vec<&str> = effects.chain(answer.discrepancy.iter().map(|found| found.effect.name())).collect();
    format!("with {}", names.join(" and "))
}

/// The end of life by the log, with the model as it is and with what is missing.
fn lives(
    input: &CampaignInput,
    answer: &Explanation,
    log: &Path,
    columns: &LogColumnArgs,
) -> anyhow::Result<Option<Lives>> {
    let names: Vec<String> = answer.recommended.iter().map(|kind| kind.id().to_owned()).collect();
    if names.is_empty() {
        return Ok(None);
    }
    let adoption = Adoption::new(&input.file, &input.campaign, &names)?;
    Lives::read(log, columns, &adoption.models).map(Some)
}

/// An error in mm or ms, and in noises.
fn in_short(errors: &Errors) -> String {
    let size = match (errors.rmse_m, errors.time_rmse_s) {
        (Some(metres), _) => {
            let unit = told_in(Dimension::Length);
            format!("{} {}, ", unit.number(metres, 3), unit.name())
        }
        (None, Some(seconds)) => format!("{:.1} ms of the stroke times, ", 1e3 * seconds),
        (None, None) => String::new(),
    };
    format!("{size}{:.1} times the noise", errors.normalised_rms)
}

/// Whether physics is missing, which, what that does to the error and to the life, and what to do.
fn short(args: &ReportArgs, input: &CampaignInput, answer: &Explanation, lives: Option<&Lives>) -> Vec<Point> {
    let effects: Vec<&str> = input.file.valve().effects().iter().map(|effect| effect.kind().id()).collect();
    let custom = input.file.valve().custom().iter().map(CustomEffect::name);
    let known = effects.into_iter().chain(custom).collect::<Vec<_>>().join(" and ");
    let has = if known.is_empty() { String::new() } else { format!("the valve file has {known}; beside that: ") };
    let mut points = vec![Point::new("Physics", has + &explanation::headline(answer))];
    let steps = explain_figures::steps(answer);
    if let [first, .., last] = &steps[..] {
        let [before, after] = [first, last].map(|step| in_short(&step.errors));
        points.push(Point::new("Error", format!("{before} ({}), {after} ({})", first.step, last.step)));
    }
    points.extend(lives.map(|lives| Point::new("Remaining life", lives.words())));
    let (why, words) = explain::next(&args.valve, input, answer, &RuledOutArgs::default());
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let command = Some(command(&words).trim_start().to_owned());
    points.push(Point { lead: "With the model", text: why.replace("above", "below"), command });
    points
}

/// Runs in one picture.
const RUNS_A_SHEET: usize = 3;

/// Runs that get a still picture.
const PICTURES: usize = 12;

/// The runs with the largest errors, in their order.
fn worst(comparison: &Comparison) -> Vec<usize> {
    let error = |run: &usize| comparison.runs[*run].score.errors.normalised_rms;
    let traces = comparison.runs.iter().take_while(|run| !run.predicted.position_m.is_empty()).count();
    let mut runs: Vec<usize> = (0..traces).collect();
    runs.sort_by(|a, b| error(b).total_cmp(&error(a)));
    runs.truncate(PICTURES);
    runs.sort_unstable();
    runs
}

fn figure(figure: Figure) -> Block {
    Block::Figure(Box::new(figure))
}

/// The model as it is beside the recordings; where physics is missing, the force that would have to be added.
fn compared(input: &CampaignInput, is_missing: bool) -> anyhow::Result<Section> {
    let compared = compare::compared(input, &input.file)?;
    let comparison = &compared.comparison;
    let mut blocks: Vec<Block> = comparison.words().into_iter().map(Block::Callout).collect();
    blocks.extend(input.doubts().into_iter().map(|doubt| Block::Text(format!("Looks wrong: {doubt}"))));
    blocks.extend(compare::error_lines(&compared).map(Block::Text));
    let mut still = vec![Block::Table(compare::run_table(comparison, None).into())];
    let mut beside = Vec::new();
    if !input.data.runs.is_empty() {
        let mut overlay = compare_figures::overlay(input, comparison, &steps::words(&comparison.overall.errors));
        if overlay.runs.len() > PICTURES {
            overlay.runs = worst(comparison).into_iter().filter_map(|run| overlay.runs.get(run).cloned()).collect();
            still.push(Block::Text(format!("The {PICTURES} runs with the largest errors:")));
        }
        still.extend(overlay.sheets(RUNS_A_SHEET).into_iter().map(figure));
        still.push(figure(compare_figures::strips(input, comparison, None).figure()));
        if let Some(force) = ResidualForce::new(&input.data, input.file.valve(), input.file.tolerances()) {
            still.extend(is_missing.then(|| figure(compare_figures::missing_force(&force).figure())));
            let signature = force.signature.as_ref();
            beside.extend(signature.map(|found| {
                figure(compare_figures::signature(input.file.name(), found, compare::signature_words(found)).figure())
            }));
        }
    }
    blocks.push(Block::View(View { kind: "strokes", of: "campaign", still }));
    blocks.extend(beside);
    Ok(Section { title: format!("Recorded strokes: {}", input.campaign.name), blocks })
}

fn calibrated(input: &CampaignInput, calibration: &Calibration) -> Section {
    let verdict = verdict_words(calibration);
    let mut blocks = vec![Block::Callout(verdict.to_owned())];
    blocks.extend(calibration.reasons.iter().filter(|reason| *reason != verdict).cloned().map(Block::Text));
    blocks.push(Block::Table(calibrate::parameter_table(calibration.found()).into()));
    blocks.push(Block::Table(steps::rows(&calibration.steps).into()));
    blocks.push(Block::Text(format!("left: {}", steps::words(&calibration.steps[1].errors))));
    blocks.extend(
        explain::nuisance_lines(&calibration.nuisances).lines().map(|line| Block::Text(line.trim().to_owned())),
    );
    blocks.push(figure(calibrate_figures::shifts(input, calibration).figure()));
    Section { title: "Calibration".to_owned(), blocks }
}

fn explained(input: &CampaignInput, answer: &Explanation) -> Section {
    let (name, headline) = (&input.campaign.name, explanation::headline(answer));
    let mut still = vec![Block::Callout(headline.clone())];
    let parameters = adopt::parameter_lines(&answer.parameters);
    still.extend(parameters.lines().map(|line| Block::Text(line.to_owned())));
    still.extend(explanation::notes(answer).into_iter().map(Block::Text));
    let steps = explain_figures::steps(answer);
    still.push(Block::Table(steps::rows(&steps).into()));
    still.push(figure(explain_figures::staircase(name, &headline, &steps).figure()));
    still.push(figure(explain_figures::leaderboard(answer, name, &headline).figure()));
    for group in &answer.indistinguishable {
        if let Some(plan) = &group.experiment {
            let others: Vec<&str> = group.with.iter().map(|other| other.kind.id()).collect();
            let (kind, others) = (group.kind.id(), others.join(", "));
            still.push(Block::Text(format!("What would tell {kind} from {others}: {}", plan.purpose)));
            still.push(Block::Code(explanation::run_toml(plan)));
        }
    }
    still.extend(explain_figures::next_experiment(answer).map(|found| figure(found.figure())));
    if let Some(discrepancy) = &answer.discrepancy {
        still.push(figure(explain_figures::unexplained(discrepancy, name).figure()));
        still.push(Block::Text("The same as an effect for the valve file:".to_owned()));
        still.push(Block::Code(explanation::effect_toml(discrepancy)));
    }
    let blocks = vec![Block::View(View { kind: "answer", of: "campaign", still })];
    Section { title: "What is missing".to_owned(), blocks }
}
