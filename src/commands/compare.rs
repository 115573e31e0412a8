//! `valve compare`: the model beside the record.

use std::fmt::Write;
use std::path::PathBuf;

use model_lab::compare::{Comparison, Direction, Phase, PhaseScore};
use model_lab::diagnosis::TakenBy;
use model_lab::errors::Errors;
use model_lab::residual_force::{ResidualForce, Signature};
use quantity::Dimension;
use valve_file::ValveFile;

use super::explain::nuisance_text;
use super::{campaign_input, steps};
use crate::cli::{CompareArgs, Format};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Align, Outputs, PlotFile, TextTable, free_name_beside, next_step, told_in};
use answers::comparison::Compared;
use answers::figures::comparison as figures;
use answers::{CampaignInput, comparison as json};

/// Why no missing force is told, and what would let it be.
const NO_FORCE: &str = "the recorded strokes are too short to tell a missing force, or their rows too far apart";
const NEEDED_FOR_FORCE: &str =
    "strokes that move for at least 50 ms away from their stops, with ten rows in that time, are needed";

/// Compares and prints.
pub fn run(args: &CompareArgs) -> anyhow::Result<Answer> {
    let input = campaign_input::read(&args.valve, &args.campaign)?;
    let other = args.against.as_deref().map(ValveFile::read).transpose()?;
    let traces_needed = args.plot.is_some() || args.plot_strips.is_some() || wants_force(args);
    if traces_needed && input.data.runs.is_empty() {
        return Err(Hinted::error(
            format!("campaign {}: stroke times alone show no motion to draw", input.campaign.name),
            "leave --residual-force and the plots out, or record traces",
        ));
    }
    let plots = Plots::create(args, &input)?;
    let compared_file = compared(&input, &input.file)?;
    let comparison = &compared_file.comparison;
    let against = other.as_ref().map(|file| Ok::<_, anyhow::Error>((file, compared(&input, file)?))).transpose()?;
    let force = if wants_force(args) {
        ResidualForce::new(&input.data, input.file.valve(), input.file.tolerances())
    } else {
        None
    };
    match args.format {
        Format::Text => {
            let mut text = text(&input, &compared_file, against.as_ref(), force.as_ref());
            if wants_force(args) && force.is_none() {
                let _ = writeln!(text, "\n{NO_FORCE}: {NEEDED_FOR_FORCE}");
            }
            output::print_text(&(text + &next(args, &input, &compared_file, force.is_some())))?;
        }
        Format::Json => {
            output::print_json(&json::document(&input, &compared_file, against.as_ref(), force.as_ref()))?;
        }
    }
    plots.draw(&input, comparison, against.as_ref(), force.as_ref())?;
    let bad = args.fail_above.is_some_and(|limit| comparison.overall.errors.normalised_rms > limit);
    Ok(if bad { Answer::BadNews } else { Answer::Fine })
}

/// A valve file beside a campaign.
pub fn compared(input: &CampaignInput, file: &ValveFile) -> anyhow::Result<Compared> {
    Compared::new(input, file).ok_or_else(|| {
        Hinted::error(
            format!("{}: its strokes cannot be simulated", file.file_name()),
            "look at the valve with `valve simulate`, and at the effects' parameters with `valve effects`",
        )
    })
}

/// An error up to so many times the noise is none.
const NOISE_ALONE: f64 = 1.1;

/// What to do with what was found.
fn next(args: &CompareArgs, input: &CampaignInput, compared: &Compared, tells_force: bool) -> String {
    let (valve, campaign) = (args.valve.display().to_string(), args.campaign.display().to_string());
    let is_noise = |errors: &Errors| errors.normalised_rms <= NOISE_ALONE;
    if is_noise(&compared.comparison.overall.errors) || is_noise(&compared.allowing.errors) && input.is_fitted() {
        let why = "noise and instruments explain the error: build the tables that a timing log is read with";
        return next_step(why, &["build-tables", &valve, "--out", &free_name_beside(&args.valve, "tables")]);
    }
    if tells_force && (input.is_fitted() || input.file.tolerances().is_empty()) {
        let why = "describe what is missing as a custom effect in the valve file: [[effect]] tells how";
        return next_step(why, &["help", "formats"]);
    }
    if input.file.tolerances().is_empty() {
        let why = "find the effect that is missing ([tolerance] would say which values are not known exactly)";
        return next_step(why, &["explain", &valve, &campaign]);
    }
    let out = free_name_beside(&args.valve, "calibrated.toml");
    next_step("see whether the tolerances explain it", &["calibrate", &valve, &campaign, "--out", &out])
}

