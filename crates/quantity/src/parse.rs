//! Quantities: a number and a unit.

use crate::{Dimension, QuantityError, Reference, Unit, suggest};

/// What people write for a unit, in small letters without points, signs and spaces: the nearest word in letters would
/// be another unit.
const OTHER_SPELLINGS: [(Dimension, &str, &str); 16] = [
    (Dimension::Temperature, "c", "degC"),
    (Dimension::Temperature, "celsius", "degC"),
    (Dimension::Temperature, "centigrade", "degC"),
    (Dimension::Temperature, "grad", "degC"),
    (Dimension::Temperature, "gradc", "degC"),
    (Dimension::Temperature, "deg", "degC"),
    (Dimension::Temperature, "f", "degF"),
    (Dimension::Temperature, "fahrenheit", "degF"),
    (Dimension::Temperature, "kelvin", "K"),
    (Dimension::Pressure, "atü", "barg"),
    (Dimension::Length, "micron", "um"),
    (Dimension::Time, "sec", "s"),
    (Dimension::Time, "msec", "ms"),
    (Dimension::Volume, "litre", "l"),
    (Dimension::Volume, "liter", "l"),
    (Dimension::Area, "sqin", "in2"),
];

/// A number with its unit, as the user wrote it.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    number: f64,
    unit: Unit,
}

impl Quantity {
    /// Reads a quantity of one kind, such as "25.4 mm". A pressure may count from anywhere.
    pub fn parse(text: &str, dimension: Dimension) -> Result<Self, QuantityError> {
        let (number, rest) = split(text, dimension)?;
        let Ok(unit) = Unit::parse(rest) else { return Err(unknown_unit(rest, dimension)) };
        if unit.measures(dimension) {
            return Ok(Self { number, unit });
        }
        let expected = dimension.expectation();
        Err(if rest.trim().is_empty() {
            QuantityError::MissingUnit { found: text.trim().to_owned(), expected }
        } else {
            let found = unit.dimension().map_or("another kind of quantity", Dimension::name);
            let suggestion = pounds_of_force(rest, dimension);
            QuantityError::WrongDimension {
                unit: unit.text().to_owned(),
                found: found.to_owned(),
                suggestion,
                expected,
            }
        })
    }

    /// The number in front of the unit.
    #[must_use]
    pub fn number(&self) -> f64 {
        self.number
    }

    /// The unit.
    #[must_use]
    pub fn unit(&self) -> &Unit {
        &self.unit
    }

    /// The SI value; a gauge pressure stays gauge.
    #[must_use]
    pub fn si(&self) -> f64 {
        self.unit.to_si(self.number)
    }

    /// An absolute pressure, Pa; a gauge pressure counts from `ambient_pressure_pa`.
    /// Fails for a bare psi or bar, which does not say from where it counts.
    pub fn absolute_pa(&self, ambient_pressure_pa: f64) -> Result<f64, QuantityError> {
        match self.unit.reference() {
            Reference::Gauge => Ok(self.si() + ambient_pressure_pa),
            Reference::Absolute | Reference::Unstated => Ok(self.si()),
            Reference::Ambiguous => Err(QuantityError::AmbiguousPressure { unit: self.unit.text().to_owned() }),
        }
    }
}

/// The SI value of a quantity with this SI unit; a pressure must be absolute.
/// An SI unit that is not one of [`Dimension`]'s is a mistake of the caller and counts as a pure number.
pub fn si_value(text: &str, si_unit: &str) -> Result<f64, QuantityError> {
    let dimension = Dimension::of_si_unit(si_unit).unwrap_or(Dimension::Pure);
    if dimension == Dimension::Pressure {
        return absolute_pressure_pa(text);
    }
    Quantity::parse(text, dimension).map(|quantity| quantity.si())
}

/// An absolute pressure, Pa, from a gauge or an absolute one.
pub fn pressure_pa(text: &str, ambient_pressure_pa: f64) -> Result<f64, QuantityError> {
    Quantity::parse(text, Dimension::Pressure)?.absolute_pa(ambient_pressure_pa)
}

/// An absolute pressure, Pa; gauge units are refused.
pub fn absolute_pressure_pa(text: &str) -> Result<f64, QuantityError> {
    let quantity = Quantity::parse(text, Dimension::Pressure)?;
    match quantity.unit.reference() {
        Reference::Gauge => Err(QuantityError::GaugePressure { unit: quantity.unit.text().to_owned() }),
        _ => quantity.absolute_pa(0.0),
    }
}

