//! The base model once more, as plainly as its equations: one valve, standard powers, no lanes.
//!
//! It shares no code with the model under test. Benches take it for the pace of a straightforward
//! program, tests with a tight step for an independent solution.

use valve_model::{Conditions, Parameters, Schedule};

/// Position, velocity, gas in chamber and pipe.
type State = [f64; 4];

/// Relative pressure difference within which the flow is a line, which bounds its slope.
pub const TIGHT_BLEND: f64 = 1e-5;

/// The base model of a valve under some conditions.
pub struct Plain<'a> {
    parameters: &'a Parameters,
    conditions: &'a Conditions,
    blend: f64,
    zrt: f64,
    critical: f64,
    /// 2/(Z R T) gamma/(gamma - 1).
    factor: f64,
}

impl<'a> Plain<'a> {
    /// A valve in the upright position.
    pub fn new(parameters: &'a Parameters, conditions: &'a Conditions, blend: f64) -> Self {
        let gamma = parameters.ratio_of_specific_heats;
        let zrt = parameters.compressibility * parameters.specific_gas_constant_j_per_kg_k * conditions.temperature_k;
        let critical = (2.0 / (gamma + 1.0)).powf(gamma / (gamma - 1.0));
        Self { parameters, conditions, blend, zrt, critical, factor: 2.0 / zrt * gamma / (gamma - 1.0) }
    }

    /// Mass flow through an orifice (Kulkarni et al. 2014, eq. 8), kg/s.
    fn flow(&self, p1: f64, p2: f64, area: f64) -> f64 {
        if p1 < p2 {
            return -self.flow(p2, p1, area);
        }
        let p = self.parameters;
        let nozzle = |ratio: f64| {
            let w = ratio.powf(1.0 / p.ratio_of_specific_heats);
            p.flow_coefficient * area * p1 * (self.factor * w * (w - ratio)).sqrt()
        };
        let ratio = p2 / p1;
        if 1.0 - ratio < self.blend {
            return nozzle(1.0 - self.blend) * (1.0 - ratio) / self.blend;
        }
        nozzle(ratio.max(self.critical))
    }

    fn rates(&self, [x, v, chamber_mass, pipe_mass]: State, closing: bool) -> State {
        let (p, c) = (self.parameters, self.conditions);
        let zrt = self.zrt;
        let chamber = chamber_mass * zrt / (p.dead_volume_m3 + p.piston_area_m2 * (p.stroke_m - x));
        let pipe = pipe_mass * zrt / p.pipe_volume_m3;
        let beyond = if x < 0.0 { x } else { (x - p.stroke_m).max(0.0) };
        let force = p.spring_stiffness_n_per_m * (p.stroke_m - x + p.preload_compression_m)
            - (chamber - p.ambient_pressure_pa) * p.piston_area_m2
            - p.viscous_friction_n_s_per_m * v
            - p.moving_mass_kg * 9.806_65
            - p.contact_stiffness_n_per_m * beyond;
        let upstream = if closing { c.supply_pressure_pa } else { p.ambient_pressure_pa };
        let port = self.flow(pipe, chamber, p.port_orifice_area_m2);
        let into_pipe = self.flow(upstream, pipe, p.solenoid_orifice_area_m2) - port
            + self.flow(c.supply_pressure_pa, pipe, c.leak_from_supply_m2)
            - self.flow(pipe, p.ambient_pressure_pa, c.leak_to_atmosphere_m2);
        [v, force / p.moving_mass_kg, port, into_pipe]
    }

    /// One step of the classical fourth-order Runge-Kutta method.
    pub fn step(&self, state: State, closing: bool, step_s: f64) -> State {
        let ahead = |rate: State, share: f64| core::array::from_fn(|i| state[i] + share * step_s * rate[i]);
        let k1 = self.rates(state, closing);
        let k2 = self.rates(ahead(k1, 0.5), closing);
        let k3 = self.rates(ahead(k2, 0.5), closing);
        let k4 = self.rates(ahead(k3, 1.0), closing);
        core::array::from_fn(|i| state[i] + step_s / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    }

    /// The open, vented state of rest without a leak.
    pub fn rest(&self) -> State {
        let (p, zrt) = (self.parameters, self.zrt);
        let spring = p.spring_stiffness_n_per_m;
        let force = spring * p.preload_compression_m - p.moving_mass_kg * 9.806_65;
        let x = p.stroke_m + force / (spring + p.contact_stiffness_n_per_m);
        let volume = p.dead_volume_m3 + p.piston_area_m2 * (p.stroke_m - x);
        [x, 0.0, p.ambient_pressure_pa * volume / zrt, p.ambient_pressure_pa * p.pipe_volume_m3 / zrt]
    }

    /// Closing and opening time of the first cycle from rest.
    pub fn cycle(&self, schedule: &Schedule, step_s: f64) -> [Option<f64>; 2] {
        let mut state = self.rest();
        let mut times = [None; 2];
        let legs = [(true, schedule.open_at_s - schedule.close_at_s), (false, schedule.end_s - schedule.open_at_s)];
        for ((closing, length), time_s) in legs.into_iter().zip(&mut times) {
            // Above 0 until the valve gets there.
            let left = |x: f64| if closing { x } else { self.parameters.stroke_m - x };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a positive count of steps")]
            let steps = (length / step_s).round() as usize;
            for index in 0..steps {
                let next = self.step(state, closing, step_s);
                if time_s.is_none() && left(next[0]) <= 0.0 {
                    let (from, to) = (left(state[0]).max(0.0), left(next[0]));
                    let share = if from == to { 0.0 } else { from / (from - to) };
                    *time_s = Some((index as f64 + share) * step_s);
                }
                state = next;
            }
        }
        times
    }
}
