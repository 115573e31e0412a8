//! Solenoid lag: the spool answers late and takes time to travel.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, scales};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "solenoid-lag",
    summary: "the solenoid answers late and its spool takes time to travel",
    equation: "after each edge a dead time, then a linear travel s: supply port s A, vent port (1 - s) A",
    symptom: "the whole stroke comes late by a constant time, at every pressure",
    typical_sizes: "delays of 5 to 60 ms, travel of 5 to 100 ms",
    confused_with: &["clock-offset", "sensor-lag", "dry-friction"],
    source: "Beater, Pneumatic Drives, 2007 (switching times); ISO 12238",
    acts_on: ActsOn::Solenoid,
    parameters: &[
        EffectParameter {
            name: "energise_delay",
            si_unit: "s",
            meaning: "dead time after the command to close",
            default: DefaultValue::Value(0.0),
            refinement: false,
            range: |valve| scales::delay(valve, 0.02, 1.0),
        },
        EffectParameter {
            name: "deenergise_delay",
            si_unit: "s",
            meaning: "dead time after the command to open",
            default: DefaultValue::Value(0.0),
            refinement: false,
            range: |valve| scales::delay(valve, 0.02, 1.0),
        },
        EffectParameter {
            name: "travel_time",
            si_unit: "s",
            meaning: "time of a full travel of the spool",
            default: DefaultValue::Value(0.0),
            refinement: false,
            range: |valve| scales::delay(valve, 0.02, 1.0),
        },
    ],
    neutral: 0.0,
};
