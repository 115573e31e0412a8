//! Progressive spring: a spring that hardens as it is compressed.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, fixed};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "progressive-spring",
    summary: "a spring that hardens towards the closed end",
    equation: "spring force times 1 + beta (L - x)/L",
    symptom: "right near the open end, late towards the closed end; opening starts earlier",
    typical_sizes: "a hardening of 0.01 to 0.2",
    confused_with: &["process-force", "seal-friction"],
    source: "Wahl, Mechanical Springs, 1963",
    acts_on: ActsOn::Mechanics,
    parameters: &[EffectParameter {
        name: "hardening",
        si_unit: "",
        meaning: "relative gain of spring force over the stroke, beta",
        default: DefaultValue::Required,
        refinement: false,
        range: |_| fixed(-0.5, 0.04, 1.0),
    }],
    neutral: 0.0,
};
