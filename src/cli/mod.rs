//! The command line: one definition for the parser, `--help`, the man page and
//! the completions.

mod init;
mod lab;
mod measurement;
mod model;
mod prognosis;
mod quantities;
mod tables;

use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::output::{ColorWhen, Units};

pub use init::{InitArgs, InitCampaignArgs, InitValveArgs, InitWhat};
pub use lab::{LabArgs, PageArgs, WatchArgs};
pub use measurement::{AdoptArgs, CalibrateArgs, CompareArgs, ExplainArgs, RuledOutArgs};
pub use model::{EffectsArgs, ReportArgs, RevertArgs, SimulateArgs};
pub use prognosis::{
    BrokerArgs, DemoArgs, EvaluateArgs, GrowthName, LearnArgs, LogColumnArgs, MethodName, PrognoseArgs, StartName,
    StreamFormat,
};
pub use tables::{BuildTablesArgs, QuantityRange};

/// Physics-based prognosis of pneumatic valves from their stroke times
#[derive(Debug, Parser)]
#[command(name = "valve", version, max_term_width = 80, after_help = CHAIN, disable_help_subcommand = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub verb: Verb,
    /// How the program speaks.
    #[command(flatten)]
    pub manner: MannerArgs,
}

/// Options of every verb about how it speaks.
#[derive(Debug, Args)]
#[command(next_help_heading = "Manners")]
pub struct MannerArgs {
    /// Results only: no warnings, progress or next steps
    #[arg(short, long, global = true, conflicts_with = "verbose", display_order = 900)]
    pub quiet: bool,
    /// Also tell what is being done
    #[arg(short, long, global = true, display_order = 901)]
    pub verbose: bool,
    /// Colours: auto (on a terminal), always or never
    #[arg(
        long,
        global = true,
        value_enum,
        value_name = "WHEN",
        default_value = "auto",
        hide_default_value = true,
        hide_possible_values = true,
        display_order = 902
    )]
    pub color: ColorWhen,
    /// Units of text results, such as psig,mm,degC; "file": the valve file's own
    #[arg(long, global = true, value_name = "LIST", value_parser = told_units, display_order = 903)]
    pub units: Option<ToldUnits>,
}

/// The units that text results are told in.
#[derive(Debug, Clone)]
pub enum ToldUnits {
    /// Those that the valve file of the call is written in.
    OfFile,
    /// These.
    These(Units),
}

fn told_units(text: &str) -> Result<ToldUnits, String> {
    if text == "file" { Ok(ToldUnits::OfFile) } else { Units::parse(text).map(ToldUnits::These) }
}

const CHAIN: &str = "\
A valve file describes the valve. Tables made from it turn each measured closing
and opening time into a leak area, and the growth of the leak into the remaining
useful life. `valve help VERB` says more of each verb, with examples.

Quantities are a number and a unit: \"75 psig\", \"0.1 mm2\", \"10 ms\".
Results go to stdout, all else to stderr. Exit code: 0 done; 1 done, and the
answer is the bad news asked for; 2 the input or the call is wrong.";

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Verb {
    /// Begin: a valve file from a datasheet, a campaign from recordings
    Init(Box<InitArgs>),
    /// Simulate cycles of a valve: their stroke times
    #[command(visible_alias = "sim")]
    Simulate(SimulateArgs),
    /// Build the tables from leaks and other wear to stroke times
    BuildTables(Box<BuildTablesArgs>),
    /// Fault, leak and remaining useful life from a timing log
    Prognose(Box<PrognoseArgs>),
    /// Open a page of all valves of growing logs, worst first, live
    Watch(WatchArgs),
    /// Learn from logs of sister valves what to expect of the next
    Learn(LearnArgs),
    /// How good the prognosis of a valve is, on lives with known ends
    Evaluate(EvaluateArgs),
    /// Show the whole chain on data that the program carries
    Demo(DemoArgs),
    /// Hold a model against recorded strokes: how far off, and where
    Compare(CompareArgs),
    /// Fit the parameters that have a tolerance to recorded strokes
    Calibrate(CalibrateArgs),
    /// Find which physical effect a model lacks, and how sure that is
    Explain(ExplainArgs),
    /// Add effects to a valve file, everything refitted
    Adopt(AdoptArgs),
    /// Open a page of the model beside recorded strokes, live
    Lab(LabArgs),
    /// List the physical effects that a valve file can add
    Effects(EffectsArgs),
    /// Write all that is known of a valve into one HTML page
    Report(ReportArgs),
    /// Undo the last step of a valve file's history
    Revert(RevertArgs),
    /// This message, help of a verb, or a page (formats, results)
    ///
    /// Examples: valve help simulate; valve help formats; valve help results
    Help {
        /// A verb, "formats" or "results".
        topic: Vec<String>,
    },
    /// Print the completions for a shell
    ///
    /// Example, for bash: valve completions bash > ~/.local/share/bash-completion/completions/valve
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Print the manual page, or write one for every verb
    ///
    /// Example: valve man | man -l -
    Man {
        /// Directory for one page a verb.
        dir: Option<PathBuf>,
        /// Replace pages that exist
        #[arg(long, requires = "dir")]
        force: bool,
    },
}

impl Verb {
    /// The valve file that a verb reads, if it reads one.
    pub fn valve_file(&self) -> Option<&Path> {
        match self {
            Self::Simulate(args) => Some(&args.valve),
            Self::BuildTables(args) => Some(&args.valve),
            Self::Prognose(args) => args.valve.as_deref(),
            Self::Evaluate(args) => Some(&args.valve),
            Self::Compare(args) => Some(&args.valve),
            Self::Calibrate(args) => Some(&args.valve),
            Self::Explain(args) => Some(&args.valve),
            Self::Adopt(args) => Some(&args.valve),
            Self::Report(args) => Some(&args.valve),
            Self::Effects(args) => args.valve.as_deref(),
            _ => None,
        }
    }
}

/// How a result is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// For people: sentences and aligned tables.
    Text,
    /// For programs: one JSON document (`valve help results`).
    Json,
}
