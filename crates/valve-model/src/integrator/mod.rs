//! Fixed-step fourth-order Runge-Kutta over lanes: several runs advance together.
//!
//! Each lane keeps a clock of its own. A segment of its command is cut into equal steps of at most
//! the given length, so that no step straddles an edge. Where pipe and chamber are nearly at one
//! pressure while the piston still creeps (close to the leak that stalls the valve), the orifice law
//! is stiff and the lane takes substeps ([`clock`]).

mod clock;
mod recorder;
mod step_control;
mod stops;

use std::cell::Cell;

pub(crate) use clock::Clock;
use clock::Held;
pub(crate) use recorder::Recorder;
use step_control::Piston;
pub(crate) use step_control::{BLOCK, StepControl};
use stops::{Depth, Stop};

use crate::command::Segment;
use crate::equations::Equations;
use crate::prescribed::{Prescribed, PrescribedPressures, Stretch};
use crate::real::Real;
use crate::rhs::System;
use crate::state::{Inputs, State};
use crate::terms::groups;
use crate::trajectory::{Outcome, Trajectory};

/// One run as the integrator takes it.
pub(crate) struct LaneRun<'a> {
    pub equations: &'a Equations,
    pub segments: &'a [Segment],
    pub initial: State<f64>,
    pub control: StepControl,
    pub prescribed: Option<&'a Prescribed>,
    /// Not to be begun: it has no segments.
    pub refused: bool,
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

/// What takes a run that is over: its index, its nodes and its final state.
pub(crate) type Take<'a> = dyn FnMut(usize, &Trajectory, &State<f64>) + 'a;

/// Packs of lanes that advance by turns, stage by stage: the operations of a stage wait for one another, and while those of
/// one pack do, the processor goes on with the next pack's.
pub(crate) const PACKS: usize = 2;

/// One for each pack.
pub(crate) type Recorders = [Recorder; PACKS];

/// Integrates runs with the same groups of terms, as many at a time as there are lanes in the packs: a lane whose run is
/// over takes the next one. Hands each to `take` when it is over.
#[inline(always)]
pub(crate) fn integrate<R: Real, const GROUPS: u8>(
    runs: &[LaneRun<'_>],
    recorders: &mut Recorders,
    take: &mut Take<'_>,
) {
    let mut queue = Queue { runs, next: 0 };
    let mut packs: Vec<Pack<'_, '_, R>> = Vec::with_capacity(PACKS);
    for recorder in recorders {
        if queue.is_empty() {
            break;
        }
        packs.push(Pack::new::<GROUPS>(&mut queue, recorder));
    }
    packs.retain_mut(|pack| pack.attend::<GROUPS>(0, &mut queue, take));
    while let Some(count) = packs.iter().map(|pack| pack.due).min() {
        for _ in 0..count {
            step::<R, GROUPS>(&mut packs);
        }
        packs.retain_mut(|pack| pack.attend::<GROUPS>(count, &mut queue, take));
    }
}

/// Takes one step in every lane of every pack.
#[inline(always)]
fn step<R: Real, const GROUPS: u8>(packs: &mut [Pack<'_, '_, R>]) {
    for pack in &mut *packs {
        pack.sum = pack.front.state;
        pack.rate = State::splat(&State::ZERO);
    }
    // Loops, so that the equations are compiled once for each instruction set.
    for (share, weight) in STAGES {
        for pack in &mut *packs {
            pack.stage::<GROUPS>(share, weight);
        }
    }
    for pack in packs {
        pack.end_step::<GROUPS>();
    }
}

/// The runs, and the next one that waits.
struct Queue<'a> {
    runs: &'a [LaneRun<'a>],
    next: usize,
}

impl Queue<'_> {
    fn is_empty(&self) -> bool {
        self.next >= self.runs.len()
    }
}

/// Runs in lanes that advance in the same operations.
struct Pack<'a, 'r, R> {
    runs: &'a [LaneRun<'a>],
    system: System<'a, R>,
    front: Front<R>,
    /// The state after the step that is being taken, as far as its stages are over, and the rate of the last one.
    sum: State<R>,
    rate: State<R>,
    lanes: Vec<InLane>,
    /// Steps until a lane needs attention, and those taken since one did.
    due: u32,
    taken: u32,
    may_settle: bool,
    prescribed: bool,
    stretches: Cell<Stretches<R>>,
    recorder: &'r mut Recorder,
}

/// The run in one lane.
struct InLane {
    run: usize,
    clock: Clock,
}

/// The stretches of the measured pressures that the lanes are in.
#[derive(Debug, Clone, Copy)]
struct Stretches<R> {
    from: R,
    until: R,
    /// Pipe, chamber and supply as they begin.
    start: [R; 3],
    rate: [R; 3],
}

