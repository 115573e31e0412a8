//! A column's heading, with the unit that it may carry.

use quantity::Unit;

/// The heading of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Heading {
    /// As it is written.
    pub name: String,
    /// The unit that stands in brackets behind it, or in the row of units under it.
    pub unit: Option<Unit>,
    /// A unit of what this program does not measure in the row of units under it, such as percent.
    pub other_unit_below: Option<String>,
}

impl Heading {
    /// The heading with the unit at its end: `Weg [mm]`, `p Kammer (bar)`, `position / mm`, `Close ms`.
    #[must_use]
    pub fn new(name: &str) -> Self {
        let name = name.trim().to_owned();
        let unit = with_unit(&name).map(|(_, unit)| unit);
        Self { name, unit, other_unit_below: None }
    }

    /// The unit of what this program does not measure that it is in, such as percent, where it says so.
    #[must_use]
    pub fn other_unit(&self) -> Option<&str> {
        other_unit_at_end(&self.name).map(|(_, unit)| unit).or(self.other_unit_below.as_deref())
    }

    /// The name without the unit at its end.
    #[must_use]
    pub fn bare(&self) -> &str {
        with_unit(&self.name).map_or(&self.name, |(bare, _)| bare)
    }
}

/// The name and the unit at its end: set off from it, or a word of its own.
fn with_unit(name: &str) -> Option<(&str, Unit)> {
    let set_off = || bracketed(name).and_then(|(bare, unit)| Some((bare, understood(unit)?)));
    let last_word = || {
        let (bare, word) = name.rsplit_once(' ')?;
        let unit = Some(word).filter(|word| !is_other_word(word)).and_then(understood)?;
        Some((bare.trim_end(), unit))
    };
    // Of "p bar(g)" the brackets are of the unit.
    if name.ends_with(')') { last_word().or_else(set_off) } else { set_off().or_else(last_word) }
}

/// Units of what this program does not measure.
const OTHER_UNITS: [&str; 26] = [
    "V", "mV", "kV", "A", "mA", "%", "% FS", "%FS", "pct", "percent", "Prozent", "N", "kN", "Nm", "Hz", "kHz", "l/min",
    "Nl/min", "m3/h", "rpm", "m/s", "1/min", "deg", "°", "counts", "digits",
];

/// Whether a word is a unit of what this program does not measure: percent, volts, forces.
pub(crate) fn is_other_unit(word: &str) -> bool {
    OTHER_UNITS.contains(&word.trim_matches(['(', ')', '[', ']', ' ']))
}

/// A name and the unit of another kind that is set off at its end: "ZT" and "%" of "ZT [%]"; `None` where there is none.
#[must_use]
pub fn other_unit_at_end(name: &str) -> Option<(&str, &str)> {
    bracketed(name).filter(|(bare, unit)| !bare.is_empty() && is_other_unit(unit))
}

/// Whether a word by itself can be something else than a unit: a letter that counts sensors, a sign, a preposition, the least.
fn is_other_word(word: &str) -> bool {
    word.len() < 2 || !word.starts_with(char::is_alphabetic) || matches!(word, "in" | "min")
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
        "S" => "s",
        "mS" | "MS" => "ms",
        "µs" => "us",
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
        other => time_in_words(other).unwrap_or(other),
    };
    Unit::parse(other).ok()
}

/// A unit of time that is written out, in any case: "SEC", "Seconds", "msec", "Sekunden".
pub(crate) fn time_in_words(text: &str) -> Option<&'static str> {
    const WORDS: [(&str, &str); 14] = [
        ("sec", "s"),
        ("secs", "s"),
        ("seconds", "s"),
        ("sek", "s"),
        ("sekunden", "s"),
        ("seg", "s"),
        ("secondes", "s"),
        ("msec", "ms"),
        ("msecs", "ms"),
        ("millisec", "ms"),
        ("milliseconds", "ms"),
        ("millisekunden", "ms"),
        ("usec", "us"),
        ("microseconds", "us"),
    ];
    let text = text.trim_end_matches('.');
    WORDS.into_iter().find(|(word, _)| word.eq_ignore_ascii_case(text)).map(|(_, unit)| unit)
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
            ("Close ms", "Close", Some("ms")),
            ("CLOSE TIME (SEC)", "CLOSE TIME", Some("s")),
            ("Close time [sec.]", "Close time", Some("s")),
            ("Time [Seconds]", "Time", Some("s")),
            ("TIME (MSEC)", "TIME", Some("ms")),
            ("Kammerdruck bar(g)", "Kammerdruck", Some("bar(g)")),
            ("Sensor C", "Sensor C", None),
            ("Laufzeit min", "Laufzeit min", None),
            ("Hub -", "Hub -", None),
            ("Position links", "Position links", None),
        ] {
            let heading = Heading::new(name);
            assert_eq!(heading.bare(), bare);
            assert_eq!(heading.unit.as_ref().map(Unit::text), unit, "{name}");
        }
    }
}
