//! Verbs about one valve file: `simulate`, `effects`, `report`, `revert`.

use std::path::PathBuf;

use clap::Args;
use quantity::Quantity;

use super::quantities::{area_m2, duration_s, pressure, temperature_k};
use super::{Format, LogColumnArgs};

/// Options of `simulate`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Examples:
  valve simulate valve.toml
  valve simulate valve.toml --cycles 4 --leak-to-atmosphere \"0.1 mm2\"
  valve simulate valve.toml --trace cycle.csv --plot cycle.svg")]
pub struct SimulateArgs {
    /// The valve file
    pub valve: PathBuf,
    /// How many cycles, each from the state in which the one before ended
    ///
    /// With a leak the first cycle differs from the later ones: the pipe starts
    /// the next stroke at another pressure. After about four cycles they repeat.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub cycles: u32,
    /// Area of a leak from the pipe to the atmosphere
    #[arg(long, value_name = "AREA", value_parser = area_m2, allow_hyphen_values = true, default_value = "0 mm2")]
    pub leak_to_atmosphere: f64,
    /// Area of a leak from the supply into the pipe
    #[arg(long, value_name = "AREA", value_parser = area_m2, allow_hyphen_values = true, default_value = "0 mm2")]
    pub leak_from_supply: f64,
    /// Supply pressure instead of the valve file's
    #[arg(long, value_name = "PRESSURE", value_parser = pressure)]
    pub supply_pressure: Option<Quantity>,
    /// Temperature instead of the valve file's
    #[arg(long, allow_hyphen_values = true, value_name = "TEMPERATURE", value_parser = temperature_k)]
    pub temperature: Option<f64>,
    /// Longest step of the integrator
    #[arg(long, value_name = "TIME", value_parser = duration_s, default_value = "1 ms")]
    pub step: f64,
    /// Write position and pressures over time to a CSV file, as the valve's sensors would record them
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Draw position and pressures over time to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// Options of `effects`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Examples:
  valve effects
  valve effects dry-friction
  valve effects dry-friction --plot dry-friction.svg")]
pub struct EffectsArgs {
    /// Id of an effect to explain; without it, all are listed
    pub id: Option<String>,
    /// Valve file whose strokes show what the effect does; without it, a reference valve
    #[arg(long, value_name = "FILE", requires = "id")]
    pub valve: Option<PathBuf>,
    /// Draw a stroke without and with the effect to an .svg or .png file
    #[arg(long, value_name = "FILE", requires = "id")]
    pub plot: Option<PathBuf>,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// Options of `report`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
The page needs no other file and no network: pictures and data are in it, to zoom, sort
and print. It tells what the valve does, what its tables hold and, with --log, how each
valve of the log stands; with --campaign, how the model compares with recorded strokes,
whether its tolerances explain them, and which effect is missing; with both, what that
does to the remaining life.

Examples:
  valve report valve.toml --log log.csv --out report.html
  valve report valve.toml --campaign campaign.toml --log log.csv --out report.html")]
pub struct ReportArgs {
    /// The valve file
    pub valve: PathBuf,
    /// A timing log of this kind of valve
    #[arg(long, value_name = "FILE")]
    pub log: Option<PathBuf>,
    /// How the log's columns are to be read.
    #[command(flatten)]
    pub columns: LogColumnArgs,
    /// Recorded strokes of this valve
    #[arg(long, value_name = "FILE")]
    pub campaign: Option<PathBuf>,
    /// Where the page goes
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// Options of `revert`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Example:
  valve revert repaired.toml --out previous.toml")]
pub struct RevertArgs {
    /// The valve file with a history
    pub valve: PathBuf,
    /// Where the earlier valve file goes
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}
