//! What may change from run to run on one valve.

use crate::params::{ParameterError, Parameters};

/// The conditions of one run, SI; pressures absolute, areas geometric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// Supply pressure, Pa absolute.
    pub supply_pressure_pa: f64,
    /// Temperature of gas, walls, supply and atmosphere, K.
    pub temperature_k: f64,
    /// Area of a leak from the pipe to atmosphere, m².
    pub leak_to_atmosphere_m2: f64,
    /// Area of a leak from the supply into the pipe, m².
    pub leak_from_supply_m2: f64,
}

impl Conditions {
    /// The valve file's own supply pressure and temperature, no leak.
    pub fn nominal(parameters: &Parameters) -> Self {
        Self {
            supply_pressure_pa: parameters.supply_pressure_pa,
            temperature_k: parameters.temperature_k,
            leak_to_atmosphere_m2: 0.0,
            leak_from_supply_m2: 0.0,
        }
    }

    /// Checks that every value is possible.
    pub fn check(&self) -> Result<(), ParameterError> {
        let checks = [
            ("supply_pressure", self.supply_pressure_pa, "Pa", self.supply_pressure_pa > 0.0, "more than 0"),
            ("temperature", self.temperature_k, "K", self.temperature_k > 0.0, "more than 0"),
            ("leak_to_atmosphere", self.leak_to_atmosphere_m2, "m2", self.leak_to_atmosphere_m2 >= 0.0, "0 or more"),
            ("leak_from_supply", self.leak_from_supply_m2, "m2", self.leak_from_supply_m2 >= 0.0, "0 or more"),
        ];
        match checks.into_iter().find(|(_, value, _, fine, _)| !fine || !value.is_finite()) {
            Some((key, value, unit, _, expected)) => {
                Err(ParameterError::OutOfDomain { key: key.into(), value, unit, expected: expected.into() })
            }
            None => Ok(()),
        }
    }
}
