//! What is kept of a run: the state at every node, lane by lane.

use super::Front;
use crate::real::{LANES, Real};
use crate::rhs::System;
use crate::state::Inputs;
use crate::trajectory::{Outcome, Trajectory};

/// Steps that are kept side by side before each lane takes its own; all of them stay in the cache.
const STAGED: usize = 64;

/// The nodes of the runs that are being integrated, one run in each lane.
pub(crate) struct Recorder {
    staged: Channels,
    /// How many steps are staged.
    count: usize,
    lanes: Vec<Lane>,
    pressures: bool,
}

/// Steps of all lanes, channel by channel.
struct Channels {
    time: Vec<Pack>,
    position: Vec<Pack>,
    velocity: Vec<Pack>,
    chamber_pressure: Vec<Pack>,
    pipe_pressure: Vec<Pack>,
}

/// A number of each lane; a run alone has the first.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Pack([f64; LANES]);

/// The run in one lane.
#[derive(Default)]
struct Lane {
    nodes: Trajectory,
    /// The first staged step that belongs to it; nothing while the lane is idle.
    from: Option<usize>,
}

impl Recorder {
    /// A recorder without runs.
    pub(crate) fn new() -> Self {
        let channel = || vec![Pack([0.0; LANES]); STAGED];
        Self {
            staged: Channels {
                time: channel(),
                position: channel(),
                velocity: channel(),
                chamber_pressure: channel(),
                pipe_pressure: channel(),
            },
            count: 0,
            lanes: (0..LANES).map(|_| Lane::default()).collect(),
            pressures: false,
        }
    }

    /// Forgets what it holds, keeps the memory; pressures are kept if asked for.
    pub(crate) fn clear(&mut self, pressures: bool) {
        self.count = 0;
        self.pressures = pressures;
        for lane in &mut self.lanes {
            lane.from = None;
        }
    }

    /// How many nodes it has memory for.
    pub(crate) fn capacity(&self) -> usize {
        self.lanes.iter().map(|lane| lane.nodes.time_s.capacity()).sum()
    }

    /// Starts a run in a lane, with its initial node.
    #[inline(never)]
    pub(super) fn begin<R: Real, const GROUPS: u8>(
        &mut self,
        lane: usize,
        system: &System<'_, R>,
        front: &Front<R>,
        inputs: &Inputs<R>,
    ) {
        let Lane { nodes, from } = &mut self.lanes[lane];
        nodes.clear();
        nodes.time_s.push(front.time.lane(lane));
        nodes.position_m.push(front.state.x.lane(lane));
        nodes.velocity_m_per_s.push(front.state.v.lane(lane));
        if self.pressures {
            let (chamber, pipe) = system.gas::<GROUPS>(&front.state, inputs);
            nodes.chamber_pressure_pa.push(chamber.pa.lane(lane));
            nodes.pipe_pressure_pa.push(pipe.pa.lane(lane));
        }
        *from = Some(self.count);
    }

    /// Keeps the state of all lanes after a step.
    #[inline(always)]
    pub(super) fn node<R: Real, const GROUPS: u8>(
        &mut self,
        system: &System<'_, R>,
        front: &Front<R>,
        inputs: &Inputs<R>,
    ) {
        let at = self.count;
        front.time.store(&mut self.staged.time[at].0);
        front.state.x.store(&mut self.staged.position[at].0);
        front.state.v.store(&mut self.staged.velocity[at].0);
        if self.pressures {
            let (chamber, pipe) = system.gas::<GROUPS>(&front.state, inputs);
            chamber.pa.store(&mut self.staged.chamber_pressure[at].0);
            pipe.pa.store(&mut self.staged.pipe_pressure[at].0);
        }
        self.count += 1;
        if self.count == STAGED {
            self.hand_over();
        }
    }

    /// Whether there is a run in a lane.
    pub(super) fn is_busy(&self, lane: usize) -> bool {
        self.lanes[lane].from.is_some()
    }

    /// Ends the run in a lane, which is then idle; its nodes.
    pub(super) fn end(&mut self, lane: usize, outcome: Outcome) -> &Trajectory {
        self.hand_over();
        let Lane { nodes, from } = &mut self.lanes[lane];
        *from = None;
        nodes.outcome = outcome;
        if let Outcome::Diverged { .. } = outcome {
            nodes.keep_finite();
        }
        nodes
    }

    /// Hands the staged steps to the lanes.
    #[inline(never)]
    fn hand_over(&mut self) {
        let Self { staged, count, lanes, pressures } = self;
        for (lane, Lane { nodes, from }) in lanes.iter_mut().enumerate() {
            let Some(from) = from else { continue };
            let extend = |to: &mut Vec<f64>, channel: &[Pack]| {
                to.extend(channel[*from..*count].iter().map(|pack| pack.0[lane]));
            };
            extend(&mut nodes.time_s, &staged.time);
            extend(&mut nodes.position_m, &staged.position);
            extend(&mut nodes.velocity_m_per_s, &staged.velocity);
            if *pressures {
                extend(&mut nodes.chamber_pressure_pa, &staged.chamber_pressure);
                extend(&mut nodes.pipe_pressure_pa, &staged.pipe_pressure);
            }
            *from = 0;
        }
        *count = 0;
    }
}
