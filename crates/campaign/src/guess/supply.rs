//! The supply pressure of a recording, where it shows.

use quantity::{Dimension, Quantity, Reference, Unit};

use super::{Hints, Recording, SupplyGuess, Understanding};
use crate::levels::plateaus;
use crate::noise::quantile;

/// From the file's name, else from the recorded supply, else from where a chamber that was filled long enough stands.
pub(super) fn find(recording: &Recording, found: &Understanding, hints: &Hints) -> Option<SupplyGuess> {
    if let Some((text, bare)) = in_name(&recording.file) {
        let from = if bare { "the file's name, taken for gauge" } else { "the file's name" };
        return Some(SupplyGuess { text, from });
    }
    let of = |channel: &str| found.columns.iter().find(|column| column.channel == channel);
    let pressure = |index: usize, unit: Option<&String>, number: f64| {
        let unit = unit.and_then(|text| Unit::parse(text).ok()).or_else(|| recording.unit(index))?;
        let absolute = match unit.reference() {
            Reference::Ambiguous => return None,
            Reference::Gauge => unit.to_si(number) + hints.ambient_pressure_pa,
            _ => unit.to_si(number),
        };
        absolute.is_finite().then(|| format!("{:.1} kPa", absolute / 1e3))
    };
    let recorded = of("supply_pressure").and_then(|supply| {
        let median = quantile(&recording.columns[supply.index], 0.5);
        let text = pressure(supply.index, supply.unit.as_ref(), median)?;
        Some(SupplyGuess { text, from: "the median of the recorded supply pressure" })
    });
    if recorded.is_some() {
        return recorded;
    }
    let chamber = of("chamber_pressure")?;
    let values = &recording.columns[chamber.index];
    let (low, high) = plateaus(values);
    // Long at its top, it has reached the supply.
    let top = values.iter().filter(|value| **value > high - 0.02 * (high - low)).count();
    let text = pressure(chamber.index, chamber.unit.as_ref(), high)?;
    (top * 10 > values.len()).then_some(SupplyGuess { text, from: "where the chamber pressure stays" })
}

/// A pressure in a file's name: "run-75psig.csv", "hub_5,2barg.csv", "versuch 60 psi.csv"; true where it does not say
/// that it is gauge.
fn in_name(file: &str) -> Option<(String, bool)> {
    let name = file.rsplit(['/', '\\']).next()?;
    let name = name.rsplit_once('.').map_or(name, |(stem, _)| stem).replace(',', ".");
    let mut best = None;
    for (start, _) in name.char_indices().filter(|(_, character)| character.is_ascii_digit()) {
        let before = name[..start].chars().next_back();
        if before.is_some_and(|before| before.is_ascii_digit() || before == '.') {
            continue;
        }
        let rest = &name[start..];
        let digits =
            rest.find(|character: char| !(character.is_ascii_digit() || character == '.')).unwrap_or(rest.len());
        let unit = rest[digits..].trim_start_matches([' ', '_', '-']);
        let letters = unit.find(|character: char| !character.is_ascii_alphabetic()).unwrap_or(unit.len());
        let known = Dimension::Pressure.unit_ignoring_case(&unit[..letters]);
        let bare = known.is_none();
        let unit = known.or(match unit[..letters].to_ascii_lowercase().as_str() {
            "psi" => Some("psig"),
            "bar" => Some("barg"),
            _ => None,
        });
        let number = rest[..digits].trim_end_matches('.');
        if let Some(unit) = unit
            && Quantity::parse(&format!("{number} {unit}"), Dimension::Pressure).is_ok()
        {
            best = Some((format!("{number} {unit}"), bare));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::in_name;

    #[test]
    fn pressures_in_names_are_read() {
        for (file, expected) in [
            ("traces/run-75psig.csv", Some("75 psig")),
            ("Hub_5,2barg_02.csv", Some("5.2 barg")),
            ("Versuch 60 psi.csv", Some("60 psig")),
            ("run-01.csv", None),
            ("2026-03-01_run3.csv", None),
            ("p4.5bar-T20.csv", Some("4.5 barg")),
        ] {
            assert_eq!(in_name(file).map(|(text, _)| text).as_deref(), expected, "{file}");
        }
    }
}
