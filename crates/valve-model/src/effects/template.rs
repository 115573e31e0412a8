//! Rod leak: gas escapes past the rod's gland, from the chamber to the atmosphere (laminar flow through a gap).
//!
//! A template: no part of the catalogue, compiled for the tests of this crate. A new effect starts as a copy.

use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, FitRange, Search};
use super::term::{Term, numbers};
use super::{Assembly, Moment, scales};
use crate::real::Real;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "template",
    summary: "one line: what it is",
    equation: "the chamber loses G (p_t - p_atm)",
    symptom: "what it does to a stroke: closes late, opens early",
    typical_sizes: "what is met in practice",
    confused_with: &["leak-to-atmosphere"],
    source: "author, year, equation",
    acts_on: ActsOn::Pneumatics(add),
    parameters: &[EffectParameter {
        name: "conductance",
        si_unit: "kg/(s Pa)",
        meaning: "flow per pressure, G",
        allowed: Allowed::NON_NEGATIVE,
        default: DefaultValue::Required,
        range: |valve| {
            let scale = scales::flow_kg_per_s(valve) / scales::gauge_pa(valve);
            FitRange { lower: 0.0, typical: 0.02 * scale, upper: scale }
        },
        search: Search::Size,
    }],
    neutral: 0.0,
};

numbers! {
    /// Flow per pressure G, kg/(s Pa).
    conductance: 0.0,
}

impl<R: Real> Term<R> for Law<R> {
    #[inline(always)]
    fn chamber_flow(&self, at: &Moment<'_, R>, sum: R) -> R {
        sum - self.conductance * (at.chamber - at.base.ambient)
    }
}

fn add(values: &[f64], to: &mut Assembly<'_>) {
    to.terms.flows = true;
    to.laws.template = Law { conductance: values[0] };
}

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::Subject;

    #[test]
    fn the_chamber_loses_what_the_pressure_pushes_out() {
        let subject = Subject::with(EffectKind::TEMPLATE, &[2e-10]).at_pressures(3e5, 3e5);
        let loss = subject.change(|rate| rate.chamber_mass);
        assert!((loss + 2e-10 * (3e5 - 101_325.0)).abs() < 1e-15, "{loss}");
        assert_eq!(subject.change(|rate| rate.pipe_mass), 0.0);
    }
}
