//! `valve explain`: which physical effect is missing.

use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use identify::Stop;
use identify::select::BY_CHANCE;
use model_lab::diagnosis::discrepancy::ModelDiscrepancy;
use model_lab::diagnosis::experiment::DECISIVE;
use model_lab::diagnosis::{
    DiagnoseOptions, Exchanged, Explanation, Indistinguishable, NuisanceReport, Progress, Verdict, explain,
};
use model_lab::errors::Errors;
use quantity::Dimension;

use super::adopt::{parameter_lines, with_error};
use super::{campaign_input, steps};
use crate::cli::{ExplainArgs, Format, RuledOutArgs};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Align, Outputs, PlotFile, ProgressLine, TextTable, free_name_beside, next_step, told_in};
use answers::figures::explanation as pictures;
use answers::{CampaignInput, explanation};

/// Searches, prints and draws.
pub fn run(args: &ExplainArgs) -> anyhow::Result<Answer> {
    let input = campaign_input::read(&args.valve, &args.campaign)?;
    let mut outputs = Outputs::new(args.force).reads(input.files());
    let plot = PlotFile::create(&mut outputs, args.plot.as_deref())?;
    let plot_steps = PlotFile::create(&mut outputs, args.plot_steps.as_deref())?;
    let plot_missing = PlotFile::create(&mut outputs, args.plot_missing.as_deref())?;
    let plot_experiment = PlotFile::create(&mut outputs, args.plot_experiment.as_deref())?;
    let options = DiagnoseOptions { good_enough_m: args.good_enough, ..options(&args.ruled_out) };
    let answer = search(&input, &options)?;
    match args.format {
        Format::Text => {
            let (why, words) = next(&args.valve, &input, &answer, &args.ruled_out);
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            output::print_text(&(text(&answer, &input) + &next_step(&why, &words)))?;
        }
        Format::Json => output::print_json(&explanation::document(&answer, &input))?,
    }
    if let Some(plot) = plot {
        plot.write(&pictures::leaderboard(&answer, &input.campaign.name, &explanation::headline(&answer)).figure())?;
    }
    if let Some(plot) = plot_steps {
        let figure =
            pictures::staircase(&input.campaign.name, &explanation::headline(&answer), &pictures::steps(&answer));
        plot.write(&figure.figure())?;
    }
    if let Some(plot) = plot_missing {
        match &answer.discrepancy {
            Some(discrepancy) => plot.write(&pictures::unexplained(discrepancy, &input.campaign.name).figure())?,
            None => output::note("nothing sits outside the catalogue: no picture of it was drawn"),
        }
    }
    if let Some(plot) = plot_experiment {
        match pictures::next_experiment(&answer) {
            Some(figure) => plot.write(&figure.figure())?,
            None => output::note("no effects are left to be told apart: no picture of an experiment was drawn"),
        }
    }
    Ok(if answer.interrupted { Answer::Interrupted } else { Answer::Fine })
}

/// A search without what was ruled out.
pub fn options(ruled_out: &RuledOutArgs) -> DiagnoseOptions {
    let mut options = DiagnoseOptions::default();
    options.effects.retain(|kind| !ruled_out.without.contains(kind));
    options
}

/// Searches for what is missing, with a line of progress; Ctrl-C ends it with what is known by then.
pub fn search(input: &CampaignInput, options: &DiagnoseOptions) -> anyhow::Result<Explanation> {
    let stop = Arc::new(Stop::new());
    let asked = Arc::clone(&stop);
    // Without the handler, Ctrl-C ends the program at once; the search itself does not need it.
    let _ = ctrlc::set_handler(move || asked.ask());
    let line = ProgressLine::new("reading the strokes");
    let (done, round) = (AtomicUsize::new(0), AtomicUsize::new(1));
    let tell = |progress: Progress| show(&line, &done, &round, &progress);
    explain(&input.file, &input.campaign, options, &tell, &stop).ok_or_else(|| {
        if stop.is_asked() {
            return anyhow::anyhow!("stopped before the model was calibrated: nothing is known yet");
        }
        Hinted::error(
            format!("{}: its strokes cannot be simulated", input.file.file_name()),
            "look at the valve with `valve simulate`",
        )
    })
}

fn show(line: &ProgressLine, done: &AtomicUsize, round: &AtomicUsize, progress: &Progress) {
    match progress {
        Progress::Tried { kinds, of, .. } => {
            let count = done.fetch_add(1, Ordering::Relaxed) % of + 1;
            let stage = format!("round {}", round.load(Ordering::Relaxed));
            let trying = format!("trying {}", explanation::joined(kinds));
            line.show_stage(&stage, count as f64 / *of as f64, &trying);
        }
        Progress::Reached { kinds, gain } => {
            done.store(0, Ordering::Relaxed);
            round.fetch_add(1, Ordering::Relaxed);
            line.doing(&format!(
                "{} raises the log evidence by {gain:.0}, looking further",
                explanation::joined(kinds)
            ));
        }
        Progress::Doing(what) => line.doing(what),
    }
}

