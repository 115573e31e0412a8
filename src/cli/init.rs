//! Options of `valve init`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Options of `valve init`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, after_long_help = INIT_EXAMPLES)]
pub struct InitArgs {
    /// What to write, where it is no valve file
    #[command(subcommand)]
    pub what: Option<InitWhat>,
    /// The valve file's numbers
    #[command(flatten)]
    pub valve: InitValveArgs,
}

const INIT_EXAMPLES: &str = "\
At a terminal, what is not given is asked for, with a word about where it stands
on a datasheet. Elsewhere, give the options; --typical fills in the rest.

Examples:
  valve init --out valve.toml
  valve init --stroke \"25.4 mm\" --bore \"63 mm\" --supply \"5.2 barg\" --typical
  valve init campaign traces/*.csv --valve valve.toml --out campaign.toml";

/// What else can be begun.
#[derive(Debug, Subcommand)]
pub enum InitWhat {
    /// Write a campaign file for recordings, after a look at them
    Campaign(InitCampaignArgs),
}

/// What a datasheet says, each as text with its unit.
#[derive(Debug, Args)]
pub struct InitValveArgs {
    /// The file to write
    #[arg(long, value_name = "FILE", default_value = "valve.toml")]
    pub out: PathBuf,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// Take typical values, with wide tolerances, for all that is not given
    #[arg(long)]
    pub typical: bool,
    /// What the valve is called
    #[arg(long)]
    pub name: Option<String>,
    /// Travel between the stops, such as "25.4 mm"
    #[arg(long, value_name = "LENGTH")]
    pub stroke: Option<String>,
    /// Bore of the cylinder, such as "63 mm"
    #[arg(long, value_name = "LENGTH")]
    pub bore: Option<String>,
    /// Effective area of piston or diaphragm, such as "31.2 cm2"; a bore beside it has to agree
    #[arg(long, value_name = "AREA")]
    pub piston_area: Option<String>,
    /// Supply pressure, such as "75 psig" or "5.2 barg"
    #[arg(long, value_name = "PRESSURE")]
    pub supply: Option<String>,
    /// Bench set: pressures at which the stroke begins and ends, such as "0.8..2.4 barg"
    #[arg(long, value_name = "RANGE", conflicts_with_all = ["spring_stiffness", "spring_preload"])]
    pub bench_set: Option<String>,
    /// Stiffness of the spring, such as "16 N/mm"; "0 N/m" without a spring
    #[arg(long, value_name = "STIFFNESS")]
    pub spring_stiffness: Option<String>,
    /// Compression of the spring with the valve open, such as "36 mm", or its force then, such as "130 lbf"
    #[arg(long, value_name = "LENGTH", hide_short_help = true)]
    pub spring_preload: Option<String>,
    /// Mass of piston, stem and plug, such as "1.5 kg"
    #[arg(long, value_name = "MASS", hide_short_help = true)]
    pub moving_mass: Option<String>,
    /// Volume of the chamber with the valve open, such as "30 cm3"
    #[arg(long, value_name = "VOLUME", hide_short_help = true)]
    pub dead_volume: Option<String>,
    /// Viscous friction, such as "600 N s/m"
    #[arg(long, value_name = "FRICTION", hide_short_help = true)]
    pub viscous_friction: Option<String>,
    /// Orifice of the solenoid: a diameter, an area, "Kv 0.03", "Cv 0.04" or "C 0.1"
    #[arg(long, value_name = "ORIFICE")]
    pub solenoid: Option<String>,
    /// Orifice of the cylinder's port, likewise
    #[arg(long, value_name = "ORIFICE", hide_short_help = true)]
    pub port: Option<String>,
    /// Volume between solenoid and cylinder, such as "40 cm3", or "6 mm x 1.4 m" for a hose
    #[arg(long, value_name = "VOLUME")]
    pub pipe: Option<String>,
    /// Stiffness of the end stops, such as "1 MN/m"
    #[arg(long, value_name = "STIFFNESS", hide_short_help = true)]
    pub contact_stiffness: Option<String>,
    /// Discharge coefficient of the orifices
    #[arg(long, value_name = "NUMBER", hide_short_help = true)]
    pub flow_coefficient: Option<String>,
    /// How it stands: upright (the weight closes the valve), inverted (it opens it) or horizontal
    #[arg(long, value_name = "WORD", hide_short_help = true)]
    pub orientation: Option<String>,
    /// How well a value is known, one standard deviation, such as spring.stiffness=0.02 or "port 20 %"; may be repeated. The
    /// limits of a datasheet stand behind the value itself instead: --port "3.5 mm2 +-20 %"
    #[arg(long, value_name = "VALUE=SHARE", hide_short_help = true)]
    pub tolerance: Vec<String>,
    /// When the valve is told to open, after it was told to close, such as "4 s"
    #[arg(long, value_name = "TIME", hide_short_help = true)]
    pub open_at: Option<String>,
    /// When the cycle ends, such as "12 s"
    #[arg(long, value_name = "TIME", hide_short_help = true)]
    pub cycle_end: Option<String>,
    /// Gas: air or nitrogen
    #[arg(long, value_name = "GAS", hide_short_help = true)]
    pub gas: Option<String>,
    /// Temperature, such as "20 degC"
    #[arg(long, allow_hyphen_values = true, value_name = "TEMPERATURE", hide_short_help = true)]
    pub temperature: Option<String>,
    /// Atmospheric pressure, such as "101.325 kPa"
    #[arg(long, value_name = "PRESSURE", hide_short_help = true)]
    pub ambient: Option<String>,
    /// Longest acceptable closing time, such as "3 s"
    #[arg(long, value_name = "TIME")]
    pub close_within: Option<String>,
    /// Longest acceptable opening time, such as "6 s"
    #[arg(long, value_name = "TIME")]
    pub open_within: Option<String>,
}

/// Options of `valve init campaign`.
#[derive(Debug, Args)]
pub struct InitCampaignArgs {
    /// The recordings
    #[arg(required = true, value_name = "FILES")]
    pub files: Vec<PathBuf>,
    /// The file to write
    #[arg(long, value_name = "FILE", default_value = "campaign.toml")]
    pub out: PathBuf,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// The campaign's name; else that of its folder
    #[arg(long)]
    pub name: Option<String>,
    /// The valve file: stroke, ambient pressure and temperature are taken from it
    #[arg(long, value_name = "FILE")]
    pub valve: Option<PathBuf>,
    /// The stroke, where there is no valve file yet, such as "25.4 mm"
    #[arg(long, value_name = "LENGTH", conflicts_with = "valve")]
    pub stroke: Option<String>,
    /// Supply pressure of all recordings, or FILE=PRESSURE of one; may be repeated
    #[arg(long, value_name = "PRESSURE")]
    pub supply: Vec<String>,
    /// Temperature of all recordings, or FILE=TEMPERATURE of one; may be repeated
    #[arg(long, allow_hyphen_values = true, value_name = "TEMPERATURE")]
    pub temperature: Vec<String>,
    /// Leak that was opened on purpose, such as FILE=atmosphere:0.15mm2 or FILE=supply:0.05mm2; may be repeated
    #[arg(long, value_name = "LEAK")]
    pub leak: Vec<String>,
    /// Which column is which: CHANNEL=NAME, such as position=LVDT, or supply_pressure=none to leave a channel out
    #[arg(long, value_name = "CHANNEL=NAME")]
    pub column: Vec<String>,
    /// Noise of the position sensor, one standard deviation, such as "0.01 mm", where a datasheet states it
    #[arg(long, value_name = "LENGTH")]
    pub position_noise: Option<String>,
    /// What a command of 1 means: close or open
    #[arg(long, value_name = "close|open", value_parser = ["close", "open"])]
    pub one_means: Option<String>,
    /// Towards which end the recorded position grows: open or closed
    #[arg(long, value_name = "open|closed", value_parser = ["open", "closed"])]
    pub position_grows: Option<String>,
}
