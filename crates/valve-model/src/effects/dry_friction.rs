//! Dry friction: Coulomb, static and Stribeck friction
//! (Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30(7), 1994).

use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, FitRange, Search};
use super::scales;
use super::shared::{OPENING_FACTOR, POSITION_SLOPE, STRIBECK_VELOCITY, TYPICAL_FRICTION, bristle_stiffness, stribeck, ways};
use super::term::{Term, numbers};
use super::{Assembly, Moment};
use crate::real::Real;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "dry-friction",
    summary: "dry friction between piston, rod and their guides",
    equation: "F = -sgn(v) (F_c + (F_s - F_c) exp(-(v/v_s)^2)); at rest it holds up to F_s",
    symptom: "both strokes break away later and run slower; the closing and the opening lag by about as much pressure",
    typical_sizes: "1 to 10 % of the spring force; the static force up to twice the Coulomb force",
    confused_with: &["seal-friction", "clock-offset", "solenoid-lag"],
    source: "Armstrong-Hélouvry, Dupont, Canudas de Wit 1994",
    acts_on: ActsOn::Mechanics(add),
    parameters: &[
        EffectParameter {
            name: "coulomb_force",
            si_unit: "N",
            meaning: "friction while moving fast, F_c",
            default: DefaultValue::Required,
            search: Search::Size,
            allowed: Allowed::NON_NEGATIVE,
            range: |valve| FitRange {
                lower: 0.0,
                typical: scales::modest_force_n(valve, TYPICAL_FRICTION),
                upper: 0.61 * scales::force_n(valve),
            },
        },
        EffectParameter {
            name: "static_force",
            si_unit: "N",
            meaning: "largest force held at rest, F_s",
            default: DefaultValue::SameAs(0),
            search: Search::ExcessOver { other: 0, least: "the Coulomb force", start: 0.3 },
            allowed: Allowed::NON_NEGATIVE,
            range: |valve| FitRange {
                lower: 0.0,
                typical: 5.0 / 3.0 * scales::modest_force_n(valve, TYPICAL_FRICTION),
                upper: 0.92 * scales::force_n(valve),
            },
        },
        STRIBECK_VELOCITY,
        bristle_stiffness("force per travel before it slides"),
        OPENING_FACTOR,
        POSITION_SLOPE,
    ],
    neutral: 0.0,
};

/// Its static force is larger than its Coulomb force.
const STRIBECK: u8 = 1;

/// It depends on the direction of the motion, or on the position.
const UNEVEN: u8 = 1 << 1;

numbers! {
    /// Coulomb force F_c, N.
    coulomb: 0.0,
    /// Static force minus Coulomb force, N.
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
        let variant = at.variants.dry_friction;
        let zero = R::splat(0.0);
        let mut force = self.coulomb;
        if variant & STRIBECK != 0 {
            force = self.static_excess.mul_add(stribeck(at.state.v, self.inverse_stribeck), force);
        }
        if variant & UNEVEN == 0 {
            return sum + force;
        }
        let way = zero.select_lt(at.state.v, self.opening, self.closing);
        let place = self.slope_per_m.mul_add(at.state.x, self.at_closed).max(zero);
        (force * way).mul_add(place, sum)
    }
}

fn add(values: &[f64], to: &mut Assembly<'_>) {
    let [coulomb, at_rest, stribeck, stiffness, factor, slope] = [0, 1, 2, 3, 4, 5].map(|index| values[index]);
    let (opening, closing) = ways(factor);
    to.rubs(stiffness, "effect.dry-friction.bristle_stiffness");
    to.laws.dry_friction = Law {
        coulomb,
        static_excess: at_rest - coulomb,
        inverse_stribeck: 1.0 / stribeck,
        opening,
        closing,
        at_closed: 1.0 - 0.5 * slope,
        slope_per_m: slope / to.parameters.stroke_m,
    };
    let used = |variant: u8, is: bool| if is { variant } else { 0 };
    to.laws.variants.dry_friction = used(STRIBECK, at_rest > coulomb) | used(UNEVEN, factor != 1.0 || slope != 0.0);
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Subject, testbed};
    use super::super::{Effect, EffectKind};

    #[test]
    fn a_sliding_piston_is_held_back_by_the_law() {
        for (v, way) in [(0.01, 2.6 / 2.3), (-0.01, 2.0 / 2.3), (0.1, 2.6 / 2.3)] {
            let mut subject =
                Subject::with(EffectKind::DRY_FRICTION, &[30.0, 50.0, 0.01, 1e5, 1.3, 0.4]).moving(0.02, v);
            let place = 1.0 + 0.4 * (0.02 / testbed().stroke_m - 0.5);
            let force = v.signum() * (30.0 + 20.0 * (-(v / 0.01).powi(2)).exp()) * way * place;
            subject.state.bristle = force / 1e5;
            assert!((subject.force() + force).abs() < 1e-9, "{} N at {v} m/s", subject.force());
            assert!(subject.rates().bristle.abs() < 1e-12, "{}", subject.rates().bristle);
        }
    }

    #[test]
    fn the_static_force_is_no_less_than_the_coulomb_force() {
        let error = Effect::new(EffectKind::DRY_FRICTION, &[Some(30.0), Some(20.0)]).expect_err("less");
        assert_eq!(error.key(), "effect.dry-friction.static_force");
    }
}
