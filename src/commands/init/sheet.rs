//! The valve file that is written, with a word about each value.

use std::fmt::Write;

use quantity::format_number;
use valve_model::Schedule;

/// A value as it is to stand in the file.
pub struct Entry {
    /// Its table and key.
    pub key: &'static str,
    /// Its value in TOML.
    pub text: String,
    /// What stands behind it.
    pub comment: String,
    /// Its relative tolerance, where it may be calibrated.
    pub tolerance: Option<f64>,
}

/// All that goes into the file.
pub struct Draft {
    /// What the valve is called.
    pub name: String,
    /// The gas and its specific gas constant, J/(kg K).
    pub gas: (&'static str, f64),
    /// The values, in the order of the file within each table.
    pub entries: Vec<Entry>,
    /// The limits of closing and opening that somebody has said, s.
    pub limits_s: [Option<f64>; 2],
    /// When the valve is told to open and when the cycle ends, where somebody has said, s.
    pub cycle_s: [Option<f64>; 2],
}

impl Draft {
    /// The file, with a cycle and limits, s.
    pub fn text(&self, schedule: Schedule, limits: [f64; 2]) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ =
            writeln!(text, "# A valve that pressure closes and a spring, or its weight, opens. Written by valve init.");
        let _ = writeln!(
            text,
            "# Quantities are a number and a unit; pressures are psig, psia, barg, bara, kPa, MPa or Pa."
        );
        let _ = writeln!(text, "name = {}", quoted(&self.name));
        for section in ["actuator", "spring", "stops", "gas", "pneumatics"] {
            let _ = writeln!(text, "\n[{section}]");
            if section == "gas" {
                let (name, constant) = self.gas;
                let _ = writeln!(text, "ratio_of_specific_heats = 1.4                # {name}");
                let _ = writeln!(text, "specific_gas_constant = \"{} J/(kg K)\"", format_number(constant));
                let _ = writeln!(text, "compressibility = 1.0");
            }
            for entry in &self.entries {
                if let Some((table, key)) = entry.key.split_once('.')
                    && table == section
                {
                    let line = format!("{key} = {}", entry.text);
                    let _ = writeln!(text, "{line:<44} # {}", entry.comment);
                }
            }
        }
        let seconds = |number: f64| format!("\"{} s\"", format_number(number));
        let _ =
            writeln!(text, "\n# The cycle in which stroke times are taken, and for which tables are built.\n[cycle]");
        let _ = writeln!(text, "close_at = {}", seconds(schedule.close_at_s));
        let _ = writeln!(text, "open_at = {}", seconds(schedule.open_at_s));
        let _ = writeln!(text, "end = {}", seconds(schedule.end_s));
        let _ = writeln!(
            text,
            "\n# A stroke that takes longer has failed. Maintenance manual: maximum stroke time, Stellzeit.\n[limits]"
        );
        let _ = writeln!(text, "close_within = {}", seconds(limits[0]));
        let _ = writeln!(text, "open_within = {}", seconds(limits[1]));
        let _ = writeln!(
            text,
            "\n# How well the values above are known, one standard deviation as a fraction: these may be calibrated."
        );
        let _ = writeln!(text, "[tolerance]");
        for entry in &self.entries {
            if let Some(tolerance) = entry.tolerance {
                let _ = writeln!(text, "\"{}\" = {}", entry.key, format_number(tolerance));
            }
        }
        text
    }
}

/// A text as a TOML string, on one line.
pub fn quoted(text: &str) -> String {
    let text: String = text.chars().filter(|character| !character.is_control()).collect();
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn an_inch_sign_does_not_end_a_text() {
        assert_eq!(quoted("0.083\""), "\"0.083\\\"\"");
        assert_eq!(quoted("a\\b\n"), "\"a\\\\b\"");
    }
}