fn text(answer: &Explanation, input: &CampaignInput) -> String {
    let mut groups = String::new();
    answer.indistinguishable.iter().for_each(|group| indistinguishable_text(&mut groups, group, answer));
    let mut sections = vec![
        format!("{}: {}", input.campaign.name, headline(answer)),
        parameter_lines(&answer.parameters),
        steps::table(&pictures::steps(answer)),
        groups,
        answer.discrepancy.as_ref().map_or_else(String::new, discrepancy_text),
        nuisance_text(&answer.nuisances),
        candidate_table(answer),
    ];
    sections.extend(explanation::notes(answer).iter().map(|note| format!("note: {note}")));
    let sections = sections.iter().map(|section| section.trim_end()).filter(|section| !section.is_empty());
    sections.collect::<Vec<_>>().join("\n\n") + "\n"
}

/// The answer in a sentence, an error that is left in the units of the user.
fn headline(answer: &Explanation) -> String {
    let unit = told_in(Dimension::Length);
    explanation::headline_in(answer, &|rmse_m| format!("{} {}", unit.number(rmse_m, 3), unit.name()))
}

fn indistinguishable_text(text: &mut String, group: &Indistinguishable, answer: &Explanation) {
    if group.with.is_empty() {
        // Where something is left, that is said of what is known here alone.
        let (among, other) = if answer.verdict == Verdict::PartlyExplained {
            (" among the effects known here", "none of the others")
        } else {
            ("", "no other effect")
        };
        let share = explanation::inclusion_words(answer, group.kind)
            .map_or_else(String::new, |share| format!("needed with a probability of {share}{among}; "));
        let _ = writeln!(text, "{}: {share}{other} explains these data as well", group.kind.id());
        return;
    }
    let _ = writeln!(text, "{} cannot be told from:", group.kind.id());
    for other in &group.with {
        let _ = writeln!(text, "  {} (log evidence {:+.1})", other.kind.id(), -other.behind);
        for line in parameter_lines(&other.parameters).lines() {
            let _ = writeln!(text, "    {line}");
        }
    }
    if let Some(plan) = &group.experiment {
        let verb = if plan.separation >= DECISIVE { "would tell them apart" } else { "would help most" };
        let _ =
            writeln!(text, "  {verb}: {} (expected difference of chi-squared {:.0})\n", plan.purpose, plan.separation);
        for line in explanation::run_toml(plan).lines() {
            let _ = writeln!(text, "    {line}");
        }
    }
}

/// So many records are told one by one, with what each is off by or that it is at a bound; of more, the range and how many.
const TOLD_ALONE: usize = 2;

/// What instruments and conditions were found to be off by; nothing where that is not much.
pub fn nuisance_text(nuisances: &[NuisanceReport]) -> String {
    match nuisance_lines(nuisances) {
        lines if lines.is_empty() => lines,
        lines => format!("Instruments and conditions were found to be off by:\n{lines}"),
    }
}

/// A line for each instrument or condition that was found to be off by much, one for all records where these are many.
pub fn nuisance_lines(nuisances: &[NuisanceReport]) -> String {
    const AT_BOUND: &str = "at its bound: something may be missing";
    let mut text = String::new();
    let mut told: Vec<&str> = Vec::new();
    for nuisance in nuisances {
        let of_records: Vec<&NuisanceReport> =
            nuisances.iter().filter(|other| other.what == nuisance.what && other.record.is_some()).collect();
        if nuisance.record.is_none() || of_records.len() <= TOLD_ALONE {
            let (value, sigma, unit) = in_unit(nuisance, nuisance.value);
            let of = nuisance.record.as_ref().map_or(String::new(), |record| format!(" ({record})"));
            // At a bound nothing is known of how sure it is.
            let _ = if nuisance.is_at_bound {
                writeln!(text, "  {}{of}: {value} {unit}, {AT_BOUND}", nuisance.what)
            } else {
                writeln!(text, "  {}{of}: {value} +- {sigma} {unit}", nuisance.what)
            };
        } else if !told.contains(&nuisance.what) {
            told.push(nuisance.what);
            let values = || of_records.iter().map(|one| one.value);
            let (least, _, unit) = in_unit(nuisance, values().fold(f64::INFINITY, f64::min));
            let (most, ..) = in_unit(nuisance, values().fold(f64::NEG_INFINITY, f64::max));
            let held: Vec<&str> =
                of_records.iter().filter(|one| one.is_at_bound).filter_map(|one| one.record.as_deref()).collect();
            let bound = match held.len() {
                0 => String::new(),
                few if few <= TOLD_ALONE => format!(", {AT_BOUND} ({})", held.join("; ")),
                many => format!(", in {many} of them {AT_BOUND}"),
            };
            let of = of_records.len();
            let _ = writeln!(text, "  {}: {least} to {most} {unit} in {of} records{bound}", nuisance.what);
        }
    }
    text
}