fn wants_force(args: &CompareArgs) -> bool {
    args.residual_force || args.plot_force.is_some() || args.plot_signature.is_some()
}

/// The pictures asked for, opened before the work.
struct Plots {
    overlay: Option<PlotFile>,
    strips: Option<PlotFile>,
    force: Option<PlotFile>,
    signature: Option<PlotFile>,
}

impl Plots {
    fn create(args: &CompareArgs, input: &CampaignInput) -> anyhow::Result<Self> {
        let mut outputs = Outputs::new(args.force).reads(input.files()).reads(&args.against);
        let mut plot = |path: &Option<PathBuf>| PlotFile::create(&mut outputs, path.as_deref());
        Ok(Self {
            overlay: plot(&args.plot)?,
            strips: plot(&args.plot_strips)?,
            force: plot(&args.plot_force)?,
            signature: plot(&args.plot_signature)?,
        })
    }

    fn draw(
        self,
        input: &CampaignInput,
        comparison: &Comparison,
        against: Option<&(&ValveFile, Compared)>,
        force: Option<&ResidualForce>,
    ) -> anyhow::Result<()> {
        if let Some(plot) = self.overlay {
            plot.write(&figures::overlay(input, comparison, &steps::words(&comparison.overall.errors)).figure())?;
        }
        if let Some(plot) = self.strips {
            plot.write(&figures::strips(input, comparison, against).figure())?;
        }
        let missing = || Hinted::error(NO_FORCE, NEEDED_FOR_FORCE);
        if let Some(plot) = self.force {
            plot.write(&figures::missing_force(force.ok_or_else(missing)?).figure())?;
        }
        if let Some(plot) = self.signature {
            let signature = force.and_then(|force| force.signature.as_ref()).ok_or_else(missing)?;
            plot.write(&figures::signature(input.file.name(), signature, signature_words(signature)).figure())?;
        }
        Ok(())
    }
}

fn text(
    input: &CampaignInput,
    compared: &Compared,
    against: Option<&(&ValveFile, Compared)>,
    force: Option<&ResidualForce>,
) -> String {
    let comparison = &compared.comparison;
    let mut text = format!("{}: {}\n\n", input.file.file_name(), input.campaign.name);
    for words in findings(comparison) {
        push(&mut text, &words);
    }
    text.push('\n');
    for line in error_lines(compared) {
        push(&mut text, &line);
    }
    if compared.allowing.errors.normalised_rms <= NOISE_ALONE && comparison.overall.errors.normalised_rms > NOISE_ALONE
    {
        let words = nuisance_text(&compared.nuisances);
        let none = "none of them by more than is usual of zeros, gains, delays and supply pressures\n".to_owned();
        text.push_str(&if words.is_empty() { none } else { words });
        if let Some(words) = taken_words(&compared.taken) {
            push(&mut text, &words);
        }
    }
    text.push('\n');
    text.push_str(&run_table(comparison, against.map(|(_, other)| &other.comparison)).render());
    text.push_str("times are measured minus simulated: where the model is late, they are negative\n");
    let has_none = |run: &model_lab::compare::RunComparison| {
        run.score.close_time_error_s.is_none() || run.score.open_time_error_s.is_none()
    };
    if comparison.runs.iter().any(has_none) {
        text.push_str("-: recorded or simulated, that stroke was not made or not to its end\n");
    }
    if !comparison.overall.phases.is_empty() {
        text.push('\n');
        text.push_str(&phase_table(&comparison.overall.phases).render());
    }
    text.push('\n');
    text.push_str(&noise_words(input, compared));
    if let Some((file, other)) = against {
        push(&mut text, &format!("\n{}:", file.file_name()));
        for words in findings(&other.comparison) {
            push(&mut text, &words);
        }
        for line in error_lines(other) {
            push(&mut text, &line);
        }
    }
    if let Some(force) = force {
        text.push('\n');
        text.push_str(&force_words(force));
    }
    text
}

fn push(text: &mut String, line: &str) {
    text.push_str(line);
    text.push('\n');
}

fn length(metres: Option<f64>) -> String {
    metres.map_or_else(|| "-".to_owned(), |metres| told_in(Dimension::Length).number(metres, 3))
}

