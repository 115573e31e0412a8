//! Orifice law of ISO 6358: a real orifice or valve chokes below its own
//! critical ratio, usually lower than that of an ideal nozzle.

use super::NoTerm;
use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, Search, fixed};
use crate::orifice::OrificeLaw;

pub(super) type Law<R> = NoTerm<R>;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "orifice-law",
    summary: "orifices follow ISO 6358 with a critical ratio of their own",
    equation: "choked below b; above it the choked flow times sqrt(1 - ((r - b)/(1 - b))^2); every orifice",
    symptom: "flow falls earlier as the pressures meet: the end of closing and of opening slower, at low supply most",
    typical_sizes: "a critical ratio of 0.1 to 0.5",
    confused_with: &["supply-droop", "gas-heating", "vent-restriction"],
    source: "ISO 6358-1:2013",
    acts_on: ActsOn::Pneumatics(|values, to| {
        to.coefficients.law = OrificeLaw::iso_6358(to.parameters.ratio_of_specific_heats, values[0]);
    }),
    parameters: &[EffectParameter {
        name: "critical_ratio",
        si_unit: "",
        meaning: "pressure ratio below which the flow is choked, b",
        default: DefaultValue::Required,
        search: Search::SizeAbout { scale: 0.1 },
        allowed: Allowed { contains: |value| value > 0.0 && value < 1.0, words: "between 0 and 1" },
        range: |_| fixed(0.02, 0.35, 0.9),
    }],
    // There is no value at which the law turns into that of the ideal nozzle; leaving it out does.
    neutral: f64::NAN,
};

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::Subject;
    use crate::orifice::Blend;

    #[test]
    fn the_flow_is_choked_below_the_critical_ratio_and_an_ellipse_above() {
        let law = Subject::with(EffectKind::ORIFICE_LAW, &[0.3]).with.coefficients.law;
        let flow = |ratio: f64| law.flow(5e5, ratio * 5e5, 1e-9, Blend::new(1e-9));
        assert!((flow(0.25) / flow(0.1) - 1.0).abs() < 2e-3, "{}", flow(0.25) / flow(0.1));
        let expected = (1.0_f64 - ((0.65 - 0.3) / 0.7_f64).powi(2)).sqrt();
        assert!((flow(0.65) / flow(0.1) - expected).abs() < 2e-3, "{}", flow(0.65) / flow(0.1));
    }
}
