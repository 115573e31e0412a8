//! The model beside the record: how large the error is, where it sits and under which conditions.
//!
//! Everywhere measured minus simulated: where the model is late, errors of times are negative. The model is taken as it
//! stands, instruments and conditions at their word; [`Subject::stated`] allows for what they may be off by.

pub mod findings;
pub mod phases;
mod runs;
mod score;
mod timings;
pub mod trend;

use identify::Stop;
use identify::problem::{predict_all, residuals};
use identify::select::Level;
use rayon::prelude::*;
use valve_model::simulate::{ABREAST, DEFAULT_STEP_S};
use valve_model::{Prepared, Valve, simulate};

pub use findings::{Finding, PhaseError};
pub use phases::{LevelTimes, Phase};

pub use crate::crossing::Direction;
pub use runs::{ChannelScore, RunComparison, StrokeComparison};
pub use score::{PhaseScore, Score};
pub use trend::{Condition, Trend};

use self::score::PhaseSquares;
use crate::data::Dataset;
use crate::errors::Errors;
use crate::forward::{Predicted, record};
use crate::identification::Subject;
use crate::space::Space;

/// A model beside a campaign.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// All runs together.
    pub overall: Score,
    /// Recorded runs, then stroke times grouped by conditions.
    pub runs: Vec<RunComparison>,
    /// The time errors of each direction and phase over the runs, with their trends.
    pub phase_errors: Vec<PhaseError>,
    /// What the model gets wrong, the worst first; empty where nothing is seen beyond the noise.
    pub findings: Vec<Finding>,
    /// One standard deviation of the position noise, m.
    pub noise_m: Option<f64>,
    /// One standard deviation of a stroke time, s, where there are stroke times.
    pub timing_noise_s: Option<f64>,
}

impl Comparison {
    /// Compares a valve with a campaign made ready: every run under its own conditions. The subject may be that of another
    /// valve; `data` is the same campaign. Nothing where the strokes cannot be simulated.
    pub fn new(subject: &Subject, valve: &Valve, data: &Dataset) -> Option<Self> {
        let problem = subject.problem(Space::new(valve, &[]), Level::High, Stop::never());
        let at = problem.at_their_word();
        let predicted = predict_all(&problem, std::slice::from_ref(&at)).pop()??;
        let (problem, residual) = (&problem, &residuals(&problem, &predicted)[..]);
        let mut records = simulated_records(data, valve);
        problem.write_records(&at, data, &mut records);
        let compared: Vec<(RunComparison, PhaseSquares)> = (data.runs.par_iter().zip(records).enumerate())
            .map(|(source, (run, predicted))| runs::compare_run(valve, (source, run), predicted, (problem, residual)))
            .collect();
        let mut runs = Vec::with_capacity(data.runs.len() + data.timing_groups.len());
        let mut squares = PhaseSquares::default();
        for (run, of_run) in compared {
            squares.add_all(&of_run);
            runs.push(run);
        }
        runs.extend(timings::compare_times(data, valve, (problem, residual)));
        let strokes: Vec<StrokeComparison> = runs.iter().flat_map(|run| run.strokes.iter().cloned()).collect();
        let phase_errors = findings::phase_errors(&runs);
        let stroke_m = valve.parameters().stroke_m;
        let has_traces = !data.runs.is_empty();
        Some(Self {
            overall: Score::new(Errors::of(problem, residual), has_traces.then_some(&squares), &strokes),
            findings: findings::findings(&phase_errors, &runs, stroke_m),
            phase_errors,
            noise_m: data.runs.first().and_then(|run| run.channels.first()).map(|channel| channel.noise),
            timing_noise_s: (!data.timing_rows.is_empty()).then_some(data.timing_noise_s),
            runs,
        })
    }

    /// What the model gets wrong, in a sentence each; one sentence that says so where nothing is seen.
    pub fn words(&self) -> Vec<String> {
        findings::words(self)
    }
}

/// What a recorder would have written down of every run of a dataset.
pub fn simulated_records(data: &Dataset, valve: &Valve) -> Vec<Predicted> {
    let prepared: Vec<Prepared> = data.runs.iter().map(|run| Prepared::new(valve, &run.run, DEFAULT_STEP_S)).collect();
    let pressures = data.runs.iter().any(|run| run.channels.len() > 1);
    let few = prepared.par_chunks(ABREAST).zip(data.runs.par_chunks(ABREAST));
    few.flat_map(|(prepared, runs)| {
        let mut records = vec![Predicted::default(); runs.len()];
        simulate(prepared, pressures, |index, nodes, _| {
            record(valve, nodes, &runs[index].times_s, &mut records[index]);
        });
        records
    })
    .collect()
}