impl<R: Real> Stretches<R> {
    /// Nothing is measured, ever.
    fn endless() -> Self {
        let zero = R::splat(0.0);
        Self { from: zero, until: R::splat(f64::INFINITY), start: [zero; 3], rate: [zero; 3] }
    }

    fn set_lane(&mut self, lane: usize, stretch: &Stretch) {
        let of = |pressures: PrescribedPressures| [pressures.pipe, pressures.chamber, pressures.supply];
        self.from.set_lane(lane, stretch.from_s);
        self.until.set_lane(lane, stretch.until_s);
        for (channel, (start, rate)) in of(stretch.start).into_iter().zip(of(stretch.rate)).enumerate() {
            self.start[channel].set_lane(lane, start);
            self.rate[channel].set_lane(lane, rate);
        }
    }
}

impl<'a, 'r, R: Real> Pack<'a, 'r, R> {
    /// The first runs that wait in the lanes.
    #[inline(never)]
    fn new<const GROUPS: u8>(queue: &mut Queue<'a>, recorder: &'r mut Recorder) -> Self {
        let first = &queue.runs[queue.next];
        let system = System::new(first.equations);
        // A custom formula may depend on time, and measured pressures do.
        let formulas_rest = system.custom.iter().all(|effect| !effect.formula().depends_on_time());
        let prescribed = first.equations.terms.is_prescribed();
        let zero = R::splat(0.0);
        let front = Front {
            state: State::splat(&first.initial),
            time: zero,
            step: zero,
            wait: zero,
            spool: zero,
            spool_rate: zero,
            since_command: zero,
        };
        let mut pack = Self {
            runs: queue.runs,
            system,
            sum: front.state,
            rate: front.state,
            front,
            lanes: Vec::with_capacity(R::LANES),
            due: 0,
            taken: 0,
            may_settle: formulas_rest && !prescribed,
            prescribed,
            stretches: Cell::new(Stretches::endless()),
            recorder,
        };
        for lane in 0..R::LANES.min(queue.runs.len() - queue.next) {
            let in_lane = pack.load(lane, queue);
            pack.lanes.push(in_lane);
        }
        for lane in 0..pack.lanes.len() {
            pack.record_start::<GROUPS>(lane);
        }
        pack
    }

    /// Puts the next run that waits into a lane.
    fn load(&mut self, lane: usize, queue: &mut Queue<'a>) -> InLane {
        let index = queue.next;
        let run = &self.runs[index];
        queue.next += 1;
        self.system.set_lane(lane, run.equations);
        // Over before any time, so that it is looked up anew.
        self.stretches.get_mut().until.set_lane(lane, f64::NEG_INFINITY);
        self.front.state.set_lane(lane, &run.initial);
        self.front.time.set_lane(lane, run.segments.first().map_or(0.0, |segment| segment.start_s));
        let held = Held { chamber: !self.system.terms.prescribed_chamber, pipe: !self.system.terms.prescribed_pipe };
        let piston = Piston::of(&run.equations.coefficients);
        let mut clock = Clock::new(run.segments, run.control, self.may_settle, held, piston);
        clock.load(lane, &mut self.front, &mut self.system.coefficients);
        InLane { run: index, clock }
    }

    fn record_start<const GROUPS: u8>(&mut self, lane: usize) {
        let inputs = self.inputs::<GROUPS>(R::splat(0.0));
        self.recorder.begin::<R, GROUPS>(lane, &self.system, &self.front, &inputs);
    }

    /// The inputs some time after the start of a step.
    #[inline(always)]
    fn inputs<const GROUPS: u8>(&self, ahead: R) -> Inputs<R> {
        let front = &self.front;
        let zero = R::splat(0.0);
        let mut inputs = Inputs {
            spool: front.spool_rate.mul_add(ahead, front.spool),
            since_command: front.since_command + ahead,
            pipe_pressure: zero,
            chamber_pressure: zero,
            supply_pressure: zero,
        };
        if GROUPS & groups::PRESCRIBED != 0 && self.prescribed {
            self.drive(&mut inputs, front.time + ahead);
        }
        inputs
    }

    /// One stage of a step in every lane: the rate there, and its share of the step.
    #[inline(always)]
    fn stage<const GROUPS: u8>(&mut self, share: f64, weight: f64) {
        let front = &self.front;
        let ahead = front.step * R::splat(share);
        let inputs = self.inputs::<GROUPS>(ahead);
        let rate = self.system.rates::<GROUPS>(&front.state.advanced::<GROUPS>(&self.rate, ahead), &inputs);
        self.sum = self.sum.advanced::<GROUPS>(&rate, front.step * R::splat(weight));
        self.rate = rate;
    }

    /// Ends a step whose stages are over, with a node in every lane.
    #[inline(always)]
    fn end_step<const GROUPS: u8>(&mut self) {
        if self.passes_a_stop() {
            self.add_missed_pushes();
        }
        let front = &mut self.front;
        front.state = self.sum;
        front.time = front.time + front.step + front.wait;
        front.spool = front.spool_rate.mul_add(front.step, front.spool);
        front.since_command = front.since_command + front.step;
        let inputs = self.inputs::<GROUPS>(R::splat(0.0));
        self.recorder.node::<R, GROUPS>(&self.system, &self.front, &inputs);
    }

