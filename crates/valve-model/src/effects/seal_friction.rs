//! Seal friction: dry friction of lip seals that the gas presses on.

use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, FitRange, Search};
use super::shared::{OPENING_FACTOR, POSITION_SLOPE, STRIBECK_VELOCITY, bristle_stiffness, stribeck, ways};
use super::term::{Term, numbers};
use super::{Assembly, Moment};
use crate::real::Real;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "seal-friction",
    summary: "friction of seals that the chamber pressure presses on",
    equation: "dry friction with F_c = s max(p_t - p_atm, 0) and F_s = s_0 max(p_t - p_atm, 0)",
    symptom: "like dry friction, growing with the chamber pressure: larger near the closed end and at breakaway from it",
    typical_sizes: "0.5 to 5 % of the piston area",
    confused_with: &["dry-friction", "supply-droop"],
    source: "Armstrong-Hélouvry, Dupont, Canudas de Wit 1994; pressure dependence as in pneumatic cylinder seals",
    acts_on: ActsOn::Mechanics(add),
    parameters: &[
        EffectParameter {
            name: "friction_per_pressure",
            si_unit: "m2",
            meaning: "friction force per gauge pressure in the chamber, s",
            default: DefaultValue::Required,
            search: Search::Size,
            allowed: Allowed::NON_NEGATIVE,
            range: |valve| FitRange {
                lower: 0.0,
                typical: 0.02 * valve.piston_area_m2,
                upper: 0.5 * valve.piston_area_m2,
            },
        },
        EffectParameter {
            name: "static_friction_per_pressure",
            si_unit: "m2",
            meaning: "the largest held at rest, s_0",
            default: DefaultValue::SameAs(0),
            search: Search::ExcessOver { other: 0, least: "the friction while sliding", start: 0.3 },
            allowed: Allowed::NON_NEGATIVE,
            range: |valve| FitRange {
                lower: 0.0,
                typical: 0.026 * valve.piston_area_m2,
                upper: 0.75 * valve.piston_area_m2,
            },
        },
        STRIBECK_VELOCITY,
        bristle_stiffness("force per travel before it slides; the softer one counts with dry friction beside it"),
        OPENING_FACTOR,
        POSITION_SLOPE,
    ],
    neutral: 0.0,
};

/// It holds more at rest than while sliding.
const STRIBECK: u8 = 1;

/// It depends on the direction of the motion, or on the position.
const UNEVEN: u8 = 1 << 1;

numbers! {
    /// Friction per gauge pressure in the chamber s, m2.
    per_pressure: 0.0,
    /// How much more of it there is at rest, m2.
    static_excess: 0.0,
    /// 1 over the Stribeck velocity v_s, s/m.
    inverse_stribeck: 0.0,
    /// What it is multiplied by while opening.
    opening: 1.0,
    /// And while closing.
    closing: 1.0,
    /// What it is multiplied by at the closed stop.
    at_closed: 1.0,
    /// By how much that rises with the position, 1/m.
    slope_per_m: 0.0,
}

impl<R: Real> Term<R> for Law<R> {
    #[inline(always)]
    fn friction(&self, at: &Moment<'_, R>, sum: R) -> R {
        let zero = R::splat(0.0);
        let variant = at.variants.seal_friction;
        let pressing = (at.chamber - at.base.ambient).max(zero);
        let mut per_pressure = self.per_pressure;
        if variant & STRIBECK != 0 {
            per_pressure = self.static_excess.mul_add(stribeck(at.state.v, self.inverse_stribeck), per_pressure);
        }
        if variant & UNEVEN == 0 {
            return per_pressure.mul_add(pressing, sum);
        }
        let way = zero.select_lt(at.state.v, self.opening, self.closing);
        let place = self.slope_per_m.mul_add(at.state.x, self.at_closed).max(zero);
        (per_pressure * pressing * way).mul_add(place, sum)
    }
}

fn add(values: &[f64], to: &mut Assembly<'_>) {
    let [per_pressure, at_rest, stribeck, stiffness, factor, slope] = [0, 1, 2, 3, 4, 5].map(|index| values[index]);
    let (opening, closing) = ways(factor);
    to.rubs(stiffness, "effect.seal-friction.bristle_stiffness");
    to.laws.seal_friction = Law {
        per_pressure,
        static_excess: at_rest - per_pressure,
        inverse_stribeck: 1.0 / stribeck,
        opening,
        closing,
        at_closed: 1.0 - 0.5 * slope,
        slope_per_m: slope / to.parameters.stroke_m,
    };
    let used = |variant: u8, is: bool| if is { variant } else { 0 };
    to.laws.variants.seal_friction =
        used(STRIBECK, at_rest > per_pressure) | used(UNEVEN, factor != 1.0 || slope != 0.0);
}

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::{Subject, testbed};

    #[test]
    fn it_grows_with_the_pressure_in_the_chamber() {
        for (v, way) in [(0.05, 1.6 / 1.8), (-0.05, 2.0 / 1.8)] {
            let values = [6e-5, 9e-5, 0.03, 3e5, 0.8, 0.4];
            let mut subject = Subject::with(EffectKind::SEAL_FRICTION, &values).moving(0.01, v);
            subject = subject.at_pressures(3e5, 3e5);
            let place = 1.0 + 0.4 * (0.01 / testbed().stroke_m - 0.5);
            let per_pressure = 6e-5 + 3e-5 * (-(v / 0.03_f64).powi(2)).exp();
            let force = v.signum() * per_pressure * (3e5 - testbed().ambient_pressure_pa) * way * place;
            subject.state.bristle = force / 3e5;
            assert!((subject.force() + force).abs() < 1e-9, "{} N at {v} m/s", subject.force());
        }
    }
}
