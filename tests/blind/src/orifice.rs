//! Gas through a sharp hole: the isentropic nozzle, or the ISO 6358 ellipse.
//!
//! The mass flow is written as `C A p_up / sqrt(Z R T_up)` times a number that depends on the
//! pressure ratio alone (the outflow function of the nozzle). Near equal pressures that number
//! rises with a vertical tangent; within a hundred-thousandth of the upstream pressure it is
//! replaced by a chord, which shifts no timing that can be measured.

/// Relative pressure difference below which the flow is taken as proportional to it.
const CHORD: f64 = 1e-5;

/// What one side of an orifice sees.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gas {
    /// Absolute pressure.
    pub pressure_pa: f64,
    /// Temperature.
    pub temperature_k: f64,
}

/// The outflow function of every orifice of one valve.
#[derive(Debug, Clone)]
pub(crate) struct Outflow {
    inverse_gamma: f64,
    critical_ratio: f64,
    sonic: f64,
    nozzle_scale: f64,
    ellipse_ratio: Option<f64>,
    perry_share: f64,
    chord_value: f64,
    gas_constant: f64,
}

/// Discharge coefficient of a sharp-edged orifice over the ratio of downstream to upstream pressure, 1 into a
/// vacuum (J. A. Perry, "Critical flow through sharp-edged orifices", Trans. ASME 71, 1949, as a polynomial).
fn perry(ratio: f64) -> f64 {
    const POWERS: [f64; 6] = [0.8414, -0.1002, 0.8415, -3.9, 4.6001, -1.6827];
    POWERS.iter().rev().fold(0.0, |sum, power| sum * ratio + power) / POWERS[0]
}

impl Outflow {
    /// `gas_constant` is Z R in J/(kg K); `ellipse_ratio` is the critical ratio of ISO 6358 where
    /// that law holds; `perry_share` is how much of Perry's dependence the discharge coefficient has.
    pub fn new(gamma: f64, gas_constant: f64, ellipse_ratio: Option<f64>, perry_share: f64) -> Self {
        let shrink = 2.0 / (gamma + 1.0);
        let mut law = Self {
            inverse_gamma: 1.0 / gamma,
            critical_ratio: shrink.powf(gamma / (gamma - 1.0)),
            sonic: (gamma * shrink.powf((gamma + 1.0) / (gamma - 1.0))).sqrt(),
            nozzle_scale: 2.0 * gamma / (gamma - 1.0),
            ellipse_ratio,
            perry_share,
            chord_value: 0.0,
            gas_constant,
        };
        law.chord_value = law.number(1.0 - CHORD);
        law
    }

    /// The dimensionless flow at the ratio of downstream to upstream pressure, chord left aside.
    fn number(&self, ratio: f64) -> f64 {
        if self.perry_share == 0.0 {
            return self.nominal_number(ratio);
        }
        self.nominal_number(ratio) * (1.0 + self.perry_share * (perry(ratio) - 1.0))
    }

    fn nominal_number(&self, ratio: f64) -> f64 {
        if let Some(b) = self.ellipse_ratio {
            let along = ((ratio - b) / (1.0 - b)).max(0.0);
            return self.sonic * (1.0 - along * along).max(0.0).sqrt();
        }
        if ratio <= self.critical_ratio {
            return self.sonic;
        }
        let w = ratio.powf(self.inverse_gamma);
        (self.nozzle_scale * w * (w - ratio)).max(0.0).sqrt()
    }

    /// Mass flow in kg/s from `a` to `b` (negative when it runs the other way) through the area
    /// `effective_m2`, flow coefficient included.
    pub fn mass_flow(&self, effective_m2: f64, a: Gas, b: Gas) -> f64 {
        let (up, down, sign) =
            if a.pressure_pa >= b.pressure_pa { (a, b.pressure_pa, 1.0) } else { (b, a.pressure_pa, -1.0) };
        let ratio = down / up.pressure_pa;
        let number = if ratio > 1.0 - CHORD { self.chord_value * (1.0 - ratio) / CHORD } else { self.number(ratio) };
        sign * effective_m2 * up.pressure_pa * number / (self.gas_constant * up.temperature_k).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(pressure_pa: f64) -> Gas {
        Gas { pressure_pa, temperature_k: 293.15 }
    }

    #[test]
    fn the_two_laws_agree_when_choked_and_reverse_with_the_pressures() {
        let nozzle = Outflow::new(1.4, 296.8, None, 0.0);
        let ellipse = Outflow::new(1.4, 296.8, Some(0.3), 0.0);
        let (high, low) = (at(6e5), at(1e5));
        let forward = nozzle.mass_flow(1e-6, high, low);
        assert!((forward / ellipse.mass_flow(1e-6, high, low) - 1.0).abs() < 1e-12);
        assert_eq!(forward, -nozzle.mass_flow(1e-6, low, high));
        // 0.6847 p / sqrt(R T) is the textbook value for a diatomic gas.
        assert!((forward - 0.6847 * 0.6 / (296.8_f64 * 293.15).sqrt()).abs() < 1e-7);
    }

    #[test]
    fn the_chord_joins_the_law_without_a_step() {
        let nozzle = Outflow::new(1.4, 296.8, None, 0.0);
        let inside = nozzle.mass_flow(1e-6, at(5e5), at(5e5 * (1.0 - CHORD * 0.999_999)));
        let outside = nozzle.mass_flow(1e-6, at(5e5), at(5e5 * (1.0 - CHORD * 1.000_001)));
        assert!((inside / outside - 1.0).abs() < 1e-5);
        assert_eq!(nozzle.mass_flow(1e-6, at(5e5), at(5e5)), 0.0);
    }

    #[test]
    fn a_sharp_edge_passes_less_near_equal_pressures_and_as_much_into_a_vacuum() {
        let nozzle = Outflow::new(1.4, 296.8, None, 0.0);
        let sharp = Outflow::new(1.4, 296.8, None, 1.0);
        let share = |down: f64| sharp.mass_flow(1e-6, at(5e5), at(down)) / nozzle.mass_flow(1e-6, at(5e5), at(down));
        assert!((share(1e-3) - 1.0).abs() < 1e-6);
        // Perry's coefficient falls from 0.84 to 0.60.
        assert!((share(4.99e5) - 0.713).abs() < 5e-3, "{}", share(4.99e5));
    }
}
