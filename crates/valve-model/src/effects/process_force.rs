//! Process force: the line pressure pushes on the plug.

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange, fixed, scales};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "process-force",
    summary: "the pressure in the line pushes on the plug",
    equation: "F = F_0 max(0, 1 - x/L)^n (positive opens)",
    symptom: "the closed end shifts in pressure: closing late and opening early for a force that opens",
    typical_sizes: "1 to 20 % of the spring force, either sign",
    confused_with: &["progressive-spring", "seat-adhesion"],
    source: "IEC 60534-2-1; Borden (ed.), Control Valves, 1998 (unbalanced plug force)",
    acts_on: ActsOn::Mechanics,
    parameters: &[
        EffectParameter {
            name: "force",
            si_unit: "N",
            meaning: "force on the closed plug, F_0",
            default: DefaultValue::Required,
            refinement: false,
            range: |valve| FitRange {
                lower: -0.61 * scales::force_n(valve),
                typical: scales::modest_force_n(valve, 0.0366),
                upper: 0.61 * scales::force_n(valve),
            },
        },
        EffectParameter {
            name: "exponent",
            si_unit: "",
            meaning: "how fast it fades as the valve opens, n",
            default: DefaultValue::Value(1.0),
            refinement: false,
            range: |_| fixed(0.3, 1.0, 8.0),
        },
    ],
    neutral: 0.0,
};
