//! What is kept of a run: the state at every node, lane by lane.

use super::Front;
use crate::real::Real;
use crate::rhs::{Inputs, System};

/// The nodes of up to `R::LANES` runs.
pub(crate) struct Recorder<R> {
    pub time: Vec<R>,
    pub position: Vec<R>,
    pub velocity: Vec<R>,
    pub chamber_pressure: Vec<R>,
    pub pipe_pressure: Vec<R>,
    pressures: bool,
    lengths: Vec<Option<usize>>,
}

impl<R: Real> Recorder<R> {
    /// A recorder for this many nodes; pressures are kept if asked for.
    pub(crate) fn new(pressures: bool) -> Self {
        Self {
            time: Vec::new(),
            position: Vec::new(),
            velocity: Vec::new(),
            chamber_pressure: Vec::new(),
            pipe_pressure: Vec::new(),
            pressures,
            lengths: vec![None; R::LANES],
        }
    }

    /// Forgets what it holds, keeps the memory.
    pub(crate) fn clear(&mut self, pressures: bool) {
        self.time.clear();
        self.position.clear();
        self.velocity.clear();
        self.chamber_pressure.clear();
        self.pipe_pressure.clear();
        self.pressures = pressures;
        self.lengths.fill(None);
    }

    #[inline(always)]
    pub(super) fn node<const BASE: bool>(&mut self, system: &System<'_, R>, front: &Front<R>, inputs: &Inputs<R>) {
        self.time.push(front.time);
        self.position.push(front.state.x);
        self.velocity.push(front.state.v);
        if self.pressures {
            let (chamber, pipe) = system.pressures::<BASE>(&front.state, inputs);
            self.chamber_pressure.push(chamber);
            self.pipe_pressure.push(pipe);
        }
    }

    /// Notes where a lane ends.
    #[inline(always)]
    pub(super) fn close_lane_if(&mut self, lane: usize, done: bool) {
        if done && self.lengths[lane].is_none() {
            self.lengths[lane] = Some(self.time.len());
        }
    }

    /// How many nodes a lane has.
    pub(crate) fn lane_length(&self, lane: usize) -> usize {
        self.lengths[lane].unwrap_or(self.time.len())
    }
}