/// A pressure above the atmosphere or a difference of pressures, Pa: gauge, or a bare unit
/// that does not say from where it counts; psia and bara are refused.
pub fn pressure_difference_pa(text: &str) -> Result<f64, QuantityError> {
    let quantity = Quantity::parse(text, Dimension::Pressure)?;
    match quantity.unit.reference() {
        Reference::Absolute => Err(QuantityError::AbsolutePressure { unit: quantity.unit.text().to_owned() }),
        _ => Ok(quantity.si()),
    }
}

/// A difference of temperatures, K: the zero of degC and degF does not count.
pub fn temperature_difference_k(text: &str) -> Result<f64, QuantityError> {
    let quantity = Quantity::parse(text, Dimension::Temperature)?;
    Ok(quantity.unit.difference_to_si(quantity.number))
}

/// The number at the front, and the rest.
fn split(text: &str, dimension: Dimension) -> Result<(f64, &str), QuantityError> {
    let text = text.trim();
    let length = number_length(text);
    let (front, rest) = text.split_at(length);
    let Ok(number) = front.parse::<f64>() else {
        return Err(QuantityError::MissingNumber { found: shortened(text), expected: dimension.expectation() });
    };
    if rest.starts_with(',') && rest[1..].starts_with(|next: char| next.is_ascii_digit()) {
        return Err(QuantityError::DecimalComma {
            found: shortened(text),
            fixed: with_point(&text.replacen(',', ".", 1), dimension),
        });
    }
    if number.is_infinite() && !front.to_ascii_lowercase().contains("inf") {
        return Err(QuantityError::NotFinite { found: shortened(text), expected: dimension.expectation() });
    }
    Ok((number, rest))
}

/// A text that has its decimal point, as a message shows it: a pressure that does not say from where it counts would be
/// refused in turn, and shows what it may be.
fn with_point(text: &str, dimension: Dimension) -> String {
    let quantity = Quantity::parse(text, dimension).ok();
    let is_ambiguous = quantity.is_some_and(|quantity| quantity.unit.reference() == Reference::Ambiguous);
    let text = shortened(text);
    if is_ambiguous {
        format!("\"{text}g\" (above the atmosphere) or \"{text}a\" (absolute)")
    } else {
        format!("\"{text}\"")
    }
}

/// How many bytes at the front are a number: sign, digits, point, exponent; or "inf".
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let infinite = bytes.get(sign..sign + 3).is_some_and(|word| word.eq_ignore_ascii_case(b"inf"));
    if infinite && !bytes.get(sign + 3).is_some_and(u8::is_ascii_alphabetic) {
        return sign + 3;
    }
    let mut end = sign + digits(sign);
    if bytes.get(end) == Some(&b'.') {
        end += 1 + digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let exponent = end + 1 + usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let count = if exponent <= bytes.len() { digits(exponent) } else { 0 };
        if count > 0 {
            end = exponent + count;
        }
    }
    end
}

fn unknown_unit(unit: &str, dimension: Dimension) -> QuantityError {
    let unit = unit.trim();
    QuantityError::UnknownUnit {
        unit: shortened(unit),
        suggestion: suggestion(unit, dimension),
        expected: dimension.expectation(),
    }
}

/// " (did you mean ...?)" where pounds of mass were written for those of force, as in "lb/in", or nothing.
fn pounds_of_force(unit: &str, dimension: Dimension) -> String {
    let meant = unit.trim().replacen("lbs", "lb", 1).replacen("lb", "lbf", 1);
    let measures = Unit::parse(&meant).is_ok_and(|unit| unit.measures(dimension));
    if measures { format!(" (did you mean \"{meant}\"?)") } else { String::new() }
}

/// " (did you mean ...?)" for a unit that is not known, or nothing.
pub(crate) fn suggestion(unit: &str, dimension: Dimension) -> String {
    let word: String =
        unit.chars().filter(|character| !" .°()_".contains(*character)).collect::<String>().to_lowercase();
    match OTHER_SPELLINGS.iter().find(|(kind, spelling, _)| *kind == dimension && *spelling == word) {
        Some((_, _, unit)) => format!(" (did you mean \"{unit}\"?)"),
        None => suggest::did_you_mean(unit, dimension.units().iter().copied()),
    }
}