/// The findings as sentences, places in the units of the user.
pub fn findings(comparison: &Comparison) -> Vec<String> {
    let unit = told_in(Dimension::Length);
    let place = |words: String, between: Option<(f64, f64)>| match between {
        Some((low, high)) => {
            let usual = format!("x = {:.0} and {:.0} mm", low * 1e3, high * 1e3);
            words.replace(&usual, &format!("x = {} and {} {}", unit.number(low, 0), unit.number(high, 0), unit.name()))
        }
        None => words,
    };
    let between = |words: &str| comparison.findings.iter().find(|one| one.words == words).and_then(|one| one.between_m);
    comparison.words().into_iter().map(|words| (between(&words), words)).map(|(at, words)| place(words, at)).collect()
}

fn milliseconds(seconds: Option<f64>) -> String {
    seconds.map_or_else(|| "-".to_owned(), |seconds| format!("{:+.1}", seconds * 1e3))
}

/// The error as it stands, and allowing for instruments, in a line each.
pub fn error_lines(compared: &Compared) -> impl Iterator<Item = String> {
    let errors = [&compared.comparison.overall.errors, &compared.allowing.errors].map(steps::words);
    let starts = ["error: ", "allowing for what instruments and conditions may be off by: "];
    starts.into_iter().zip(errors).map(|(start, words)| format!("{start}{words}"))
}

/// What each kind of instruments takes of the error, in a sentence.
fn taken_words(taken: &[(TakenBy, Errors)]) -> Option<String> {
    let (length, time) = (told_in(Dimension::Length), told_in(Dimension::Time));
    let size = |errors: &Errors| match (errors.rmse_m, errors.time_rmse_s) {
        (Some(error), _) => format!("{} {}", length.difference(error, 3), length.difference_name()),
        (None, time_s) => format!("{} {}", time.difference(time_s.unwrap_or(0.0), 1), time.difference_name()),
    };
    // Sensors beside the position move none of it.
    let felt = taken.iter().filter(|(_, errors)| errors.rmse_m != Some(0.0));
    let parts: Vec<String> = felt.map(|(by, errors)| format!("{} by {}", size(errors), by.words())).collect();
    (!parts.is_empty()).then(|| format!("of the error they take, each alone: {}", parts.join(", ")))
}

/// The error of every run.
pub fn run_table(comparison: &Comparison, against: Option<&Comparison>) -> TextTable {
    let pressure = told_in(Dimension::Pressure);
    let (supply, error) =
        (format!("supply ({})", pressure.name()), format!("error ({})", told_in(Dimension::Length).name()));
    let mut columns = vec![
        ("run", Align::Left),
        (supply.as_str(), Align::Right),
        (error.as_str(), Align::Right),
        ("in noise", Align::Right),
        ("closing (ms)", Align::Right),
        ("opening (ms)", Align::Right),
    ];
    if against.is_some() {
        columns.push(("other, in noise", Align::Right));
    }
    let mut table = TextTable::new(&columns);
    let others = |index: usize| against.map(|other| other.runs[index].score.errors.normalised_rms);
    for (index, run) in comparison.runs.iter().enumerate() {
        let score = &run.score;
        let mut row = vec![
            run.file.clone(),
            pressure.number(run.conditions.supply_pressure_pa, 0),
            length(score.errors.rmse_m),
            format!("{:.2}", score.errors.normalised_rms),
            milliseconds(score.close_time_error_s),
            milliseconds(score.open_time_error_s),
        ];
        row.extend(others(index).map(|size| format!("{size:.2}")));
        table.row(row);
    }
    let score = &comparison.overall;
    let mut row = vec![
        "all".to_owned(),
        String::new(),
        length(score.errors.rmse_m),
        format!("{:.2}", score.errors.normalised_rms),
        milliseconds(score.close_time_error_s),
        milliseconds(score.open_time_error_s),
    ];
    row.extend(against.map(|other| format!("{:.2}", other.overall.errors.normalised_rms)));
    table.row(row);
    table
}

