//! Seat adhesion: the plug sticks to its seat.

use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, FitRange, Search};
use super::scales;
use super::term::{Term, numbers};
use super::{Assembly, Moment};
use crate::demand::Cause;
use crate::real::Real;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "seat-adhesion",
    summary: "the plug sticks to its seat and has to be torn off",
    equation: "F = -F_b min(1, 1 - x/d) for x < d",
    symptom: "opening breaks away late and then jumps; closing is right but for its very last part",
    typical_sizes: "1 to 20 % of the spring force within 0.1 to 1 mm",
    confused_with: &["process-force", "dry-friction", "closing-cushion"],
    source: "Armstrong-Hélouvry, Dupont, Canudas de Wit 1994 (adhesion at break-away)",
    acts_on: ActsOn::Mechanics(add),
    parameters: &[
        EffectParameter {
            name: "force",
            si_unit: "N",
            meaning: "force that holds the plug on its seat, F_b",
            default: DefaultValue::Required,
            search: Search::Size,
            allowed: Allowed::NON_NEGATIVE,
            range: |valve| FitRange {
                lower: 0.0,
                typical: scales::modest_at_seat_n(valve, 0.0305),
                upper: 0.61 * scales::force_n(valve),
            },
        },
        EffectParameter {
            name: "reach",
            si_unit: "m",
            meaning: "distance from the seat over which it acts, d",
            default: DefaultValue::Value(0.3e-3),
            search: Search::Shape,
            allowed: Allowed::POSITIVE,
            range: |valve| FitRange {
                lower: 0.002 * valve.stroke_m,
                typical: 0.012 * valve.stroke_m,
                upper: 0.25 * valve.stroke_m,
            },
        },
    ],
    neutral: 0.0,
};

numbers! {
    /// The force on the seat F_b, N.
    force: 0.0,
    /// 1 over its reach d, 1/m.
    inverse_reach: 0.0,
}

impl<R: Real> Term<R> for Law<R> {
    #[inline(always)]
    fn force(&self, at: &Moment<'_, R>, sum: R) -> R {
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        sum - self.force * (-at.state.x).mul_add(self.inverse_reach, one).max(zero).min(one)
    }
}

fn add(values: &[f64], to: &mut Assembly<'_>) {
    to.terms.forces = true;
    to.laws.seat_adhesion = Law { force: values[0], inverse_reach: 1.0 / values[1] };
    // The force falls off as a spring that pulls.
    let swing = libm::sqrt((to.coefficients.contact + values[0] / values[1]) * to.coefficients.inverse_mass);
    to.settles(swing, Cause::effect("effect.seat-adhesion.reach", values[1], "m", -0.5));
}

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::Subject;

    #[test]
    fn it_pulls_on_the_seat_and_lets_go_within_its_reach() {
        let at = |x: f64| Subject::with(EffectKind::SEAT_ADHESION, &[40.0, 4e-4]).moving(x, 0.0).force();
        assert!((at(-1e-5) + 40.0).abs() < 1e-9, "{}", at(-1e-5));
        assert!((at(1e-4) + 30.0).abs() < 1e-9, "{}", at(1e-4));
        assert_eq!(at(5e-4), 0.0);
    }
}
