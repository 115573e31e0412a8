//! Sensor lag: a slow position sensor; no physics of the valve.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, scales};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "sensor-lag",
    summary: "the position sensor or its filter is slow (a measurement effect)",
    equation: "tau y' = x - y, y the recorded position",
    symptom: "every recorded motion comes late by the time constant and its corners are rounded; pressures are right",
    typical_sizes: "2 to 50 ms",
    confused_with: &["solenoid-lag", "clock-offset"],
    source: "first-order lag",
    acts_on: ActsOn::Measurement,
    parameters: &[EffectParameter {
        name: "time_constant",
        si_unit: "s",
        meaning: "time constant of the sensor",
        default: DefaultValue::Required,
        refinement: false,
        range: |valve| scales::delay(valve, 0.015, 0.5),
    }],
    neutral: 0.0,
};
