//! Vent restriction: the exhaust path passes less than the fill path.
//!
//! Two orifices one behind the other are again one by ISO 6358-3:2014, with a lower critical
//! ratio: one that lies behind the vent holds back most where the pressures are close, and least while the vent chokes.

use super::Assembly;
use super::info::{ActsOn, Allowed, DefaultValue, EffectInfo, EffectParameter, Search, fixed};
use super::term::{Term, numbers};
use crate::real::Real;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "vent-restriction",
    summary: "the exhaust path is narrower than the fill path (a silencer, dirt)",
    equation: "vent area = area factor times the solenoid's orifice area; while it chokes, (area factor)^(1 - share behind) \
               times that; between, ellipses over the pressure ratio as in ISO 6358",
    symptom: "opening slower by the same factor at every pressure, or, behind a silencer, most as it ends; closing is right",
    typical_sizes: "a factor of 0.5 to 0.98",
    confused_with: &["back-pressure", "gas-heating"],
    source: "orifice law of the base model with a second area; orifices in series: ISO 6358-3:2014",
    acts_on: ActsOn::Pneumatics(add),
    parameters: &[
        EffectParameter {
            name: "area_factor",
            si_unit: "",
            meaning: "vent area over fill area",
            default: DefaultValue::Required,
            search: Search::Size,
            allowed: Allowed::POSITIVE,
            range: |_| fixed(0.05, 0.92, 1.0),
        },
        EffectParameter {
            name: "share_behind",
            si_unit: "",
            meaning: "share of the restriction (of its logarithm) that a choked vent does not feel, since it lies behind it: \
                      0 for dirt in the vent, 1 for a silencer wider than it",
            default: DefaultValue::Value(0.0),
            search: Search::Share,
            allowed: Allowed { contains: |value| (0.0..=1.0).contains(&value), words: "between 0 and 1" },
            range: |_| fixed(0.0, 0.5, 1.0),
        },
    ],
    neutral: 1.0,
};

/// The vent may choke at this relative pressure difference at most.
const WIDEST: f64 = 0.98;

/// Relative pressure differences below this count as this: the factor does not change any more.
const LEAST: f64 = 1e-9;

numbers! {
    /// How much wider the relative pressure difference is at which the vent chokes.
    wider: 1.0,
}

impl<R: Real> Term<R> for Law<R> {
    #[inline(always)]
    fn vent(&self, difference: R, widest: R, factor: R) -> R {
        let (one, two) = (R::splat(1.0), R::splat(2.0));
        let difference = difference.max(R::splat(LEAST));
        let own = (widest * self.wider).min(R::splat(WIDEST));
        let inverse = one / (widest * own);
        let to_own = (difference * (widest * inverse)).min(one);
        let to_orifice = (difference * (own * inverse)).min(one);
        factor * ((to_own * (two - to_own)) / (to_orifice * (two - to_orifice))).sqrt()
    }
}

fn add(values: &[f64], to: &mut Assembly<'_>) {
    let [area, behind] = [values[0], values[1]];
    let choked = libm::pow(area, 1.0 - behind);
    to.coefficients.vent *= choked;
    if choked > area {
        to.terms.vent = true;
        to.laws.vent_restriction = Law { wider: (choked / area).powi(2) };
    }
}

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::Subject;

    /// The flow through the vent as a share of that without the effect.
    fn of_without(subject: &Subject) -> f64 {
        let with = subject.rates().pipe_mass;
        with / (with - subject.change(|rate| rate.pipe_mass))
    }

    #[test]
    fn only_the_vent_path_is_narrower() {
        let subject = Subject::with(EffectKind::VENT_RESTRICTION, &[0.8]);
        let (with, without) = (&subject.with.coefficients, &subject.without.coefficients);
        assert_eq!((with.vent, with.fill), (0.8 * without.vent, without.fill));
        assert_eq!(subject.with.terms, subject.without.terms);
    }

    #[test]
    fn behind_the_vent_it_counts_where_pressures_are_close() {
        // While it chokes a factor of 0.95 is left.
        const SHARE: f64 = 0.770_132;
        let vented = |chamber: f64, values: &[f64]| {
            let subject = Subject::with(EffectKind::VENT_RESTRICTION, values).at_pressures(chamber, chamber);
            of_without(&subject)
        };
        assert!((vented(8e5, &[0.8, SHARE]) - 0.95).abs() < 1e-6, "{}", vented(8e5, &[0.8, SHARE]));
        assert!((vented(1.02e5, &[0.8, SHARE]) - 0.8).abs() < 2e-3, "{}", vented(1.02e5, &[0.8, SHARE]));
        let between = vented(1.6e5, &[0.8, SHARE]);
        assert!((0.81..0.94).contains(&between), "{between}");
    }

    #[test]
    fn two_orifices_in_series_are_one() {
        // A silencer of twice the vent's area, each by the ellipse of ISO 6358 with the critical ratio of nitrogen.
        let b = 0.5283;
        let flow = |area: f64, from: f64, to: f64| {
            let over = ((to / from - b) / (1.0 - b)).max(0.0);
            area * from * (1.0 - over * over).max(0.0).sqrt()
        };
        let ambient = 101_325.0;
        let in_series = |pipe: f64| {
            let (mut low, mut high) = (ambient, pipe);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if flow(1.0, pipe, middle) > flow(2.0, middle, ambient) { low = middle } else { high = middle }
            }
            flow(1.0, pipe, low) / flow(1.0, pipe, ambient)
        };
        // Areas in series: 1/sqrt(1 + 1/4) where pressures are close; the silencer does not hold back a choked vent.
        let values = [1.25_f64.sqrt().recip(), 1.0];
        for pipe in [1.05e5, 1.2e5, 1.5e5, 1.8e5, 2.2e5, 3e5, 6e5] {
            let subject = Subject::with(EffectKind::VENT_RESTRICTION, &values).at_pressures(pipe, pipe);
            let ours = of_without(&subject);
            assert!((ours / in_series(pipe) - 1.0).abs() < 0.03, "{pipe} Pa: {ours} for {}", in_series(pipe));
        }
    }
}
