//! How an error changes with the conditions of the runs.

use nalgebra::{DMatrix, DVector};
use valve_model::Conditions;

/// A condition that may differ from run to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// Supply pressure, Pa.
    SupplyPressure,
    /// Temperature, K.
    Temperature,
    /// Area of a leak to atmosphere, m².
    LeakToAtmosphere,
    /// Area of a leak from the supply, m².
    LeakFromSupply,
}

impl Condition {
    /// All.
    pub const ALL: [Self; 4] = [Self::SupplyPressure, Self::Temperature, Self::LeakToAtmosphere, Self::LeakFromSupply];

    /// Its value, SI.
    pub fn of(self, conditions: &Conditions) -> f64 {
        match self {
            Self::SupplyPressure => conditions.supply_pressure_pa,
            Self::Temperature => conditions.temperature_k,
            Self::LeakToAtmosphere => conditions.leak_to_atmosphere_m2,
            Self::LeakFromSupply => conditions.leak_from_supply_m2,
        }
    }

    /// Its name in files, with its unit.
    pub fn id(self) -> &'static str {
        match self {
            Self::SupplyPressure => "supply_pressure_pa",
            Self::Temperature => "temperature_k",
            Self::LeakToAtmosphere => "leak_to_atmosphere_m2",
            Self::LeakFromSupply => "leak_from_supply_m2",
        }
    }

    /// Its name in a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Self::SupplyPressure => "supply pressure",
            Self::Temperature => "temperature",
            Self::LeakToAtmosphere => "a leak to atmosphere",
            Self::LeakFromSupply => "a leak from the supply",
        }
    }
}

/// How an error changes with one condition, the others held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trend {
    /// The condition.
    pub condition: Condition,
    /// Change of the error from the lowest to the highest value tested, in the unit of the error.
    pub change: f64,
    /// One standard deviation of that.
    pub standard_error: f64,
}

/// The trends of an error over runs: (conditions, error, its standard error). Conditions that do not
/// vary, or only together with others, have none; so has everything where there are too few runs.
pub fn trends(errors: &[(Conditions, f64, f64)]) -> Vec<Trend> {
    let range = |condition: Condition| {
        let values = errors.iter().map(|(conditions, _, _)| condition.of(conditions));
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        (low, high - low)
    };
    let varying: Vec<Condition> = Condition::ALL
        .into_iter()
        .filter(|condition| {
            let (low, width) = range(*condition);
            errors.len() > 1 && width > 1e-6 * low.abs().max(1e-9)
        })
        .collect();
    let columns = varying.len() + 1;
    if varying.is_empty() || errors.len() <= columns {
        return Vec::new();
    }
    let design = DMatrix::from_fn(errors.len(), columns, |row, column| match column.checked_sub(1) {
        None => 1.0,
        Some(index) => {
            let (low, width) = range(varying[index]);
            (varying[index].of(&errors[row].0) - low) / width - 0.5
        }
    });
    let target = DVector::from_iterator(errors.len(), errors.iter().map(|(_, error, _)| *error));
    let Some(inverse) = (design.transpose() * &design).try_inverse() else { return Vec::new() };
    let solution = &inverse * design.transpose() * &target;
    let left = (&target - &design * &solution).norm_squared() / (errors.len() - columns) as f64;
    let known = errors.iter().map(|(_, _, error)| error * error).sum::<f64>() / errors.len() as f64;
    let variance = left.max(known);
    varying
        .into_iter()
        .enumerate()
        .map(|(index, condition)| Trend {
            condition,
            change: solution[index + 1],
            standard_error: (variance * inverse[(index + 1, index + 1)]).sqrt(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_condition_gets_its_own_share() {
        let errors: Vec<(Conditions, f64, f64)> = [(4e5, 0.0), (5e5, 0.0), (6e5, 0.0), (7e5, 0.0), (6e5, 1e-7)]
            .into_iter()
            .map(|(supply_pressure_pa, leak)| {
                let conditions = Conditions {
                    supply_pressure_pa,
                    temperature_k: 293.15,
                    leak_to_atmosphere_m2: leak,
                    leak_from_supply_m2: 0.0,
                };
                (conditions, 0.01 + 1e-8 * supply_pressure_pa - 2e4 * leak, 1e-4)
            })
            .collect();
        let found = trends(&errors);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].condition, Condition::SupplyPressure);
        assert!((found[0].change - 3e-3).abs() < 1e-9, "{found:?}");
        assert!((found[1].change + 2e-3).abs() < 1e-9, "{found:?}");
        assert!(trends(&errors[..1]).is_empty());
    }
}
