//! Kinds of quantities and the units in which they are written.

use crate::atoms::Exponents;

/// A kind of quantity that a key, a column or an option may want.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Dimension {
    /// A number without unit.
    Pure,
    /// SI unit kg.
    Mass,
    /// SI unit m.
    Length,
    /// SI unit m2.
    Area,
    /// SI unit m3.
    Volume,
    /// SI unit s.
    Time,
    /// SI unit K.
    Temperature,
    /// SI unit N.
    Force,
    /// SI unit Pa.
    Pressure,
    /// SI unit N s/m.
    ViscousFriction,
    /// SI unit N/m.
    Stiffness,
    /// SI unit J/(kg K).
    SpecificGasConstant,
    /// SI unit Pa s/kg.
    FlowResistance,
    /// SI unit W/K.
    ThermalConductance,
    /// SI unit m/s.
    Speed,
    /// SI unit kg/s.
    MassFlow,
}

/// Name, SI unit, powers of kg, m, s and K, and the units to offer in messages.
struct Info(&'static str, &'static str, Exponents, &'static [&'static str]);

impl Dimension {
    /// Every kind of quantity.
    pub const ALL: [Self; 16] = [
        Self::Pure,
        Self::Mass,
        Self::Length,
        Self::Area,
        Self::Volume,
        Self::Time,
        Self::Temperature,
        Self::Force,
        Self::Pressure,
        Self::ViscousFriction,
        Self::Stiffness,
        Self::SpecificGasConstant,
        Self::FlowResistance,
        Self::ThermalConductance,
        Self::Speed,
        Self::MassFlow,
    ];

    fn info(self) -> Info {
        match self {
            Self::Pure => Info("a pure number", "", [0, 0, 0, 0], &[]),
            Self::Mass => Info("a mass", "kg", [1, 0, 0, 0], &["kg", "g", "lb"]),
            Self::Length => Info("a length", "m", [0, 1, 0, 0], &["mm", "cm", "m", "um", "in"]),
            Self::Area => Info("an area", "m2", [0, 2, 0, 0], &["mm2", "cm2", "m2", "in2"]),
            Self::Volume => Info("a volume", "m3", [0, 3, 0, 0], &["cm3", "l", "m3", "mm3", "in3"]),
            Self::Time => Info("a time", "s", [0, 0, 1, 0], &["s", "ms", "us", "min"]),
            Self::Temperature => Info("a temperature", "K", [0, 0, 0, 1], &["K", "degC", "degF"]),
            Self::Force => Info("a force", "N", [1, 1, -2, 0], &["N", "kN", "lbf"]),
            Self::Pressure => Info(
                "a pressure",
                "Pa",
                [1, -1, -2, 0],
                &["psig", "psia", "barg", "bara", "kPa", "MPa", "Pa", "kPag", "MPag", "hPa", "mbar"],
            ),
            Self::ViscousFriction => Info("a viscous friction", "N s/m", [1, 0, -1, 0], &["N s/m", "kN s/m"]),
            Self::Stiffness => Info("a stiffness", "N/m", [1, 0, -2, 0], &["N/m", "N/mm", "kN/m", "MN/m", "lbf/in"]),
            Self::SpecificGasConstant => {
                Info("a specific gas constant", "J/(kg K)", [0, 2, -2, -1], &["J/(kg K)", "kJ/(kg K)"])
            }
            Self::FlowResistance => {
                Info("a flow resistance", "Pa s/kg", [0, -1, -1, 0], &["Pa s/kg", "kPa s/kg", "MPa s/kg"])
            }
            Self::ThermalConductance => Info("a thermal conductance", "W/K", [1, 2, -3, -1], &["W/K", "mW/K"]),
            Self::Speed => Info("a speed", "m/s", [0, 1, -1, 0], &["m/s", "mm/s"]),
            Self::MassFlow => Info("a mass flow", "kg/s", [1, 0, -1, 0], &["kg/s", "g/s"]),
        }
    }

    /// What it is called, with its article: "a length".
    #[must_use]
    pub fn name(self) -> &'static str {
        self.info().0
    }

    /// Its SI unit as text, empty for a pure number.
    #[must_use]
    pub fn si_unit(self) -> &'static str {
        self.info().1
    }

    pub(crate) fn exponents(self) -> Exponents {
        self.info().2
    }

    /// The units in which it is usually written; bare psi and bar are left out since they do not say from where
    /// they count.
    #[must_use]
    pub fn units(self) -> &'static [&'static str] {
        self.info().3
    }

    /// The kind of quantity with this SI unit, spelt as [`Dimension::si_unit`] does.
    #[must_use]
    pub fn of_si_unit(si_unit: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|dimension| dimension.si_unit() == si_unit)
    }

    /// The usual unit that is written so when case is ignored, as at the end of a column name
    /// (`supply_pressure_kpa`).
    #[must_use]
    pub fn unit_ignoring_case(self, text: &str) -> Option<&'static str> {
        self.units().iter().copied().find(|unit| unit.eq_ignore_ascii_case(text))
    }

    /// What would be right, for messages: "a length in mm, cm, m, um or in".
    #[must_use]
    pub fn expectation(self) -> String {
        match self.units() {
            [] => self.name().to_owned(),
            [only] => format!("{} in {only}", self.name()),
            [first @ .., last] => format!("{} in {} or {last}", self.name(), first.join(", ")),
        }
    }

    pub(crate) fn of_exponents(exponents: Exponents) -> Option<Self> {
        Self::ALL.into_iter().find(|dimension| dimension.exponents() == exponents)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Unit;

    #[test]
    fn every_unit_offered_is_known_and_of_its_kind() {
        for dimension in Dimension::ALL {
            assert_eq!(Dimension::of_si_unit(dimension.si_unit()), Some(dimension));
            for unit in dimension.units() {
                let parsed = Unit::parse(unit).unwrap();
                assert!(parsed.measures(dimension), "{unit} of {dimension:?}");
            }
        }
    }

    #[test]
    fn the_si_unit_of_each_kind_is_one() {
        for dimension in Dimension::ALL {
            let unit = Unit::parse(dimension.si_unit()).unwrap();
            assert_eq!(unit.to_si(0.3), 0.3, "{dimension:?}");
        }
    }
}
