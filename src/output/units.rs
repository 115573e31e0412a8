//! The units in which people read results: the usual ones, those asked for, or those of the valve file.

use std::sync::OnceLock;

use quantity::{Dimension, Quantity, Reference, Unit};

/// Kinds of quantities that are told in text, and their units unless others are asked for. Pressures are absolute.
const USUAL: [(Dimension, &str); 8] = [
    (Dimension::Length, "mm"),
    (Dimension::Area, "mm²"),
    (Dimension::Volume, "cm3"),
    (Dimension::Pressure, "kPa"),
    (Dimension::Temperature, "K"),
    (Dimension::Force, "N"),
    (Dimension::Stiffness, "N/mm"),
    (Dimension::Time, "ms"),
];

/// Where no valve file says otherwise, Pa.
const STANDARD_ATMOSPHERE_PA: f64 = 101_325.0;

/// Units that were chosen, at most one for each kind of quantity.
#[derive(Debug, Clone)]
pub struct Units {
    chosen: Vec<Unit>,
    ambient_pressure_pa: f64,
}

static UNITS: OnceLock<Units> = OnceLock::new();

impl Default for Units {
    fn default() -> Self {
        Self { chosen: Vec::new(), ambient_pressure_pa: STANDARD_ATMOSPHERE_PA }
    }
}

impl Units {
    /// Reads a list such as "psig,mm"; says what is wrong with it.
    pub fn parse(list: &str) -> Result<Self, String> {
        let mut units = Self::default();
        for name in list.split(',') {
            let is_told = |name: &str| Unit::parse(name).ok().and_then(|unit| told(&unit)).is_some();
            if let Some((one, other)) = name.trim().split_once(' ')
                && is_told(one)
                && is_told(other)
            {
                return Err(format!("found {name:?}, expected a comma between two units: {one},{other}"));
            }
            let unit = Unit::parse(name).map_err(|error| error.to_string())?;
            let Some(dimension) = told(&unit) else {
                return Err(format!("no result is told in {name:?}; expected units such as psig, mm, degC, N or cm3"));
            };
            if dimension == Dimension::Pressure && unit.reference() == Reference::Ambiguous {
                return Err(format!(
                    "found {name:?}, expected a unit that says from where it counts: {name}g or {name}a"
                ));
            }
            if units.chosen.iter().any(|other| other.measures(dimension)) {
                return Err(format!("found two units for {}, expected one", dimension.name()));
            }
            units.chosen.push(unit);
        }
        Ok(units)
    }

    /// The units that a valve file is written in: of each kind of quantity the first one.
    pub fn of_valve_file(text: &str) -> Self {
        let mut units = Self::default();
        let quoted = text.lines().filter(|line| !line.trim_start().starts_with('#')).filter_map(|line| {
            let (_, value) = line.split_once('=')?;
            value.trim_start().strip_prefix('"')?.split('"').next()
        });
        for (value, (dimension, _)) in quoted.flat_map(|value| USUAL.map(|usual| (value, usual))) {
            let Ok(quantity) = Quantity::parse(value, dimension) else { continue };
            let is_known = units.chosen.iter().any(|other| other.measures(dimension));
            // Areas of pistons and times of cycles are of another size than those of leaks and errors.
            let is_small = matches!(dimension, Dimension::Area | Dimension::Time);
            if !is_known && !is_small && !quantity.unit().text().is_empty() {
                units.chosen.push(quantity.unit().clone());
            }
        }
        units
    }

    /// The same around a valve whose surroundings have this pressure, from which gauge pressures count.
    #[must_use]
    pub fn at_ambient(self, ambient_pressure_pa: f64) -> Self {
        Self { ambient_pressure_pa, ..self }
    }

    fn of(&self, dimension: Dimension) -> Told {
        let usual = USUAL.into_iter().find(|(one, _)| *one == dimension).map_or(dimension.si_unit(), |(_, name)| name);
        let usual = Unit::parse(usual).unwrap_or_else(|error| unreachable!("{error}"));
        let unit = self.chosen.iter().find(|unit| unit.measures(dimension)).unwrap_or(&usual).clone();
        #[expect(clippy::cast_possible_truncation, reason = "units differ by a few decades")]
        let more = (unit.difference_to_si(1.0) / usual.difference_to_si(1.0)).log10().ceil() as i32;
        let is_gauge = dimension == Dimension::Pressure && unit.reference() == Reference::Gauge;
        Told { unit, more, zero_si: if is_gauge { self.ambient_pressure_pa } else { 0.0 } }
    }
}

