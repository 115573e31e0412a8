//! Recorded strokes, the models beside them and what a search has found.

use std::collections::BTreeMap;

use answers::CampaignInput;
use answers::comparison::{ComparisonDocument, ForceDocument};
use model_lab::compare::Comparison;
use model_lab::data::{Channel, RunData};
use model_lab::diagnosis::Explanation;
use model_lab::forward::channel_of;
use model_lab::residual_force::ResidualForce;
use serde::Serialize;
use serde_json::{Value, json};
use valve_model::Valve;

use crate::lab::answer::{Found, answer};
use crate::lab::describe;
use crate::lab::simulate::{MeasuredRun, SimulatedRun, rounded, shown_per_si, strokes};
use crate::lab::subject::Subject;
use crate::thin::corners;

/// Points of all runs together, so that a page of many runs stays small.
const POINTS: usize = 30_000;

/// Points of a run: the least that still show a stroke, and as many as a screen is wide.
const POINTS_OF_RUN: [usize; 2] = [150, 2000];

/// What the page shows of a run's score.
const SCORES: [&str; 5] = ["file", "rmse_m", "normalised_rms", "close_time_error_s", "open_time_error_s"];

/// A model beside the record.
#[derive(Debug, Clone)]
pub struct NamedModel {
    /// What it is called on the page.
    pub name: String,
    /// The model.
    pub valve: Valve,
}

/// What the page shows of a campaign.
#[derive(Debug, Serialize)]
pub struct FrozenCampaign {
    lab: describe::Description,
    models: Vec<String>,
    comparisons: Vec<Value>,
    channels: BTreeMap<&'static str, Traces>,
    missing: Vec<Missing>,
    answer: Option<Found>,
}

/// One channel of all runs: as measured, and as each model has it.
#[derive(Debug, Serialize)]
struct Traces {
    measured: Vec<MeasuredRun>,
    simulated: Vec<Vec<SimulatedRun>>,
}

/// The force that a model lacks; nothing where it cannot be told.
#[derive(Debug, Serialize)]
struct Missing {
    force: Option<ForceDocument>,
}

/// What the page shows of a campaign: every run as measured and as each model has it, their errors, the force that each
/// lacks, and the answer of a search. The first model is the valve file. Nothing where the strokes of a model cannot be simulated.
pub fn campaign(input: &CampaignInput, models: &[NamedModel], found: Option<&Explanation>) -> Option<FrozenCampaign> {
    let subject = Subject::of(input.clone());
    let compared: Option<Vec<Comparison>> =
        models.iter().map(|model| Comparison::new(&subject.identified, &model.valve, &input.data)).collect();
    let compared = compared?;
    let lab = describe::Description::new(&subject).without_sliders();
    let channels = describe::channels(&subject);
    let count = POINTS / (input.data.runs.len() * channels.len()).max(1);
    let count = count.clamp(POINTS_OF_RUN[0], POINTS_OF_RUN[1]);
    let shown =
        channels.iter().map(|(channel, name)| (*name, traces(&input.data.runs, *channel, &compared, count))).collect();
    let missing = |model: &NamedModel| {
        let force = ResidualForce::new(&input.data, &model.valve, input.file.tolerances());
        Missing { force: force.as_ref().map(ForceDocument::from) }
    };
    Some(FrozenCampaign {
        lab,
        models: models.iter().map(|model| model.name.clone()).collect(),
        comparisons: compared.iter().map(|one| scores(&ComparisonDocument::new(input, one))).collect(),
        channels: shown,
        missing: models.iter().map(missing).collect(),
        answer: found.map(|found| answer(found, input)),
    })
}

/// A comparison without what the page does not show: every level of every stroke.
fn scores(document: &ComparisonDocument<'_>) -> Value {
    let mut scores = json!(document);
    if let Some(all) = scores.as_object_mut() {
        all.retain(|key, _| ["overall", "runs", "words"].contains(&key.as_str()));
    }
    for run in scores["runs"].as_array_mut().into_iter().flatten().filter_map(Value::as_object_mut) {
        run.retain(|key, _| SCORES.contains(&key.as_str()));
    }
    scores
}

/// One channel of all runs, measured and simulated at the same times: those that keep the corners of all.
fn traces(runs: &[RunData], channel: Channel, compared: &[Comparison], count: usize) -> Traces {
    let factor = shown_per_si(channel);
    let mut measured = Vec::with_capacity(runs.len());
    let mut simulated: Vec<Vec<SimulatedRun>> = compared.iter().map(|_| Vec::with_capacity(runs.len())).collect();
    for (index, run) in runs.iter().enumerate() {
        let record = run.channels.iter().find(|found| found.channel == channel).map(|found| &found.samples[..]);
        let models: Vec<&[f64]> = compared.iter().map(|one| channel_of(&one.runs[index].predicted, channel)).collect();
        let columns: Vec<&[f64]> = record.into_iter().chain(models.iter().copied()).collect();
        let kept = corners(&run.times_s, &columns, count);
        let at = |values: &[f64]| -> Vec<Option<f64>> {
            kept.iter().map(|place| shown(values.get(*place).copied(), factor)).collect()
        };
        let time_s = kept.iter().map(|place| Some(rounded(run.times_s[*place]))).collect();
        measured.push(MeasuredRun { run: index, time_s, measured: record.map(at) });
        for ((model, one), values) in simulated.iter_mut().zip(compared).zip(&models) {
            model.push(SimulatedRun { run: index, simulated: at(values), strokes: strokes(run, &one.runs[index]) });
        }
    }
    Traces { measured, simulated }
}

fn shown(value: Option<f64>, factor: f64) -> Option<f64> {
    value.filter(|value| value.is_finite()).map(|value| rounded(value * factor))
}
