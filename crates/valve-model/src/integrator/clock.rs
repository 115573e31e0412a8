//! The time of one lane: which segment it is in and how many steps are left of it.

use super::Front;
use crate::command::Segment;
use crate::real::Real;

/// The clock of one lane.
pub(crate) struct Clock {
    segments: Vec<(Segment, u32, f64)>,
    index: usize,
    left: u32,
}

impl Clock {
    /// Cuts every segment into equal steps of at most `step_s`.
    pub(crate) fn new(segments: &[Segment], step_s: f64) -> Self {
        let cut = |segment: &Segment| {
            let length = segment.end_s - segment.start_s;
            // A segment that is a whole number of steps up to rounding takes just that number.
            let count = (length / step_s - 1e-6).ceil().max(1.0);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 1, far below 2^32")]
            (*segment, count as u32, length / count)
        };
        let segments: Vec<_> = segments.iter().map(cut).collect();
        let left = segments.first().map_or(0, |(_, count, _)| *count);
        Self { segments, index: 0, left }
    }

    pub(crate) fn is_done(&self) -> bool {
        self.index >= self.segments.len()
    }

    /// Steps left in the current segment; nothing when the run is over.
    pub(crate) fn steps_left(&self) -> Option<u32> {
        (!self.is_done()).then_some(self.left)
    }

    /// The regular step of the current segment, s; 0 when the run is over.
    pub(crate) fn step_s(&self) -> f64 {
        self.segments.get(self.index).map_or(0.0, |(_, _, step)| *step)
    }

    /// Counts steps as taken; says whether the lane has entered another segment or ended.
    pub(crate) fn finish_steps(&mut self, count: u32) -> bool {
        if self.is_done() {
            return false;
        }
        self.left -= count;
        if self.left > 0 {
            return false;
        }
        self.index += 1;
        self.left = self.segments.get(self.index).map_or(0, |(_, count, _)| *count);
        true
    }

    /// Puts the current segment into a lane of the front; a lane that is over stands still.
    pub(super) fn load<R: Real>(&self, lane: usize, front: &mut Front<R>) {
        let Some((segment, _, step)) = self.segments.get(self.index) else {
            front.step.set_lane(lane, 0.0);
            front.spool_rate.set_lane(lane, 0.0);
            return;
        };
        front.time.set_lane(lane, segment.start_s);
        front.step.set_lane(lane, *step);
        front.spool.set_lane(lane, segment.spool);
        front.spool_rate.set_lane(lane, segment.spool_rate);
        front.since_command.set_lane(lane, (segment.start_s - segment.last_command_s).min(1e9));
    }
}
