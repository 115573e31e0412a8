//! Seal friction: dry friction of lip seals that the gas presses on.

use super::dry_friction::{BRISTLE_STIFFNESS_N_PER_M, bristle_stiffness};
use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange, fixed};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "seal-friction",
    summary: "friction of seals that the chamber pressure presses on",
    equation: "dry friction with F_c = s max(p_t - p_atm, 0)",
    symptom: "like dry friction, growing with the chamber pressure: larger near the closed end and at breakaway from it",
    typical_sizes: "0.5 to 5 % of the piston area",
    confused_with: &["dry-friction", "supply-droop"],
    source: "Armstrong-Hélouvry, Dupont, Canudas de Wit 1994; pressure dependence as in pneumatic cylinder seals",
    acts_on: ActsOn::Mechanics,
    parameters: &[
        EffectParameter {
            name: "friction_per_pressure",
            si_unit: "m2",
            meaning: "friction force per gauge pressure in the chamber, s",
            default: DefaultValue::Required,
            refinement: false,
            range: |valve| FitRange {
                lower: 0.0,
                typical: 0.02 * valve.piston_area_m2,
                upper: 0.5 * valve.piston_area_m2,
            },
        },
        EffectParameter {
            name: "bristle_stiffness",
            si_unit: "N/m",
            meaning: "force per travel before it slides; the softer one counts with dry friction beside it",
            default: DefaultValue::Value(BRISTLE_STIFFNESS_N_PER_M),
            refinement: true,
            range: bristle_stiffness,
        },
        EffectParameter {
            name: "opening_factor",
            si_unit: "",
            meaning: "friction while opening over that while closing",
            default: DefaultValue::Value(1.0),
            refinement: true,
            range: |_| fixed(0.2, 1.0, 5.0),
        },
    ],
    neutral: 0.0,
};
