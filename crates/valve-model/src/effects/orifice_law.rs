//! Orifice law of ISO 6358: a real orifice or valve chokes below its own
//! critical ratio, usually lower than that of an ideal nozzle, and where its edge is sharp its discharge
//! coefficient falls as the pressures meet.

use super::NoTerm;
use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, Search, fixed};
use crate::orifice::OrificeLaw;

pub(super) type Law<R> = NoTerm<R>;

/// Critical ratio of the ideal nozzle for gases of two atoms, of which the ellipse is within 0.3 % of the nozzle.
const DIATOMIC: f64 = 0.5283;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "orifice-law",
    summary: "orifices follow ISO 6358 with a critical ratio of their own",
    equation: "choked below b; above it the choked flow times sqrt(1 - ((r - b)/(1 - b))^2); all of it times 1 - s (1 - C(r)/C(0)) \
               with Perry's discharge coefficient C of a sharp edge; every orifice",
    symptom: "flow falls earlier as the pressures meet: the end of closing and of opening slower, at low supply most",
    typical_sizes: "a critical ratio of 0.1 to 0.5",
    confused_with: &["supply-droop", "gas-heating", "vent-restriction"],
    source: "ISO 6358-1:2013; sharp edges: Perry 1949, Trans. ASME 71",
    acts_on: ActsOn::Pneumatics(|values, to| {
        let law = OrificeLaw::iso_6358(to.parameters.ratio_of_specific_heats, values[0]);
        to.coefficients.law = law.with_edge(values[1]);
        to.terms.discharge |= values[1] != 0.0;
    }),
    parameters: &[
        EffectParameter {
            name: "critical_ratio",
            si_unit: "",
            meaning: "pressure ratio below which the flow is choked, b",
            default: DefaultValue::Required,
            search: Search::SizeFrom { least: DIATOMIC },
            allowed: Allowed { contains: |value| value > 0.0 && value < 1.0, words: "between 0 and 1" },
            range: |_| fixed(0.02, 0.35, 0.9),
        },
        EffectParameter {
            name: "edge_sharpness",
            si_unit: "",
            meaning: "share of the fall of a sharp edge's discharge coefficient (0.84 into a vacuum to 0.60 where the pressures \
                  meet), s: 0 for rounded orifices, 1 for sharp ones",
            default: DefaultValue::Value(0.0),
            search: Search::Share,
            allowed: Allowed { contains: |value| (0.0..=1.0).contains(&value), words: "between 0 and 1" },
            range: |_| fixed(0.0, 0.5, 1.0),
        },
    ],
    // There is no value at which the law turns into that of the ideal nozzle; leaving it out does.
    neutral: f64::NAN,
};

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::Subject;
    use crate::orifice::Laminar;

    #[test]
    fn the_flow_is_choked_below_the_critical_ratio_and_an_ellipse_above() {
        let law = Subject::with(EffectKind::ORIFICE_LAW, &[0.3]).with.coefficients.law;
        let flow = |ratio: f64| law.flow(5e5, ratio * 5e5, 1e-9, Laminar::new(1e-9));
        assert!((flow(0.25) / flow(0.1) - 1.0).abs() < 2e-3, "{}", flow(0.25) / flow(0.1));
        let expected = (1.0_f64 - ((0.65 - 0.3) / 0.7_f64).powi(2)).sqrt();
        assert!((flow(0.65) / flow(0.1) - expected).abs() < 2e-3, "{}", flow(0.65) / flow(0.1));
    }

    #[test]
    fn a_sharp_edge_lets_less_through_as_the_pressures_meet_choked_or_not() {
        let vented = |over_ambient: f64, values: &[f64]| {
            let ambient = Subject::with(EffectKind::ORIFICE_LAW, values).with.coefficients.ambient;
            let pa = over_ambient * ambient;
            Subject::with(EffectKind::ORIFICE_LAW, values).at_pressures(pa, pa).rates().pipe_mass
        };
        // Perry's coefficient at a fifth, half and nine tenths of the pressure, over 0.8414.
        for (ratio, coefficient) in [(0.2, 0.830_642), (0.5, 0.749_097), (0.9, 0.614_243)] {
            let of_rounded = vented(1.0 / ratio, &[0.3, 0.6]) / vented(1.0 / ratio, &[0.3]);
            let expected = 1.0 - 0.6 * (1.0 - coefficient / 0.8414);
            assert!((of_rounded / expected - 1.0).abs() < 1e-5, "{ratio}: {of_rounded} for {expected}");
        }
        let terms = |values: &[f64]| Subject::with(EffectKind::ORIFICE_LAW, values).with.terms;
        assert!(terms(&[0.3, 0.6]).discharge && !terms(&[0.3]).discharge);
    }
}
