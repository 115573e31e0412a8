//! Options of `build-tables`.

use std::fmt;
use std::path::PathBuf;

use clap::Args;
use quantity::{Dimension, Quantity};

use super::Format;

/// Options of `build-tables`.
#[derive(Debug, Args)]
#[command(after_long_help = "\
The directory gets a table for each kind of wear and a manifest that says what
they were made from; `valve prognose` refuses what does not fit together. With a
range of supply pressures or temperatures each kind gets a second table over
these, with which a log that has such columns is corrected row by row.

Examples:
  valve build-tables valve.toml --out tables --plot tables.svg
  valve build-tables valve.toml --out tables --supply-range \"66..84 psig\"
  valve build-tables valve.toml --out leaks --wear leaks")]
pub struct BuildTablesArgs {
    /// The valve file
    pub valve: PathBuf,
    /// Directory of the tables; made if it is missing
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Replace older tables in the directory, all at once
    #[arg(long)]
    pub force: bool,
    /// Also build tables over the supply pressure, such as "66..84 psig"
    #[arg(long, value_name = "FROM..TO", value_parser = supply_range)]
    pub supply_range: Option<QuantityRange>,
    /// Also build tables over the temperature, such as "270..310 K"
    #[arg(long, allow_hyphen_values = true, value_name = "FROM..TO", value_parser = temperature_range)]
    pub temperature_range: Option<QuantityRange>,
    /// What may wear: all, leaks, or a list of atmosphere, supply, friction, spring, exhaust, supply-line, solenoid; the two
    /// leaks are always built
    #[arg(long, value_name = "WHAT,...", value_delimiter = ',', default_value = "all")]
    pub wear: Vec<String>,
    /// Draw the tables of the leaks to an .svg or .png file
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// How the result is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// From one quantity to another.
#[derive(Debug, Clone)]
pub struct QuantityRange {
    /// Where it begins.
    pub from: Quantity,
    /// Where it ends.
    pub to: Quantity,
}

impl fmt::Display for QuantityRange {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (from, to) = (&self.from, &self.to);
        if from.unit() == to.unit() {
            return write!(formatter, "{}..{} {}", from.number(), to.number(), to.unit().text());
        }
        write!(formatter, "{} {}..{} {}", from.number(), from.unit().text(), to.number(), to.unit().text())
    }
}

/// A range of supply pressures.
pub fn supply_range(text: &str) -> Result<QuantityRange, String> {
    range(text, Dimension::Pressure, "66..84 psig")
}

fn temperature_range(text: &str) -> Result<QuantityRange, String> {
    range(text, Dimension::Temperature, "270..310 K")
}

/// Two numbers and their unit; the first may have a unit of its own.
fn range(text: &str, dimension: Dimension, example: &str) -> Result<QuantityRange, String> {
    let (from, to) =
        text.split_once("..").ok_or_else(|| format!("found {text:?}, expected a range such as {example:?}"))?;
    let parsed = |text: &str| Quantity::parse(text, dimension).map_err(|error| error.to_string());
    let to = parsed(to.trim())?;
    let from = from.trim();
    let bare = from.parse::<f64>().is_ok();
    let from = if bare { parsed(&format!("{from} {}", to.unit().text()))? } else { parsed(from)? };
    if from.si() < to.si() {
        return Ok(QuantityRange { from, to });
    }
    Err(format!("found {text:?}, expected a range that rises, such as {example:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_has_one_unit_or_two() {
        let range = supply_range("66..84 psig").unwrap();
        assert_eq!((range.from.number(), range.from.unit().text()), (66.0, "psig"));
        assert_eq!((range.to.number(), range.to.unit().text()), (84.0, "psig"));
        let range = temperature_range("-3 degC .. 310 K").unwrap();
        assert_eq!(range.from.si(), 270.15);
        // What is shown is read back as the same.
        for text in ["66..84 psig", "-3 degC..310 K"] {
            assert_eq!(super::range(text, dimension(text), "").unwrap().to_string(), text);
        }
    }

    fn dimension(text: &str) -> Dimension {
        if text.contains("psig") { Dimension::Pressure } else { Dimension::Temperature }
    }

    #[test]
    fn what_is_no_range_is_told() {
        for text in ["75 psig", "84..66 psig", "70..70 psig", "66..84", "66..84 K", ".. psig"] {
            let error = supply_range(text).unwrap_err();
            assert!(!error.is_empty(), "{text}");
        }
        assert!(supply_range("84..66 psig").unwrap_err().contains("rises, such as \"66..84 psig\""));
    }
}
