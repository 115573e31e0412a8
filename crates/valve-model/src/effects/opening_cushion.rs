//! Cushion at the open end: damping that grows towards the stop.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange, scales};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "opening-cushion",
    summary: "a cushion that brakes the last millimetres before the open stop",
    equation: "F = -c v max(0, 1 - d/l), d >= 0 the distance from the open stop (0 beyond it)",
    symptom: "the stroke slows down before the open stop, and leaves it more slowly",
    typical_sizes: "1 to 20 times the viscous friction over 2 to 8 mm",
    confused_with: &["vent-restriction", "process-force"],
    source: "Beater, Pneumatic Drives, 2007, chapter on end cushioning",
    acts_on: ActsOn::Mechanics,
    parameters: &[
        EffectParameter {
            name: "damping",
            si_unit: "N s/m",
            meaning: "damping at the stop, c",
            default: DefaultValue::Required,
            refinement: false,
            range: |valve| {
                let scale = scales::force_n(valve) / scales::speed_m_per_s(valve);
                FitRange { lower: 0.0, typical: 0.0165 * scale, upper: 1.65 * scale }
            },
        },
        EffectParameter {
            name: "length",
            si_unit: "m",
            meaning: "distance from the stop over which it acts, l",
            default: DefaultValue::Value(4e-3),
            refinement: false,
            range: |valve| FitRange {
                lower: 0.01 * valve.stroke_m,
                typical: 0.16 * valve.stroke_m,
                upper: valve.stroke_m,
            },
        },
    ],
    neutral: 0.0,
};
