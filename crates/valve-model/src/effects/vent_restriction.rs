//! Vent restriction: the exhaust path passes less than the fill path.

use super::NoTerm;
use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, Search, fixed};

pub(super) type Law<R> = NoTerm<R>;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "vent-restriction",
    summary: "the exhaust path is narrower than the fill path (a silencer, dirt)",
    equation: "vent area = area factor times the solenoid's orifice area",
    symptom: "opening slower by the same factor at every pressure; closing is right",
    typical_sizes: "a factor of 0.5 to 0.98",
    confused_with: &["back-pressure", "gas-heating"],
    source: "orifice law of the base model with a second area",
    acts_on: ActsOn::Pneumatics(|values, to| to.coefficients.vent *= values[0]),
    parameters: &[EffectParameter {
        name: "area_factor",
        si_unit: "",
        meaning: "vent area over fill area",
        default: DefaultValue::Required,
        search: Search::Size,
        allowed: Allowed::POSITIVE,
        range: |_| fixed(0.05, 0.92, 1.0),
    }],
    neutral: 1.0,
};

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::Subject;

    #[test]
    fn only_the_vent_path_is_narrower() {
        let subject = Subject::with(EffectKind::VENT_RESTRICTION, &[0.8]);
        let (with, without) = (&subject.with.coefficients, &subject.without.coefficients);
        assert_eq!((with.vent, with.fill), (0.8 * without.vent, without.fill));
    }
}
