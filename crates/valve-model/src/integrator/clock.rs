//! The time of one lane: which segment it is in, how long its steps are, how many are left.
//!
//! A lane in which nothing happens any more goes to the end of its segment at once.

use super::Front;
use super::step_control::{BLOCK, Past, Piston, StepControl, Stride, block_steps};
use crate::coefficients::Coefficients;
use crate::command::Segment;
use crate::real::Real;
use crate::state::State;
use crate::trajectory::Outcome;

/// A lane of which no state moves by more than this share over a block is at rest. A creep that
/// slow would take years for a stroke, and what is still to come of a decay is below 1e-8.
const SETTLED: f64 = 1e-11;

/// Steps after which a piston may count as resting within a segment. What happens at its beginning is over by then, so that
/// it does not depend on a parameter by jumps in which block that is.
const UNREST: u32 = 5 * BLOCK;

/// The clock of one lane.
pub(crate) struct Clock {
    segments: Vec<(Segment, u32, f64)>,
    control: StepControl,
    index: usize,
    /// Whole steps left in the segment after the current block.
    beyond: u32,
    /// Whole steps in the current block.
    block: u32,
    /// Substeps left in the current block.
    left: u32,
    /// Whether a lane at rest stays there until its segment ends.
    may_settle: bool,
    /// The state at the start of the block before, within the same segment.
    before: Option<State<f64>>,
    held: Held,
    piston: Piston,
    /// That of the block before, which the equations are set to.
    stride: Option<Stride>,
    outcome: Outcome,
}

/// Whether the gas of a volume is that of its state; a measured pressure leaves the state to itself.
#[derive(Debug, Clone, Copy)]
pub(super) struct Held {
    pub chamber: bool,
    pub pipe: bool,
}

impl Held {
    /// What is no longer physical about a state with the chamber at this volume, if anything.
    fn fault(self, state: &State<f64>, volume: f64) -> Option<&'static str> {
        let sum = state.x + state.v + state.bristle;
        let gas = state.chamber_temperature + state.pipe_temperature + state.line_pressure;
        let chamber = if self.chamber { state.chamber_mass } else { 1.0 };
        let pipe = if self.pipe { state.pipe_mass } else { 1.0 };
        // In this order, since one bad state soon spoils all of them.
        if chamber > 0.0 && pipe > 0.0 && volume > 0.0 && (sum + gas + chamber + pipe).is_finite() {
            return None;
        }
        let named = [
            (!(pipe > 0.0 && pipe.is_finite()), "the gas in the pipe"),
            (!(chamber > 0.0 && chamber.is_finite()), "the gas in the chamber"),
            (!gas.is_finite(), "a temperature or the line's pressure"),
        ];
        Some(named.into_iter().find(|(bad, _)| *bad).map_or("the motion", |(_, name)| name))
    }
}

impl Clock {
    /// Cuts every segment into equal steps of at most the step control's. `may_settle` says that nothing but
    /// a new segment can move a lane at rest.
    pub(super) fn new(
        segments: &[Segment],
        control: StepControl,
        may_settle: bool,
        held: Held,
        piston: Piston,
    ) -> Self {
        let cut = |segment: &Segment| {
            let length = segment.end_s - segment.start_s;
            // A segment that is a whole number of steps up to rounding takes just that number.
            let count = (length / control.step_s - 1e-6).ceil().max(1.0);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 1, far below 2^32")]
            (*segment, count as u32, length / count)
        };
        let segments: Vec<_> = segments.iter().map(cut).collect();
        let beyond = segments.first().map_or(0, |(_, count, _)| *count);
        Self {
            segments,
            control,
            index: 0,
            beyond,
            block: BLOCK,
            left: 0,
            may_settle,
            before: None,
            held,
            piston,
            stride: None,
            outcome: Outcome::Complete,
        }
    }

    /// How the run ended, once it is done.
    pub(super) fn outcome(&self) -> Outcome {
        self.outcome
    }

