//! Verbs about timing logs and tables: `build-tables`, `prognose`.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use log_columns::NamedColumn;

use super::Format;
use super::quantities::duration_s;
use super::tables::{QuantityRange, supply_range};

/// Options of `demo`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Examples:
  valve demo
  valve demo --plot life.svg
  valve demo --files demo   # leaves valve file, tables and log there to try the other verbs on")]
pub struct DemoArgs {
    /// Draw leak, remaining life and fault over the cycles to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// Write the valve file, the timing log and the tables into a directory
    #[arg(long, value_name = "DIR")]
    pub files: Option<PathBuf>,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// Options of `prognose`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
The log is CSV with the columns valve,cycle,close_time_s,open_time_s and, if you
like, time (RFC 3339), supply_pressure_UNIT (psig, psia, barg, bara, kpag, kpa,
mpa, pa) and temperature_UNIT (k, degc, degf). An empty time was not measured; the
word stalled says that the valve did not get there. Valves may be interleaved.

At the end of a text run every valve is listed, worst first. From good to bad they
are healthy, unknown, watch, plan, act-now, eol-reached. A valve that is replaced
as soon as the latest replace_by_cycle is reached ends in service with no more
than --risk.

Examples:
  valve prognose log.csv --tables tables
  valve prognose log.csv --tables tables --noise \"10 ms\" --plot life.svg
  tail -f log.csv | valve prognose - --tables tables --format jsonl
  valve prognose log.csv --tables tables --follow --fail-on-eol
  valve prognose log.csv --tables tables --follow --state state --out lives.jsonl --format jsonl
  valve prognose mqtt://broker --topic plant/{valve}/stroke --tables tables --state state \\
    --publish plant/{valve}/prognosis --listen 127.0.0.1:9184")]
#[expect(clippy::struct_excessive_bools, reason = "options of a command line")]
pub struct PrognoseArgs {
    /// The timing log; `-` reads stdin, mqtt://HOST:PORT from a broker
    pub log: PathBuf,
    /// Directory of the tables, as `valve build-tables` writes them
    #[arg(long, value_name = "DIR")]
    pub tables: PathBuf,
    /// Valve file that the tables must have been built from; others are refused
    #[arg(long, value_name = "FILE")]
    pub valve: Option<PathBuf>,
    /// How the remaining life is estimated
    #[arg(long, value_enum, default_value_t = MethodName::Bayes)]
    pub method: MethodName,
    /// One-sigma noise of the stroke times; without it, it is estimated from the log
    #[arg(long, value_name = "TIME", value_parser = duration_s)]
    pub noise: Option<f64>,
    /// Risk of an end in service of a valve that is replaced at the latest `replace_by_cycle`
    #[arg(long, value_name = "FRACTION", value_parser = risk, default_value_t = USUAL_RISK)]
    pub risk: f64,
    /// What sister valves have taught, as `valve learn` writes it
    #[arg(long, value_name = "FILE")]
    pub prior: Option<PathBuf>,
    /// Supply pressures to expect, such as "70..80 psig": the end of life is told for the worst of them
    #[arg(long, value_name = "RANGE", value_parser = supply_range)]
    pub expect_supply: Option<QuantityRange>,
    /// An empty time means that the valve did not get there, as in logs made for version 0.1
    #[arg(long, hide_short_help = true)]
    pub empty_is_stalled: bool,
    /// How the log's columns are to be read.
    #[command(flatten)]
    pub columns: LogColumnArgs,
    /// Print every row as text, not only how the valves stand at the end
    #[arg(long)]
    pub all_rows: bool,
    /// What is known of the leak at the first cycle
    #[arg(long, value_enum, default_value_t = StartName::Healthy, hide_short_help = true)]
    pub start: StartName,
    /// How the leak is assumed to grow
    #[arg(long, value_enum, hide_short_help = true)]
    pub growth: Option<GrowthName>,
    /// Typical number of cycles from no leak to end of life, before any data (median of a wide prior; 50 where it is not stated)
    #[arg(long, value_name = "CYCLES", value_parser = positive, hide_short_help = true)]
    pub life: Option<f64>,
    /// Go on reading as the log grows, over rotations, until interrupted
    #[arg(long)]
    pub follow: bool,
    /// Keep estimates in a directory, to go on from there at the next start
    ///
    /// Every valve's estimate, the place in the log and the length of the output are kept together: nothing is lost and
    /// nothing written twice, whenever the program or the machine stops.
    #[arg(long, value_name = "DIR", conflicts_with = "plot")]
    pub state: Option<PathBuf>,
    /// Where the rows go with --state
    ///
    /// After a sudden stop the file is cut back to what was kept, which stdout cannot be.
    #[arg(long, value_name = "FILE", requires = "state")]
    pub out: Option<PathBuf>,
    /// End at the first line that is no row; without it, it is skipped with a word
    #[arg(long)]
    pub strict: bool,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = StreamFormat::Text)]
    pub format: StreamFormat,
    /// Draw leak, remaining life and fault over the cycles to an .svg or .png file
    #[arg(long, value_name = "FILE", conflicts_with = "follow")]
    pub plot: Option<PathBuf>,
    /// Which valve of the log is drawn; without it, the first
    #[arg(long, value_name = "NAME", requires = "plot")]
    pub plot_valve: Option<String>,
    /// End of life if it is known afterwards: draws the truth and its alpha cone
    #[arg(long, value_name = "CYCLE", requires = "plot", value_parser = positive, hide_short_help = true)]
    pub true_eol: Option<f64>,
    /// Exit with code 1 if a valve has reached its end of life; with --follow, as soon as one does
    #[arg(long)]
    pub fail_on_eol: bool,
    /// Answer /health and /metrics (Prometheus) at an address, such as 127.0.0.1:9184
    #[arg(long, value_name = "ADDRESS", hide_short_help = true)]
    pub listen: Option<SocketAddr>,
    /// Readings from a broker
    #[command(flatten)]
    pub broker: BrokerArgs,
}