fn phase_table(phases: &[PhaseScore]) -> TextTable {
    let unit = told_in(Dimension::Length);
    let [closing, opening] = ["closing", "opening"].map(|name| format!("{name} ({})", unit.name()));
    let mut table = TextTable::new(&[
        ("phase", Align::Left),
        (&closing, Align::Right),
        ("share", Align::Right),
        ("off by (ms)", Align::Right),
        (&opening, Align::Right),
        ("share", Align::Right),
        ("off by (ms)", Align::Right),
    ]);
    for phase in Phase::ALL {
        let mut row = vec![phase.id().replace('_', " ")];
        for direction in Direction::ALL {
            let score = phases.iter().find(|score| score.direction == direction && score.phase == phase);
            row.push(length(score.and_then(|score| score.rmse_m)));
            let share = score.and_then(|score| score.share);
            row.push(share.map_or_else(|| "-".to_owned(), |share| format!("{share:.3}")));
            row.push(milliseconds(score.and_then(|score| score.time_error_s)));
        }
        table.row(row);
    }
    table
}

/// Where noise is this many times larger than what errors are counted in, they are of means over several readings.
const MEANS: f64 = 1.5;

/// A model error below this share of the stroke is not worth a word.
const LEAST_MODEL_ERROR: f64 = 1e-4;

fn noise_words(input: &CampaignInput, Compared { comparison, allowing, .. }: &Compared) -> String {
    let mut text = String::new();
    let source = input.noise_source();
    if let Some(noise) = comparison.noise_m {
        let unit = told_in(Dimension::Length);
        let _ = write!(text, "noise of the position: {} {} ({source})", unit.number(noise, 4), unit.name());
        let counted_m = allowing.errors.rmse_m.map_or(noise, |rmse_m| rmse_m / allowing.errors.normalised_rms);
        if counted_m < noise / MEANS {
            let counted = unit.number(counted_m, 4);
            let _ =
                write!(text, "; errors are counted in that of means over several readings, {counted} {}", unit.name());
        }
        text.push('\n');
    }
    if let Some(noise) = comparison.timing_noise_s {
        let _ = writeln!(text, "noise of stroke times: {:.2} ms ({source})", noise * 1e3);
    }
    if let (Some(size), Some(time_s)) = (allowing.discrepancy, allowing.correlation_time_s)
        && size > LEAST_MODEL_ERROR
        && comparison.noise_m.is_some()
    {
        let _ = writeln!(
            text,
            "what they leave is not white: {:.2} % of the stroke at full speed that hangs together over {:.0} ms",
            100.0 * size,
            1e3 * time_s
        );
    }
    text
}

fn force_words(force: &ResidualForce) -> String {
    let mut text = String::new();
    let places = force.along_stroke();
    let (newtons, metres) = (told_in(Dimension::Force), told_in(Dimension::Length));
    let worst = |value: fn(&model_lab::residual_force::ForceAt) -> f64| {
        places.iter().max_by(|a, b| value(a).abs().total_cmp(&value(b).abs()))
    };
    for (name, value) in [
        ("friction", (|place| place.friction_n) as fn(&model_lab::residual_force::ForceAt) -> f64),
        ("push towards open", |place| place.push_n),
    ] {
        if let Some(place) = worst(value) {
            let _ = writeln!(
                text,
                "missing {name}: at most {} {force} at x = {} {} (standard error {} {force})",
                newtons.signed_difference(value(place), 1),
                metres.number(place.position_m, 1),
                metres.name(),
                newtons.number(place.standard_error_n, 1),
                force = newtons.name(),
            );
        }
    }
    let _ = writeln!(
        text,
        "chamber pressure: {}",
        if force.pressure_is_measured { "measured" } else { "simulated along the measured motion" }
    );
    if let Some(signature) = &force.signature {
        let _ = writeln!(text, "signature: {}", signature_words(signature));
    }
    text
}

/// Friction band, spring rate and bench set in a sentence.
pub fn signature_words(signature: &Signature) -> String {
    let pressure = told_in(Dimension::Pressure);
    let (force, stiffness) = (told_in(Dimension::Force), told_in(Dimension::Stiffness));
    // The bench set is told over the ambient pressure, like a difference.
    format!(
        "friction band ±{} {} (±{} {newton}, of which {} {newton} viscous in the model), spring rate {} {}, \
         bench set {} to {} {}",
        pressure.difference(signature.friction_band_pa, 2),
        pressure.difference_name(),
        force.number(signature.friction_n, 1),
        force.number(signature.viscous_n, 1),
        stiffness.number(signature.spring_rate_n_per_m, 2),
        stiffness.name(),
        pressure.difference(signature.bench_set_pa[0], 1),
        pressure.difference(signature.bench_set_pa[1], 1),
        pressure.difference_name(),
        newton = force.name(),
    )
}
