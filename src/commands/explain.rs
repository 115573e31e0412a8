//! `valve explain`: which physical effect is missing.

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use model_lab::Space;
use model_lab::explain::experiment::DECISIVE;
use model_lab::explain::search::ACCEPT;
use model_lab::explain::{Explanation, Progress, Verdict, Watch, explain};
use report::figures::{Candidate, LeaderboardFigure};

use super::adopt::parameter_lines;
use super::campaign_input::CampaignInput;
use super::{explain_json, ladder};
use crate::cli::{ExplainArgs, Format};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Align, PlotFile, ProgressLine, TextTable};

/// Searches, prints and draws.
pub fn run(args: &ExplainArgs) -> anyhow::Result<Answer> {
    let input = CampaignInput::read(&args.valve, &args.campaign)?;
    let plot = PlotFile::create(args.plot.as_deref())?;
    let plot_steps = PlotFile::create(args.plot_steps.as_deref())?;
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    // Without the handler, Ctrl-C ends the program at once; the search itself does not need it.
    let _ = ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed));
    let line = ProgressLine::new();
    let done = AtomicUsize::new(0);
    let tell = |progress: Progress| show(&line, &done, &progress);
    let answer = explain(&input.data, &Space::tolerated(&input.file), &Watch { report: &tell, stop: &stop })
        .ok_or_else(|| {
            Hinted::error(
                format!("{}: its strokes cannot be simulated", input.file.file_name()),
                "look at the valve with `valve simulate`",
            )
        })?;
    drop(line);
    match args.format {
        Format::Text => output::print_text(&text(&answer, &input.campaign.name))?,
        Format::Json => output::print_json(&explain_json::document(&answer, &input.campaign.name))?,
    }
    if let Some(plot) = plot {
        plot.write(&leaderboard(&answer, &input.campaign.name).figure())?;
    }
    if let Some(plot) = plot_steps {
        let figure = ladder::figure(&input.campaign.name, &headline(&answer), &answer.steps, &answer.scatter);
        plot.write(&figure.figure())?;
    }
    Ok(Answer::Fine)
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

fn headline(answer: &Explanation) -> String {
    match answer.verdict {
        Verdict::Adequate => "nothing is missing beyond noise and the stated tolerances".into(),
        Verdict::EffectFound => format!("missing: {}", ids(answer)),
        Verdict::OutsideCatalogue => {
            "something is missing, and no effect of the catalogue, nor a pair or triple, explains it".into()
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
        let _ = writeln!(
            text,
            "What is missing acts as {} along {}. A formula for it leaves an error of {:.3} ({} on conditions left out); paste it into the valve file, then `valve adopt --effect {}`:\n\n{}",
            outside.axis.target.id(),
            outside.axis.variable,
            outside.fit.normalised_rms(&answer.scatter),
            outside.held_out.map_or_else(|| "-".to_owned(), |error| format!("{error:.3}")),
            outside.effect.name(),
            explain_json::effect_toml(outside),
        );
    }
    text.push('\n');
    text.push_str(&candidate_table(answer));
    for note in &answer.notes {
        let _ = writeln!(text, "\nnote: {note}");
    }
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

fn leaderboard(answer: &Explanation, campaign: &str) -> LeaderboardFigure {
    LeaderboardFigure {
        title: campaign.to_owned(),
        subtitle: headline(answer),
        candidates: answer
            .candidates
            .iter()
            .filter(|candidate| candidate.kinds.len() == 1 || candidate.rejected.is_none())
            .take(18)
            .map(|candidate| Candidate {
                name: candidate.kinds.iter().map(|kind| kind.id()).collect::<Vec<_>>().join(" + "),
                gain: candidate.gain,
                recommended: candidate.rejected.is_none(),
                ..Candidate::default()
            })
            .collect(),
        brackets: Vec::new(),
        acceptance_gain: ACCEPT,
    }
}
