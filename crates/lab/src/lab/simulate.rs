//! Strokes as measured and as the sliders have them.

use answers::comparison::{ComparisonDocument, ForceDocument};
use model_lab::compare::phases::boundaries;
use model_lab::compare::{Comparison, RunComparison};
use model_lab::data::{Channel, RunData};
use model_lab::forward::{Predicted, channel_of, record};
use model_lab::residual_force::ResidualForce;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{CommandEdge, Conditions, Prepared, Run, Start, Valve, simulate};

use super::model::Model;
use super::subject::Subject;
use crate::site::Refusal;

/// Which samples are wanted.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Selection {
    /// The runs, by index.
    runs: Vec<usize>,
    /// From when to when, s; nothing for all.
    window_s: Option<[f64; 2]>,
    /// Points of a run at most.
    points: usize,
    /// "position", "chamber" or "pipe".
    channel: String,
}

impl Selection {
    fn channel(&self) -> Channel {
        match self.channel.as_str() {
            "chamber" => Channel::ChamberPressure,
            "pipe" => Channel::PipePressure,
            _ => Channel::Position,
        }
    }

    fn factor(&self) -> f64 {
        shown_per_si(self.channel())
    }

    fn runs<'a>(&self, subject: &'a Subject) -> Vec<(usize, &'a RunData)> {
        let runs = &subject.input.data.runs;
        self.runs.iter().filter_map(|index| Some((*index, runs.get(*index)?))).collect()
    }

    /// Every so many samples within the window, and one beyond each end, so that lines reach the edge.
    fn samples(&self, times_s: &[f64]) -> impl Iterator<Item = usize> + use<> {
        let (from, to) = match self.window_s {
            Some([from, to]) => (
                times_s.partition_point(|time| *time < from).saturating_sub(1),
                (times_s.partition_point(|time| *time <= to) + 1).min(times_s.len()),
            ),
            None => (0, times_s.len()),
        };
        let step = to.saturating_sub(from).div_ceil(self.points.clamp(10, 20_000)).max(1);
        // Always at the same samples, whatever the window: what is seen does not flicker while it is dragged.
        (from - from % step..to).step_by(step)
    }

    fn thinned(&self, times_s: &[f64], values: &[f64], factor: f64) -> Vec<Option<f64>> {
        let value = |index: usize| values.get(index).copied().filter(|value| value.is_finite());
        self.samples(times_s).map(|index| value(index).map(|value| rounded(value * factor))).collect()
    }
}

/// Four decimals: a tenth of a micrometre, a tenth of a pascal.
pub fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// From SI to what the page shows: mm and kPa.
pub fn shown_per_si(channel: Channel) -> f64 {
    if channel == Channel::Position { 1e3 } else { 1e-3 }
}

/// A run as it was recorded; nothing where the channel was not.
#[derive(Debug, Serialize)]
pub struct MeasuredRun {
    /// Its place among the runs.
    pub run: usize,
    /// When, s.
    pub time_s: Vec<Option<f64>>,
    /// mm or kPa.
    pub measured: Option<Vec<Option<f64>>>,
}

/// A run as a model has it, at the same samples.
#[derive(Debug, Serialize)]
pub struct SimulatedRun {
    /// Its place among the runs.
    pub run: usize,
    /// mm or kPa.
    pub simulated: Vec<Option<f64>>,
    /// Its strokes.
    pub strokes: Vec<StrokeInfo>,
}

/// What was recorded.
#[derive(Debug, Serialize)]
pub struct Measured {
    version: u64,
    runs: Vec<MeasuredRun>,
}

/// What was recorded of the runs that are wanted.
pub fn measured(subject: &Subject, wanted: &Selection) -> Measured {
    let runs = wanted
        .runs(subject)
        .into_iter()
        .map(|(index, run)| {
            let samples = run.channels.iter().find(|channel| channel.channel == wanted.channel());
            MeasuredRun {
                run: index,
                time_s: wanted.thinned(&run.times_s, &run.times_s, 1.0),
                measured: samples.map(|found| wanted.thinned(&run.times_s, &found.samples, wanted.factor())),
            }
        })
        .collect();
    Measured { version: subject.version, runs }
}

/// A model and what is wanted of it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    model: Model,
    show: Selection,
}

/// Simulates every run with a model: errors of all runs, traces of those that are shown.
pub fn simulated(subject: &Subject, request: &Request) -> Result<Value, Refusal> {
    let input = &subject.input;
    let valve = request.model.valve(&input.file)?;
    let comparison = Comparison::new(&subject.identified, &valve, &input.data)
        .ok_or_else(|| Refusal::new("the strokes of this model cannot be simulated"))?;
    let show = &request.show;
    let runs: Vec<SimulatedRun> = show
        .runs(subject)
        .into_iter()
        .map(|(index, run)| {
            let model = channel_of(&comparison.runs[index].predicted, show.channel());
            SimulatedRun {
                run: index,
                simulated: show.thinned(&run.times_s, model, show.factor()),
                strokes: strokes(run, &comparison.runs[index]),
            }
        })
        .collect();
    Ok(json!({ "version": subject.version, "comparison": ComparisonDocument::new(input, &comparison), "runs": runs }))
}

/// A stroke: its command, where its phases end, and when it got to the limit.
#[derive(Debug, Serialize)]
pub struct StrokeInfo {
    direction: &'static str,
    command_s: f64,
    until_s: f64,
    ends_s: [f64; 3],
    measured_s: Option<f64>,
    simulated_s: Option<f64>,
}

