//! Fixed-step fourth-order Runge-Kutta over lanes: several runs advance together.
//!
//! Each lane keeps a clock of its own. A segment of its command is cut into equal steps of at most
//! the given length, so that no step straddles an edge. Two things need more care:
//!
//! - Dry friction is set-valued: a lane slides one way or sticks, and where that changes within a
//!   step, the step is cut at that instant ([`friction`]).
//! - Pipe and chamber nearly at one pressure while the piston still creeps (close to the leak that
//!   stalls the valve): the orifice law is stiff there, and the lane takes substeps ([`clock`]).

mod clock;
mod friction;
mod recorder;

pub(crate) use clock::{Clock, Pace};
pub(crate) use recorder::Recorder;

use crate::coefficients::{Coefficients, Equations};
use crate::command::Segment;
use crate::driven::Driven;
use crate::real::Real;
use crate::rhs::{Inputs, Rates, State, System};

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
    spool: R,
    spool_rate: R,
    since_command: R,
    slide: R,
}

/// Integrates up to `R::LANES` runs with the same groups of terms; returns their final states.
#[inline(always)]
pub(crate) fn integrate<R: Real, const BASE: bool>(
    runs: &[LaneRun<'_>],
    recorder: &mut Recorder<R>,
) -> Vec<State<f64>> {
    let (mut system, mut front) = pack(runs);
    let mut clocks: Vec<Clock> = runs.iter().map(|run| Clock::new(run.segments, run.pace)).collect();
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
    let system =
        System { coefficients, terms: first.equations.terms, custom: &first.equations.custom, custom_parameters };
    let zero = R::splat(0.0);
    let front =
        Front { state, time: zero, step: zero, spool: zero, spool_rate: zero, since_command: zero, slide: zero };
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
    let zero = R::splat(0.0);
    let friction = !BASE && system.terms.friction;
    let driven = !BASE && (system.terms.driven_pipe || system.terms.driven_chamber);
    let rest = State { x: zero, v: zero, chamber_mass: zero, pipe_mass: zero, ..front.state };
    let mut first = Rates { rate: rest, net_force: zero, hold: zero };
    let mut first_is_known = false;
    let mut start = front.inputs();
    if driven {
        drive(runs, &mut start, front.time);
    }
    recorder.node::<BASE>(system, front, &start);
    while let Some(left) = clocks.iter().filter_map(Clock::steps_left).min() {
        let count = if friction || driven { 1 } else { left };
        let mut cut = [0.0; MAX_LANES];
        for _ in 0..count {
            let mut changes: Option<friction::Changes> = None;
            // The stages stand in a loop, and a step that is taken again goes through the same loop, so
            // that the equations are compiled once for each instruction set.
            let (next, end) = loop {
                let half = front.step * R::splat(0.5);
                let (mut middle, mut end) = front.later_inputs();
                if driven {
                    drive(runs, &mut middle, front.time + half);
                    drive(runs, &mut end, front.time + front.step);
                }
                let mut sum = front.state;
                let mut last = first;
                let begin = if first_is_known {
                    sum = sum.advanced::<BASE>(&first.rate, front.step * R::splat(WEIGHTS[0]));
                    1
                } else {
                    0
                };
                let stages = if friction { 5 } else { 4 };
                for stage in begin..stages {
                    let (at, inputs) = match stage {
                        0 => (front.state, &start),
                        1 | 2 => (front.state.advanced::<BASE>(&last.rate, half), &middle),
                        3 => (front.state.advanced::<BASE>(&last.rate, front.step), &end),
                        _ => (sum, &end),
                    };
                    last = system.rates::<BASE>(&at, inputs, front.slide);
                    if stage == 0 {
                        first = last;
                    }
                    if let Some(weight) = WEIGHTS.get(stage) {
                        sum = sum.advanced::<BASE>(&last.rate, front.step * R::splat(*weight));
                    }
                }
                if !friction {
                    break (sum, end);
                }
                first_is_known = true;
                if let Some(changes) = &changes {
                    friction::settle(changes, &mut sum, &mut front.slide, &last);
                    first_is_known = false;
                    break (sum, end);
                }
                let found = friction::changes(front, &first, &sum, &last, clocks.len());
                if !found.any() {
                    first = last;
                    break (sum, end);
                }
                cut = found.shorten(front);
                first_is_known = false;
                changes = Some(found);
            };
            front.state = next;
            front.time = front.time + front.step;
            front.spool = end.spool;
            front.since_command = end.since_command;
            start = end;
            recorder.node::<BASE>(system, front, &end);
        }
        for (lane, clock) in clocks.iter_mut().enumerate() {
            if cut[lane] > SHORTEST_STEP_S {
                front.step.set_lane(lane, cut[lane]);
                continue;
            }
            if clock.finish_steps(count) {
                clock.load(lane, front, &mut system.coefficients);
                first_is_known = false;
            } else {
                front.step.set_lane(lane, clock.step_s());
            }
            recorder.close_lane_if(lane, clock.is_done());
        }
        if !first_is_known {
            start = front.inputs();
            if driven {
                drive(runs, &mut start, front.time);
            }
        }
    }
}

/// The most lanes that the integrator is ever given.
pub(super) const MAX_LANES: usize = 16;

/// What is left of a step after a change of friction is dropped when shorter than this, s.
const SHORTEST_STEP_S: f64 = 1e-12;

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
