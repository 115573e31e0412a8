//! Sensor lag: a slow position sensor; no physics of the valve.

use super::NoTerm;
use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, Search};
use super::scales;

pub(super) type Law<R> = NoTerm<R>;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "sensor-lag",
    summary: "the position sensor or its filter is slow (a measurement effect)",
    equation: "tau y' = x - y, y the recorded position",
    symptom: "every recorded motion comes late by the time constant and its corners are rounded; pressures are right",
    typical_sizes: "2 to 50 ms",
    confused_with: &["solenoid-lag", "clock-offset"],
    source: "first-order lag",
    acts_on: ActsOn::Measurement(|values, to| to.lag_s = values[0]),
    parameters: &[EffectParameter {
        name: "time_constant",
        si_unit: "s",
        meaning: "time constant of the sensor",
        default: DefaultValue::Required,
        search: Search::Size,
        allowed: Allowed::NON_NEGATIVE,
        range: |valve| scales::delay(valve, 0.015, 0.5),
    }],
    neutral: 0.0,
};

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::valve_with;
    use crate::measurement::Measurement;

    #[test]
    fn the_record_is_slow() {
        let instruments = valve_with(EffectKind::SENSOR_LAG, &[0.015]).measurement();
        assert_eq!(instruments, Measurement { lag_s: 0.015, ..Measurement::default() });
    }
}