    /// Whether the push of a stop may begin or end in a lane's step: where the piston passes its end, and, of damped stops, anywhere.
    #[inline(always)]
    fn passes_a_stop(&self) -> bool {
        let (from, to, stroke) = (self.front.state.x, self.sum.x, self.system.coefficients.stroke);
        let closed = from * to;
        let open = (from - stroke) * (to - stroke);
        self.system.terms.stop_damping || closed.min(open).any_lt(R::splat(0.0))
    }

    /// Adds what the stages of a step missed where the push of a stop begins or ends.
    #[inline(always)]
    fn add_missed_pushes(&mut self) {
        let c = &self.system.coefficients;
        let (from, to, step) = (&self.front.state, &mut self.sum, self.front.step);
        let stop = Stop { stiffness: c.contact, damping: c.stop_damping };
        let in_closed = |state: &State<R>| Depth { m: -state.x, rate: -state.v };
        let in_open = |state: &State<R>| Depth { m: state.x - c.stroke, rate: state.v };
        let closed = stop.missed(in_closed(from), in_closed(to), step);
        let open = stop.missed(in_open(from), in_open(to), step);
        let by = c.inverse_mass * step;
        to.v = by.mul_add(closed.speeds - open.speeds, to.v);
        to.x = (by * step).mul_add(closed.moves - open.moves, to.x);
    }

    /// Counts steps as taken in every lane, and loads what is then due; whether any lane still has a run.
    #[inline(always)]
    fn attend<const GROUPS: u8>(&mut self, count: u32, queue: &mut Queue<'a>, take: &mut Take<'_>) -> bool {
        self.taken += count;
        self.due -= count;
        if self.due > 0 {
            return true;
        }
        let mut any_over = self.taken == 0;
        for (lane, InLane { clock, .. }) in self.lanes.iter_mut().enumerate() {
            if clock.finish_steps(self.taken) {
                clock.load(lane, &mut self.front, &mut self.system.coefficients);
                any_over |= clock.is_done();
            }
        }
        if any_over {
            self.hand_over::<GROUPS>(queue, take);
        }
        let due = self.lanes.iter().filter_map(|lane| lane.clock.steps_left()).min();
        (self.due, self.taken) = (due.unwrap_or(0), 0);
        due.is_some()
    }

    /// Hands over the runs that are over, and puts those that wait in their place.
    #[inline(never)]
    fn hand_over<const GROUPS: u8>(&mut self, queue: &mut Queue<'a>, take: &mut Take<'_>) {
        for lane in 0..self.lanes.len() {
            while self.lanes[lane].clock.is_done() && self.recorder.is_busy(lane) {
                let InLane { run, clock } = &self.lanes[lane];
                let outcome = if self.runs[*run].refused { Outcome::Refused } else { clock.outcome() };
                take(*run, self.recorder.end(lane, outcome), &self.front.state.lane(lane));
                if !queue.is_empty() {
                    self.lanes[lane] = self.load(lane, queue);
                    self.record_start::<GROUPS>(lane);
                }
            }
        }
    }

    /// Fills in the measured pressures at each lane's time.
    #[inline(always)]
    fn drive(&self, inputs: &mut Inputs<R>, time: R) {
        let mut stretches = self.stretches.get();
        if stretches.until.any_lt(time) || time.any_lt(stretches.from) {
            stretches = self.entered(stretches, time);
        }
        let since = time - stretches.from;
        let at = |channel: usize| since.mul_add(stretches.rate[channel], stretches.start[channel]);
        (inputs.pipe_pressure, inputs.chamber_pressure, inputs.supply_pressure) = (at(0), at(1), at(2));
    }

    /// The stretches of the measured pressures at each lane's time.
    #[inline(never)]
    fn entered(&self, mut stretches: Stretches<R>, time: R) -> Stretches<R> {
        for (lane, in_lane) in self.lanes.iter().enumerate() {
            let time_s = time.lane(lane);
            let is_within = time_s >= stretches.from.lane(lane) && time_s <= stretches.until.lane(lane);
            if let (false, Some(prescribed)) = (is_within, self.runs[in_lane.run].prescribed) {
                stretches.set_lane(lane, &prescribed.stretch_at(time_s));
            }
        }
        self.stretches.set(stretches);
        stretches
    }
}

/// The stages of the classical fourth-order method (Kutta 1901): where in the step each lies, and its weight.
const STAGES: [(f64, f64); 4] = [(0.0, 1.0 / 6.0), (0.5, 1.0 / 3.0), (0.5, 1.0 / 3.0), (1.0, 1.0 / 6.0)];
