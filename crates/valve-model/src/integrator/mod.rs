//! Fixed-step fourth-order Runge-Kutta over lanes: several runs advance together.
//!
//! Each lane keeps a clock of its own. A segment of its command is cut into equal steps of at most
//! the given length, so that no step straddles an edge. Where pipe and chamber are nearly at one
//! pressure while the piston still creeps (close to the leak that stalls the valve), the orifice law
//! is stiff and the lane takes substeps ([`clock`]).

mod clock;
mod recorder;

pub(crate) use clock::{Clock, MOST_SUBSTEPS, Pace};
pub(crate) use recorder::Recorder;

use crate::coefficients::{Coefficients, Equations};
use crate::command::Segment;
use crate::driven::Driven;
use crate::real::Real;
use crate::rhs::{Inputs, State, System};

/// One run as the integrator takes it.
pub(crate) struct LaneRun<'a> {
    pub equations: &'a Equations,
    pub segments: &'a [Segment],
    pub initial: State<f64>,
    pub pace: Pace,
    pub driven: Option<&'a Driven>,
}

/// What the integrator keeps of each lane in registers or close to them.
pub(super) struct Front<R> {
    state: State<R>,
    time: R,
    step: R,
    /// Time that passes with the step, s: of a lane at rest that waits for its segment to end.
    wait: R,
    spool: R,
    spool_rate: R,
    since_command: R,
}

/// Integrates up to `R::LANES` runs with the same groups of terms; returns their final states.
#[inline(always)]
pub(crate) fn integrate<R: Real, const BASE: bool>(
    runs: &[LaneRun<'_>],
    recorder: &mut Recorder<R>,
) -> Vec<State<f64>> {
    let (mut system, mut front) = pack(runs);
    let terms = &system.terms;
    // A custom formula may depend on time, and measured pressures do.
    let formulas_rest = system.custom.iter().all(|effect| !effect.formula().depends_on_time());
    let may_settle = formulas_rest && !(terms.driven_pipe || terms.driven_chamber);
    let mut clocks: Vec<Clock> = runs.iter().map(|run| Clock::new(run.segments, run.pace, may_settle)).collect();
    for (lane, clock) in clocks.iter_mut().enumerate() {
        clock.load(lane, &mut front, &mut system.coefficients);
    }
    march::<R, BASE>(&mut system, runs, &mut clocks, &mut front, recorder);
    (0..runs.len()).map(|lane| front.state.lane(lane)).collect()
}

/// Puts the runs side by side.
#[inline(never)]
fn pack<'a, R: Real>(runs: &[LaneRun<'a>]) -> (System<'a, R>, Front<R>) {
    let first = &runs[0];
    let mut coefficients = Coefficients::splat(&first.equations.coefficients);
    let mut state = State::splat(&first.initial);
    let mut custom_parameters: Vec<Vec<R>> =
        first.equations.custom_values().iter().map(|values| values.iter().map(|v| R::splat(*v)).collect()).collect();
    for (lane, run) in runs.iter().enumerate().skip(1) {
        coefficients.set_lane(lane, &run.equations.coefficients);
        state.set_lane(lane, &run.initial);
        for (packed, values) in custom_parameters.iter_mut().zip(run.equations.custom_values()) {
            for (pack, value) in packed.iter_mut().zip(values) {
                pack.set_lane(lane, value);
            }
        }
    }
    let system = System::new(coefficients, first.equations.terms, &first.equations.custom, custom_parameters);
    let zero = R::splat(0.0);
    let front = Front { state, time: zero, step: zero, wait: zero, spool: zero, spool_rate: zero, since_command: zero };
    (system, front)
}

/// Takes steps until every lane is at the end of its run.
#[inline(always)]
fn march<R: Real, const BASE: bool>(
    system: &mut System<'_, R>,
    runs: &[LaneRun<'_>],
    clocks: &mut [Clock],
    front: &mut Front<R>,
    recorder: &mut Recorder<R>,
) {
    let driven = !BASE && (system.terms.driven_pipe || system.terms.driven_chamber);
    let mut start = front.inputs();
    if driven {
        drive(runs, &mut start, front.time);
    }
    recorder.node::<BASE>(system, front, &start);
    while let Some(count) = clocks.iter().filter_map(Clock::steps_left).min() {
        for _ in 0..count {
            let half = front.step * R::splat(0.5);
            let (mut middle, mut end) = front.later_inputs();
            if driven {
                drive(runs, &mut middle, front.time + half);
                drive(runs, &mut end, front.time + front.step);
            }
            let stages = [(R::splat(0.0), &start), (half, &middle), (half, &middle), (front.step, &end)];
            let mut sum = front.state;
            let mut rate = State::splat(&State::ZERO);
            // A loop, so that the equations are compiled once for each instruction set.
            for ((ahead, inputs), weight) in stages.into_iter().zip(WEIGHTS) {
                rate = system.rates::<BASE>(&front.state.advanced::<BASE>(&rate, ahead), inputs);
                sum = sum.advanced::<BASE>(&rate, front.step * R::splat(weight));
            }
            front.state = sum;
            front.time = front.time + front.step + front.wait;
            front.spool = end.spool;
            front.since_command = end.since_command;
            start = end;
            recorder.node::<BASE>(system, front, &end);
        }
        for (lane, clock) in clocks.iter_mut().enumerate() {
            if clock.finish_steps(count) {
                clock.load(lane, front, &mut system.coefficients);
            }
            recorder.close_lane_if(lane, clock.is_done());
        }
        start = front.inputs();
        if driven {
            drive(runs, &mut start, front.time);
        }
    }
}

/// Weights of the stages of the classical fourth-order method (Kutta 1901).
const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

/// Fills in the measured pressures at each lane's time.
#[inline(never)]
fn drive<R: Real>(runs: &[LaneRun<'_>], inputs: &mut Inputs<R>, time: R) {
    for (lane, run) in runs.iter().enumerate() {
        if let Some(driven) = run.driven {
            let (pipe, chamber) = driven.at(time.lane(lane));
            inputs.pipe_pressure.set_lane(lane, pipe);
            inputs.chamber_pressure.set_lane(lane, chamber);
        }
    }
}

impl<R: Real> Front<R> {
    #[inline(always)]
    fn inputs(&self) -> Inputs<R> {
        let zero = R::splat(0.0);
        Inputs { spool: self.spool, since_command: self.since_command, pipe_pressure: zero, chamber_pressure: zero }
    }

    /// The inputs in the middle and at the end of the step.
    #[inline(always)]
    fn later_inputs(&self) -> (Inputs<R>, Inputs<R>) {
        let after = |share: f64| {
            let time = self.step * R::splat(share);
            let mut inputs = self.inputs();
            inputs.spool = self.spool + self.spool_rate * time;
            inputs.since_command = self.since_command + time;
            inputs
        };
        (after(0.5), after(1.0))
    }
}
