//! Cushion at the closed end: damping that grows towards the stop.

use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, FitRange, Search};
use super::scales;
use super::term::{Term, numbers};
use super::{Assembly, Moment};
use crate::real::Real;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "closing-cushion",
    summary: "a cushion that brakes the last millimetres before the closed stop",
    equation: "F = -c v max(0, 1 - d/l), d >= 0 the distance from the closed stop (0 beyond it)",
    symptom: "the stroke slows down before the closed stop, and leaves it more slowly",
    typical_sizes: "1 to 20 times the viscous friction over 2 to 8 mm",
    confused_with: &["seat-adhesion", "process-force"],
    source: "Beater, Pneumatic Drives, 2007, chapter on end cushioning",
    acts_on: ActsOn::Mechanics(add),
    parameters: &[
        EffectParameter {
            name: "damping",
            si_unit: "N s/m",
            meaning: "damping at the stop, c",
            default: DefaultValue::Required,
            search: Search::Size,
            allowed: Allowed::NON_NEGATIVE,
            range: |valve| {
                let scale = scales::force_n(valve) / scales::speed_m_per_s(valve);
                FitRange { lower: 0.0, typical: 0.0165 * scale, upper: 1.65 * scale }
            },
        },
        EffectParameter {
            name: "length",
            si_unit: "m",
            meaning: "distance from the stop over which it acts, l",
            default: DefaultValue::Value(4e-3),
            search: Search::Shape,
            allowed: Allowed::POSITIVE,
            range: |valve| FitRange {
                lower: 0.01 * valve.stroke_m,
                typical: 0.16 * valve.stroke_m,
                upper: valve.stroke_m,
            },
        },
    ],
    neutral: 0.0,
};

numbers! {
    /// Damping at the stop c, N s/m.
    damping: 0.0,
    /// 1 over the length l, 1/m.
    inverse_length: 0.0,
}

impl<R: Real> Term<R> for Law<R> {
    #[inline(always)]
    fn damping(&self, at: &Moment<'_, R>, sum: R) -> R {
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        let from_closed = at.state.x.max(zero);
        sum + self.damping * (-from_closed).mul_add(self.inverse_length, one).max(zero)
    }
}

fn add(values: &[f64], to: &mut Assembly<'_>) {
    to.terms.forces = true;
    to.laws.closing_cushion = Law { damping: values[0], inverse_length: 1.0 / values[1] };
}

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::Subject;

    #[test]
    fn it_brakes_near_the_closed_stop_alone() {
        let at = |x: f64| Subject::with(EffectKind::CLOSING_CUSHION, &[1500.0, 4e-3]).moving(x, -0.1).force();
        assert!((at(1e-3) - 0.75 * 150.0).abs() < 1e-9, "{}", at(1e-3));
        assert!((at(-1e-5) - 150.0).abs() < 1e-9, "no more beyond the stop: {}", at(-1e-5));
        assert_eq!(at(5e-3), 0.0);
    }
}
