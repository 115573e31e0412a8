//! Columns of the conditions of a cycle, with their unit in the name.

use super::error::LogErrorKind;
use super::layout::field_error;

/// Pressure of the standard atmosphere, to which gauge pressures of a log are
/// added.
const ATMOSPHERE_PA: f64 = 101_325.0;

/// A column of a condition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ConditionColumn {
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
    pub(super) fn named(name: &str) -> Option<Self> {
        let (name, scale, zero) = COLUMNS.into_iter().find(|(known, ..)| known.eq_ignore_ascii_case(name))?;
        Some(Self { name, pressure: name.starts_with("supply_pressure"), scale, zero })
    }

    pub(super) fn is_pressure(self) -> bool {
        self.pressure
    }

    /// What it tells of.
    pub(super) fn quantity(self) -> &'static str {
        if self.pressure { "supply_pressure_UNIT" } else { "temperature_UNIT" }
    }

    /// The value in Pa absolute or in K; none where nothing was written.
    pub(super) fn si(self, field: &str) -> Result<Option<f64>, LogErrorKind> {
        if field.is_empty() {
            return Ok(None);
        }
        let value = field.parse::<f64>().ok().map(|value| self.zero + self.scale * value);
        match value.filter(|value| value.is_finite() && *value > 0.0) {
            Some(value) => Ok(Some(value)),
            None => {
                Err(field_error(self.name, field, "a number in the unit of the column, or nothing if it is not known"))
            }
        }
    }
}
