//! Solenoid lag: the spool answers late and takes time to travel.

use super::NoTerm;
use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, Search};
use super::scales;
use crate::command::Solenoid;

pub(super) type Law<R> = NoTerm<R>;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "solenoid-lag",
    summary: "the solenoid answers late and its spool takes time to travel",
    equation: "after each edge a dead time, then a linear travel s: supply port s A, vent port (1 - s) A",
    symptom: "the whole stroke comes late by a constant time, at every pressure",
    typical_sizes: "delays of 5 to 60 ms, travel of 5 to 100 ms",
    confused_with: &["clock-offset", "sensor-lag", "dry-friction"],
    source: "Beater, Pneumatic Drives, 2007 (switching times); ISO 12238",
    acts_on: ActsOn::Solenoid(|values, to| {
        *to = Solenoid { energise_delay_s: values[0], deenergise_delay_s: values[1], travel_time_s: values[2] };
    }),
    parameters: &[
        EffectParameter {
            name: "energise_delay",
            si_unit: "s",
            meaning: "dead time after the command to close",
            default: DefaultValue::Value(0.0),
            search: Search::Size,
            allowed: Allowed::NON_NEGATIVE,
            range: |valve| scales::delay(valve, 0.02, 1.0),
        },
        EffectParameter {
            name: "deenergise_delay",
            si_unit: "s",
            meaning: "dead time after the command to open",
            default: DefaultValue::Value(0.0),
            search: Search::Size,
            allowed: Allowed::NON_NEGATIVE,
            range: |valve| scales::delay(valve, 0.02, 1.0),
        },
        EffectParameter {
            name: "travel_time",
            si_unit: "s",
            meaning: "time of a full travel of the spool",
            default: DefaultValue::Value(0.0),
            search: Search::Size,
            allowed: Allowed::NON_NEGATIVE,
            range: |valve| scales::delay(valve, 0.02, 1.0),
        },
    ],
    neutral: 0.0,
};

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::valve_with;
    use crate::command::Solenoid;

    #[test]
    fn the_solenoid_has_its_delays_and_its_travel() {
        let solenoid = valve_with(EffectKind::SOLENOID_LAG, &[0.02, 0.03, 0.05]).solenoid();
        let expected = Solenoid { energise_delay_s: 0.02, deenergise_delay_s: 0.03, travel_time_s: 0.05 };
        assert_eq!(solenoid, expected);
    }

    #[test]
    fn it_is_neutral_with_all_times_at_0_only() {
        let neutral = |values: &[f64]| valve_with(EffectKind::SOLENOID_LAG, values).effects()[0].is_neutral();
        assert!(neutral(&[0.0, 0.0, 0.0]) && !neutral(&[0.0, 0.0, 0.01]) && !neutral(&[0.0, 0.01, 0.0]));
    }
}
