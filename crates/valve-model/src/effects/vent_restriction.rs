//! Vent restriction: the exhaust path passes less than the fill path.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, fixed};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "vent-restriction",
    summary: "the exhaust path is narrower than the fill path (a silencer, dirt)",
    equation: "vent area = area factor times the solenoid's orifice area",
    symptom: "opening slower by the same factor at every pressure; closing is right",
    typical_sizes: "a factor of 0.5 to 0.98",
    confused_with: &["back-pressure", "gas-heating"],
    source: "orifice law of the base model with a second area",
    acts_on: ActsOn::Pneumatics,
    parameters: &[EffectParameter {
        name: "area_factor",
        si_unit: "",
        meaning: "vent area over fill area",
        default: DefaultValue::Required,
        refinement: false,
        range: |_| fixed(0.05, 0.92, 1.0),
    }],
    neutral: 1.0,
};
