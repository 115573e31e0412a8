//! A drawn campaign: what its user gets, and beside it the truth.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::rig::Conditions;
use crate::truth::{Channels, Truth};
use crate::valve::{TEMPERATURE_K, Valve, tidy};

/// One sigma of recorded pressures.
pub const PRESSURE_NOISE_PA: f64 = 500.0;

/// A recorded run as its user gets it, noise and resolution included.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// What was set.
    pub conditions: Conditions,
    /// Times of the rows.
    pub time_s: Vec<f64>,
    /// Command, true closes.
    pub command: Vec<bool>,
    /// Position.
    pub position_m: Vec<f64>,
    /// Absolute pressures of chamber and pipe, where they were recorded.
    pub pressures_pa: Option<(Vec<f64>, Vec<f64>)>,
}

/// One row of written-down stroke times.
#[derive(Debug, Clone, PartialEq)]
pub struct TimingRow {
    /// What was set.
    pub conditions: Conditions,
    /// Closing time, if it closed.
    pub close_s: Option<f64>,
    /// Opening time, if it opened.
    pub open_s: Option<f64>,
}

/// A campaign of one valve with things hidden in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// Name, also of its folder.
    pub name: String,
    /// The valve as its user believes it to be.
    pub valve: Valve,
    /// Recorded runs; empty where only stroke times were taken.
    pub runs: Vec<Run>,
    /// Stroke times; empty where traces were recorded.
    pub timings: Vec<TimingRow>,
    /// What is hidden.
    pub truth: Truth,
}

/// Why a campaign could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {path}: {source}; check that the folder exists and may be written to")]
pub struct WriteError {
    /// The file or folder.
    path: PathBuf,
    /// What the system said.
    source: std::io::Error,
}

impl Campaign {
    /// The text of `valve.toml`.
    pub fn valve_toml(&self) -> String {
        self.valve.to_toml(&format!("valve of {}", self.name))
    }

    /// The text of `campaign.toml`.
    pub fn campaign_toml(&self) -> String {
        let mut text = format!("name = \"{}\"\n\n[sensors]\n", self.name);
        if self.timings.is_empty() {
            let _ = writeln!(text, "position_noise = \"{} mm\"", tidy(self.truth.position_noise_m * 1e3));
            if self.truth.channels == Channels::PositionAndPressures {
                let _ = writeln!(text, "pressure_noise = \"{} kPa\"", tidy(PRESSURE_NOISE_PA / 1e3));
            }
        } else {
            let _ = writeln!(text, "timing_noise = \"{} ms\"", tidy(self.truth.timing_noise_s * 1e3));
            text.push_str("\n[timings]\nfile = \"timings.csv\"\n");
        }
        for (index, run) in self.runs.iter().enumerate() {
            let c = &run.conditions;
            let _ = writeln!(text, "\n[[run]]\nfile = \"{}\"", trace_path(index));
            let _ = writeln!(text, "supply_pressure = \"{} psig\"", tidy(c.supply_psig));
            let _ = writeln!(text, "temperature = \"{TEMPERATURE_K} K\"");
            for (key, area) in
                [("leak_to_atmosphere", c.leak_to_atmosphere_m2), ("leak_from_supply", c.leak_from_supply_m2)]
            {
                if area > 0.0 {
                    let _ = writeln!(text, "{key} = \"{} mm2\"", tidy(area * 1e6));
                }
            }
        }
        text
    }

    /// The text of `timings.csv`.
    pub fn timings_csv(&self) -> String {
        let mut text = String::from(
            "supply_pressure_psig,leak_to_atmosphere_mm2,leak_from_supply_mm2,temperature_k,close_time_s,open_time_s\n",
        );
        let time = |t: Option<f64>| t.map_or_else(String::new, |t| format!("{t:.4}"));
        for row in &self.timings {
            let c = &row.conditions;
            let _ = writeln!(
                text,
                "{},{},{},{TEMPERATURE_K},{},{}",
                tidy(c.supply_psig),
                tidy(c.leak_to_atmosphere_m2 * 1e6),
                tidy(c.leak_from_supply_m2 * 1e6),
                time(row.close_s),
                time(row.open_s),
            );
        }
        text
    }

    /// Writes `valve.toml`, `campaign.toml`, the recordings and `truth.json` into a folder of the
    /// campaign's name within `parent`, and returns that folder.
    pub fn write_to(&self, parent: &Path) -> Result<PathBuf, WriteError> {
        let folder = parent.join(&self.name);
        create(&folder)?;
        write(&folder.join("valve.toml"), &self.valve_toml())?;
        write(&folder.join("campaign.toml"), &self.campaign_toml())?;
        write(&folder.join("truth.json"), &self.truth.to_json())?;
        if !self.timings.is_empty() {
            write(&folder.join("timings.csv"), &self.timings_csv())?;
        }
        if !self.runs.is_empty() {
            create(&folder.join("traces"))?;
        }
        for (index, run) in self.runs.iter().enumerate() {
            write(&folder.join(trace_path(index)), &run.to_csv())?;
        }
        Ok(folder)
    }
}

impl Run {
    /// The text of this run's trace.
    pub fn to_csv(&self) -> String {
        let mut text = String::from("time_s,command,position_mm");
        if self.pressures_pa.is_some() {
            text.push_str(",chamber_pressure_kpa,pipe_pressure_kpa");
        }
        text.push('\n');
        for row in 0..self.time_s.len() {
            let _ = write!(
                text,
                "{:.3},{},{:.3}",
                self.time_s[row],
                u8::from(self.command[row]),
                self.position_m[row] * 1e3
            );
            if let Some((chamber, pipe)) = &self.pressures_pa {
                let _ = write!(text, ",{:.2},{:.2}", chamber[row] / 1e3, pipe[row] / 1e3);
            }
            text.push('\n');
        }
        text
    }
}

fn trace_path(index: usize) -> String {
    format!("traces/run-{:02}.csv", index + 1)
}

pub(crate) fn create(folder: &Path) -> Result<(), WriteError> {
    std::fs::create_dir_all(folder).map_err(|source| WriteError { path: folder.to_owned(), source })
}

pub(crate) fn write(file: &Path, text: &str) -> Result<(), WriteError> {
    std::fs::write(file, text).map_err(|source| WriteError { path: file.to_owned(), source })
}
