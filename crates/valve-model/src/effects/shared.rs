//! Parameters that more than one effect has.

use super::info::{Allowed, DefaultValue, EffectParameter, FitRange, Search, fixed};
use super::scales;
use crate::bristles;
use crate::params::Parameters;
use crate::real::Real;

/// A typical Coulomb force is this share of the largest force on the piston: clearly visible, and nothing sticks.
pub(super) const TYPICAL_FRICTION: f64 = 0.01828;

/// How stiff the bristles of a friction are.
pub(super) const fn bristle_stiffness(meaning: &'static str) -> EffectParameter {
    EffectParameter {
        name: "bristle_stiffness",
        si_unit: "N/m",
        meaning,
        allowed: Allowed::POSITIVE,
        default: DefaultValue::Value(bristles::STIFFNESS_N_PER_M),
        range: bristle_range,
        search: Search::Refinement,
    }
}

/// Stiffnesses with which a typical friction gives by 5 % of the stroke before it slides, and by 1/10,000 of it.
fn bristle_range(valve: &Parameters) -> FitRange {
    let per_metre = scales::modest_force_n(valve, TYPICAL_FRICTION) / valve.stroke_m;
    FitRange {
        lower: (20.0 * per_metre).min(0.1 * bristles::STIFFNESS_N_PER_M),
        typical: bristles::STIFFNESS_N_PER_M,
        upper: (1e4 * per_metre).max(10.0 * bristles::STIFFNESS_N_PER_M),
    }
}

/// The speed that parts sticking from sliding: what the seals and their grease make it, between far below and far above the
/// speed of a stroke.
pub(super) const STRIBECK_VELOCITY: EffectParameter = EffectParameter {
    name: "stribeck_velocity",
    si_unit: "m/s",
    meaning: "velocity over which static turns into Coulomb friction, v_s",
    default: DefaultValue::Value(0.01),
    search: Search::Shape,
    allowed: Allowed::POSITIVE,
    range: |valve| {
        let speed = scales::speed_m_per_s(valve);
        FitRange { lower: (0.0068 * speed).min(1e-4), typical: 0.01, upper: (20.0 * speed).max(0.3) }
    },
};

/// How much of what a friction holds at rest beyond its sliding force is left at a speed, `inverse_stribeck` being 1 over the Stribeck
/// velocity.
#[inline(always)]
pub(super) fn stribeck<R: Real>(speed: R, inverse_stribeck: R) -> R {
    let ratio = speed * inverse_stribeck;
    (ratio * ratio).exp_of_negative()
}

/// How much a friction depends on which way the piston goes. Its size is the mean of both, which motions of both kinds tell
/// best: at a factor a, 2 a/(1 + a) times that while opening and 2/(1 + a) times while closing.
pub(super) const OPENING_FACTOR: EffectParameter = EffectParameter {
    name: "opening_factor",
    si_unit: "",
    meaning: "friction opening over that closing, of the same mean",
    allowed: Allowed::NON_NEGATIVE,
    default: DefaultValue::Value(1.0),
    range: |_| fixed(0.2, 1.0, 5.0),
    search: Search::Refinement,
};

/// What a friction is multiplied by while opening and while closing.
pub(super) fn ways(opening_factor: f64) -> (f64, f64) {
    (2.0 * opening_factor / (1.0 + opening_factor), 2.0 / (1.0 + opening_factor))
}

/// How much a friction changes along the stroke, as a bore does that is worn or not quite round.
pub(super) const POSITION_SLOPE: EffectParameter = EffectParameter {
    name: "position_slope",
    si_unit: "",
    meaning: "relative change of the friction from closed to open, a: times 1 + a (x/L - 1/2)",
    allowed: Allowed { contains: |value| value.abs() <= 2.0, words: "between -2 and 2" },
    default: DefaultValue::Value(0.0),
    range: |_| fixed(-1.8, 0.0, 1.8),
    search: Search::Refinement,
};

/// The area of a leak that was there from the start.
pub(super) const STANDING_LEAK: EffectParameter = EffectParameter {
    name: "area",
    si_unit: "m2",
    meaning: "geometric area of the leak",
    allowed: Allowed::NON_NEGATIVE,
    default: DefaultValue::Required,
    range: |valve| {
        let area = valve.solenoid_orifice_area_m2;
        FitRange { lower: 0.0, typical: 0.05 * area, upper: 2.0 * area }
    },
    search: Search::Size,
};
