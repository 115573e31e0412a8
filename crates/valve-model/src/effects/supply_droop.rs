//! Supply droop: the line before the solenoid resists the flow.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange, scales};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "supply-droop",
    summary: "the supply pressure at the solenoid falls while it fills",
    equation: "V/(R T) p' = (p_s - p)/R_d - flow; starts at p_s; solenoid and supply leak draw from it",
    symptom: "closing late, more so at high supply pressure; opening is right",
    typical_sizes: "a droop of 1 to 20 % at full flow",
    confused_with: &["orifice-law", "seal-friction", "vent-restriction"],
    source: "mass balance of a line with a linear resistance; Beater, Pneumatic Drives, 2007",
    acts_on: ActsOn::Pneumatics,
    parameters: &[
        EffectParameter {
            name: "resistance",
            si_unit: "Pa s/kg",
            meaning: "pressure drop per mass flow, R_d",
            default: DefaultValue::Required,
            refinement: false,
            range: |valve| {
                let scale = valve.supply_pressure_pa / scales::flow_kg_per_s(valve);
                FitRange { lower: 0.0, typical: 0.04 * scale, upper: 2.0 * scale }
            },
        },
        EffectParameter {
            name: "line_volume",
            si_unit: "m3",
            meaning: "volume between resistance and solenoid, V",
            default: DefaultValue::Value(20e-6),
            refinement: false,
            range: |valve| {
                let scale = scales::volume_m3(valve);
                FitRange { lower: 0.0067 * scale, typical: 0.134 * scale, upper: 13.4 * scale }
            },
        },
    ],
    neutral: 0.0,
};
