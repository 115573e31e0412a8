//! The model beside the record: how large the error is, where it sits and under which conditions.
//!
//! Errors of times are simulated minus measured, so that a model that is late has a positive error;
//! errors of positions in figures are measured minus simulated, as residuals usually are.

pub mod averages;
pub mod crossing;
pub mod findings;
pub mod phases;
mod runs;
mod score;
mod timings;
pub mod trend;

use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{Prepared, Valve, simulate};

pub use averages::LongAverage;
pub use findings::{Finding, PhaseError};
pub use phases::{Direction, LevelTimes, Phase};
pub use runs::{ChannelScore, RunComparison, StrokeComparison};
pub use score::{PhaseScore, Score};
pub use trend::{Condition, Trend};

use crate::data::{Dataset, RunData};
use crate::forward::{Predicted, record, residuals};

/// A model beside a campaign.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// All runs together.
    pub overall: Score,
    /// Recorded runs, then stroke times grouped by conditions.
    pub runs: Vec<RunComparison>,
    /// Averages of all residuals over longer times; empty for stroke times alone.
    pub averages: Vec<LongAverage>,
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
    /// Compares a valve with a dataset: every run under its own conditions.
    pub fn new(data: &Dataset, valve: &Valve) -> Self {
        let residual = residuals(data, core::slice::from_ref(valve)).remove(0);
        let mut runs = Vec::with_capacity(data.unit_count());
        let mut start = 0;
        for (run, predicted) in data.runs.iter().zip(simulated_records(data, valve)) {
            let end = start + run.block_count();
            runs.push(runs::compare_run(valve, run, predicted, &residual[start..end]));
            start = end;
        }
        runs.extend(timings::compare_times(data, valve));
        let strokes: Vec<StrokeComparison> = runs.iter().flat_map(|run| run.strokes.iter().cloned()).collect();
        let noise_m = data.runs.first().and_then(|run| run.channels.first()).map(|channel| channel.noise);
        let phase_errors = findings::phase_errors(&runs);
        let stroke_m = valve.parameters().stroke_m;
        Self {
            overall: Score::overall(runs.iter().map(|run| &run.score), &strokes, noise_m.unwrap_or(1.0)),
            averages: averages::long_averages(&data.runs.iter().collect::<Vec<&RunData>>(), &residual),
            findings: findings::findings(&phase_errors, &runs, stroke_m),
            phase_errors,
            noise_m,
            timing_noise_s: (!data.timing_rows.is_empty()).then_some(data.timing_noise_s),
            runs,
        }
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
    let mut records = vec![Predicted::default(); data.runs.len()];
    simulate(&prepared, pressures, |index, nodes, _| {
        record(valve, nodes, &data.runs[index].times_s, &mut records[index]);
    });
    records
}
