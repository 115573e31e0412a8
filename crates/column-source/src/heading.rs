//! A column's heading, with the unit that it may carry.

use quantity::Unit;

/// The heading of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Heading {
    /// As it is written.
    pub name: String,
    /// The unit that stands in brackets behind it, or in the row of units under it.
    pub unit: Option<Unit>,
}

impl Heading {
    /// The heading with the unit at its end: `Weg [mm]`, `p Kammer (bar)`, `position / mm`.
    #[must_use]
    pub fn new(name: &str) -> Self {
        let name = name.trim().to_owned();
        let unit = bracketed(&name).and_then(|(_, unit)| understood(unit));
        Self { name, unit }
    }

    /// The name without the unit in brackets.
    #[must_use]
    pub fn bare(&self) -> &str {
        match bracketed(&self.name) {
            Some((bare, unit)) if understood(unit).is_some() => bare,
            _ => &self.name,
        }
    }
}

/// The name and what stands in brackets, or behind a slash with spaces, at its end.
fn bracketed(name: &str) -> Option<(&str, &str)> {
    for (open, close) in [('[', ']'), ('(', ')'), ('<', '>')] {
        if let Some(inner) = name.strip_suffix(close)
            && let Some(start) = matching(inner, open, close)
        {
            return Some((inner[..start].trim_end(), inner[start + 1..].trim()));
        }
    }
    let (bare, unit) = name.rsplit_once(" / ").or_else(|| name.rsplit_once(" in "))?;
    Some((bare.trim_end(), unit.trim()))
}

/// Where the bracket opens that the end of the text closes.
fn matching(inner: &str, open: char, close: char) -> Option<usize> {
    let mut depth = 1;
    for (index, character) in inner.char_indices().rev() {
        if character == close {
            depth += 1;
        } else if character == open {
            depth -= 1;
            if depth == 0 {
                return Some(index);
            }
        }
    }
    None
}

/// A unit as it is written in headings: "mm", "°C", "bar(g)", "sec", "-" for none.
pub(crate) fn understood(text: &str) -> Option<Unit> {
    let text = text.trim().trim_start_matches(['[', '(']);
    let text = if text.contains('(') { text } else { text.trim_end_matches([']', ')']) };
    let text = text.trim_end_matches(']');
    let other = match text {
        "-" | "" | "1" => "",
        "sec" | "Sec" | "S" | "sek" | "Sek" => "s",
        "msec" | "mS" => "ms",
        "µs" | "usec" => "us",
        "C" | "°C" | "deg C" | "Grad C" => "degC",
        "°F" | "deg F" => "degF",
        "kpa" | "KPA" | "KPa" => "kPa",
        "mpa" | "MPA" => "MPa",
        "Bar" | "BAR" => "bar",
        "Barg" | "BARG" | "barü" | "bar ü" => "barg",
        "Bara" | "BARA" | "bar abs" => "bara",
        "PSI" | "Psi" => "psi",
        "PSIG" | "Psig" => "psig",
        "PSIA" | "Psia" => "psia",
        "MM" => "mm",
        "inch" | "Inch" | "inches" | "\"" => "in",
        other => other,
    };
    Unit::parse(other).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_behind_a_name_are_understood_and_other_brackets_are_left() {
        for (name, bare, unit) in [
            ("Weg [mm]", "Weg", Some("mm")),
            ("p Kammer (bar(g))", "p Kammer", Some("bar(g)")),
            ("Position / mm", "Position", Some("mm")),
            ("Zeit in ms", "Zeit", Some("ms")),
            ("T (°C)", "T", Some("degC")),
            ("LVDT", "LVDT", None),
            ("Sensor (links)", "Sensor (links)", None),
            ("Kanal [3]", "Kanal [3]", None),
            ("position_mm", "position_mm", None),
        ] {
            let heading = Heading::new(name);
            assert_eq!(heading.bare(), bare);
            assert_eq!(heading.unit.as_ref().map(Unit::text), unit, "{name}");
        }
    }
}
