//! Runs in, nodes out: the entry to the integrator, for one run or for many.

use std::borrow::Borrow;
use std::cell::Cell;
use std::sync::Arc;

use crate::command::{CommandEdge, Segment, segments_after};
use crate::conditions::Conditions;
use crate::dispatch::{InstructionSet, integrate_scalar, integrate_with};
use crate::equations::Equations;
use crate::equilibrium::vented_rest;
pub use crate::fidelity::DEFAULT_STEP_S;
use crate::fidelity::Fidelity;
use crate::integrator::{LaneRun, PACKS, Recorder, Recorders, StepControl};
use crate::params::ParameterError;
use crate::prescribed::Prescribed;
use crate::real::LANES;
use crate::start::Start;
use crate::state::{Inputs, State};
use crate::trajectory::Trajectory;
use crate::valve::Valve;

/// So many runs advance together where there are as many.
pub const ABREAST: usize = PACKS * LANES;

/// One recorded or planned run of a valve.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Its conditions.
    pub conditions: Conditions,
    /// Changes of the command, in order of time; those before 0 were given before the start. Before the first, the
    /// solenoid is as [`Run::start`] says: vented, unless the run starts closed.
    pub commands: Vec<CommandEdge>,
    /// Its end, s.
    pub end_s: f64,
    /// Measured pressures that drive the model, if any.
    pub prescribed: Option<Arc<Prescribed>>,
    /// Where it starts.
    pub start: Start,
}

impl Run {
    /// What the solenoid of a valve does in it.
    pub fn segments(&self, valve: &Valve) -> Vec<Segment> {
        segments_after(self.start.is_energised(), &self.commands, &valve.solenoid(), self.end_s)
    }
}

/// A run that is not begun, and what would be right.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RunError {
    /// A parameter makes it absurdly long.
    #[error(transparent)]
    TooStiff(#[from] ParameterError),
    /// It cannot start there.
    #[error("the run starts at {0}")]
    Start(String),
    /// The spool is told to go where it cannot.
    #[error("the command at {time_s} s sends the spool to {spool}; expected 0 (the exhaust) to 1 (the supply)")]
    Command {
        /// When, s.
        time_s: f64,
        /// Where to.
        spool: f64,
    },
    /// The measured pressures that drive it are no record.
    #[error("the measured pressures that drive the run have {0}")]
    Prescribed(String),
}

/// A run made ready: equations, segments, substeps and the state it starts from.
#[derive(Debug, Clone)]
pub struct Prepared {
    equations: Equations,
    segments: Vec<Segment>,
    initial: State<f64>,
    control: StepControl,
    prescribed: Option<Arc<Prescribed>>,
    refused: Option<RunError>,
}

impl Prepared {
    /// Makes a run of a valve ready, to be followed as closely as `fidelity` says; a number alone is the longest step, s.
    /// A run that [`Prepared::check`] refuses is not begun.
    pub fn new(valve: &Valve, run: &Run, fidelity: impl Into<Fidelity>) -> Self {
        let fidelity = fidelity.into();
        let mut equations = Equations::new(valve, &run.conditions, fidelity);
        let mut segments = run.segments(valve);
        equations.terms.spool |= run.commands.iter().any(|edge| edge.spool > 0.0 && edge.spool < 1.0);
        let mut inputs = Inputs { spool: segments.first().map_or(0.0, |first| first.spool), ..Inputs::default() };
        if let Some(prescribed) = &run.prescribed {
            equations.terms.prescribed_pipe = prescribed.pipe_pressure_pa.is_some();
            equations.terms.prescribed_chamber = prescribed.chamber_pressure_pa.is_some();
            equations.terms.prescribed_supply = prescribed.supply_pressure_pa.is_some();
            let first = prescribed.at(0.0);
            (inputs.pipe_pressure, inputs.chamber_pressure) = (first.pipe, first.chamber);
            if equations.terms.prescribed_supply {
                equations.coefficients.supply = first.supply;
            }
        }
        inputs.supply_pressure = equations.coefficients.supply;
        let refused = refusal(&equations, run, fidelity).err();
        let control = equations.step_control(fidelity);
        let initial = if refused.is_some() {
            segments.clear();
            vented_rest(&equations, &inputs)
        } else {
            run.start.state(&equations, &inputs)
        };
        Self { equations, segments, initial, control, prescribed: run.prescribed.clone(), refused }
    }

    /// Whether it can be begun, and why not. One that cannot ends at once with [`crate::Outcome::Refused`].
    pub fn check(&self) -> Result<(), &RunError> {
        self.refused.as_ref().map_or(Ok(()), Err)
    }

