//! The files of a recorded campaign: what its user gets, and the truth.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use crate::campaign::{WriteError, create, write};
use crate::rig::Conditions;
use crate::valve::{TOLERANCES, Valve, tidy};

/// What one file holds, as written down.
#[derive(Debug, Clone, PartialEq)]
pub struct File {
    /// What was set, as its user believes.
    pub conditions: Conditions,
    /// Recorded times.
    pub time_s: Vec<f64>,
    /// Command, where it was recorded.
    pub command: Option<Vec<bool>>,
    /// Position as shown.
    pub position_m: Vec<f64>,
    /// Other channels: name of the column and absolute pressures.
    pub pressures_pa: Vec<(&'static str, Vec<f64>)>,
}

/// A recorded campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Name, also of its folder.
    pub name: String,
    /// The valve as its user believes it to be.
    pub valve: Valve,
    /// Index in the tolerances and one sigma of what the user says is uncertain; none: no such table.
    pub tolerances: Option<Vec<(usize, f64)>>,
    /// Position noise as the user states it, where he does.
    pub stated_noise_m: Option<f64>,
    /// Temperature that was noted.
    pub temperature_k: f64,
    /// Pipe pressure at which the command counts as given, and its hysteresis, where it drives the model.
    pub driven_above_pa: Option<(f64, f64)>,
    /// The recorded files.
    pub files: Vec<File>,
    /// What is hidden.
    pub truth: Value,
}

impl Recording {
    /// The text of `valve.toml`.
    pub fn valve_toml(&self) -> String {
        let text = self.valve.to_toml(&format!("valve of {}", self.name));
        let mut text = text.split("\n[tolerance]").next().unwrap_or_default().to_owned();
        if let Some(tolerances) = &self.tolerances {
            text.push_str("\n[tolerance]\n");
            for (index, sigma) in tolerances {
                let _ = writeln!(text, "\"{}\" = {sigma:?}", TOLERANCES[*index].0);
            }
        }
        text
    }

    /// The text of `campaign.toml`.
    pub fn campaign_toml(&self) -> String {
        let mut text = format!("name = \"{}\"\n", self.name);
        if let Some((threshold, hysteresis)) = self.driven_above_pa {
            let _ = writeln!(
                text,
                "command_from = {{ channel = \"pipe_pressure\", threshold = \"{} kPa\", hysteresis = \"{} kPa\" }}\n\n\
                 [inputs]\npipe_pressure = \"measured\"",
                tidy(threshold / 1e3),
                tidy(hysteresis / 1e3),
            );
        }
        if let Some(noise) = self.stated_noise_m {
            let _ = writeln!(text, "\n[sensors]\nposition_noise = \"{} mm\"", tidy(noise * 1e3));
        }
        for (index, file) in self.files.iter().enumerate() {
            let c = &file.conditions;
            let _ = writeln!(text, "\n[[run]]\nfile = \"{}\"", trace_path(index));
            let _ = writeln!(text, "supply_pressure = \"{} psig\"", tidy(c.supply_psig));
            let _ = writeln!(text, "temperature = \"{} K\"", tidy(self.temperature_k));
            let leaks = [("leak_to_atmosphere", c.leak_to_atmosphere_m2), ("leak_from_supply", c.leak_from_supply_m2)];
            for (key, area) in leaks.into_iter().filter(|(_, area)| *area > 0.0) {
                let _ = writeln!(text, "{key} = \"{} mm2\"", tidy(area * 1e6));
            }
        }
        text
    }

    /// Writes the campaign into a folder of its name within `parent`, and returns that folder.
    pub fn write_to(&self, parent: &Path) -> Result<PathBuf, WriteError> {
        let folder = parent.join(&self.name);
        create(&folder.join("traces"))?;
        write(&folder.join("valve.toml"), &self.valve_toml())?;
        write(&folder.join("campaign.toml"), &self.campaign_toml())?;
        write(&folder.join("truth.json"), &format!("{:#}\n", self.truth))?;
        for (index, file) in self.files.iter().enumerate() {
            write(&folder.join(trace_path(index)), &file.to_csv())?;
        }
        Ok(folder)
    }
}

/// Writes the truths of many campaigns into one file, by name.
pub fn write_truths(recordings: &[(String, Value)], parent: &Path) -> Result<(), WriteError> {
    let all: Map<String, Value> = recordings.iter().cloned().collect();
    write(&parent.join("truth.json"), &format!("{:#}\n", Value::Object(all)))
}

impl File {
    /// The text of this file.
    pub fn to_csv(&self) -> String {
        let mut text = String::from("time_s");
        if self.command.is_some() {
            text.push_str(",command");
        }
        text.push_str(",position_mm");
        for (name, _) in &self.pressures_pa {
            let _ = write!(text, ",{name}");
        }
        text.push('\n');
        for row in 0..self.time_s.len() {
            let _ = write!(text, "{:.5}", self.time_s[row]);
            if let Some(command) = &self.command {
                let _ = write!(text, ",{}", u8::from(command[row]));
            }
            let _ = write!(text, ",{:.4}", self.position_m[row] * 1e3);
            for (_, pressures) in &self.pressures_pa {
                let _ = write!(text, ",{:.2}", pressures[row] / 1e3);
            }
            text.push('\n');
        }
        text
    }
}

fn trace_path(index: usize) -> String {
    format!("traces/run-{:02}.csv", index + 1)
}
