//! What the tests of the effects have in common: the valve of the pneumatic test bed with one effect, at one state.

use super::{Effect, EffectKind};
use crate::conditions::Conditions;
use crate::equations::Equations;
use crate::params::{Orientation, Parameters, Switches};
use crate::rhs::System;
use crate::state::{Inputs, State};
use crate::terms::groups;
use crate::valve::Valve;

const STEP_S: f64 = 1e-3;

/// The test bed's parameters (Kulkarni et al. 2014).
pub(super) fn testbed() -> Parameters {
    Parameters {
        moving_mass_kg: 1.5,
        stroke_m: 25.4e-3,
        piston_area_m2: 31.17e-4,
        dead_volume_m3: 30e-6,
        viscous_friction_n_s_per_m: 600.0,
        spring_stiffness_n_per_m: 16e3,
        preload_compression_m: 36e-3,
        contact_stiffness_n_per_m: 1e6,
        stop_damping_n_s_per_m: 0.0,
        ratio_of_specific_heats: 1.4,
        specific_gas_constant_j_per_kg_k: 296.8,
        compressibility: 1.0,
        supply_pressure_pa: 75.0 * 6894.757 + 101_325.0,
        ambient_pressure_pa: 101_325.0,
        temperature_k: 293.15,
        pipe_volume_m3: 40e-6,
        flow_coefficient: 0.86,
        solenoid_orifice_area_m2: 0.5e-6,
        port_orifice_area_m2: 3.488_372e-6,
        orientation: Orientation::Upright,
    }
}

fn valve_of(effects: Vec<Effect>) -> Valve {
    Valve::new(testbed(), Switches::default(), effects, Vec::new()).expect("possible")
}

fn effect(kind: EffectKind, values: &[f64]) -> Effect {
    let given: Vec<_> = values.iter().copied().map(Some).collect();
    Effect::new(kind, &given).expect("possible values")
}

/// The test bed with an effect of these leading values.
pub(super) fn valve_with(kind: EffectKind, values: &[f64]) -> Valve {
    valve_of(vec![effect(kind, values)])
}

/// A valve with one effect, beside the same without, at one state.
pub(super) struct Subject {
    pub with: Equations,
    pub without: Equations,
    pub state: State<f64>,
    pub inputs: Inputs<f64>,
}

impl Subject {
    /// The test bed with an effect of these leading values, half open, at rest, at atmospheric pressure, vented.
    pub fn with(kind: EffectKind, values: &[f64]) -> Self {
        let equations = |effects: Vec<Effect>| {
            let valve = valve_of(effects);
            Equations::new(&valve, &Conditions::nominal(valve.parameters()), STEP_S)
        };
        let (with, without) = (equations(vec![effect(kind, values)]), equations(Vec::new()));
        let temperature = without.coefficients.temperature;
        let state = State {
            x: 0.5 * without.coefficients.stroke,
            chamber_temperature: temperature,
            pipe_temperature: temperature,
            line_pressure: without.coefficients.supply,
            ..State::ZERO
        };
        let inputs = Inputs { supply_pressure: without.coefficients.supply, ..Inputs::default() };
        let ambient = without.coefficients.ambient;
        Self { with, without, state, inputs }.at_pressures(ambient, ambient)
    }

    /// At another position, m, and velocity, m/s, under the same pressures.
    pub fn moving(mut self, x: f64, v: f64) -> Self {
        let volume = |x: f64| self.without.coefficients.closed_volume - self.without.coefficients.piston_area * x;
        self.state.chamber_mass *= volume(x) / volume(self.state.x);
        (self.state.x, self.state.v) = (x, v);
        self
    }

    /// With these pressures, Pa.
    pub fn at_pressures(mut self, chamber: f64, pipe: f64) -> Self {
        let c = &self.without.coefficients;
        self.state.chamber_mass = chamber * (c.closed_volume - c.piston_area * self.state.x) / c.zrt;
        self.state.pipe_mass = pipe / c.pipe_gain;
        self
    }

    /// The rates of change with the effect.
    pub fn rates(&self) -> State<f64> {
        System::<f64>::new(&self.with).rates::<{ groups::ANY }>(&self.state, &self.inputs)
    }

    /// What the effect changes of a rate.
    pub fn change(&self, of: impl Fn(&State<f64>) -> f64) -> f64 {
        let without = System::<f64>::new(&self.without).rates::<{ groups::ANY }>(&self.state, &self.inputs);
        of(&self.rates()) - of(&without)
    }

    /// The force that the effect adds to the piston, N.
    pub fn force(&self) -> f64 {
        self.change(|rate| rate.v) * self.without.coefficients.mass
    }
}
