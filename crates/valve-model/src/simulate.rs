//! Runs in, nodes out: the entry to the integrator, for one run or for many.

use std::cell::Cell;

use crate::coefficients::Equations;
use crate::command::{CommandEdge, Segment, Solenoid, segments};
use crate::conditions::Conditions;
use crate::dispatch::{InstructionSet, LANES, integrate_lanes};
use crate::driven::Driven;
use crate::integrator::{LaneRun, Pace, Recorder, integrate};
use crate::params::Valve;
use crate::real::{Lanes, Real};
use crate::rest::vented_rest;
use crate::rhs::State;

/// The step of the integrator unless said otherwise, s.
pub const DEFAULT_STEP_S: f64 = 1e-3;

/// One recorded or planned run of a valve.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Its conditions.
    pub conditions: Conditions,
    /// Changes of the command, in order of time; the solenoid is vented before the first.
    pub commands: Vec<CommandEdge>,
    /// Its end, s.
    pub end_s: f64,
    /// Measured pressures that drive the model, if any.
    pub driven: Option<Driven>,
}

/// A run made ready: equations, segments, substeps and the state it starts from.
#[derive(Debug, Clone)]
pub struct Prepared {
    equations: Equations,
    segments: Vec<Segment>,
    initial: State<f64>,
    pace: Pace,
    driven: Option<Driven>,
}

impl Prepared {
    /// Makes a run of a valve ready, with steps of at most `step_s`; starts at rest, open and vented.
    pub fn new(valve: &Valve, run: &Run, step_s: f64) -> Self {
        let mut equations = Equations::new(valve, &run.conditions, step_s);
        if let Some(driven) = &run.driven {
            equations.terms.driven_pipe = driven.pipe_pressure_pa.is_some();
            equations.terms.driven_chamber = driven.chamber_pressure_pa.is_some();
        }
        let segments = segments(&run.commands, &Solenoid::from_effects(valve.effects()), run.end_s);
        let initial = vented_rest(&equations);
        let pace = equations.pace(step_s);
        Self { equations, segments, initial, pace, driven: run.driven.clone() }
    }

    /// Takes at most this many substeps where pipe and chamber are nearly at one pressure. Few are
    /// enough for a fit; stroke times close to the leak that stalls the valve want all of them.
    #[must_use]
    pub fn with_most_substeps(mut self, most: u32) -> Self {
        self.pace.most_substeps = most.max(1);
        self
    }

    /// Ends the run once the valve has opened after the last command, a little beyond its switch; the final
    /// state is then not that of a whole cycle.
    #[must_use]
    pub fn until_open(mut self, valve: &Valve) -> Self {
        let vents_last = self.segments.last().is_some_and(|segment| segment.spool == 0.0 && segment.spool_rate == 0.0);
        if vents_last {
            self.pace.ends_at_m = valve.switches().open_at * valve.parameters().stroke_m;
        }
        self
    }

    /// Starts from another state, such as the end of an earlier run.
    #[must_use]
    pub fn starting_from(mut self, state: State<f64>) -> Self {
        self.initial = state;
        self
    }

    /// The state it starts from.
    pub fn initial(&self) -> &State<f64> {
        &self.initial
    }

    /// The longest step that it will take, s.
    pub fn step_s(&self) -> f64 {
        self.pace.step_s
    }

    fn lane_run(&self) -> LaneRun<'_> {
        LaneRun {
            equations: &self.equations,
            segments: &self.segments,
            initial: self.initial,
            pace: self.pace,
            driven: self.driven.as_ref(),
        }
    }

    fn fits_beside(&self, other: &Self) -> bool {
        let same_formulas = self.equations.custom.len() == other.equations.custom.len()
            && self
                .equations
                .custom
                .iter()
                .zip(&other.equations.custom)
                .all(|(a, b)| a.target() == b.target() && a.formula() == b.formula());
        self.equations.terms == other.equations.terms && same_formulas
    }
}

/// The nodes of one run: its state at the start and after every step.
#[derive(Debug, Clone, Default)]
pub struct Nodes {
    /// Time, s, not falling.
    pub time_s: Vec<f64>,
    /// Position, m.
    pub position_m: Vec<f64>,
    /// Velocity, m/s.
    pub velocity_m_per_s: Vec<f64>,
    /// Chamber pressure, Pa; empty unless asked for.
    pub chamber_pressure_pa: Vec<f64>,
    /// Pipe pressure, Pa; empty unless asked for.
    pub pipe_pressure_pa: Vec<f64>,
}