/// A value of what a nuisance is, with its standard deviation, and their unit: a share in percent.
fn in_unit(nuisance: &NuisanceReport, value: f64) -> (String, String, String) {
    match Dimension::of_si_unit(nuisance.unit).filter(|one| *one != Dimension::Pure).map(told_in) {
        Some(told) => {
            (told.signed_difference(value, 3), told.difference(nuisance.sigma, 3), told.difference_name().to_owned())
        }
        None => (format!("{:+.3}", 100.0 * value), format!("{:.3}", 100.0 * nuisance.sigma), "%".to_owned()),
    }
}

/// What to do with an answer: why, and the call that does it. A search that it asks for leaves out what this one did.
pub fn next(
    valve: &Path,
    input: &CampaignInput,
    answer: &Explanation,
    ruled_out: &RuledOutArgs,
) -> (String, Vec<String>) {
    let [file, strokes] = [valve, &input.campaign_path].map(|path| path.display().to_string());
    let call = |why: &str, words: &[&str]| (why.to_owned(), words.iter().map(|word| (*word).to_owned()).collect());
    let ids = ruled_out.without.iter().map(|kind| kind.id()).collect::<Vec<_>>().join(",");
    let without: &[&str] = if ids.is_empty() { &[] } else { &["--without", &ids] };
    let adopt = |why: &str, out: &str, effects: &[&str], without: &[&str]| {
        let out = free_name_beside(valve, out);
        let effects = effects.iter().flat_map(|id| ["--effect", id]);
        let words = ["adopt", &file, &strokes].into_iter().chain(effects).chain(without.iter().copied());
        call(why, &words.chain(["--out", out.as_str()]).collect::<Vec<_>>())
    };
    let again = [&["explain", file.as_str(), strokes.as_str()], without].concat();
    if let Some(Exchanged { runs: [one, other], what }) = &answer.exchanged {
        let why =
            format!("in {strokes}, write the {what} of {one} and {other} the other way round; then explain again");
        return call(&why, &again);
    }
    if let Some(left_out) = &answer.left_out {
        let verb = if left_out.repair.is_some() { "correct" } else { "see to" };
        let why = format!(
            "in {strokes}, {verb} {}; or take its [[run]] out; then explain again",
            explanation::correction(left_out)
        );
        return call(&why, &again);
    }
    match answer.verdict {
        // What was fitted to these strokes once is not to be fitted to them for ever.
        Verdict::Adequate if input.is_fitted() => {
            let tables = free_name_beside(valve, "tables");
            let why = "the valve file is fitted to these strokes: build the tables that a timing log is read with";
            call(why, &["build-tables", &file, "--out", &tables])
        }
        Verdict::Adequate => adopt("write the refitted parameters into a valve file", "calibrated.toml", &[], &[]),
        Verdict::EffectFound | Verdict::PartlyExplained => {
            let effects: Vec<&str> = answer.recommended.iter().map(|kind| kind.id()).collect();
            let first = if answer.indistinguishable.iter().any(|group| group.experiment.is_some()) {
                " (or record the [[run]] above first, add it to the campaign, and explain again)"
            } else {
                ""
            };
            adopt(&format!("add what was found to the valve file{first}"), "better.toml", &effects, &[])
        }
        Verdict::OutsideCatalogue => match answer.discrepancy.as_ref().filter(|_| explanation::is_explained(answer)) {
            Some(discrepancy) => {
                let name = discrepancy.effect.name();
                adopt("add the formula to the valve file, refitted", "better.toml", &[name], without)
            }
            None => call(
                "see where the missing force or flow sits",
                &["compare", &file, &strokes, "--residual-force", "--plot-force", "force.svg"],
            ),
        },
        Verdict::NotEnoughData if answer.interrupted => call("let the search run to its end", &again),
        Verdict::NotEnoughData => {
            call("record more (the [[run]] above tells most), add it to the campaign, and explain again", &again)
        }
    }
}

