//! The verbs that serve a page: `lab`, `watch`.

use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;

use clap::Args;

use super::LogColumnArgs;

/// Where a page is served.
#[derive(Debug, Args)]
pub struct PageArgs {
    /// Address to serve at; one that others can reach needs --token
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    pub host: IpAddr,
    /// Port to serve at; 0 takes any that is free
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    pub port: u16,
    /// What the page's address must hold, 16 characters or more; made up at random unless given
    #[arg(long, value_name = "SECRET")]
    pub token: Option<String>,
    /// Do not open the page in a browser, only print its address
    #[arg(long)]
    pub no_open: bool,
}

/// Options of `lab`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Serves a page on this machine alone, at a random address that it prints and opens:
measured and simulated strokes with their difference, the physics as switches and
sliders that re-simulate all runs while the hand moves, a fit, the search for what is
missing, and the valve file with what was found. Its numbers are those of `valve
compare`, `calibrate`, `explain` and `adopt`. Nothing is asked of any other machine,
and no file is written but the one that you name there.

Examples:
  valve lab valve.toml campaign.toml
  valve lab valve.toml campaign.toml --log log.csv
  valve lab valve.toml campaign.toml --no-open --port 8000")]
pub struct LabArgs {
    /// The valve file
    pub valve: PathBuf,
    /// The campaign file
    pub campaign: PathBuf,
    /// A timing log of the valve, to see its remaining life by the file's model and by the sliders'
    #[arg(long, value_name = "FILE")]
    pub log: Option<PathBuf>,
    /// How the log's columns are to be read.
    #[command(flatten)]
    pub columns: LogColumnArgs,
    /// Where it is served
    #[command(flatten)]
    pub page: PageArgs,
}

/// Options of `watch`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Serves a page on which every valve of the logs stands, worst first, and follows the
logs as they grow: status, fault, leak, remaining cycles with their bounds, by when to
replace; a click shows a valve's past. A folder stands for the CSV files in it, those
that come later included. A row that cannot be read is left out and said.

Examples:
  valve watch log.csv --tables tables
  valve watch logs/ --tables tables --no-open --port 8000")]
pub struct WatchArgs {
    /// Timing logs (CSV), or folders of them
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<PathBuf>,
    /// Directory with the tables
    #[arg(long, value_name = "DIR")]
    pub tables: PathBuf,
    /// Where it is served
    #[command(flatten)]
    pub page: PageArgs,
}
