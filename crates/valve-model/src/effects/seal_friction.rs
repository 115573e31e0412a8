//! Seal friction: dry friction of lip seals that the gas presses on.

use super::dry_friction::{OPENING_FACTOR, bristles};
use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange};

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
        bristles("force per travel before it slides; the softer one counts with dry friction beside it"),
        OPENING_FACTOR,
    ],
    neutral: 0.0,
};
