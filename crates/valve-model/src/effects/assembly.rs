//! The equations of a valve while effects are added to them.

use super::Laws;
use crate::coefficients::Coefficients;
use crate::demand::{Cause, Demand, FOLLOWED_RATE};
use crate::params::Parameters;
use crate::terms::Terms;

/// The equations of a valve while effects are added to them: each changes the numbers of the base equations, or
/// brings its own with a term.
#[derive(Debug)]
pub struct Assembly<'a> {
    /// The valve's parameters.
    pub parameters: &'a Parameters,
    /// The numbers of the base equations.
    pub coefficients: &'a mut Coefficients<f64>,
    pub(crate) laws: &'a mut Laws<f64>,
    pub(crate) terms: &'a mut Terms,
    pub(crate) demands: &'a mut Vec<Demand>,
    /// Whose bristles count.
    pub(crate) bristles: &'a mut Option<Cause>,
    /// Whose line it is.
    pub(crate) line: &'a mut Option<Cause>,
}

impl Assembly<'_> {
    /// The coefficient of an orifice, kg/(s Pa), from its geometric area, m².
    #[must_use]
    pub fn orifice(&self, area_m2: f64) -> f64 {
        self.parameters.flow_coefficient * area_m2 / libm::sqrt(self.coefficients.zrt)
    }

    /// Adds a friction with bristles of this stiffness, N/m, under its key in the valve file. Frictions side by side
    /// share bristles, as stiff as the geometric mean of what each says: whichever says it, it counts smoothly, so that a fit
    /// can tell.
    pub(crate) fn rubs(&mut self, stiffness_n_per_m: f64, key: &'static str) {
        self.terms.friction = true;
        let given = self.coefficients.bristle_stiffness;
        let is_first = given.is_infinite();
        if is_first || stiffness_n_per_m > given {
            *self.bristles = Some(Cause::effect(key, stiffness_n_per_m, "N/m", 0.5));
        }
        self.coefficients.bristle_stiffness =
            if is_first { stiffness_n_per_m } else { libm::sqrt(given * stiffness_n_per_m) };
    }

    /// Gives the supply a line with a pressure of its own, which rises by this much for the gas that stays in it,
    /// Pa/kg; and what to blame where it follows too fast.
    pub(crate) fn feeds_through_line(&mut self, gain_pa_per_kg: f64, cause: Cause) {
        self.terms.line = true;
        self.coefficients.line_gain = gain_pa_per_kg;
        *self.line = Some(cause);
    }

    /// Says that the effect brings in a rate, 1/s, which the step has to follow.
    pub(crate) fn settles(&mut self, rate: f64, cause: Cause) {
        self.demands.push(Demand { rate, limit: FOLLOWED_RATE, cause });
    }
}
