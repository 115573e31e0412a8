//! Process force: the line pressure pushes on the plug.

use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, FitRange, Search, fixed};
use super::scales;
use super::term::{Term, numbers};
use super::{Assembly, Moment};
use crate::real::Real;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "process-force",
    summary: "the pressure in the line pushes on the plug",
    equation: "F = F_0 max(0, 1 - x/L)^n (positive opens)",
    symptom: "the closed end shifts in pressure: closing late and opening early for a force that opens",
    typical_sizes: "1 to 20 % of the spring force, either sign",
    confused_with: &["progressive-spring", "seat-adhesion"],
    source: "IEC 60534-2-1; Borden (ed.), Control Valves, 1998 (unbalanced plug force)",
    acts_on: ActsOn::Mechanics(add),
    parameters: &[
        EffectParameter {
            name: "force",
            si_unit: "N",
            meaning: "force on the closed plug, F_0",
            default: DefaultValue::Required,
            search: Search::Size,
            allowed: Allowed::ANY,
            range: |valve| FitRange {
                lower: -0.61 * scales::force_n(valve),
                typical: scales::modest_force_n(valve, 0.0366),
                upper: 0.61 * scales::force_n(valve),
            },
        },
        EffectParameter {
            name: "exponent",
            si_unit: "",
            meaning: "how fast it fades as the valve opens, n",
            default: DefaultValue::Value(1.0),
            search: Search::Shape,
            allowed: Allowed::POSITIVE,
            range: |_| fixed(0.3, 1.0, 8.0),
        },
    ],
    neutral: 0.0,
};

/// Further open than this, what is left of the force is none: a power is of a number above 0.
const SHUT: f64 = 1e-300;

/// The force fades with an exponent other than 1.
const CURVED: u8 = 1;

numbers! {
    /// The force on the closed plug F_0, N.
    force: 0.0,
    /// How it fades, n.
    exponent: 1.0,
}

impl<R: Real> Term<R> for Law<R> {
    #[inline(always)]
    fn force(&self, at: &Moment<'_, R>, sum: R) -> R {
        let shut = (-at.state.x).mul_add(at.base.inverse_stroke, R::splat(1.0)).max(R::splat(0.0));
        if at.variants.process_force & CURVED == 0 {
            return sum + self.force * shut;
        }
        sum + self.force * shut.max(R::splat(SHUT)).power(self.exponent)
    }
}

fn add(values: &[f64], to: &mut Assembly<'_>) {
    to.terms.forces = true;
    to.laws.process_force = Law { force: values[0], exponent: values[1] };
    to.laws.variants.process_force = if values[1] == 1.0 { 0 } else { CURVED };
}

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::{Subject, testbed};

    #[test]
    fn it_fades_as_the_valve_opens() {
        let at = |share: f64, exponent: f64| {
            let subject = Subject::with(EffectKind::PROCESS_FORCE, &[-60.0, exponent]);
            subject.moving(share * testbed().stroke_m, 0.0).force()
        };
        assert!((at(0.25, 1.0) + 45.0).abs() < 1e-9, "{}", at(0.25, 1.0));
        assert!((at(0.75, 0.5) + 30.0).abs() < 1e-9, "{}", at(0.75, 0.5));
        assert!(at(1.0, 3.0).abs() < 1e-9);
    }
}