/// Where the phases of each stroke end.
pub fn strokes(run: &RunData, compared: &RunComparison) -> Vec<StrokeInfo> {
    compared
        .strokes
        .iter()
        .map(|stroke| {
            let window = stroke.window;
            let until_s = window.until_s.min(run.run.end_s);
            let ends = boundaries(&stroke.levels, until_s - window.command_s).map(|end| window.command_s + end);
            let limit = stroke.levels.last();
            StrokeInfo {
                direction: window.direction.name(),
                command_s: window.command_s,
                until_s,
                ends_s: ends,
                measured_s: limit.and_then(|level| level.measured_s),
                simulated_s: limit.and_then(|level| level.simulated_s),
            }
        })
        .collect()
}

/// The force that a model lacks along the recorded motion; nothing where it cannot be told.
#[derive(Debug, Clone, Serialize)]
pub struct Missing {
    version: u64,
    force: Option<ForceDocument>,
}

/// The force that a model lacks along the recorded motion.
pub fn missing(subject: &Subject, model: &Model) -> Result<Missing, Refusal> {
    let input = &subject.input;
    let valve = model.valve(&input.file)?;
    let force = ResidualForce::new(&input.data, &valve, input.file.tolerances());
    Ok(Missing { version: subject.version, force: force.as_ref().map(ForceDocument::from) })
}

/// A command of a planned run.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Edge {
    at_s: f64,
    close: bool,
}

/// A run that is only thought of, for every model still alive.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    models: Vec<Model>,
    /// For each model those that differ from it by a standard deviation each, in independent ways; none where it has no band.
    #[serde(default)]
    spread: Vec<Vec<Model>>,
    commands: Vec<Edge>,
    end_s: f64,
    supply_pressure_pa: f64,
    temperature_k: f64,
    leak_to_atmosphere_m2: f64,
    leak_from_supply_m2: f64,
}

/// The longest run that is thought of, s.
const LONGEST_S: f64 = 600.0;

/// Standard deviations from the middle to where 95 % lie below.
const TO_95_PERCENT: f64 = 1.645;

/// Points of a prediction.
const POINTS: u32 = 1200;

impl Plan {
    fn run(&self) -> Result<Run, Refusal> {
        let rising = self.commands.windows(2).all(|pair| pair[0].at_s < pair[1].at_s);
        let inside = self.commands.iter().all(|edge| edge.at_s >= 0.0 && edge.at_s < self.end_s);
        if !(rising && inside && self.end_s > 0.0 && self.end_s <= LONGEST_S) {
            return Err(Refusal::new(format!(
                "expected commands one after the other from 0 s on, before an end of at most {LONGEST_S} s"
            )));
        }
        let conditions = [self.leak_to_atmosphere_m2, self.leak_from_supply_m2];
        if conditions.iter().any(|leak| !(0.0..=1.0).contains(leak)) || self.temperature_k <= 0.0 {
            return Err(Refusal::new("expected leaks of 0 mm2 or more and a temperature above 0 K"));
        }
        Ok(Run {
            conditions: Conditions {
                supply_pressure_pa: self.supply_pressure_pa,
                temperature_k: self.temperature_k,
                leak_to_atmosphere_m2: self.leak_to_atmosphere_m2,
                leak_from_supply_m2: self.leak_from_supply_m2,
            },
            commands: self.commands.iter().map(|edge| CommandEdge::new(edge.at_s, edge.close)).collect(),
            end_s: self.end_s,
            prescribed: None,
            start: Start::Rest,
        })
    }
}

/// Predictions of a planned run, a list for each model.
#[derive(Debug, Serialize)]
pub struct Prediction {
    version: u64,
    time_s: Vec<f64>,
    position_mm: Vec<Vec<f64>>,
    band_mm: Vec<Option<Vec<f64>>>,
}

/// What each model predicts for a planned run, and half the width of its band, 5 to 95 %, where what is open about it is given.
pub fn predicted(subject: &Subject, plan: &Plan) -> Result<Prediction, Refusal> {
    let run = plan.run()?;
    let file = &subject.input.file;
    if run.conditions.supply_pressure_pa <= file.valve().parameters().ambient_pressure_pa {
        return Err(Refusal::new("expected a supply pressure above that of the atmosphere"));
    }
    let times_s: Vec<f64> = (0..=POINTS).map(|i| run.end_s * f64::from(i) / f64::from(POINTS)).collect();
    let predict = |model: &Model| Ok(positions_mm(&model.valve(file)?, &run, &times_s));
    let predictions: Vec<Vec<f64>> = plan.models.iter().map(predict).collect::<Result<_, Refusal>>()?;
    let bands: Vec<Option<Vec<f64>>> = predictions
        .iter()
        .enumerate()
        .map(|(model, prediction)| {
            let Some(spread) = plan.spread.get(model).filter(|spread| !spread.is_empty()) else { return Ok(None) };
            let others: Vec<Vec<f64>> = spread.iter().map(predict).collect::<Result<_, Refusal>>()?;
            let deviation = |at: usize| others.iter().map(|other| (other[at] - prediction[at]).powi(2)).sum::<f64>();
            Ok(Some((0..prediction.len()).map(|at| rounded(TO_95_PERCENT * deviation(at).sqrt())).collect()))
        })
        .collect::<Result<_, Refusal>>()?;
    Ok(Prediction { version: subject.version, time_s: times_s, position_mm: predictions, band_mm: bands })
}

/// What the sensor of a valve writes down of a run, mm.
pub fn positions_mm(valve: &Valve, run: &Run, times_s: &[f64]) -> Vec<f64> {
    let mut predicted = Predicted::default();
    simulate(&[Prepared::new(valve, run, DEFAULT_STEP_S)], false, |_, nodes, _| {
        record(valve, nodes, times_s, &mut predicted);
    });
    predicted.position_m.iter().map(|x| rounded(1e3 * x)).collect()
}