impl PrognoseArgs {
    /// The options without which another call would estimate something else, as they are written.
    pub fn estimate_words(&self) -> Vec<String> {
        let mut words = Vec::new();
        let mut add = |option: &str, value: Option<String>| {
            words.extend(value.into_iter().flat_map(|value| [option.to_owned(), value]));
        };
        let path = |path: &Option<PathBuf>| path.as_ref().map(|path| path.display().to_string());
        add("--valve", path(&self.valve));
        add("--method", (self.method != MethodName::Bayes).then(|| name_of(&self.method)));
        add("--noise", self.noise.map(|noise_s| format!("{noise_s} s")));
        add("--risk", (self.risk != USUAL_RISK).then(|| self.risk.to_string()));
        add("--prior", path(&self.prior));
        add("--expect-supply", self.expect_supply.as_ref().map(ToString::to_string));
        add("--start", (self.start != StartName::Healthy).then(|| name_of(&self.start)));
        add("--growth", self.growth.as_ref().map(name_of));
        add("--life", self.life.map(|cycles| cycles.to_string()));
        words.extend(self.empty_is_stalled.then(|| "--empty-is-stalled".to_owned()));
        words.extend(self.columns.words());
        words
    }
}

/// A choice as it is written.
fn name_of(choice: &impl ValueEnum) -> String {
    choice.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

/// The risk that is taken where none is stated.
const USUAL_RISK: f64 = 0.05;

/// Options of readings that come from an MQTT broker.
#[derive(Debug, Args)]
#[command(next_help_heading = "Readings from an MQTT broker")]
pub struct BrokerArgs {
    /// Topics of the readings, such as plant/{valve}/stroke: where {valve} stands is the valve's name
    ///
    /// Without {valve} the payload has the name. + and # stand for other levels. $share/GROUP/TOPIC shares the readings
    /// among all programs of a group; the broker must then give all readings of a valve to the same one.
    #[arg(long, value_name = "TOPIC", hide_short_help = true)]
    pub topic: Option<String>,
    /// Which field of a payload is what, in which unit (`valve help formats`)
    ///
    /// Without it, payloads are JSON objects with the columns of a log as fields.
    #[arg(long, value_name = "FILE", requires = "topic", hide_short_help = true)]
    pub map: Option<PathBuf>,
    /// Where each result goes as JSON, such as plant/{valve}/prognosis
    #[arg(long, value_name = "TOPIC", requires = "topic", hide_short_help = true)]
    pub publish: Option<String>,
    /// Name of this program among the broker's clients; with --state one is made up and kept
    #[arg(long, value_name = "NAME", requires = "topic", hide_short_help = true)]
    pub client_id: Option<String>,
    /// TOML file with username and password; without it, VALVE_MQTT_USERNAME and VALVE_MQTT_PASSWORD
    #[arg(long, value_name = "FILE", requires = "topic", hide_short_help = true)]
    pub credentials: Option<PathBuf>,
}

/// Options of `evaluate`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Runs whole lives with known ends through the same estimators as real logs:
every life grows its leak from nothing to the limit, its stroke times come from
the simulation and get normal noise. Reported are, over the lives:

  relative accuracy  mean over the predictions of 1 - |error| / true remaining
                     life, not below 0 (Saxena et al. 2010); median, 10 and 90 %
  converged at       first cycle from which on all predictions are within alpha
  coverage           share of the 90 % intervals that hold the true end
  error to bound     rms error of the end over its Cramer-Rao bound, at a
                     quarter, half and three quarters of life and at its end

With --scenarios the lives are of worlds that are not as assumed: growth that
curves, steps, rests or varies, two leaks at once, other wear, pressures and
temperatures that change, blanks, correlated noise. With --log, the lives are those
of the user's own valves that ran to their end.

Examples:
  valve evaluate valve.toml --seeds 300 --plot study.svg
  valve evaluate valve.toml --scenarios --seeds 200
  valve evaluate valve.toml --log history.csv")]
pub struct EvaluateArgs {
    /// The valve file
    pub valve: PathBuf,
    /// Cycles from a healthy valve to the end of life
    #[arg(long, value_name = "CYCLES", value_parser = some_cycles, default_value = "25")]
    pub cycles: f64,
    /// Variances of the noise of the stroke times, s2
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = variance, default_value = "0,1e-4,1e-3,1e-2")]
    pub noise_variance: Vec<f64>,
    /// Lives for each fault and noise
    #[arg(long, value_name = "COUNT", default_value_t = 300, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub seeds: u64,
    /// First of the seeds; other seeds are other lives
    #[arg(long, default_value_t = 1, value_name = "SEED")]
    pub first_seed: u64,
    /// Lives of worlds that are not as assumed
    #[arg(long, conflicts_with = "plot")]
    pub scenarios: bool,
    /// Only the worlds whose name contains this
    #[arg(long, value_name = "TEXT", requires = "scenarios")]
    pub only: Option<String>,
    /// A log of valves that ran to their end of life: scores the method on it
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scenarios", "plot"])]
    pub log: Option<PathBuf>,
    /// How the log's columns are to be read.
    #[command(flatten)]
    pub columns: LogColumnArgs,
    /// Half width of the cone around the true remaining life, a fraction
    #[arg(long, value_name = "FRACTION", value_parser = positive, default_value = "0.1")]
    pub alpha: f64,
    /// Draw the accuracy over the noise to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// Options of `learn`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
