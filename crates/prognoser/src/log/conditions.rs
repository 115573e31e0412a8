//! Columns of the conditions of a cycle, with their unit in the name.

/// Pressure of the standard atmosphere, to which gauge pressures of a log are
/// added.
const ATMOSPHERE_PA: f64 = 101_325.0;

/// A column of a condition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConditionColumn {
    name: &'static str,
    pressure: bool,
    /// SI value of 1 and of 0 of the unit.
    scale: f64,
    zero: f64,
}

/// Names, and what 1 and 0 of the unit are in Pa absolute or K.
const COLUMNS: [(&str, f64, f64); 11] = [
    ("supply_pressure_psig", 6_894.757_293_168, ATMOSPHERE_PA),
    ("supply_pressure_psia", 6_894.757_293_168, 0.0),
    ("supply_pressure_barg", 1e5, ATMOSPHERE_PA),
    ("supply_pressure_bara", 1e5, 0.0),
    ("supply_pressure_kpag", 1e3, ATMOSPHERE_PA),
    ("supply_pressure_kpa", 1e3, 0.0),
    ("supply_pressure_mpa", 1e6, 0.0),
    ("supply_pressure_pa", 1.0, 0.0),
    ("temperature_k", 1.0, 0.0),
    ("temperature_degc", 1.0, 273.15),
    ("temperature_degf", 5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0),
];

impl ConditionColumn {
    /// The column of this name, whatever its case.
    pub fn named(name: &str) -> Option<Self> {
        let (name, scale, zero) = COLUMNS.into_iter().find(|(known, ..)| known.eq_ignore_ascii_case(name))?;
        Some(Self { name, pressure: name.starts_with("supply_pressure"), scale, zero })
    }

    /// Whether it is a pressure; else it is a temperature.
    pub fn is_pressure(self) -> bool {
        self.pressure
    }

    /// What it tells of.
    pub fn quantity(self) -> &'static str {
        if self.pressure { "supply_pressure_UNIT" } else { "temperature_UNIT" }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        self.name
    }

    /// A value in Pa absolute or in K; none where there can be no such thing.
    pub fn si(self, value: f64) -> Option<f64> {
        Some(self.zero + self.scale * value).filter(|value| value.is_finite() && *value > 0.0)
    }
}
