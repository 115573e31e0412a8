//! Dry friction: Coulomb, static and Stribeck friction
//! (Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30(7), 1994).

use super::{ActsOn, DefaultValue, EffectInfo, EffectParameter, FitRange, fixed, scales};
use crate::params::Parameters;

/// Stiffness of the friction bristles unless said otherwise, N/m: elastomer seals give by a tenth of a millimetre
/// before they slide (some 100 N over 0.5 mm), which shows in a recorded stroke.
pub(crate) const BRISTLE_STIFFNESS_N_PER_M: f64 = 2e5;

/// A typical Coulomb force is this share of the largest force on the piston: clearly visible, and nothing sticks.
const TYPICAL: f64 = 0.01828;

/// How stiff the bristles are, for any friction that has them.
pub(super) const fn bristles(meaning: &'static str) -> EffectParameter {
    EffectParameter {
        name: "bristle_stiffness",
        si_unit: "N/m",
        meaning,
        default: DefaultValue::Value(BRISTLE_STIFFNESS_N_PER_M),
        refinement: true,
        range: bristle_stiffness,
    }
}

/// How much a friction depends on which way the piston goes.
pub(super) const OPENING_FACTOR: EffectParameter = EffectParameter {
    name: "opening_factor",
    si_unit: "",
    meaning: "friction while opening over that while closing",
    default: DefaultValue::Value(1.0),
    refinement: true,
    range: |_| fixed(0.2, 1.0, 5.0),
};

/// Stiffnesses with which a typical friction gives by 5 % of the stroke before it slides, and by 1/10,000 of it.
fn bristle_stiffness(valve: &Parameters) -> FitRange {
    let per_metre = scales::modest_force_n(valve, TYPICAL) / valve.stroke_m;
    FitRange {
        lower: (20.0 * per_metre).min(0.1 * BRISTLE_STIFFNESS_N_PER_M),
        typical: BRISTLE_STIFFNESS_N_PER_M,
        upper: (1e4 * per_metre).max(10.0 * BRISTLE_STIFFNESS_N_PER_M),
    }
}

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
            refinement: false,
            range: |valve| FitRange {
                lower: 0.0,
                typical: scales::modest_force_n(valve, TYPICAL),
                upper: 0.61 * scales::force_n(valve),
            },
        },
        EffectParameter {
            name: "static_force",
            si_unit: "N",
            meaning: "largest force held at rest, F_s",
            default: DefaultValue::SameAs(0),
            refinement: false,
            range: |valve| FitRange {
                lower: 0.0,
                typical: 5.0 / 3.0 * scales::modest_force_n(valve, TYPICAL),
                upper: 0.92 * scales::force_n(valve),
            },
        },
        EffectParameter {
            name: "stribeck_velocity",
            si_unit: "m/s",
            meaning: "velocity over which static turns into Coulomb friction, v_s",
            default: DefaultValue::Value(0.01),
            refinement: false,
            // What the seals and their grease make it, between far below and far above the speed of a stroke.
            range: |valve| {
                let speed = scales::speed_m_per_s(valve);
                FitRange { lower: (0.0068 * speed).min(1e-4), typical: 0.01, upper: (20.0 * speed).max(0.3) }
            },
        },
        bristles("force per travel before it slides"),
        OPENING_FACTOR,
        EffectParameter {
            name: "position_slope",
            si_unit: "",
            meaning: "relative change of the friction from closed to open, a: times 1 + a (x/L - 1/2)",
            default: DefaultValue::Value(0.0),
            refinement: true,
            range: |_| fixed(-1.8, 0.0, 1.8),
        },
    ],
    neutral: 0.0,
};