fn discrepancy_text(discrepancy: &ModelDiscrepancy) -> String {
    let (target, along) = (discrepancy.axis.target.id(), discrepancy.axis.variable);
    let mut text =
        format!("What is missing acts as {target} along {along}: {}\n", discrepancy.effect.formula().source());
    for (parameter, sigma) in discrepancy.effect.parameters().iter().zip(&discrepancy.parameter_sigmas) {
        let _ = writeln!(text, "  {} = {}", parameter.name, with_error(parameter.value, *sigma, &parameter.unit));
    }
    let unit = told_in(Dimension::Length);
    let left = |errors: Errors| {
        errors.rmse_m.map_or_else(|| "-".to_owned(), |rmse| format!("{} {}", unit.number(rmse, 3), unit.name()))
    };
    let _ = write!(
        text,
        "It leaves an error of {} ({} on what was held out). As an effect of the valve file (`valve adopt --effect {}` puts it there):\n\n{}",
        left(discrepancy.errors),
        discrepancy.held_out.map_or_else(|| "-".to_owned(), left),
        discrepancy.effect.name(),
        indented(&explanation::effect_toml(discrepancy)),
    );
    text
}

/// Lines as they stand in a file, apart from the prose around them.
fn indented(toml: &str) -> String {
    toml.lines().map(|line| if line.is_empty() { "\n".to_owned() } else { format!("    {line}\n") }).collect()
}

/// Candidates that the table has, beside those that the answer names.
const LIKELIEST: usize = 12;

fn candidate_table(answer: &Explanation) -> String {
    let unit = told_in(Dimension::Length);
    let error = format!("error ({})", unit.name());
    let mut table = TextTable::new(&[
        ("candidate", Align::Left),
        ("log evidence", Align::Right),
        (&error, Align::Right),
        ("in noise", Align::Right),
        ("held out", Align::Right),
        ("", Align::Left),
    ]);
    let (candidates, others): (Vec<_>, Vec<_>) = pictures::distinct(answer)
        .into_iter()
        .enumerate()
        .partition(|(place, candidate)| *place < LIKELIEST || pictures::is_told(answer, candidate));
    if candidates.is_empty() {
        return String::new();
    }
    for (_, candidate) in candidates {
        let why = candidate.rejected.clone().unwrap_or_else(|| "chosen".into());
        let held_out = candidate.held_out.map_or_else(String::new, |errors| format!("{:.2}", errors.normalised_rms));
        table.row(vec![
            explanation::joined(&candidate.kinds),
            format!("{:+.1}", candidate.gain),
            candidate.errors.rmse_m.map_or_else(|| "-".into(), |rmse| unit.number(rmse, 4)),
            format!("{:.2}", candidate.errors.normalised_rms),
            held_out,
            why,
        ]);
    }
    let told = format!(
        "log evidence: how far the natural logarithm of the probability of what was recorded rises with the candidate; \
         none is taken below {BY_CHANCE:+.0}, and of several the one with the most{}",
        if others.is_empty() { String::new() } else { format!("; {} with less are in the JSON output", others.len()) }
    );
    format!("{}{told}\n", table.render())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zero(record: Option<&str>, value: f64, is_at_bound: bool) -> NuisanceReport {
        NuisanceReport {
            what: "zero of the position sensor",
            record: record.map(str::to_owned),
            value,
            sigma: 1e-4,
            prior: 1e-3,
            unit: "m",
            is_at_bound,
        }
    }

    #[test]
    fn what_many_records_are_off_by_is_one_line() {
        let gain = NuisanceReport { what: "gain of the position sensor", unit: "", ..zero(None, 0.03, true) };
        let two = [zero(Some("a.csv"), 1e-3, false), zero(Some("b.csv"), -2e-3, true), gain.clone()];
        let lines = nuisance_lines(&two);
        assert_eq!(
            lines,
            "  zero of the position sensor (a.csv): +1.000 +- 0.100 mm\n  \
             zero of the position sensor (b.csv): -2.000 mm, at its bound: something may be missing\n  \
             gain of the position sensor: +3.000 %, at its bound: something may be missing\n"
        );
        let three = [&two[..2], &[zero(Some("c.csv"), 4e-3, true), gain.clone()]].concat();
        let lines = nuisance_lines(&three);
        assert_eq!(
            lines,
            "  zero of the position sensor: -2.000 to +4.000 mm in 3 records, at its bound: something may be missing (b.csv; c.csv)\n  \
             gain of the position sensor: +3.000 %, at its bound: something may be missing\n"
        );
        let held = [&three[..3], &[zero(Some("d.csv"), 3e-3, true)]].concat();
        assert_eq!(
            nuisance_lines(&held),
            "  zero of the position sensor: -2.000 to +4.000 mm in 4 records, in 3 of them at its bound: something may be missing\n"
        );
    }
}
