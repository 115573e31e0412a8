//! `valve explain`: which physical effect is missing.

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use model_lab::Space;
use model_lab::explain::experiment::DECISIVE;
use model_lab::explain::outside::Outside;
use model_lab::explain::report::fitted_parameters;
use model_lab::explain::{Explanation, Progress, Verdict, Watch, explain};
use model_lab::scatter::Origin;

use valve_model::EffectKind;

use super::adopt::{parameter_lines, with_error};
use super::campaign_input::CampaignInput;
use super::{explain_figures, explain_json, ladder};
use crate::cli::{ExplainArgs, Format};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Align, PlotFile, ProgressLine, TextTable};

/// Searches, prints and draws.
pub fn run(args: &ExplainArgs) -> anyhow::Result<Answer> {
    let input = CampaignInput::read(&args.valve, &args.campaign)?;
    let plot = PlotFile::create(args.plot.as_deref())?;
    let plot_steps = PlotFile::create(args.plot_steps.as_deref())?;
    let plot_missing = PlotFile::create(args.plot_missing.as_deref())?;
    let plot_experiment = PlotFile::create(args.plot_experiment.as_deref())?;
    let answer = search(&input)?;
    match args.format {
        Format::Text => output::print_text(&text(&answer, &input.campaign.name))?,
        Format::Json => output::print_json(&explain_json::document(&answer, &input.campaign.name))?,
    }
    if let Some(plot) = plot {
        plot.write(&explain_figures::leaderboard(&answer, &input.campaign.name, &headline(&answer)).figure())?;
    }
    if let Some(plot) = plot_steps {
        let figure = ladder::figure(&input.campaign.name, &headline(&answer), &answer.steps, &answer.scatter);
        plot.write(&figure.figure())?;
    }
    if let Some(plot) = plot_missing {
        match &answer.outside {
            Some(outside) => plot.write(&explain_figures::unexplained(outside, &input.campaign.name).figure())?,
            None => output::note("nothing sits outside the catalogue: no picture of it was drawn"),
        }
    }
    if let Some(plot) = plot_experiment {
        match explain_figures::next_experiment(&answer, &input.data) {
            Some(figure) => plot.write(&figure.figure())?,
            None => output::note("no effects are left to be told apart: no picture of an experiment was drawn"),
        }
    }
    Ok(Answer::Fine)
}

/// Searches for what is missing, with a line of progress; Ctrl-C ends it with what is known by then.
pub fn search(input: &CampaignInput) -> anyhow::Result<Explanation> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    // Without the handler, Ctrl-C ends the program at once; the search itself does not need it.
    let _ = ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed));
    let line = ProgressLine::new();
    let done = AtomicUsize::new(0);
    let tell = |progress: Progress| show(&line, &done, &progress);
    let space = Space::tolerated(&input.file);
    explain(&input.data, &space, &Watch { report: &tell, stop: &stop }).ok_or_else(|| {
        Hinted::error(
            format!("{}: its strokes cannot be simulated", input.file.file_name()),
            "look at the valve with `valve simulate`",
        )
    })
}

fn show(line: &ProgressLine, done: &AtomicUsize, progress: &Progress) {
    match progress {
        Progress::Tried { depth, total, kind, .. } => {
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            line.show(count as f64 / *total as f64, &format!("effects: {depth} at a time, {}", kind.id()));
        }
        Progress::Accepted { kinds, .. } => {
            done.store(0, Ordering::Relaxed);
            let ids: Vec<&str> = kinds.iter().map(|kind| kind.id()).collect();
            line.show(0.0, &format!("found {}, looking further", ids.join(" + ")));
        }
        Progress::Calibrated { normalised_rms } => {
            line.show(0.0, &format!("calibrated: error {normalised_rms:.2} times the noise"));
        }
        Progress::Doing(what) => line.show(0.99, what),
    }
}

fn ids(answer: &Explanation) -> String {
    answer.recommended.iter().map(|kind| kind.id()).collect::<Vec<_>>().join(" and ")
}

/// What was found, each effect with those that it cannot be told from.
fn groups(answer: &Explanation) -> String {
    let group = |kind: &EffectKind| {
        let with = answer.twins.iter().filter(|twin| twin.kind == *kind).flat_map(|twin| &twin.with);
        let names: Vec<&str> = with.map(|other| other.kind.id()).collect();
        if names.is_empty() { kind.id().to_owned() } else { format!("{} (or {})", kind.id(), names.join(", or ")) }
    };
    answer.recommended.iter().map(group).collect::<Vec<_>>().join(" and ")
}

