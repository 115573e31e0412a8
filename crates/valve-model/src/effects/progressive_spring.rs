//! Progressive spring: a spring that hardens as it is compressed.

use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, Search, fixed};
use super::term::{Term, numbers};
use super::{Assembly, Moment};
use crate::real::Real;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "progressive-spring",
    summary: "a spring that hardens towards the closed end",
    equation: "spring force times 1 + beta (L - x)/L",
    symptom: "right near the open end, late towards the closed end; opening starts earlier",
    typical_sizes: "a hardening of 0.01 to 0.2",
    confused_with: &["process-force", "seal-friction"],
    source: "Wahl, Mechanical Springs, 1963",
    acts_on: ActsOn::Mechanics(add),
    parameters: &[EffectParameter {
        name: "hardening",
        si_unit: "",
        meaning: "relative gain of spring force over the stroke, beta",
        default: DefaultValue::Required,
        search: Search::Size,
        allowed: Allowed { contains: |value| value > -1.0, words: "more than -1" },
        range: |_| fixed(-0.5, 0.04, 1.0),
    }],
    neutral: 0.0,
};

numbers! {
    /// Hardening over stroke, 1/m.
    hardening_per_m: 0.0,
}

impl<R: Real> Term<R> for Law<R> {
    #[inline(always)]
    fn spring(&self, at: &Moment<'_, R>, force: R) -> R {
        force * self.hardening_per_m.mul_add(at.base.stroke - at.state.x, R::splat(1.0))
    }
}

fn add(values: &[f64], to: &mut Assembly<'_>) {
    to.terms.forces = true;
    to.laws.progressive_spring = Law { hardening_per_m: values[0] / to.parameters.stroke_m };
}

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::{Subject, testbed};

    #[test]
    fn the_spring_is_as_much_harder_as_it_is_compressed() {
        let p = testbed();
        let subject = Subject::with(EffectKind::PROGRESSIVE_SPRING, &[0.1]).moving(0.25 * p.stroke_m, 0.0);
        let spring = p.spring_stiffness_n_per_m * (0.75 * p.stroke_m + p.preload_compression_m);
        assert!((subject.force() - 0.075 * spring).abs() < 1e-9, "{}", subject.force());
    }
}
