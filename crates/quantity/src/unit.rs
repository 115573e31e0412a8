//! Units: products of known units with powers.

use crate::atoms::{ATOMS, Atom, Exponents, atom};
use crate::reference::Reference;
use crate::{Dimension, QuantityError, suggest};

/// A unit as the user wrote it, with its way to SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    text: String,
    numerator: f64,
    denominator: f64,
    shift: f64,
    exponents: Exponents,
    reference: Reference,
}

impl Unit {
    /// Reads a unit such as "mm", "N s/m", "J/(kg K)" or "cm²"; empty text is a pure number.
    pub fn parse(text: &str) -> Result<Self, QuantityError> {
        let written = text.trim();
        let plain = normalised(written);
        let mut unit = Self {
            text: written.to_owned(),
            numerator: 1.0,
            denominator: 1.0,
            shift: 0.0,
            exponents: [0; 4],
            reference: Reference::Unstated,
        };
        let factors = factors(&plain).ok_or_else(|| unknown(written, None))?;
        for (name, power) in &factors {
            if name == "1" {
                continue;
            }
            let atom = atom(name).ok_or_else(|| unknown(written, Some(name)))?;
            unit.multiply(atom, *power);
        }
        if let [(name, 1)] = factors.as_slice()
            && let Some(atom) = atom(name)
        {
            unit.shift = atom.shift;
            unit.reference = atom.reference;
        }
        Ok(unit)
    }

    fn multiply(&mut self, atom: &Atom, power: i32) {
        let (up, down) =
            if power >= 0 { (atom.numerator, atom.denominator) } else { (atom.denominator, atom.numerator) };
        // Repeated products of small whole numbers are exact, a power function need not be.
        for _ in 0..power.unsigned_abs() {
            self.numerator *= up;
            self.denominator *= down;
        }
        for (total, exponent) in self.exponents.iter_mut().zip(atom.exponents) {
            *total += exponent * power;
        }
    }

    /// The unit as it was written.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether it measures this kind of quantity.
    #[must_use]
    pub fn measures(&self, dimension: Dimension) -> bool {
        self.exponents == dimension.exponents()
    }

    /// What kind of quantity it measures, if it is one of the usual ones.
    #[must_use]
    pub fn dimension(&self) -> Option<Dimension> {
        Dimension::of_exponents(self.exponents)
    }

    /// From where a pressure in this unit counts.
    #[must_use]
    pub fn reference(&self) -> Reference {
        self.reference
    }

    /// A number in this unit as SI; a gauge pressure stays gauge.
    #[must_use]
    pub fn to_si(&self, number: f64) -> f64 {
        (number + self.shift) * self.numerator / self.denominator
    }

    /// An SI value as a number in this unit; the inverse of [`Unit::to_si`].
    #[must_use]
    pub fn from_si(&self, si: f64) -> f64 {
        si * self.denominator / self.numerator - self.shift
    }

    /// A difference in this unit as SI: like [`Unit::to_si`] without the zero of degC and degF.
    #[must_use]
    pub fn difference_to_si(&self, number: f64) -> f64 {
        number * self.numerator / self.denominator
    }
}

fn unknown(written: &str, part: Option<&str>) -> QuantityError {
    let names = || ATOMS.iter().map(|atom| atom.name);
    let suggestion = part.map_or_else(String::new, |part| suggest::did_you_mean(part, names()));
    QuantityError::UnknownUnit {
        unit: crate::parse::shortened(written),
        suggestion,
        expected: "a product of units with powers, such as N s/m or J/(kg K)".into(),
    }
}

/// The same unit in plain characters: powers as digits, products as spaces.
fn normalised(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '²' => plain.push('2'),
            '³' => plain.push('3'),
            'µ' | 'μ' => plain.push('u'),
            '·' | '⋅' | '*' => plain.push(' '),
            '°' => plain.push_str("deg"),
            '^' => {}
            _ => plain.push(character),
        }
    }
    let plain = plain.trim();
    if matches!(plain, "\"" | "\u{2033}" | "''") {
        return "in".to_owned();
    }
    referred(plain).or_else(|| squared(plain)).unwrap_or_else(|| plain.to_owned())
}