    pub(crate) fn is_done(&self) -> bool {
        self.index >= self.segments.len()
    }

    /// Steps until this lane needs attention; nothing when its run is over.
    pub(crate) fn steps_left(&self) -> Option<u32> {
        (!self.is_done()).then_some(self.left)
    }

    /// Counts steps as taken; says whether the lane must be loaded anew.
    pub(crate) fn finish_steps(&mut self, count: u32) -> bool {
        if self.is_done() {
            return false;
        }
        self.left -= count;
        if self.left == 0 && self.beyond == 0 {
            self.index += 1;
            self.beyond = self.segments.get(self.index).map_or(0, |(_, count, _)| *count);
        }
        self.left == 0
    }

    /// Starts the next block of a lane; a lane whose run is over stands still.
    pub(super) fn load<R: Real>(&mut self, lane: usize, front: &mut Front<R>, coefficients: &mut Coefficients<R>) {
        let state = front.state.lane(lane);
        let volume = coefficients.closed_volume.lane(lane) - coefficients.piston_area.lane(lane) * state.x;
        if let (Some(what), Outcome::Complete) = (self.held.fault(&state, volume), self.outcome) {
            self.outcome = Outcome::Diverged { time_s: front.time.lane(lane), what };
            (self.index, self.beyond, self.left) = (self.segments.len(), 0, 0);
        }
        let Some((segment, count, step)) = self.segments.get(self.index) else {
            stand_still(lane, front, coefficients);
            return;
        };
        if self.index + 1 == self.segments.len() && state.x >= self.control.ends_at_m && self.beyond < *count {
            self.index += 1;
            self.left = 0;
            stand_still(lane, front, coefficients);
            return;
        }
        let starts = self.beyond == *count;
        let rests = self.may_settle
            && !starts
            && segment.spool_rate == 0.0
            && self.before.is_some_and(|before| state.is_within(&before, SETTLED));
        let before = self.before.replace(state).filter(|_| !starts);
        if rests {
            front.step.set_lane(lane, 0.0);
            front.wait.set_lane(lane, segment.end_s - front.time.lane(lane));
            (self.beyond, self.left) = (0, 1);
            return;
        }
        front.wait.set_lane(lane, 0.0);
        if starts {
            front.time.set_lane(lane, segment.start_s);
            front.spool.set_lane(lane, segment.spool);
            front.spool_rate.set_lane(lane, segment.spool_rate);
            front.since_command.set_lane(lane, (segment.start_s - segment.last_command_s).min(1e9));
        }
        let whole = self.beyond >= BLOCK && count - self.beyond >= UNREST && segment.spool_rate == 0.0;
        let past = before.filter(|_| whole).map(|state| Past {
            state,
            steps: self.block,
            length_s: step * f64::from(self.block),
            rested: self.stride.is_some_and(|stride| stride.span > 1),
        });
        let stride = Stride::choose(lane, front, &state, past.as_ref(), coefficients, self.control);
        let stride = if starts { stride.first(self.control) } else { stride };
        let block = block_steps(lane, &state, past.as_ref(), stride, coefficients, self.beyond);
        self.beyond -= block;
        self.block = block;
        self.left = block * stride.substeps / stride.span;
        front.step.set_lane(lane, step * stride.length());
        if stride.span > 1 || self.stride != Some(stride) {
            stride.load(lane, &state, coefficients, self.control, self.piston);
            self.stride = Some(stride);
        }
    }
}

/// Lets a lane stand still, and not ask for anything that its neighbours would wait for.
fn stand_still<R: Real>(lane: usize, front: &mut Front<R>, coefficients: &mut Coefficients<R>) {
    front.step.set_lane(lane, 0.0);
    front.wait.set_lane(lane, 0.0);
    front.spool_rate.set_lane(lane, 0.0);
    coefficients.port_ease.set_lane(lane, f64::INFINITY);
    coefficients.pipe_ease.set_lane(lane, f64::INFINITY);
}