/// Simulates runs side by side, as many at a time as fit, and hands the nodes and the final state of
/// each to `consume` with its index. Runs with the same groups of terms should stand together.
pub fn simulate(runs: &[Prepared], pressures: bool, consume: impl FnMut(usize, &Nodes, &State<f64>)) {
    simulate_with(InstructionSet::widest(), runs, pressures, consume);
}

/// As [`simulate`], with chosen instructions; the results are the same with any.
pub fn simulate_with(
    set: InstructionSet,
    runs: &[Prepared],
    pressures: bool,
    mut consume: impl FnMut(usize, &Nodes, &State<f64>),
) {
    let mut memory = SPARE.take().unwrap_or_default();
    let Memory { nodes, recorder } = &mut memory;
    let mut next = 0;
    while next < runs.len() {
        let mates = runs[next..].iter().take(LANES).take_while(|run| run.fits_beside(&runs[next])).count();
        let batch: Vec<LaneRun<'_>> = runs[next..next + mates].iter().map(Prepared::lane_run).collect();
        if mates == 1 {
            let mut single = Recorder::new(pressures);
            let state = scalar(&batch, &mut single);
            copy_lanes(&single, &mut nodes[..1]);
            consume(next, &nodes[0], &state);
        } else {
            recorder.clear(pressures);
            let base = batch[0].equations.terms.is_base();
            let states = integrate_lanes(set, base, &batch, recorder);
            copy_lanes(recorder, &mut nodes[..mates]);
            for (lane, state) in states.iter().enumerate() {
                consume(next + lane, &nodes[lane], state);
            }
        }
        next += mates;
    }
    if memory.recorder.time.capacity() <= MOST_SPARE_NODES {
        SPARE.set(Some(memory));
    }
}

/// What a batch writes to; kept for the next one of the thread, since fresh memory costs more than
/// what is written to it.
struct Memory {
    nodes: Vec<Nodes>,
    recorder: Recorder<Lanes<LANES>>,
}

impl Default for Memory {
    fn default() -> Self {
        Self { nodes: vec![Nodes::default(); LANES], recorder: Recorder::new(false) }
    }
}

/// Memory for more nodes than this is given back (some 50 MB with pressures).
const MOST_SPARE_NODES: usize = 1 << 17;

thread_local! {
    static SPARE: Cell<Option<Memory>> = const { Cell::new(None) };
}

/// Simulates runs one at a time on the scalar path; the definition that the lanes must meet.
pub fn simulate_scalar(runs: &[Prepared], pressures: bool, mut consume: impl FnMut(usize, &Nodes, &State<f64>)) {
    let mut nodes = [Nodes::default()];
    for (index, run) in runs.iter().enumerate() {
        let mut recorder = Recorder::new(pressures);
        let state = scalar(&[run.lane_run()], &mut recorder);
        copy_lanes(&recorder, &mut nodes);
        consume(index, &nodes[0], &state);
    }
}

fn scalar(run: &[LaneRun<'_>], recorder: &mut Recorder<f64>) -> State<f64> {
    let states = if run[0].equations.terms.is_base() {
        integrate::<f64, true>(run, recorder)
    } else {
        integrate::<f64, false>(run, recorder)
    };
    states[0]
}

/// Hands each lane of a recorder to nodes of its own.
fn copy_lanes<R: Real>(recorder: &Recorder<R>, nodes: &mut [Nodes]) {
    for (lane, nodes) in nodes.iter_mut().enumerate() {
        for (_, to) in nodes.channels(recorder) {
            to.clear();
            to.reserve(recorder.lane_length(lane));
        }
    }
    // All lanes of a block while it is in the cache.
    for start in (0..recorder.time.len()).step_by(COPY_BLOCK) {
        for (lane, nodes) in nodes.iter_mut().enumerate() {
            let end = recorder.lane_length(lane).min(start + COPY_BLOCK);
            for (from, to) in nodes.channels(recorder) {
                let block = from.get(start.min(from.len())..end.min(from.len())).unwrap_or_default();
                to.extend(block.iter().map(|pack| pack.lane(lane)));
            }
        }
    }
}

/// Nodes copied at a time.
const COPY_BLOCK: usize = 64;

impl Nodes {
    /// Each channel of a recorder with the list that takes it.
    fn channels<'a, R: Real>(&'a mut self, recorder: &'a Recorder<R>) -> [(&'a Vec<R>, &'a mut Vec<f64>); 5] {
        [
            (&recorder.time, &mut self.time_s),
            (&recorder.position, &mut self.position_m),
            (&recorder.velocity, &mut self.velocity_m_per_s),
            (&recorder.chamber_pressure, &mut self.chamber_pressure_pa),
            (&recorder.pipe_pressure, &mut self.pipe_pressure_pa),
        ]
    }
}
