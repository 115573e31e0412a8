//! Under what conditions a run was made.

use checked_toml::{QuantityKind, Section, TomlFileError};

use crate::types::{RunConditions, ValveFacts};
use crate::warning::Doubt;

/// The keys that state conditions.
pub(crate) const CONDITION_KEYS: [&str; 4] =
    ["supply_pressure", "temperature", "leak_to_atmosphere", "leak_from_supply"];

/// Reads the conditions of a `[[run]]`; what is left out is as in the valve file, without leaks.
pub(crate) fn read(section: &Section<'_>, valve: &ValveFacts) -> Result<(RunConditions, Option<Doubt>), TomlFileError> {
    let ambient_pressure_pa = valve.ambient_pressure_pa;
    let supply = section.quantity("supply_pressure", QuantityKind::Pressure { ambient_pressure_pa })?;
    let doubt = match supply {
        None => Some(Doubt::SupplyAssumed { assumed_kpa: valve.supply_pressure_pa / 1e3 }),
        Some(supply) => far_supply(supply, valve),
    };
    let conditions = RunConditions {
        supply_pressure_pa: supply.unwrap_or(valve.supply_pressure_pa),
        temperature_k: section.quantity("temperature", QuantityKind::Si("K"))?.unwrap_or(valve.temperature_k),
        leak_to_atmosphere_m2: section.quantity("leak_to_atmosphere", QuantityKind::Si("m2"))?.unwrap_or(0.0),
        leak_from_supply_m2: section.quantity("leak_from_supply", QuantityKind::Si("m2"))?.unwrap_or(0.0),
    };
    match fault(&conditions, ambient_pressure_pa) {
        None => Ok((conditions, doubt)),
        Some((key, found, expected)) => Err(section.wrong(key, found, expected)),
    }
}

/// How many times the valve file's supply pressure, or what part of it, is in doubt (both gauge): units that are
/// taken for each other differ by more.
const FAR: f64 = 4.0;

/// A doubt about a supply pressure that is far from the valve file's, as one in a wrong unit is.
pub(crate) fn far_supply(supply_pa: f64, valve: &ValveFacts) -> Option<Doubt> {
    let gauge = |absolute: f64| absolute - valve.ambient_pressure_pa;
    let ratio = gauge(supply_pa) / gauge(valve.supply_pressure_pa);
    let usual_kpa = valve.supply_pressure_pa / 1e3;
    (!(1.0 / FAR..=FAR).contains(&ratio)).then_some(Doubt::SupplyFar { supply_kpa: supply_pa / 1e3, usual_kpa })
}

/// The first condition that makes no sense: its key, what was found and what would be right.
pub(crate) fn fault(conditions: &RunConditions, ambient_pressure_pa: f64) -> Option<(&'static str, String, String)> {
    let RunConditions { supply_pressure_pa, temperature_k, leak_to_atmosphere_m2, leak_from_supply_m2 } = *conditions;
    if !(supply_pressure_pa > ambient_pressure_pa && supply_pressure_pa.is_finite()) {
        let expected = format!(
            "more than the ambient pressure of {ambient_pressure_pa} Pa (is it meant as a gauge pressure, such as \"75 psig\"?)"
        );
        return Some(("supply_pressure", format!("{supply_pressure_pa} Pa absolute"), expected));
    }
    // Far outside what seals and gas bear, and where degrees Celsius were called kelvin.
    if !(150.0..=600.0).contains(&temperature_k) {
        return Some(("temperature", format!("{temperature_k} K"), "a temperature between 150 and 600 K".into()));
    }
    for (key, area) in [("leak_to_atmosphere", leak_to_atmosphere_m2), ("leak_from_supply", leak_from_supply_m2)] {
        if !(area >= 0.0 && area.is_finite()) {
            return Some((key, format!("{area} m2"), "an area of 0 or more".into()));
        }
    }
    None
}
