//! Dry friction: Coulomb, static and Stribeck friction
//! (Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30(7), 1994).

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange, fixed, spring_force_n};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "dry-friction",
    summary: "dry friction between piston, rod and their guides",
    equation: "F = -sgn(v) (F_c + (F_s - F_c) exp(-(v/v_s)^2)); at rest it holds up to F_s",
    symptom: "both strokes break away later and run slower; the closing and the opening lag by about as much pressure",
    typical_sizes: "1 to 10 % of the spring force; the static force up to twice the Coulomb force",
    confused_with: &["seal-friction", "clock-offset", "solenoid-lag"],
    source: "Armstrong-Hélouvry, Dupont, Canudas de Wit 1994",
    acts_on: ActsOn::Mechanics,
    parameters: &[
        EffectParameter {
            name: "coulomb_force",
            si_unit: "N",
            meaning: "friction while moving fast, F_c",
            default: DefaultValue::Required,
            range: |valve| FitRange { lower: 0.0, typical: 0.03 * spring_force_n(valve), upper: spring_force_n(valve) },
        },
        EffectParameter {
            name: "static_force",
            si_unit: "N",
            meaning: "largest force held at rest, F_s",
            default: DefaultValue::SameAs(0),
            range: |valve| FitRange {
                lower: 0.0,
                typical: 0.05 * spring_force_n(valve),
                upper: 1.5 * spring_force_n(valve),
            },
        },
        EffectParameter {
            name: "stribeck_velocity",
            si_unit: "m/s",
            meaning: "velocity over which static turns into Coulomb friction, v_s",
            default: DefaultValue::Value(0.01),
            range: |_| fixed(1e-4, 0.01, 0.3),
        },
    ],
    neutral: 0.0,
};
