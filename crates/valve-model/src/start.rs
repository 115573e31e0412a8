//! Where a run starts: at rest on a stop, or in the midst of a motion.

use crate::equations::Equations;
use crate::equilibrium::{closed_rest, line_pressure, rest, root, vented_rest};
use crate::rhs::System;
use crate::state::{Inputs, State};
use crate::terms::groups;

/// The state that a run starts from. All gas is at the run's temperature.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Start {
    /// At rest with the solenoid vented, which is open for most valves; any leak in balance.
    #[default]
    Rest,
    /// At rest with the solenoid energised long before, which is closed for most valves; pipe and chamber filled
    /// to the supply, any leak in balance.
    ClosedRest,
    /// At rest with pipe and chamber at a pressure, which is on the open stop while they are vented. The solenoid stands as
    /// the last command before time 0 left it, vented without one. Measured pressures that drive the model come first.
    Venting {
        /// Pressure of pipe and chamber, Pa.
        pressure_pa: f64,
    },
    /// Anywhere, at any speed. The solenoid stands as the last command before time 0 left it, vented without one.
    Moving {
        /// Position, m.
        position_m: f64,
        /// Velocity, m/s.
        velocity_m_per_s: f64,
        /// Chamber pressure. A measured one that drives the model comes first.
        chamber: ChamberStart,
        /// Pipe pressure, Pa; where it is not known, that of the chamber. A measured one that drives the model
        /// comes first.
        pipe_pressure_pa: Option<f64>,
    },
}

/// The chamber pressure in which a run starts that starts in the midst of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ChamberStart {
    /// A known one, Pa.
    Known(f64),
    /// Nearly that at which all forces on the piston balance, friction included, between the lowest and the highest
    /// pressure that pipe and chamber can meet.
    Balance {
        /// What it is beyond that, Pa; an absolute pressure stays at 1 Pa at least.
        beyond_pa: f64,
    },
}

impl ChamberStart {
    /// The pressure at which all forces on the piston balance.
    pub const BALANCE: Self = Self::Balance { beyond_pa: 0.0 };
}

/// Speed from which on the friction bristles of a moving piston start fully loaded, m/s; in proportion below
/// it. Far below the speed of any stroke, and above what position noise makes of a piston at rest.
const SLIDING_M_PER_S: f64 = 1e-3;

impl Start {
    /// Whether the solenoid was energised before the first command.
    #[must_use]
    pub fn is_energised(&self) -> bool {
        matches!(self, Self::ClosedRest)
    }

    /// What is wrong with it on a valve of these equations, in words.
    pub(crate) fn fault(&self, equations: &Equations) -> Option<String> {
        let is_pressure = |pressure: f64| pressure.is_finite() && pressure > 0.0;
        if let Self::Venting { pressure_pa } = *self
            && !is_pressure(pressure_pa)
        {
            return Some(format!("pressure {pressure_pa} Pa, expected an absolute pressure above 0"));
        }
        let Self::Moving { position_m, velocity_m_per_s, chamber, pipe_pressure_pa } = self else {
            return None;
        };
        let c = &equations.coefficients;
        let most_m = c.closed_volume / c.piston_area;
        if !position_m.is_finite() || *position_m >= most_m {
            return Some(format!("position {position_m} m, expected less than {most_m} m, where the chamber ends"));
        }
        if !velocity_m_per_s.is_finite() {
            return Some(format!("velocity {velocity_m_per_s} m/s, expected a finite one"));
        }
        let known = match chamber {
            ChamberStart::Known(pressure) => Some(*pressure),
            ChamberStart::Balance { beyond_pa } if !beyond_pa.is_finite() => {
                return Some(format!("chamber pressure {beyond_pa} Pa beyond balance, expected a finite one"));
            }
            ChamberStart::Balance { .. } => None,
        };
        for (name, pressure) in [("chamber", known), ("pipe", *pipe_pressure_pa)] {
            if let Some(pressure) = pressure.filter(|pressure| !is_pressure(*pressure)) {
                return Some(format!("{name} pressure {pressure} Pa, expected an absolute pressure above 0"));
            }
        }
        None
    }

