//! Clock offset: measurement and command are stamped by different clocks.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange, scales};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "clock-offset",
    summary: "the clocks of measurement and command differ (a measurement effect)",
    equation: "recorded position time = true time + offset",
    symptom: "closing and opening shifted by one and the same time, either way",
    typical_sizes: "1 to 100 ms, either sign",
    confused_with: &["solenoid-lag", "sensor-lag", "dry-friction"],
    source: "definition",
    acts_on: ActsOn::Measurement,
    parameters: &[EffectParameter {
        name: "offset",
        si_unit: "s",
        meaning: "what is added to the true time",
        default: DefaultValue::Required,
        refinement: false,
        range: |valve| {
            let range = scales::delay(valve, 0.015, 0.5);
            FitRange { lower: -range.upper, ..range }
        },
    }],
    neutral: 0.0,
};