/// Datasheets say "bar(g)", "psi a", "psi gauge" and "barü"; as products these make no sense.
fn referred(plain: &str) -> Option<String> {
    ["psi", "bar", "kPa", "MPa", "hPa", "mbar"].into_iter().find_map(|name| {
        let (front, mark) = plain.split_at_checked(name.len())?;
        let _ = atom(front).filter(|atom| atom.name == name)?;
        match mark.trim_matches([' ', '(', ')', '.']).to_lowercase().as_str() {
            "g" | "gauge" | "ü" | "ue" | "überdruck" | "ueberdruck" => Some(format!("{name}g")),
            // All but psi and bar are absolute by themselves.
            "a" | "abs" | "absolute" | "absolut" => {
                Some(if matches!(name, "psi" | "bar") { format!("{name}a") } else { name.to_owned() })
            }
            _ => None,
        }
    })
}

/// "sq.in", "sq in" and "cu. in." as powers.
fn squared(plain: &str) -> Option<String> {
    [("sq", 2), ("cu", 3)].into_iter().find_map(|(word, power)| {
        let length = plain.strip_prefix(word)?.trim_matches(['.', ' ']);
        let is_length = atom(length).is_some_and(|atom| atom.exponents == Dimension::Length.exponents());
        is_length.then(|| format!("{length}{power}"))
    })
}

/// The factors of a unit with their powers; `None` where the text is no unit at all.
fn factors(text: &str) -> Option<Vec<(String, i32)>> {
    let mut found = Vec::new();
    let mut rest = text.trim_start();
    // A slash turns the next factor, or the next group in parentheses, upside down.
    let mut divide = false;
    let mut group = None;
    while let Some(first) = rest.chars().next() {
        match first {
            '/' if !divide && !found.is_empty() => {
                divide = true;
                rest = &rest[1..];
            }
            '(' if group.is_none() => {
                group = Some(divide);
                divide = false;
                rest = &rest[1..];
            }
            ')' if group.is_some() && !divide => {
                group = None;
                rest = &rest[1..];
            }
            _ => {
                let end = rest.find([' ', '/', '(', ')']).unwrap_or(rest.len());
                let (name, power) = factor(&rest[..end])?;
                let sign = if divide == group.unwrap_or(false) { 1 } else { -1 };
                found.push((name, sign * power));
                divide = false;
                rest = &rest[end..];
            }
        }
        rest = rest.trim_start();
    }
    (group.is_none() && !divide).then_some(found)
}

