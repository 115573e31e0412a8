//! Under what conditions a run was made.

use checked_toml::{QuantityKind, Section, TomlFileError};

use crate::types::{RunConditions, ValveFacts};
use crate::warning::Doubt;

/// The keys that state conditions.
pub(crate) const CONDITION_KEYS: [&str; 4] =
    ["supply_pressure", "temperature", "leak_to_atmosphere", "leak_from_supply"];

/// Reads the conditions of a `[[run]]`; what is left out is as in the valve file, without leaks.
pub(crate) fn read(section: &Section<'_>, valve: &ValveFacts) -> Result<(RunConditions, Vec<Doubt>), TomlFileError> {
    let ambient_pressure_pa = valve.ambient_pressure_pa;
    let supply = section.quantity("supply_pressure", QuantityKind::Pressure { ambient_pressure_pa })?;
    let mut doubts = Vec::new();
    if supply.is_none() {
        doubts.push(Doubt::SupplyAssumed { assumed_kpa: valve.supply_pressure_pa / 1e3 });
    }
    let conditions = RunConditions {
        supply_pressure_pa: supply.unwrap_or(valve.supply_pressure_pa),
        temperature_k: section.quantity("temperature", QuantityKind::Si("K"))?.unwrap_or(valve.temperature_k),
        leak_to_atmosphere_m2: section.quantity("leak_to_atmosphere", QuantityKind::Si("m2"))?.unwrap_or(0.0),
        leak_from_supply_m2: section.quantity("leak_from_supply", QuantityKind::Si("m2"))?.unwrap_or(0.0),
    };
    match fault(&conditions, ambient_pressure_pa) {
        None => {
            doubts.extend(far(&conditions, valve));
            Ok((conditions, doubts))
        }
        Some((key, found, expected)) => Err(section.wrong(key, found, expected)),
    }
}

/// Temperatures that gas and seals of hardly any valve see, K: below -50 degC, above 130 degC.
const USUAL_TEMPERATURES_K: std::ops::Range<f64> = 223.0..403.0;
/// Nobody opens a leak as large as this on purpose, m2: a bore of 11 mm.
const LARGE_LEAK_M2: f64 = 1e-4;

/// Conditions that can be, but hardly are.
pub(crate) fn far(conditions: &RunConditions, valve: &ValveFacts) -> Vec<Doubt> {
    let mut doubts: Vec<Doubt> = far_supply(conditions.supply_pressure_pa, valve).into_iter().collect();
    let temperature_k = conditions.temperature_k;
    let like_the_valve = (temperature_k - valve.temperature_k).abs() < 30.0;
    if !USUAL_TEMPERATURES_K.contains(&temperature_k) && !like_the_valve {
        doubts.push(Doubt::TemperatureFar { temperature_k, temperature_degc: temperature_k - 273.15 });
    }
    let leaks = [
        ("leak_to_atmosphere", conditions.leak_to_atmosphere_m2),
        ("leak_from_supply", conditions.leak_from_supply_m2),
    ];
    let large = leaks.into_iter().filter(|(_, area_m2)| *area_m2 > LARGE_LEAK_M2);
    doubts.extend(large.map(|(key, area_m2)| Doubt::LargeLeak { key, area_mm2: (area_m2 * 1e12).round() / 1e6 }));
    doubts
}

/// How many times the valve file's supply pressure, or what part of it, is in doubt (both gauge): units that are
/// taken for each other differ by more.
const FAR: f64 = 4.0;

/// A doubt about a supply pressure that is far from the valve file's, as one in a wrong unit is.
fn far_supply(supply_pa: f64, valve: &ValveFacts) -> Option<Doubt> {
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