/// The answer in a sentence.
pub fn headline(answer: &Explanation) -> String {
    match answer.verdict {
        Verdict::Adequate if answer.scatter.origin == Origin::Supposed => {
            "nothing is missing beyond noise, the stated tolerances and strokes that would differ".into()
        }
        Verdict::Adequate => "nothing is missing beyond noise and the stated tolerances".into(),
        Verdict::EffectFound => format!("missing: {}", groups(answer)),
        Verdict::OutsideCatalogue => {
            "something is missing, and no effect of the catalogue, nor a pair or triple, explains it".into()
        }
        Verdict::NotEnoughData if answer.interrupted && answer.recommended.is_empty() => {
            "the search was cut short before it was known what is missing, if anything is".into()
        }
        Verdict::NotEnoughData if answer.interrupted => {
            format!("something is missing; {} explains part of it, and the search was cut short there", ids(answer))
        }
        Verdict::NotEnoughData => {
            format!("something is missing; {} explains it, and so do too many others", ids(answer))
        }
    }
}

fn text(answer: &Explanation, campaign: &str) -> String {
    let mut text = format!("{campaign}: {}\n\n", headline(answer));
    let parameters = parameter_lines(&answer.parameters);
    if !parameters.is_empty() {
        let _ = writeln!(text, "{parameters}");
    }
    text.push_str(&ladder::table(&answer.steps));
    text.push('\n');
    for twin in &answer.twins {
        if twin.with.is_empty() {
            let _ = writeln!(text, "{}: no other effect explains these data as well", twin.kind.id());
            continue;
        }
        let _ = writeln!(text, "{} cannot be told from:", twin.kind.id());
        for (other, likeness) in twin.with.iter().zip(&twin.likeness) {
            let _ = writeln!(
                text,
                "  {} (chi-squared {:+.1}; what both change in the records is {:.4} alike)",
                other.kind.id(),
                other.behind,
                likeness
            );
            for line in parameter_lines(&fitted_parameters(&other.model.fit, &[other.kind], &answer.scatter)).lines() {
                let _ = writeln!(text, "    {line}");
            }
        }
        if let Some(plan) = &twin.experiment {
            let verb = if plan.separation >= DECISIVE { "would tell them apart" } else { "would help most" };
            let _ = writeln!(
                text,
                "  {verb}: {} (expected difference of chi-squared {:.0})\n",
                plan.purpose, plan.separation
            );
            for line in explain_json::run_toml(plan).lines() {
                let _ = writeln!(text, "    {line}");
            }
        }
    }
    if let Some(outside) = &answer.outside {
        text.push_str(&outside_text(outside, answer));
    }
    text.push('\n');
    text.push_str(&candidate_table(answer));
    for note in &answer.notes {
        let _ = writeln!(text, "\nnote: {note}");
    }
    text
}

fn outside_text(outside: &Outside, answer: &Explanation) -> String {
    let (target, along) = (outside.axis.target.id(), outside.axis.variable);
    let mut text = format!("What is missing acts as {target} along {along}: {}\n", outside.effect.formula().source());
    for (parameter, sigma) in outside.effect.parameters().iter().zip(&outside.parameter_sigmas) {
        let _ = writeln!(text, "  {} = {}", parameter.name, with_error(parameter.value, *sigma, &parameter.unit));
    }
    let _ = write!(
        text,
        "It leaves an error of {:.3} ({} on conditions left out). Paste it into the valve file, then `valve adopt --effect {}`:\n\n{}",
        outside.fit.normalised_rms(&answer.scatter),
        outside.held_out.map_or_else(|| "-".to_owned(), |error| format!("{error:.3}")),
        outside.effect.name(),
        explain_json::effect_toml(outside),
    );
    text
}

fn candidate_table(answer: &Explanation) -> String {
    let mut table = TextTable::new(&[
        ("candidate", Align::Left),
        ("chi-squared gained", Align::Right),
        ("error", Align::Right),
        ("left out", Align::Right),
        ("", Align::Left),
    ]);
    for candidate in answer.candidates.iter().take(12) {
        let name = candidate.kinds.iter().map(|kind| kind.id()).collect::<Vec<_>>().join(" + ");
        let why = candidate.rejected.clone().unwrap_or_else(|| "chosen".into());
        let left_out = candidate.held_out_normalised_rms.map_or_else(String::new, |error| format!("{error:.3}"));
        let error = format!("{:.3}", candidate.normalised_rms);
        table.row(vec![name, format!("{:.1}", candidate.gain), error, left_out, why]);
    }
    table.render()
}
