//! Back pressure: the exhaust ends above atmosphere.

use super::NoTerm;
use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, FitRange, Search};
use super::scales;

pub(super) type Law<R> = NoTerm<R>;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "back-pressure",
    summary: "the exhaust ends in a header above atmospheric pressure",
    equation: "the solenoid vents to p_atm + p_b; the vented start is at that pressure too",
    symptom: "opening slows down towards its end; closing starts a little earlier",
    typical_sizes: "2 to 50 kPa gauge",
    confused_with: &["vent-restriction", "opening-cushion"],
    source: "orifice law of the base model with another downstream pressure",
    acts_on: ActsOn::Pneumatics(|values, to| to.coefficients.exhaust += values[0]),
    parameters: &[EffectParameter {
        name: "pressure",
        si_unit: "Pa",
        meaning: "exhaust pressure above atmosphere, p_b (gauge)",
        default: DefaultValue::Required,
        search: Search::Size,
        allowed: Allowed::NON_NEGATIVE,
        range: |valve| {
            let span = scales::gauge_pa(valve);
            FitRange { lower: 0.0, typical: scales::modest_back_pressure_pa(valve, 0.015), upper: 0.4 * span }
        },
    }],
    neutral: 0.0,
};

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::Subject;

    #[test]
    fn the_exhaust_is_above_the_atmosphere() {
        let subject = Subject::with(EffectKind::BACK_PRESSURE, &[1e4]);
        let (with, without) = (&subject.with.coefficients, &subject.without.coefficients);
        assert_eq!((with.exhaust, with.ambient), (without.ambient + 1e4, without.ambient));
    }
}
