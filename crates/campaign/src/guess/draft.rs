//! The campaign file that was understood, with comments.

use std::fmt::Write;

use quantity::format_number;

use super::{ColumnGuess, Recording, Understanding};
use crate::columns::LEFT_OUT;

/// The conditions of one recording, as the campaign file is to state them.
#[derive(Debug, Clone, Default)]
pub struct DraftRun {
    /// Its file, relative to the campaign.
    pub file: String,
    /// Its supply pressure as a quantity.
    pub supply_pressure: String,
    /// Where that comes from.
    pub supply_from: String,
    /// Its temperature as a quantity, where it is known.
    pub temperature: Option<String>,
    /// The leak that was opened on purpose, where one was: its key, such as `leak_to_atmosphere`, and its area.
    pub leak: Option<(&'static str, String)>,
}

/// A text as a TOML string.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for character in text.chars() {
        match character {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            character if character.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(character));
            }
            character => out.push(character),
        }
    }
    out.push('"');
    out
}

/// A text within a comment, where no control character may stand, as headings and file names can have them.
fn in_comment(text: &str) -> String {
    text.chars().map(|character| if character.is_control() { ' ' } else { character }).collect()
}

/// Writes the campaign file.
#[must_use]
pub fn draft(name: &str, found: &Understanding, first: &Recording, runs: &[DraftRun]) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(text, "# Strokes recorded on one valve. What was understood of the recordings, and why:");
    for said in &found.said {
        let _ = writeln!(text, "# - {}", in_comment(said));
    }
    let _ = writeln!(text, "name = {}\n", quoted(name));
    let mut lines = String::new();
    for column in &found.columns {
        let threshold_on_it = found.threshold.is_some() && column.channel == "command";
        let same_for_all = column.call == column.name || column.channel.ends_with("pressure");
        let says_nothing = same_for_all && column.is_plain(found_by_itself(column, first));
        if !threshold_on_it && !says_nothing {
            let _ = writeln!(lines, "{} = {}", column.channel, mapping(column));
        }
    }
    // A command that is left out is told by a threshold, which leaves its columns alone.
    for channel in found.left_out.iter().filter(|channel| channel.ends_with("pressure")) {
        let _ = writeln!(lines, "{channel} = {}", quoted(LEFT_OUT));
    }
    if !lines.is_empty() {
        let _ = writeln!(
            text,
            "# Which column holds which channel; the unit is that of the heading where none is given here."
        );
        let _ = writeln!(text, "[columns]\n{lines}");
    }
    if let Some(threshold) = &found.threshold {
        let level = |number: f64| {
            if threshold.is_pressure { format!("\"{:.0} %\"", 100.0 * number) } else { format_number(number) }
        };
        let _ = writeln!(
            text,
            "# The command is told by a signal: above the threshold, until it falls again, the valve is told to {}.",
            word(threshold.above_closes)
        );
        let command = found.columns.iter().find(|column| column.channel == "command" && !threshold.is_pressure);
        let channel = command.map_or(&threshold.channel, |command| &command.call);
        let _ = writeln!(text, "[command_from]\nchannel = {}", quoted(channel));
        let _ =
            writeln!(text, "threshold = {}\nhysteresis = {}", level(threshold.threshold), level(threshold.hysteresis));
        if let Some(release) = threshold.release {
            let _ = writeln!(text, "release = {}", level(release));
        }
        let _ = writeln!(text, "above = \"{}\"\n", word(threshold.above_closes));
        if threshold.is_pressure {
            let _ = writeln!(
                text,
                "# When the command was given, that pressure does not tell to the millisecond: it drives the model as it was\n\
                 # measured, so that nothing is learned of solenoid and supply. Without these lines it is simulated from the command.\n\
                 [inputs]\n{} = \"measured\"\n",
                threshold.channel
            );
        }
    }
    let _ =
        writeln!(text, "# One standard deviation of the noise; estimated from the recordings where it is not stated.");
    let _ = match &found.position_noise {
        Some(noise) => {
            writeln!(text, "[sensors]\nposition_noise = {}\n# pressure_noise = \"0.5 kPa\"\n", quoted(noise))
        }
        None => writeln!(text, "# [sensors]\n# position_noise = \"0.03 mm\"\n# pressure_noise = \"0.5 kPa\"\n"),
    };
    let _ = writeln!(text, "# How far instruments and conditions may be off apart from noise, one standard deviation.");
    let _ =
        writeln!(text, "# [uncertainty]\n# position_zero = \"0.1 mm\"\n# position_gain = 0.01\n# supply_gauge = 0.02");
    for run in runs {
        let _ = writeln!(text, "\n[[run]]\nfile = {}", quoted(&run.file));
        let _ =
            writeln!(text, "supply_pressure = {}    # {}", quoted(&run.supply_pressure), in_comment(&run.supply_from));
        let _ = match &run.leak {
            Some((key, area)) => writeln!(text, "{key} = {}", quoted(area)),
            None => writeln!(
                text,
                "# leak_to_atmosphere = \"0.15 mm2\"    # where one was opened on purpose; or leak_from_supply"
            ),
        };
        if let Some(temperature) = &run.temperature {
            let _ = writeln!(text, "temperature = {}", quoted(temperature));
        }
    }
    text
}

fn word(closes: bool) -> &'static str {
    if closes { "close" } else { "open" }
}

/// Whether the reader finds the column without being told.
pub(super) fn found_by_itself(column: &ColumnGuess, first: &Recording) -> bool {
    let bare = first.bare[column.index].to_ascii_lowercase().replace(' ', "_");
    let by_unit = first.units[column.index].is_some() && bare == column.channel;
    let usual = match column.channel {
        "time" => "time_s",
        "position" => "position_mm",
        channel => channel,
    };
    let by_name = column.name.eq_ignore_ascii_case(usual)
        || column.channel.ends_with("pressure") && column.name.eq_ignore_ascii_case(&format!("{}_kpa", column.channel));
    by_unit && column.channel != "command" || by_name
}

fn mapping(column: &ColumnGuess) -> String {
    let mut parts = vec![format!("name = {}", quoted(&column.call))];
    if let Some(unit) = &column.unit {
        parts.push(format!("unit = {}", quoted(unit)));
    }
    if column.scale != 1.0 {
        parts.push(format!("scale = {}", toml_number(column.scale)));
    }
    if column.offset != 0.0 {
        parts.push(match column.channel {
            "command" => format!("offset = {}", toml_number(column.offset)),
            _ => format!("offset = \"{} mm\"", format_number(column.offset * 1e3)),
        });
    }
    match &parts[..] {
        // A column that is called as what leaves a channel out.
        [only] if column.call == LEFT_OUT => format!("{{ {only} }}"),
        [only] => only.trim_start_matches("name = ").to_owned(),
        _ => format!("{{ {} }}", parts.join(", ")),
    }
}

/// A number as TOML wants a float.
fn toml_number(number: f64) -> String {
    let text = format_number(number);
    if text.contains(['.', 'e']) { text } else { format!("{text}.0") }
}
