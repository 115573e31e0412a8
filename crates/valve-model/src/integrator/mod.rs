//! Fixed-step fourth-order Runge-Kutta over lanes: several runs advance together.
//!
//! Each lane keeps a clock of its own. A segment of its command is cut into equal steps of at most
//! the given length, so that no step straddles an edge. Dry friction is set-valued: a lane slides
//! one way or sticks, and where that changes within a step, the step is cut at that instant.

mod clock;
mod friction;
mod recorder;

pub(crate) use clock::Clock;
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
    pub step_s: f64,
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
    let mut front =
        Front { state, time: zero, step: zero, spool: zero, spool_rate: zero, since_command: zero, slide: zero };
    let mut clocks: Vec<Clock> = runs.iter().map(|run| Clock::new(run.segments, run.step_s)).collect();
    for (lane, clock) in clocks.iter().enumerate() {
        clock.load(lane, &mut front);
    }
    if !BASE && (system.terms.friction || system.terms.driven_pipe || system.terms.driven_chamber) {
        guarded(&system, runs, &mut clocks, &mut front, recorder);
    } else {
        free::<R, BASE>(&system, &mut clocks, &mut front, recorder);
    }
    (0..runs.len()).map(|lane| front.state.lane(lane)).collect()
}

/// The plain loop: nothing happens between the ends of segments.
#[inline(always)]
fn free<R: Real, const BASE: bool>(
    system: &System<'_, R>,
    clocks: &mut [Clock],
    front: &mut Front<R>,
    recorder: &mut Recorder<R>,
) {
    recorder.node::<BASE>(system, front, &front.inputs());
    while let Some(count) = clocks.iter().filter_map(Clock::steps_left).min() {
        for _ in 0..count {
            let start = front.inputs();
            let first = system.rates::<BASE>(&front.state, &start, front.slide);
            let (middle, end) = front.later_inputs();
            front.state = runge_kutta::<R, BASE>(system, front, &first, &middle, &end);
            front.advance_time(&end);
            recorder.node::<BASE>(system, front, &end);
        }
        for (lane, clock) in clocks.iter_mut().enumerate() {
            if clock.finish_steps(count) {
                clock.load(lane, front);
            }
            recorder.close_lane_if(lane, clock.is_done());
        }
    }
}

/// The loop that looks at each step: dry friction may change its state, measured inputs change.
#[inline(always)]
fn guarded<R: Real>(
    system: &System<'_, R>,
    runs: &[LaneRun<'_>],
    clocks: &mut [Clock],
    front: &mut Front<R>,
    recorder: &mut Recorder<R>,
) {
    let driven = system.terms.driven_pipe || system.terms.driven_chamber;
    let drive = |inputs: &mut Inputs<R>, time: R| {
        for (lane, run) in runs.iter().enumerate() {
            if let Some(driven) = run.driven {
                let (pipe, chamber) = driven.at(time.lane(lane));
                inputs.pipe_pressure.set_lane(lane, pipe);
                inputs.chamber_pressure.set_lane(lane, chamber);
            }
        }
    };
    let mut start = front.inputs();
    if driven {
        drive(&mut start, front.time);
    }
    recorder.node::<false>(system, front, &start);
    let mut first = system.rates::<false>(&front.state, &start, front.slide);
    while clocks.iter().any(|clock| !clock.is_done()) {
        let (mut middle, mut end) = front.later_inputs();
        if driven {
            drive(&mut middle, front.time + front.step * R::splat(0.5));
            drive(&mut end, front.time + front.step);
        }
        let mut next = runge_kutta::<R, false>(system, front, &first, &middle, &end);
        let mut last = system.rates::<false>(&next, &end, front.slide);
        let mut cut = [0.0; 16];
        if system.terms.friction {
            let changes = friction::changes(front, &first, &next, &last, clocks.len());
            if changes.any() {
                // Take the step again, each lane that changes only up to its change.
                for lane in 0..clocks.len() {
                    if let Some(share) = changes.share[lane] {
                        let whole = front.step.lane(lane);
                        front.step.set_lane(lane, share * whole);
                        cut[lane] = whole - share * whole;
                        if changes.stick_now[lane] {
                            front.slide.set_lane(lane, 0.0);
                        }
                    }
                }
                (middle, end) = front.later_inputs();
                if driven {
                    drive(&mut middle, front.time + front.step * R::splat(0.5));
                    drive(&mut end, front.time + front.step);
                }
                first = system.rates::<false>(&front.state, &start, front.slide);
                next = runge_kutta::<R, false>(system, front, &first, &middle, &end);
                last = system.rates::<false>(&next, &end, front.slide);
                friction::settle(&changes, &mut next, &mut front.slide, &last);
                last = system.rates::<false>(&next, &end, front.slide);
            }
        }
        front.state = next;
        front.advance_time(&end);
        recorder.node::<false>(system, front, &end);
        let mut reloaded = false;
        for (lane, clock) in clocks.iter_mut().enumerate() {
            if clock.is_done() {
                continue;
            }
            if cut[lane] > 1e-12 {
                front.step.set_lane(lane, cut[lane]);
            } else if clock.finish_steps(1) {
                clock.load(lane, front);
                reloaded = true;
            } else {
                front.step.set_lane(lane, clock.step_s());
            }
            recorder.close_lane_if(lane, clock.is_done());
        }
        start = front.inputs();
        if driven {
            drive(&mut start, front.time);
        }
        first = if reloaded { system.rates::<false>(&front.state, &start, front.slide) } else { last };
    }
}

/// One step of the classical fourth-order method (Kutta 1901).
#[inline(always)]
fn runge_kutta<R: Real, const BASE: bool>(
    system: &System<'_, R>,
    front: &Front<R>,
    first: &Rates<R>,
    middle: &Inputs<R>,
    end: &Inputs<R>,
) -> State<R> {
    let state = &front.state;
    let half = front.step * R::splat(0.5);
    let k1 = &first.rate;
    let k2 = system.rates::<BASE>(&state.advanced::<BASE>(k1, half), middle, front.slide).rate;
    let k3 = system.rates::<BASE>(&state.advanced::<BASE>(&k2, half), middle, front.slide).rate;
    let k4 = system.rates::<BASE>(&state.advanced::<BASE>(&k3, front.step), end, front.slide).rate;
    let sixth = front.step * R::splat(1.0 / 6.0);
    let third = front.step * R::splat(1.0 / 3.0);
    state
        .advanced::<BASE>(k1, sixth)
        .advanced::<BASE>(&k2, third)
        .advanced::<BASE>(&k3, third)
        .advanced::<BASE>(&k4, sixth)
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

    #[inline(always)]
    fn advance_time(&mut self, end: &Inputs<R>) {
        self.time = self.time + self.step;
        self.spool = end.spool;
        self.since_command = end.since_command;
    }
}