    /// Ends the run once the valve has opened after the last command, a little beyond its switch; the final
    /// state is then not that of a whole cycle.
    #[must_use]
    pub fn until_open(mut self, valve: &Valve) -> Self {
        let vents_last = self.segments.last().is_some_and(|segment| segment.spool == 0.0 && segment.spool_rate == 0.0);
        if vents_last {
            self.control.ends_at_m = valve.switches().open_at * valve.parameters().stroke_m;
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
        self.control.step_s
    }

    fn lane_run(&self) -> LaneRun<'_> {
        LaneRun {
            equations: &self.equations,
            segments: &self.segments,
            initial: self.initial,
            control: self.control,
            prescribed: self.prescribed.as_deref(),
            refused: self.refused.is_some(),
        }
    }

    /// Whether it has the same groups of terms as another run, so that they can share the lanes.
    pub fn fits_beside(&self, other: &Self) -> bool {
        let same_formulas = self.equations.custom.len() == other.equations.custom.len()
            && self
                .equations
                .custom
                .iter()
                .zip(&other.equations.custom)
                .all(|(a, b)| a.target() == b.target() && a.formula() == b.formula());
        self.equations.terms == other.equations.terms
            && self.equations.laws.variants == other.equations.laws.variants
            && same_formulas
    }
}

/// Whether a run can be begun.
fn refusal(equations: &Equations, run: &Run, fidelity: Fidelity) -> Result<(), RunError> {
    equations.affordable(fidelity, run.end_s)?;
    if let Some(fault) = run.prescribed.as_ref().and_then(|prescribed| prescribed.fault()) {
        return Err(RunError::Prescribed(fault));
    }
    if let Some(&CommandEdge { time_s, spool }) = run.commands.iter().find(|edge| !(0.0..=1.0).contains(&edge.spool)) {
        return Err(RunError::Command { time_s, spool });
    }
    run.start.fault(equations).map_or(Ok(()), |fault| Err(RunError::Start(fault)))
}

/// Simulates runs side by side and hands the nodes and the final state of each to `consume` with its index,
/// in the order in which they end. Runs with the same groups of terms share the lanes.
pub fn simulate<P: Borrow<Prepared>>(
    runs: &[P],
    pressures: bool,
    consume: impl FnMut(usize, &Trajectory, &State<f64>),
) {
    simulate_with(InstructionSet::widest(), runs, pressures, consume);
}

/// As [`simulate`], with chosen instructions; fused and unfused ones differ by rounding alone.
pub fn simulate_with<P: Borrow<Prepared>>(
    set: InstructionSet,
    runs: &[P],
    pressures: bool,
    mut consume: impl FnMut(usize, &Trajectory, &State<f64>),
) {
    let mut recorders = SPARE.take().unwrap_or_else(recorders);
    let mut waiting: Vec<usize> = (0..runs.len()).collect();
    while let Some(first) = waiting.first().map(|first| runs[*first].borrow()) {
        let (mates, others): (Vec<usize>, Vec<usize>) =
            waiting.into_iter().partition(|index| runs[*index].borrow().fits_beside(first));
        let batch: Vec<LaneRun<'_>> = mates.iter().map(|index| runs[*index].borrow().lane_run()).collect();
        let mut take = |mate: usize, nodes: &Trajectory, state: &State<f64>| consume(mates[mate], nodes, state);
        for recorder in &mut recorders {
            recorder.clear(pressures);
        }
        integrate_with(set, &batch, &mut recorders, &mut take);
        waiting = others;
    }
    if recorders.iter().map(Recorder::capacity).sum::<usize>() <= MOST_SPARE_NODES {
        SPARE.set(Some(recorders));
    }
}

fn recorders() -> Recorders {
    std::array::from_fn(|_| Recorder::new())
}

/// Memory for more nodes than this is given back (some 40 MB with pressures).
const MOST_SPARE_NODES: usize = 1 << 20;

thread_local! {
    /// What a batch writes to; kept for the next one of the thread, since fresh memory costs more than what
    /// is written to it.
    static SPARE: Cell<Option<Recorders>> = const { Cell::new(None) };
}

/// Simulates runs one at a time with plain numbers, no product fused with a sum; what the lanes must meet, the
/// baseline to the bit and fused ones to 1e-9 s in every stroke time.
pub fn simulate_scalar(runs: &[Prepared], pressures: bool, mut consume: impl FnMut(usize, &Trajectory, &State<f64>)) {
    let mut recorders = recorders();
    for (index, run) in runs.iter().enumerate() {
        let mut take = |_: usize, nodes: &Trajectory, state: &State<f64>| consume(index, nodes, state);
        recorders[0].clear(pressures);
        integrate_scalar(&[run.lane_run()], &mut recorders, &mut take);
    }
}
