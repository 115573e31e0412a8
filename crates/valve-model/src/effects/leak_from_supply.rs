//! Leak from the supply: it fed the pipe from the start, a worn seat of the solenoid.

use super::NoTerm;
use super::info::{ActsOn, EffectInfo};
use super::shared::STANDING_LEAK;

pub(super) type Law<R> = NoTerm<R>;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "leak-from-supply",
    summary: "a standing leak from the supply into the pipe",
    equation: "the pipe gains f(p_s, p_p; A)",
    symptom: "closes faster, opens slower",
    typical_sizes: "1 to 40 % of the solenoid's orifice area",
    confused_with: &["vent-restriction", "back-pressure"],
    source: "Kulkarni, Daigle, Gorospe, Goebel 2014",
    acts_on: ActsOn::Pneumatics(|values, to| to.coefficients.leak_in += to.orifice(values[0])),
    parameters: &[STANDING_LEAK],
    neutral: 0.0,
};

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::Subject;

    #[test]
    fn the_supply_leaks_through_an_orifice_of_that_area() {
        let subject = Subject::with(EffectKind::LEAK_FROM_SUPPLY, &[0.1e-6]).at_pressures(4e5, 4e5);
        let (with, without) = (&subject.with.coefficients, &subject.without.coefficients);
        // The solenoid's orifice has 0.5 mm2.
        assert!((with.leak_in / without.fill - 0.2).abs() < 1e-12);
        assert!(subject.change(|rate| rate.pipe_mass) > 0.0);
    }
}
