//! A cycle by the backward differentiation formulae of diffsol, of variable order and step: what a good general solver of
//! stiff equations makes of one valve. It advances the very equations that our integrator does, not eased.

use std::cell::{Cell, RefCell};

use diffsol::error::DiffsolError;
use diffsol::{NalgebraLU, NalgebraMat, OdeBuilder, OdeSolverMethod, OdeSolverStopReason};
use valve_model::equations::Equations;
use valve_model::equilibrium::vented_rest;
use valve_model::orifice::Laminar;
use valve_model::rhs::System;
use valve_model::state::{Inputs, State};
use valve_model::{Conditions, Fidelity, Schedule, Valve};

use crate::cycle::Answer;

/// The groups of terms of a valve without effects: none.
const BASE: u8 = 0;
/// Position, velocity, gas in chamber and pipe.
const STATES: usize = 4;

/// How closely the solver follows the equations.
#[derive(Clone, Copy, Debug)]
pub struct Closeness {
    /// Tolerance relative to a state; also, of what is usual of it, the absolute one.
    pub tolerance: f64,
    /// Relative pressure difference below which all orifices are laminar: wider is less stiff.
    pub laminar: f64,
}

/// What the solver sees of a valve.
struct Equation<'a> {
    system: System<'a, f64>,
    inputs: Inputs<f64>,
    /// What is usual of each state.
    scales: [f64; STATES],
    evaluations: &'a Cell<usize>,
    /// Where the rates were last asked for, and what they were: all columns of a Jacobian are differences to these.
    last: RefCell<([f64; STATES], [f64; STATES])>,
}

impl Equation<'_> {
    fn rates(&self, at: &[f64]) -> [f64; STATES] {
        self.evaluations.set(self.evaluations.get() + 1);
        let state = State {
            x: at[0],
            v: at[1],
            chamber_mass: at[2],
            pipe_mass: at[3],
            chamber_temperature: self.system.coefficients.temperature,
            pipe_temperature: self.system.coefficients.temperature,
            line_pressure: self.system.coefficients.supply,
            bristle: 0.0,
        };
        let rate = self.system.rates::<BASE>(&state, &self.inputs);
        [rate.x, rate.v, rate.chamber_mass, rate.pipe_mass]
    }

    /// The Jacobian times `along`, by a difference.
    fn slope(&self, at: &[f64], along: &[f64], into: &mut [f64]) {
        let mut last = self.last.borrow_mut();
        if last.0 != at {
            last.0.copy_from_slice(at);
            last.1 = self.rates(at);
        }
        let longest = along.iter().zip(self.scales).map(|(along, scale)| along.abs() / scale).fold(0.0, f64::max);
        if longest == 0.0 {
            into.fill(0.0);
            return;
        }
        let step = f64::EPSILON.sqrt() / longest;
        let beside: [f64; STATES] = std::array::from_fn(|i| at[i] + step * along[i]);
        for ((into, there), here) in into.iter_mut().zip(self.rates(&beside)).zip(last.1) {
            *into = (there - here) / step;
        }
    }
}

/// The first cycle of a valve without effects from rest.
///
/// # Errors
/// If the solver gives up.
pub fn cycle(
    valve: &Valve,
    conditions: &Conditions,
    schedule: &Schedule,
    closeness: Closeness,
) -> Result<Answer, DiffsolError> {
    let mut equations = Equations::new(valve, conditions, Fidelity::FINE);
    assert_eq!(equations.terms.groups(), BASE, "the valve has effects, which this peer does not follow");
    let start = vented_rest(&equations, &Inputs::default());
    equations.coefficients.port_laminar = Laminar::new(closeness.laminar);
    equations.coefficients.laminar = Laminar::new(closeness.laminar);
    let stroke = valve.parameters().stroke_m;
    let scales = [stroke, stroke, start.chamber_mass, start.pipe_mass];
    let mut state = [start.x, start.v, start.chamber_mass, start.pipe_mass];
    let evaluations = Cell::new(0);
    let mut times_s = [None; 2];
    let legs =
        [(1.0, schedule.open_at_s - schedule.close_at_s, 0.0), (0.0, schedule.end_s - schedule.open_at_s, stroke)];
    for ((spool, length_s, level), time_s) in legs.into_iter().zip(&mut times_s) {
        let equation = Equation {
            system: System::new(&equations),
            inputs: Inputs { spool, supply_pressure: conditions.supply_pressure_pa, ..Inputs::default() },
            scales,
            evaluations: &evaluations,
            last: RefCell::new(([f64::NAN; STATES], [0.0; STATES])),
        };
        *time_s = leg(&equation, &mut state, length_s, level, closeness.tolerance)?;
    }
    Ok(Answer { times_s, evaluations: evaluations.get() })
}

/// One leg of a cycle, from `state` to its end: when the piston first reached `level`.
fn leg(
    equation: &Equation<'_>,
    state: &mut [f64; STATES],
    length_s: f64,
    level: f64,
    tolerance: f64,
) -> Result<Option<f64>, DiffsolError> {
    let start = *state;
    let problem = OdeBuilder::<NalgebraMat<f64>>::new()
        .rtol(tolerance)
        .atol(equation.scales.map(|scale| tolerance * scale))
        .rhs_implicit(
            |at, _, _, into| into.copy_from_slice(&equation.rates(at)),
            |at, _, _, along, into| equation.slope(at, along, into),
        )
        .init(|_, _, into| into.copy_from_slice(&start), STATES)
        .build()?;
    let mut solver = problem.bdf::<NalgebraLU<f64>>()?;
    solver.set_stop_time(length_s)?;
    let side = (start[0] - level).signum();
    let left = |position: f64| side * (position - level);
    let mut reached = None;
    let (mut before_s, mut over) = (0.0, false);
    while !over {
        over = solver.step()? == OdeSolverStopReason::TstopReached;
        let (now_s, here) = (solver.state().t, left(solver.state().y[0]));
        if reached.is_none() && here <= 0.0 {
            // Bisection of the solver's own interpolation: a few of its evaluations, none of the equations.
            let (mut early, mut late) = (before_s, now_s);
            for _ in 0..40 {
                let middle = 0.5 * (early + late);
                if left(solver.interpolate(middle)?[0]) > 0.0 { early = middle } else { late = middle }
            }
            reached = Some(late);
        }
        before_s = now_s;
    }
    for (i, state) in state.iter_mut().enumerate() {
        *state = solver.state().y[i];
    }
    Ok(reached)
}
