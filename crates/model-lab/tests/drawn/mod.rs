//! Valves as they leave the workshop: their values off by what is tolerated.

use valve_file::Tolerance;
use valve_model::Valve;

use crate::recorded::Noise;

/// A valve whose tolerated parameters were drawn from their tolerances, and those draws.
pub fn drawn(valve: &Valve, tolerances: &[Tolerance], noise: &mut Noise) -> (Valve, Vec<f64>) {
    let mut parameters = valve.parameters().clone();
    let mut truth = Vec::new();
    for tolerance in tolerances {
        let value = parameters.get(tolerance.parameter) * (tolerance.relative_sigma * noise.normal()).exp();
        parameters.set(tolerance.parameter, value);
        truth.push(value);
    }
    let drawn = Valve::new(parameters, valve.switches(), Vec::new(), Vec::new()).expect("a possible valve");
    (drawn, truth)
}