fn told(unit: &Unit) -> Option<Dimension> {
    USUAL.into_iter().map(|(dimension, _)| dimension).find(|dimension| unit.measures(*dimension))
}

/// Sets the units of this call. Only the first call counts.
pub fn set_units(units: Units) {
    UNITS.get_or_init(|| units);
}

/// The unit in which a kind of quantity is told.
pub fn told_in(dimension: Dimension) -> Told {
    UNITS.get_or_init(Units::default).of(dimension)
}

/// A unit that results are told in.
#[derive(Debug, Clone)]
pub struct Told {
    unit: Unit,
    /// Decimals more than in the usual unit, for the same precision.
    more: i32,
    zero_si: f64,
}

impl Told {
    /// A value, SI, pressures absolute, with as many decimals as so many of the usual unit are worth.
    pub fn number(&self, si: f64, decimals: usize) -> String {
        format!("{:.*}", self.decimals(decimals), self.unit.from_si(si - self.zero_si))
    }

    /// The same of a difference, an error or a pressure over another.
    pub fn difference(&self, si: f64, decimals: usize) -> String {
        format!("{:.*}", self.decimals(decimals), self.difference_value(si))
    }

    /// A difference as a number.
    pub fn difference_value(&self, si: f64) -> f64 {
        si / self.unit.difference_to_si(1.0)
    }

    /// The same with its sign.
    pub fn signed_difference(&self, si: f64, decimals: usize) -> String {
        format!("{:+.*}", self.decimals(decimals), self.difference_value(si))
    }

    /// The unit's name.
    pub fn name(&self) -> &str {
        self.unit.text()
    }

    /// The unit's name for differences, which count from nowhere.
    pub fn difference_name(&self) -> &str {
        let name = self.unit.text();
        let bare = name.trim_end_matches(['g', 'a']).trim_end_matches(' ');
        let states_it = name.starts_with("psi") || name.starts_with("bar") || (name.ends_with("Pag"));
        if states_it && self.unit.measures(Dimension::Pressure) { bare } else { name }
    }

    fn decimals(&self, usual: usize) -> usize {
        let decimals = i32::try_from(usual).unwrap_or(0) + self.more;
        usize::try_from(decimals).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usual_units_tell_what_they_always_told() {
        let units = Units::default();
        assert_eq!(units.of(Dimension::Length).number(0.001_234_5, 3), "1.234");
        assert_eq!(units.of(Dimension::Pressure).number(618_432.0, 0), "618");
        assert_eq!(units.of(Dimension::Pressure).difference_name(), "kPa");
    }

    #[test]
    fn units_asked_for_keep_the_precision() {
        let units = Units::parse("psig,in,degC").unwrap();
        let psig = units.of(Dimension::Pressure);
        assert_eq!([psig.number(618_432.0, 0), psig.name().to_owned()], ["75.0", "psig"]);
        assert_eq!([psig.difference(6894.757, 2), psig.difference_name().to_owned()], ["1.000", "psi"]);
        assert_eq!(units.of(Dimension::Length).number(0.0254, 3), "1.00000");
        assert_eq!(units.of(Dimension::Temperature).number(293.15, 0), "20");
        assert_eq!(units.of(Dimension::Temperature).difference(5.0, 0), "5");
        assert_eq!(units.of(Dimension::Force).number(2.0, 1), "2.0", "the others stay");
        assert_eq!(units.of(Dimension::Speed).difference_name(), "m/s", "what cannot be chosen is told in SI");
        assert_eq!(Units::parse("Pa").unwrap().of(Dimension::Pressure).number(618_432.0, 1), "618432");
    }

    #[test]
    fn what_cannot_be_meant_is_refused() {
        for (list, words) in [
            ("psi", "from where it counts"),
            ("mm,in", "two units for a length"),
            ("m/s", "no result is told in"),
            ("furlong", "furlong"),
        ] {
            let error = Units::parse(list).unwrap_err();
            assert!(error.contains(words), "{list}: {error}");
        }
    }

    #[test]
    fn a_valve_file_speaks_in_its_own_units() {
        let units = Units::of_valve_file(include_str!("../../models/testbed.toml"));
        assert_eq!(units.of(Dimension::Pressure).name(), "psig");
        assert_eq!(units.of(Dimension::Length).name(), "mm");
    }
}