/// A text cut to a length that a message can bear.
pub(crate) fn shortened(text: &str) -> String {
    const LONGEST: usize = 60;
    if text.chars().count() <= LONGEST {
        return text.to_owned();
    }
    text.chars().take(LONGEST).chain("...".chars()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_whole() {
        let read = |text| si_value(text, "m").unwrap();
        assert_eq!(read("1e-3 m"), 1e-3);
        assert_eq!(read("1E3mm"), 1.0);
        assert_eq!(read("-.5 m"), -0.5);
        assert_eq!(read("+2. m"), 2.0);
        assert_eq!(read("  25.4mm "), 0.0254);
        assert_eq!(si_value("inf W/K", "W/K").unwrap(), f64::INFINITY);
        assert_eq!(si_value("0.25", "").unwrap(), 0.25);
    }

    #[test]
    fn differences_of_temperature_have_no_zero() {
        for (text, expected) in [("5 K", 5.0), ("5 degC", 5.0), ("9 degF", 5.0)] {
            assert!((temperature_difference_k(text).unwrap() - expected).abs() < 1e-12, "{text}");
        }
    }

    #[test]
    fn pressures_know_from_where_they_count() {
        let ambient = 101_325.0;
        assert_eq!(pressure_pa("75 psig", ambient).unwrap(), 75.0 * 6894.757 + ambient);
        assert_eq!(pressure_pa("6 bara", ambient).unwrap(), 6e5);
        assert_eq!(pressure_pa("6 barg", ambient).unwrap(), 6e5 + ambient);
        assert_eq!(absolute_pressure_pa("101.325 kPa").unwrap(), ambient);
        assert_eq!(pressure_difference_pa("3 kPa").unwrap(), 3e3);
        assert_eq!(pressure_difference_pa("1 psi").unwrap(), 6894.757);
        assert!(matches!(absolute_pressure_pa("0 psig"), Err(QuantityError::GaugePressure { .. })));
        assert!(matches!(pressure_difference_pa("15 psia"), Err(QuantityError::AbsolutePressure { .. })));
        assert_eq!(pressure_difference_pa("0.5 bar").unwrap(), 5e4);
        for (bare, text) in [("psi", "75 psi"), ("bar", "5 bar")] {
            let refusal = pressure_pa(text, ambient).unwrap_err().to_string();
            let both = format!("expected {bare}g (gauge, above the atmosphere) or {bare}a (absolute)");
            assert_eq!(refusal, format!("\"{bare}\" does not say from where it counts; {both}"));
        }
    }

    #[test]
    fn other_spellings_lead_to_the_unit_that_is_meant() {
        for (text, unit, meant) in [
            ("20 C", "K", "degC"),
            ("20 Celsius", "K", "degC"),
            ("68 F", "K", "degF"),
            ("5 atü", "Pa", "barg"),
            ("250 msec", "s", "ms"),
            ("2 litre", "m3", "l"),
            ("91.4 lb/in", "N/m", "lbf/in"),
            ("20 lbs", "N", "lbf"),
        ] {
            let message = si_value(text, unit).unwrap_err().to_string();
            assert!(message.contains(&format!("(did you mean \"{meant}\"?)")), "{text}: {message}");
        }
    }

    #[test]
    fn every_refusal_says_what_would_be_right() {
        let message = |text, unit| si_value(text, unit).unwrap_err().to_string();
        assert_eq!(
            message("25.4 mn", "m"),
            "unknown unit \"mn\" (did you mean \"mm\"?); expected a length in mm, cm, m, um or in"
        );
        assert_eq!(message("mm", "m"), "\"mm\" does not begin with a number; expected a length in mm, cm, m, um or in");
        assert_eq!(message("3", "s"), "\"3\" has no unit; expected a time in s, ms, us or min");
        assert_eq!(message("3 N", "s"), "\"N\" is a unit of a force; expected a time in s, ms, us or min");
        assert_eq!(
            message("0,5 mm2", "m2"),
            "\"0,5 mm2\" has a decimal comma; write a decimal point, as in \"0.5 mm2\""
        );
        assert!(message("nan s", "s").contains("does not begin with a number"));
        assert!(message("1e999 s", "s").contains("not a finite number"));
        assert!(message("1 mm", "").contains("expected a pure number"));
        assert!(message("", "s").contains("does not begin with a number"));
        assert!(message(&"x".repeat(10_000_000), "s").len() < 300);
    }
}
