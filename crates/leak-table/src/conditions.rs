//! The conditions of a cycle that a table may be built over.

use std::fmt;

use thiserror::Error;

/// Files round the ends of a range; conditions this share beyond them are still covered.
const ROUNDING: f64 = 1e-9;

/// Supply pressure and temperature of a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Supply pressure in Pa, absolute.
    pub supply_pressure_pa: f64,
    /// Temperature of gas, walls and surroundings in K.
    pub temperature_k: f64,
}

/// The conditions that tables cover, both ends included. Where the two ends are equal the tables do
/// not vary with this condition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConditionRange {
    /// Lowest and highest supply pressure in Pa, absolute.
    pub supply_pressure_pa: (f64, f64),
    /// Lowest and highest temperature in K.
    pub temperature_k: (f64, f64),
}

/// One of the two conditions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Condition {
    /// The supply pressure in Pa, absolute.
    SupplyPressure,
    /// The temperature in K.
    Temperature,
}

impl Condition {
    /// Both, in the order used throughout.
    pub const ALL: [Self; 2] = [Self::SupplyPressure, Self::Temperature];

    pub(crate) const fn unit(self) -> &'static str {
        match self {
            Self::SupplyPressure => "Pa absolute",
            Self::Temperature => "K",
        }
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::SupplyPressure => "supply pressure",
            Self::Temperature => "temperature",
        })
    }
}

/// Conditions that a table does not cover, or a range that is none.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ConditionsError {
    /// A condition lies outside the tables.
    #[error(
        "{condition}: found {found} {}, expected {from} to {to} {}, for which the tables were built; build them over a range that holds it",
        condition.unit(), condition.unit()
    )]
    Outside {
        /// Which one.
        condition: Condition,
        /// Its value.
        found: f64,
        /// The lowest value that the tables cover.
        from: f64,
        /// The highest.
        to: f64,
    },
    /// A range does not rise from a positive number.
    #[error("{condition}: found a range from {from} to {to} {}, expected one that rises from a number above 0", condition.unit())]
    Range {
        /// Of which condition.
        condition: Condition,
        /// Its lower end.
        from: f64,
        /// Its upper end.
        to: f64,
    },
}

impl Conditions {
    /// The value of one condition.
    #[must_use]
    pub const fn get(&self, condition: Condition) -> f64 {
        match condition {
            Condition::SupplyPressure => self.supply_pressure_pa,
            Condition::Temperature => self.temperature_k,
        }
    }
}

impl ConditionRange {
    /// The range of one condition.
    #[must_use]
    pub const fn get(&self, condition: Condition) -> (f64, f64) {
        match condition {
            Condition::SupplyPressure => self.supply_pressure_pa,
            Condition::Temperature => self.temperature_k,
        }
    }

    /// Whether tables over this range vary with a condition.
    #[must_use]
    pub fn varies(&self, condition: Condition) -> bool {
        let (from, to) = self.get(condition);
        from < to
    }

    /// The covered conditions that are nearest to some others.
    #[must_use]
    pub fn nearest(&self, conditions: &Conditions) -> Conditions {
        let clamp = |value: f64, (from, to): (f64, f64)| value.max(from).min(to);
        Conditions {
            supply_pressure_pa: clamp(conditions.supply_pressure_pa, self.supply_pressure_pa),
            temperature_k: clamp(conditions.temperature_k, self.temperature_k),
        }
    }

    /// Says which condition is not covered.
    pub fn check(&self, conditions: &Conditions) -> Result<(), ConditionsError> {
        for condition in Condition::ALL {
            let (found, (from, to)) = (conditions.get(condition), self.get(condition));
            let slack = ROUNDING * to;
            if !(found >= from - slack && found <= to + slack) {
                return Err(ConditionsError::Outside { condition, found, from, to });
            }
        }
        Ok(())
    }

    /// Refuses ranges of numbers that are not positive or run backwards.
    pub fn check_ends(&self) -> Result<(), ConditionsError> {
        for condition in Condition::ALL {
            let (from, to) = self.get(condition);
            if !(from > 0.0 && from <= to && to.is_finite()) {
                return Err(ConditionsError::Range { condition, from, to });
            }
        }
        Ok(())
    }
}