From the logs of sister valves, finished and unfinished lives, learns how long such
valves last, how they wear, how far their healthy times are off and how noisy times
are. `valve prognose --prior` starts from that.

Example:
  valve learn unit-1.csv unit-2.csv --tables tables --out prior.toml")]
pub struct LearnArgs {
    /// Timing logs
    #[arg(required = true)]
    pub logs: Vec<PathBuf>,
    /// How the logs' columns are to be read.
    #[command(flatten)]
    pub columns: LogColumnArgs,
    /// Directory of the tables, as `valve build-tables` writes them
    #[arg(long, value_name = "DIR")]
    pub tables: PathBuf,
    /// The file to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Replace outputs that exist
    #[arg(long)]
    pub force: bool,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// Which column of a timing log is which.
#[derive(Debug, Clone, Default, Args)]
pub struct LogColumnArgs {
    /// Which column of the log is which: COLUMN=NAME, such as close_time_ms="Laufzeit ZU"; may be repeated
    #[arg(long, value_name = "COLUMN=NAME", hide_short_help = true)]
    pub column: Vec<NamedColumn>,
    /// The valve of all rows, where no column of the log tells it
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    pub valve_name: Option<String>,
}

impl LogColumnArgs {
    /// Whether nothing was said.
    pub fn is_empty(&self) -> bool {
        self.column.is_empty() && self.valve_name.is_none()
    }

    /// The same as words of a command.
    pub fn words(&self) -> Vec<String> {
        let columns = self.column.iter().flat_map(|column| ["--column".to_owned(), column.to_string()]);
        let valve = self.valve_name.iter().flat_map(|name| ["--valve-name".to_owned(), name.clone()]);
        columns.chain(valve).collect()
    }
}

/// Methods by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MethodName {
    /// Recursive Bayesian estimate from both stroke times, with bounds
    Bayes,
    /// One stroke time and a straight line by least squares, as in the paper
    Ols,
}

/// Knowledge of the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum StartName {
    /// The valve was healthy at the first cycle of the log
    Healthy,
    /// It may have leaked already
    Unknown,
}

/// Laws of growth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum GrowthName {
    /// The same amount every cycle
    Linear,
    /// The same factor every cycle
    Exponential,
    /// Linear, unless the log speaks clearly for exponential growth
    Auto,
}

/// How a stream of results is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum StreamFormat {
    /// For people: an aligned table, and the state of each valve at the end
    Text,
    /// One JSON array (`valve help results`)
    Json,
    /// One JSON object a line, as soon as it is known (`valve help results`)
    Jsonl,
    /// CSV with a header (`valve help results`)
    Csv,
}

fn risk(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value < 1.0 => Ok(value),
        _ => Err("a fraction between 0 and 1 is needed, such as 0.05".to_owned()),
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("a number above zero is needed".to_owned()),
    }
}

/// From how many cycles on a life has any that it can be scored in.
const FEWEST_CYCLES: f64 = 3.0;

fn some_cycles(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value >= FEWEST_CYCLES && value.is_finite() => Ok(value),
        _ => Err(format!("a life of at least {FEWEST_CYCLES} cycles is needed")),
    }
}

fn variance(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value >= 0.0 && value.is_finite() => Ok(value),
        _ => Err("variances in s2 are needed, such as 0,1e-4,1e-3".to_owned()),
    }
}
