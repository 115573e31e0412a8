//! Verbs about a valve file and a campaign: `compare`, `calibrate`, `explain`, `adopt`.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use valve_model::EffectKind;

use super::{Format, LogColumnArgs};

/// Options of `compare`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Errors are measured minus simulated: of times, a model that is late has a negative
one. The error in units of the noise is 1 where the noise explains it. It is that
of the step datasheet in calibrate, explain and adopt.

Examples:
  valve compare valve.toml campaign.toml
  valve compare valve.toml campaign.toml --against calibrated.toml
  valve compare valve.toml campaign.toml --plot overlay.svg --plot-force force.svg
  valve compare valve.toml campaign.toml --fail-above 1.1")]
pub struct CompareArgs {
    /// The valve file
    pub valve: PathBuf,
    /// The campaign file
    pub campaign: PathBuf,
    /// Another valve file, to be shown beside the first
    #[arg(long, value_name = "FILE")]
    pub against: Option<PathBuf>,
    /// End with exit code 1 if the normalised error is above this
    #[arg(long, value_name = "ERROR", value_parser = positive)]
    pub fail_above: Option<f64>,
    /// Tell the force and the flow that the model lacks along the recorded motion
    #[arg(long)]
    pub residual_force: bool,
    /// Draw measured and simulated strokes with their difference to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// Draw the difference of all strokes as strips of colour to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot_strips: Option<PathBuf>,
    /// Draw the force that the model lacks to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot_force: Option<PathBuf>,
    /// Draw pressure against travel (the valve signature) to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot_signature: Option<PathBuf>,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// Options of `calibrate`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
The parameters named in [tolerance] are fitted, each with its tolerance as what is
known beforehand. A fit that needs a parameter far beyond its tolerance, or leaves
more than noise and the variability of strokes, is reported as a sign of missing
physics; values that would only stand in for it are not written (exit code 1)
unless --force says so. How strokes differ from one to the next is taken from
repeats; where there are none, it is estimated from what the fit leaves of three
strokes or more, and said so.

Examples:
  valve calibrate valve.toml campaign.toml --out calibrated.toml
  valve calibrate valve.toml campaign.toml --plot parameters.svg   # writes no valve file")]
pub struct CalibrateArgs {
    /// The valve file
    pub valve: PathBuf,
    /// The campaign file
    pub campaign: PathBuf,
    /// Where the calibrated valve file goes; without it, none is written
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replace outputs that exist, and write values where physics is missing
    #[arg(long)]
    pub force: bool,
    /// Draw how far each parameter moved to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// Reads the name of an effect of the catalogue.
fn effect_parser() -> impl TypedValueParser<Value = EffectKind> {
    let ids = PossibleValuesParser::new(EffectKind::ALL.iter().map(|kind| kind.id()));
    ids.map(|id| EffectKind::from_id(&id).unwrap_or_else(|| unreachable!("it is one of them")))
}

/// What a search for missing effects leaves out.
#[derive(Debug, Default, Args)]
pub struct RuledOutArgs {
    /// Effects that you know are not there, such as process-force on a bench without a line: they are not looked for
    /// (`valve effects` lists all)
    #[arg(long, value_name = "IDS", value_delimiter = ',', value_parser = effect_parser(), hide_possible_values = true)]
    pub without: Vec<EffectKind>,
}

/// Options of `explain`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
The model is calibrated within its tolerances. Every effect of the catalogue is then
added and everything refitted; pairs follow where the noise does not explain what is
left. An answer names the effect, its size and how sure it is, what else it could
be, and the run that would tell them apart; or that nothing is missing; or that no
effect explains the data, with a formula for what is missing. Strokes that differ
from one to the next are allowed for, even where none was repeated to show it. Ctrl-C
ends the search and prints what is known by then.

Examples:
  valve explain valve.toml campaign.toml
  valve explain valve.toml campaign.toml --plot candidates.svg
  valve explain valve.toml campaign.toml --without process-force,back-pressure
  valve adopt valve.toml campaign.toml --effect dry-friction --out better.toml")]
pub struct ExplainArgs {
    /// The valve file
    pub valve: PathBuf,
    /// The campaign file
    pub campaign: PathBuf,
    /// Draw the candidates and what each explains to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// Draw the error after each step to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot_steps: Option<PathBuf>,
    /// Draw where something sits that no effect explains, with its formula, to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot_missing: Option<PathBuf>,
    /// Draw what effects that cannot be told apart predict for the next experiment to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot_experiment: Option<PathBuf>,
    /// An error that does not matter to you, such as "0.2 mm": nothing smaller is looked for
    #[arg(long, value_name = "LENGTH", value_parser = crate::cli::quantities::length_m)]
    pub good_enough: Option<f64>,
    #[command(flatten)]
    pub ruled_out: RuledOutArgs,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// Options of `adopt`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Adds the effects, refits them together with the tolerated parameters and writes a new
valve file that remembers the step (`valve revert` goes back). An effect of your own,
a custom [[effect]] of the valve file, is named by its name and refitted. `unexplained`
is the formula that `valve explain` finds where no effect of the catalogue fits; unless
the valve file has it, it is searched for. Without effects the tolerated parameters alone
are refitted, what instruments may be off by allowed for.

Examples:
  valve adopt valve.toml campaign.toml --effect dry-friction --out better.toml
  valve adopt valve.toml campaign.toml --effect unexplained --out better.toml
  valve adopt valve.toml campaign.toml --effect dry-friction --effect supply-droop --out better.toml")]
pub struct AdoptArgs {
    /// The valve file
    pub valve: PathBuf,
    /// The campaign file
    pub campaign: PathBuf,
    /// Id of an effect of the catalogue, name of a custom effect of the valve file, or "unexplained"
    #[arg(long = "effect", value_name = "ID")]
    pub effects: Vec<String>,
    #[command(flatten)]
    pub ruled_out: RuledOutArgs,
    /// Where the new valve file goes
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// Tell the end of life by a timing log of the same valve with each step's model: as it was, calibrated,
    /// with each effect
    #[arg(long, value_name = "CSV")]
    pub log: Option<PathBuf>,
    /// How the log's columns are to be read.
    #[command(flatten)]
    pub columns: LogColumnArgs,
    /// Draw the error after each step to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("a number above 0 is needed, such as 1.1".to_owned()),
    }
}