    /// The state of a run of these equations, with the spool and the measured pressures of its first instant.
    pub(crate) fn state(&self, equations: &Equations, inputs: &Inputs<f64>) -> State<f64> {
        match *self {
            Self::Rest => vented_rest(equations, inputs),
            Self::ClosedRest => closed_rest(equations, inputs),
            Self::Venting { pressure_pa } => rest(equations, inputs, false, || pressure_pa),
            Self::Moving { position_m, velocity_m_per_s, chamber, pipe_pressure_pa } => {
                let motion = Motion { equations, inputs, position_m, velocity_m_per_s };
                motion.state(chamber, pipe_pressure_pa)
            }
        }
    }
}

/// A piston on its way.
struct Motion<'a> {
    equations: &'a Equations,
    inputs: &'a Inputs<f64>,
    position_m: f64,
    velocity_m_per_s: f64,
}

impl Motion<'_> {
    fn state(&self, chamber: ChamberStart, pipe_pressure_pa: Option<f64>) -> State<f64> {
        let terms = self.equations.terms;
        let prescribed = |drives: bool, pressure: f64| drives.then_some(pressure);
        let system = System::new(self.equations);
        let chamber =
            prescribed(terms.prescribed_chamber, self.inputs.chamber_pressure).unwrap_or_else(|| match chamber {
                ChamberStart::Known(pressure) => pressure,
                ChamberStart::Balance { beyond_pa } => (self.balancing_pressure(&system) + beyond_pa).max(1.0),
            });
        let pipe = prescribed(terms.prescribed_pipe, self.inputs.pipe_pressure)
            .or(pipe_pressure_pa)
            .unwrap_or_else(|| self.passing_pressure(&system, chamber));
        self.with_pressures(&system, chamber, pipe)
    }

    /// The chamber pressure at which nothing accelerates the piston, Pa.
    fn balancing_pressure(&self, system: &System<'_, f64>) -> f64 {
        let c = &self.equations.coefficients;
        let (low, high) = (c.exhaust.min(c.ambient), c.supply.max(c.exhaust));
        let acceleration = |pressure: f64| {
            let inputs = Inputs { chamber_pressure: pressure, ..*self.inputs };
            system.rates::<{ groups::ANY }>(&self.with_pressures(system, pressure, pressure), &inputs).v
        };
        root(low, high, acceleration)
    }

    /// The pipe pressure at which as much gas leaves the pipe as enters it, Pa: a pipe is small beside what passes through
    /// it while a piston moves.
    fn passing_pressure(&self, system: &System<'_, f64>, chamber: f64) -> f64 {
        let c = &self.equations.coefficients;
        let (low, high) = (c.exhaust.min(chamber), c.supply.max(chamber));
        root(low, high, |pipe| {
            let inputs = Inputs { chamber_pressure: chamber, pipe_pressure: pipe, ..*self.inputs };
            system.rates::<{ groups::ANY }>(&self.with_pressures(system, chamber, pipe), &inputs).pipe_mass
        })
    }

    fn with_pressures(&self, system: &System<'_, f64>, chamber: f64, pipe: f64) -> State<f64> {
        let c = &self.equations.coefficients;
        let mut state = State {
            x: self.position_m,
            v: self.velocity_m_per_s,
            chamber_mass: chamber * (c.closed_volume - c.piston_area * self.position_m) / c.zrt,
            pipe_mass: pipe / c.pipe_gain,
            chamber_temperature: c.temperature,
            pipe_temperature: c.temperature,
            line_pressure: line_pressure(self.equations, self.inputs.spool, pipe),
            bristle: 0.0,
        };
        if self.equations.terms.friction {
            let inputs = Inputs { chamber_pressure: chamber, pipe_pressure: pipe, ..*self.inputs };
            let sliding = system.sliding_friction::<{ groups::ANY }>(&state, &inputs) / c.bristle_stiffness;
            state.bristle = sliding * (self.velocity_m_per_s / SLIDING_M_PER_S).clamp(-1.0, 1.0);
        }
        state
    }
}
