//! Leak to atmosphere: the pipe leaked from the start.

use super::NoTerm;
use super::info::{ActsOn, EffectInfo};
use super::shared::STANDING_LEAK;

pub(super) type Law<R> = NoTerm<R>;

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "leak-to-atmosphere",
    summary: "a standing leak from the pipe to atmosphere",
    equation: "the pipe loses f(p_p, p_atm; A)",
    symptom: "closes slower, opens faster",
    typical_sizes: "1 to 50 % of the solenoid's orifice area",
    confused_with: &["supply-droop", "orifice-law"],
    source: "Kulkarni, Daigle, Gorospe, Goebel 2014",
    acts_on: ActsOn::Pneumatics(|values, to| to.coefficients.leak_out += to.orifice(values[0])),
    parameters: &[STANDING_LEAK],
    neutral: 0.0,
};

#[cfg(test)]
mod tests {
    use super::super::EffectKind;
    use super::super::testing::Subject;

    #[test]
    fn the_pipe_leaks_through_an_orifice_of_that_area() {
        let subject = Subject::with(EffectKind::LEAK_TO_ATMOSPHERE, &[0.1e-6]).at_pressures(4e5, 4e5);
        let (with, without) = (&subject.with.coefficients, &subject.without.coefficients);
        // The solenoid's orifice has 0.5 mm2.
        assert!((with.leak_out / without.vent - 0.2).abs() < 1e-12);
        assert!(subject.change(|rate| rate.pipe_mass) < 0.0);
    }
}
