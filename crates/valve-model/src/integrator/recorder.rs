//! What is kept of a run: the state at every node, lane by lane.

use super::Front;
use crate::real::Real;
use crate::rhs::{Inputs, System};
use crate::simulate::Nodes;

/// Steps that are kept side by side before each lane takes its own; all of them stay in the cache.
const STAGED: usize = 64;

/// The nodes of the runs that are being integrated, one run in each lane.
pub(crate) struct Recorder<R> {
    staged: Vec<Node<R>>,
    lanes: Vec<Lane>,
    pressures: bool,
}

/// One step of all lanes.
#[derive(Clone, Copy)]
struct Node<R> {
    time: R,
    position: R,
    velocity: R,
    chamber_pressure: R,
    pipe_pressure: R,
}

/// The run in one lane.
#[derive(Default)]
struct Lane {
    nodes: Nodes,
    /// The first staged step that belongs to it; nothing while the lane is idle.
    from: Option<usize>,
}

impl<R: Real> Recorder<R> {
    /// A recorder without runs.
    pub(crate) fn new() -> Self {
        Self {
            staged: Vec::with_capacity(STAGED),
            lanes: (0..R::LANES).map(|_| Lane::default()).collect(),
            pressures: false,
        }
    }

    /// Forgets what it holds, keeps the memory; pressures are kept if asked for.
    pub(crate) fn clear(&mut self, pressures: bool) {
        self.staged.clear();
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
    pub(super) fn begin<const BASE: bool>(
        &mut self,
        lane: usize,
        system: &System<'_, R>,
        front: &Front<R>,
        inputs: &Inputs<R>,
    ) {
        let node = self.of::<BASE>(system, front, inputs);
        let Lane { nodes, from } = &mut self.lanes[lane];
        nodes.clear();
        nodes.extend(lane, core::slice::from_ref(&node), self.pressures);
        *from = Some(self.staged.len());
    }

    /// Keeps the state of all lanes after a step.
    #[inline(always)]
    pub(super) fn node<const BASE: bool>(&mut self, system: &System<'_, R>, front: &Front<R>, inputs: &Inputs<R>) {
        let node = self.of::<BASE>(system, front, inputs);
        self.staged.push(node);
        if self.staged.len() == STAGED {
            self.hand_over();
        }
    }

    #[inline(always)]
    fn of<const BASE: bool>(&self, system: &System<'_, R>, front: &Front<R>, inputs: &Inputs<R>) -> Node<R> {
        let none = R::splat(0.0);
        let (chamber_pressure, pipe_pressure) =
            if self.pressures { system.pressures::<BASE>(&front.state, inputs) } else { (none, none) };
        Node { time: front.time, position: front.state.x, velocity: front.state.v, chamber_pressure, pipe_pressure }
    }

    /// Whether there is a run in a lane.
    pub(super) fn is_busy(&self, lane: usize) -> bool {
        self.lanes[lane].from.is_some()
    }

    /// Ends the run in a lane, which is then idle; its nodes.
    pub(super) fn end(&mut self, lane: usize) -> &Nodes {
        self.hand_over();
        let Lane { nodes, from } = &mut self.lanes[lane];
        *from = None;
        nodes
    }

    /// Hands the staged steps to the lanes.
    #[inline(never)]
    fn hand_over(&mut self) {
        for (lane, Lane { nodes, from }) in self.lanes.iter_mut().enumerate() {
            if let Some(from) = from {
                nodes.extend(lane, &self.staged[*from..], self.pressures);
                *from = 0;
            }
        }
        self.staged.clear();
    }
}

impl Nodes {
    fn clear(&mut self) {
        self.time_s.clear();
        self.position_m.clear();
        self.velocity_m_per_s.clear();
        self.chamber_pressure_pa.clear();
        self.pipe_pressure_pa.clear();
    }

    fn extend<R: Real>(&mut self, lane: usize, from: &[Node<R>], pressures: bool) {
        self.time_s.extend(from.iter().map(|node| node.time.lane(lane)));
        self.position_m.extend(from.iter().map(|node| node.position.lane(lane)));
        self.velocity_m_per_s.extend(from.iter().map(|node| node.velocity.lane(lane)));
        if pressures {
            self.chamber_pressure_pa.extend(from.iter().map(|node| node.chamber_pressure.lane(lane)));
            self.pipe_pressure_pa.extend(from.iter().map(|node| node.pipe_pressure.lane(lane)));
        }
    }
}
