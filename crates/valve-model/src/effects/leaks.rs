//! Standing leaks: a leak of the pipe that was there from the start.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange};
use crate::params::Parameters;

fn range(valve: &Parameters) -> FitRange {
    let area = valve.solenoid_orifice_area_m2;
    FitRange { lower: 0.0, typical: 0.05 * area, upper: 2.0 * area }
}

const AREA: EffectParameter = EffectParameter {
    name: "area",
    si_unit: "m2",
    meaning: "geometric area of the leak",
    default: DefaultValue::Required,
    refinement: false,
    range,
};

pub(super) const TO_ATMOSPHERE: EffectInfo = EffectInfo {
    id: "leak-to-atmosphere",
    summary: "a standing leak from the pipe to atmosphere",
    equation: "the pipe loses f(p_p, p_atm; A)",
    symptom: "closes slower, opens faster",
    typical_sizes: "1 to 50 % of the solenoid's orifice area",
    confused_with: &["supply-droop", "orifice-law"],
    source: "Kulkarni, Daigle, Gorospe, Goebel 2014",
    acts_on: ActsOn::Pneumatics,
    parameters: &[AREA],
    neutral: 0.0,
};

pub(super) const FROM_SUPPLY: EffectInfo = EffectInfo {
    id: "leak-from-supply",
    summary: "a standing leak from the supply into the pipe",
    equation: "the pipe gains f(p_s, p_p; A)",
    symptom: "closes faster, opens slower",
    typical_sizes: "1 to 40 % of the solenoid's orifice area",
    confused_with: &["vent-restriction", "back-pressure"],
    source: "Kulkarni, Daigle, Gorospe, Goebel 2014",
    acts_on: ActsOn::Pneumatics,
    parameters: &[AREA],
    neutral: 0.0,
};