/// One factor and its power: "mm2" is mm to the 2, "s-1" is s to the -1.
fn factor(text: &str) -> Option<(String, i32)> {
    if text == "1" {
        return Some((text.to_owned(), 1));
    }
    let letters = text.find(|character: char| !character.is_alphabetic()).unwrap_or(text.len());
    let (name, power) = text.split_at(letters);
    let power = if power.is_empty() { 1 } else { power.parse().ok()? };
    let sensible = !name.is_empty() && (-9..=9).contains(&power) && power != 0;
    sensible.then(|| (name.to_owned(), power))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn si(number: f64, unit: &str) -> f64 {
        Unit::parse(unit).unwrap().to_si(number)
    }

    #[test]
    fn usual_units_become_the_nearest_double() {
        assert_eq!(si(25.4, "mm"), 0.0254);
        assert_eq!(si(1.0, "in"), 0.0254);
        assert_eq!(si(0.5, "mm2"), 0.5e-6);
        assert_eq!(si(30.0, "cm³"), 30e-6);
        assert_eq!(si(16.0, "kN/m"), 16_000.0);
        assert_eq!(si(5.0, "N/mm"), 5_000.0);
        assert_eq!(si(75.0, "psig"), 75.0 * 6894.757);
        for (text, reference) in
            [("bar(g)", Reference::Gauge), ("psi a", Reference::Absolute), ("MPa (g)", Reference::Gauge)]
        {
            assert_eq!(Unit::parse(text).unwrap().reference(), reference, "{text}");
        }
        assert_eq!(Unit::parse("kPa(a)").unwrap().reference(), Reference::Unstated);
        assert_eq!(si(20.0, "°C"), 293.15);
        assert!((si(68.0, "degF") - 293.15).abs() < 1e-9);
        assert!((si(1.0, "lbf/in") - 175.126_835).abs() < 1e-6);
    }

    #[test]
    fn datasheets_and_displays_write_units_their_own_way() {
        for (written, usual) in [
            ("PSIG", "psig"),
            ("PSI", "psi"),
            ("Psia", "psia"),
            ("BARG", "barg"),
            ("Bar(G)", "barg"),
            ("KPA", "kPa"),
            ("kpa", "kPa"),
            ("MPA", "MPa"),
            ("mBAR", "mbar"),
            ("psi gauge", "psig"),
            ("psi abs.", "psia"),
            ("barü", "barg"),
            ("bar ü", "barg"),
            ("bar Überdruck", "barg"),
            ("mbar abs", "mbar"),
            ("hPa(a)", "hPa"),
            ("mbar(g)", "mbarg"),
            ("sq.in", "in2"),
            ("sq in", "in2"),
            ("sq. inches", "in2"),
            ("sq cm", "cm2"),
            ("cu.in", "in3"),
            ("cu in", "in3"),
            ("cc", "cm3"),
            ("ccm", "cm3"),
            ("inch", "in"),
            ("inches", "in"),
            ("\"", "in"),
            ("lbs", "lb"),
            ("lbm", "lb"),
            ("lbf/inch", "lbf/in"),
        ] {
            let (unit, usual) = (Unit::parse(written).unwrap(), Unit::parse(usual).unwrap());
            assert_eq!(unit.to_si(7.0), usual.to_si(7.0), "{written}");
            assert_eq!((unit.exponents, unit.reference()), (usual.exponents, usual.reference()), "{written}");
            assert_eq!(unit.text(), written);
        }
        // Milli and mega, and all that is no pressure, stay apart by their case.
        for written in ["mpa", "mPa", "MBAR", "MM", "KG", "MW", "mpag", "n", "sq", "sq psi", "cu.", "psi gauges"] {
            assert!(Unit::parse(written).is_err(), "{written}");
        }
    }

    #[test]
    fn spellings_of_a_product_agree() {
        for spelling in ["N s/m", "N*s/m", "N·s / m", "N s m-1", "N s m^-1", "N/(m/s)", "kg/s"] {
            let unit = Unit::parse(spelling).unwrap();
            assert!(unit.measures(Dimension::ViscousFriction), "{spelling}");
            assert_eq!(unit.to_si(600.0), 600.0);
        }
        assert!(Unit::parse("J/(kg K)").unwrap().measures(Dimension::SpecificGasConstant));
        assert!(Unit::parse("J/kg/K").unwrap().measures(Dimension::SpecificGasConstant));
        assert!(!Unit::parse("J/kg K").unwrap().measures(Dimension::SpecificGasConstant));
    }

    #[test]
    fn a_wrong_unit_names_the_nearest() {
        let message = Unit::parse("psgi").unwrap_err().to_string();
        assert!(message.contains("did you mean \"psig\""), "{message}");
        for text in ["m/", "/m", "m//s", "(m", "m)", "m2.5", "2m", "m0", "m99"] {
            assert!(Unit::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn zero_points_count_alone_but_not_in_products() {
        assert_eq!(si(0.0, "degC"), 273.15);
        assert_eq!(si(1.0, "W/degC"), 1.0);
        assert_eq!(Unit::parse("psig").unwrap().reference(), Reference::Gauge);
        assert_eq!(Unit::parse("N/psig").unwrap().reference(), Reference::Unstated);
    }
}
