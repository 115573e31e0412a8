//! The states that the equations of motion advance, and what acts on them from outside.

use crate::real::Real;
use crate::terms::groups;

/// The state of a valve.
#[derive(Debug, Clone, Copy)]
pub struct State<R> {
    /// Position x, m: 0 closed, L open.
    pub x: R,
    /// Velocity, m/s.
    pub v: R,
    /// Gas in the chamber, kg.
    pub chamber_mass: R,
    /// Gas in the pipe, kg.
    pub pipe_mass: R,
    /// Gas temperature in the chamber, K.
    pub chamber_temperature: R,
    /// Gas temperature in the pipe, K.
    pub pipe_temperature: R,
    /// Pressure of the supply line, Pa.
    pub line_pressure: R,
    /// Deflection of the friction bristles, m.
    pub bristle: R,
}

impl State<f64> {
    /// All zero: a rate of change before any is known.
    pub(crate) const ZERO: Self = State {
        x: 0.0,
        v: 0.0,
        chamber_mass: 0.0,
        pipe_mass: 0.0,
        chamber_temperature: 0.0,
        pipe_temperature: 0.0,
        line_pressure: 0.0,
        bristle: 0.0,
    };
}

impl<R: Real> State<R> {
    /// The same state in every lane.
    pub fn splat(from: &State<f64>) -> Self {
        State {
            x: R::splat(from.x),
            v: R::splat(from.v),
            chamber_mass: R::splat(from.chamber_mass),
            pipe_mass: R::splat(from.pipe_mass),
            chamber_temperature: R::splat(from.chamber_temperature),
            pipe_temperature: R::splat(from.pipe_temperature),
            line_pressure: R::splat(from.line_pressure),
            bristle: R::splat(from.bristle),
        }
    }

    /// Puts a state into a lane.
    pub fn set_lane(&mut self, lane: usize, from: &State<f64>) {
        self.x.set_lane(lane, from.x);
        self.v.set_lane(lane, from.v);
        self.chamber_mass.set_lane(lane, from.chamber_mass);
        self.pipe_mass.set_lane(lane, from.pipe_mass);
        self.chamber_temperature.set_lane(lane, from.chamber_temperature);
        self.pipe_temperature.set_lane(lane, from.pipe_temperature);
        self.line_pressure.set_lane(lane, from.line_pressure);
        self.bristle.set_lane(lane, from.bristle);
    }

    /// The state in a lane.
    pub fn lane(&self, lane: usize) -> State<f64> {
        State {
            x: self.x.lane(lane),
            v: self.v.lane(lane),
            chamber_mass: self.chamber_mass.lane(lane),
            pipe_mass: self.pipe_mass.lane(lane),
            chamber_temperature: self.chamber_temperature.lane(lane),
            pipe_temperature: self.pipe_temperature.lane(lane),
            line_pressure: self.line_pressure.lane(lane),
            bristle: self.bristle.lane(lane),
        }
    }

    /// `self + factor * rate`, of the states in use.
    #[inline(always)]
    pub(crate) fn advanced<const GROUPS: u8>(&self, rate: &Self, factor: R) -> Self {
        let mut next = State {
            x: factor.mul_add(rate.x, self.x),
            v: factor.mul_add(rate.v, self.v),
            chamber_mass: factor.mul_add(rate.chamber_mass, self.chamber_mass),
            pipe_mass: factor.mul_add(rate.pipe_mass, self.pipe_mass),
            ..*self
        };
        if GROUPS & groups::HEATING != 0 {
            next.chamber_temperature = factor.mul_add(rate.chamber_temperature, self.chamber_temperature);
            next.pipe_temperature = factor.mul_add(rate.pipe_temperature, self.pipe_temperature);
        }
        if GROUPS & groups::LINE != 0 {
            next.line_pressure = factor.mul_add(rate.line_pressure, self.line_pressure);
        }
        if GROUPS & groups::FRICTION != 0 {
            next.bristle = factor.mul_add(rate.bristle, self.bristle);
        }
        next
    }
}

impl State<f64> {
    /// Whether every state but the velocity differs from another's by at most this share.
    pub(crate) fn is_within(&self, other: &Self, share: f64) -> bool {
        let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= share * scale;
        near(self.x, other.x, self.x.abs().max(1e-3))
            && near(self.bristle, other.bristle, 1e-3)
            && near(self.chamber_mass, other.chamber_mass, other.chamber_mass)
            && near(self.pipe_mass, other.pipe_mass, other.pipe_mass)
            && near(self.chamber_temperature, other.chamber_temperature, other.chamber_temperature)
            && near(self.pipe_temperature, other.pipe_temperature, other.pipe_temperature)
            && near(self.line_pressure, other.line_pressure, other.line_pressure)
    }
}

/// What acts from outside at one instant.
#[derive(Debug, Clone, Copy, Default)]
pub struct Inputs<R> {
    /// Spool position: 1 joins the supply, 0 the exhaust.
    pub spool: R,
    /// Time since the last command edge, s (for custom formulas).
    pub since_command: R,
    /// Measured pipe pressure, Pa, where it drives the model.
    pub pipe_pressure: R,
    /// Measured chamber pressure, Pa, where it drives the model.
    pub chamber_pressure: R,
    /// Measured supply pressure, Pa, where it drives the model.
    pub supply_pressure: R,
}

/// The flows into and out of the pipe and the chamber, kg/s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Flows<R> {
    /// From the supply; 0 where the solenoid joins one side at a time and no line has to know.
    pub filled: R,
    /// From the exhaust, negative where gas leaves; with the flow from the supply where that is 0.
    pub vented: R,
    /// Through a leak from the supply.
    pub leaked_in: R,
    /// Through a leak to atmosphere, out of the pipe.
    pub leaked_out: R,
    /// From the pipe to the chamber.
    pub through_port: R,
    /// The root of the relative pressure difference between them.
    pub port_root: R,
    /// What is kept of all flows into and out of the pipe but that through the port: 1 unless they are eased.
    pub kept: R,
    /// What effects add to the pipe.
    pub into_pipe: R,
    /// What effects add to the chamber.
    pub into_chamber: R,
}
