//! What the tests of runs have in common: the valve of the pneumatic test bed, and a run of it.
#![allow(dead_code, reason = "each test target uses a part of it")]

use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{
    CommandEdge, Conditions, Effect, EffectKind, Orientation, Parameters, Prepared, Run, Start, Switches, Trajectory,
    Valve, simulate,
};

/// The test bed's parameters (Kulkarni et al. 2014).
pub fn testbed() -> Parameters {
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

pub fn valve_of(parameters: Parameters, effects: Vec<Effect>) -> Valve {
    Valve::new(parameters, Switches::default(), effects, Vec::new()).expect("a possible valve")
}

/// An effect with its leading parameters.
pub fn effect(kind: EffectKind, values: &[f64]) -> Effect {
    let given: Vec<_> = values.iter().copied().map(Some).collect();
    Effect::new(kind, &given).expect("possible values")
}

pub fn close_at(time_s: f64) -> CommandEdge {
    CommandEdge::new(time_s, true)
}

pub fn open_at(time_s: f64) -> CommandEdge {
    CommandEdge::new(time_s, false)
}

/// A run at the valve's own supply pressure.
pub fn run_of(valve: &Valve, commands: Vec<CommandEdge>, end_s: f64) -> Run {
    Run { conditions: Conditions::nominal(valve.parameters()), commands, end_s, prescribed: None, start: Start::Rest }
}

/// The nodes of a run with its pressures.
pub fn nodes_of(valve: &Valve, run: &Run) -> Trajectory {
    let mut found = Trajectory::default();
    simulate(&[Prepared::new(valve, run, DEFAULT_STEP_S)], true, |_, nodes, _| found = nodes.clone());
    found
}

/// Position, m, chamber and pipe pressure, Pa, at a time.
pub fn at(nodes: &Trajectory, time_s: f64) -> [f64; 3] {
    let (mut position, mut chamber, mut pipe) = (Vec::new(), Vec::new(), Vec::new());
    nodes.positions_at(&[time_s], &mut position);
    nodes.pressures_at(&nodes.chamber_pressure_pa, &[time_s], &mut chamber);
    nodes.pressures_at(&nodes.pipe_pressure_pa, &[time_s], &mut pipe);
    [position[0], chamber[0], pipe[0]]
}
