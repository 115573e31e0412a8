//! `compare` for programs: fractions and SI units throughout.

use identify::Stop;
use model_lab::compare::{Comparison, Direction, Finding, Phase, PhaseError, RunComparison, Score, StrokeComparison};
use model_lab::data::Channel;
use model_lab::errors::StepReport;
use model_lab::identification::{NuisanceSizes, Subject};
use model_lab::residual_force::{Axis, Bin, ResidualForce, Signature};
use serde_json::{Map, Value, json};
use valve_file::ValveFile;
use valve_model::Conditions;

use crate::{CampaignInput, SCHEMA, error, steps};

/// A model beside a campaign: as it stands, and allowing for what instruments and conditions may be off by.
#[derive(Debug, Clone)]
pub struct Compared {
    /// As it stands.
    pub comparison: Comparison,
    /// With that fitted and nothing else, as all fits state their errors.
    pub allowing: StepReport,
}

impl Compared {
    /// A valve file beside a campaign; nothing where its strokes cannot be simulated.
    pub fn new(input: &CampaignInput, file: &ValveFile) -> Option<Self> {
        let subject = Subject::new(file, &input.campaign, &NuisanceSizes::default());
        let comparison = Comparison::new(&subject, file.valve(), &input.data)?;
        let stated = subject.stated(Stop::never())?;
        Some(Self { comparison, allowing: StepReport::new("datasheet", &stated) })
    }
}

fn compared_value(input: &CampaignInput, compared: &Compared) -> Value {
    let mut value = comparison_value(input, &compared.comparison);
    value["allowing_for_instruments"] = steps::step(&compared.allowing);
    value
}

/// The whole answer of `compare`.
pub fn document(
    input: &CampaignInput,
    compared: &Compared,
    against: Option<&(&ValveFile, Compared)>,
    force: Option<&ResidualForce>,
) -> Value {
    let mut document = compared_value(input, compared);
    let root = &mut document;
    root["schema"] = json!(SCHEMA);
    root["valve"] = json!(input.file.file_name());
    root["campaign"] = json!(input.campaign.name);
    if let Some((file, other)) = against {
        let mut value = compared_value(input, other);
        value["valve"] = json!(file.file_name());
        root["against"] = value;
    }
    if let Some(force) = force {
        root["residual_force"] = force_value(force);
        root["signature"] = force.signature.as_ref().map_or(Value::Null, signature_value);
    }
    document
}

/// One model beside the campaign.
pub fn comparison_value(input: &CampaignInput, comparison: &Comparison) -> Value {
    let source = input.noise_source();
    let mut overall = score_value(&comparison.overall);
    overall["noise_m"] = json!(comparison.noise_m);
    overall["noise_source"] = json!(source);
    overall["timing_noise_s"] = json!(comparison.timing_noise_s);
    json!({
        "overall": overall,
        "runs": comparison.runs.iter().map(|run| run_value(run, source)).collect::<Vec<_>>(),
        "words": comparison.words(),
        "findings": comparison.findings.iter().map(finding_value).collect::<Vec<_>>(),
        "by_condition": comparison.phase_errors.iter().map(phase_error_value).collect::<Vec<_>>(),
    })
}

fn score_value(score: &Score) -> Value {
    let mut phases = Map::new();
    if !score.phases.is_empty() {
        for direction in Direction::ALL {
            let of_direction: Map<String, Value> = score
                .phases
                .iter()
                .filter(|phase| phase.direction == direction)
                .map(|phase| {
                    let value = json!({
                        "rmse_m": phase.rmse_m,
                        "share": phase.share,
                        "time_error_s": phase.time_error_s,
                        "time_standard_error_s": phase.time_standard_error_s.filter(|error| error.is_finite()),
                    });
                    (phase.phase.id().to_owned(), value)
                })
                .collect();
            phases.insert(direction.name().to_owned(), Value::Object(of_direction));
        }
    }
    let mut value = error::value(&score.errors);
    value["close_time_error_s"] = json!(score.close_time_error_s);
    value["open_time_error_s"] = json!(score.open_time_error_s);
    value["phases"] = Value::Object(phases);
    value
}

fn run_value(run: &RunComparison, noise_source: &str) -> Value {
    let mut value = score_value(&run.score);
    let noise = |channel: Channel| run.channels.iter().find(|score| score.channel == channel).map(|score| score.noise);
    value["file"] = json!(run.file);
    value["conditions"] = conditions_value(&run.conditions);
    value["noise_m"] = json!(noise(Channel::Position));
    value["noise_source"] = json!(noise_source);
    value["channels"] = run
        .channels
        .iter()
        .map(|score| {
            let name = match score.channel {
                Channel::Position => "position_m",
                Channel::ChamberPressure => "chamber_pressure_pa",
                Channel::PipePressure => "pipe_pressure_pa",
            };
            json!({ "channel": name, "rmse": score.rmse, "noise": score.noise,
                    "normalised_rms": score.normalised_rms })
        })
        .collect();
    value["strokes"] = run.strokes.iter().map(stroke_value).collect();
    value
}

fn stroke_value(stroke: &StrokeComparison) -> Value {
    let limit = stroke.levels.last();
    let levels: Vec<Value> = stroke
        .levels
        .iter()
        .map(|level| {
            json!({ "travelled": level.travelled, "measured_s": level.measured_s, "simulated_s": level.simulated_s })
        })
        .collect();
    json!({
        "direction": stroke.window.direction.name(),
        "command_s": stroke.window.command_s,
        "measured_s": limit.and_then(|level| level.measured_s),
        "simulated_s": limit.and_then(|level| level.simulated_s),
        "time_error_s": stroke.time_error_s(),
        "levels": levels,
    })
}

/// Conditions, SI.
pub fn conditions_value(conditions: &Conditions) -> Value {
    json!({
        "supply_pressure_pa": conditions.supply_pressure_pa,
        "temperature_k": conditions.temperature_k,
        "leak_to_atmosphere_m2": conditions.leak_to_atmosphere_m2,
        "leak_from_supply_m2": conditions.leak_from_supply_m2,
    })
}

fn finding_value(finding: &Finding) -> Value {
    let conditions: Map<String, Value> =
        finding.conditions.iter().map(|(condition, change)| (condition.id().to_owned(), json!(change))).collect();
    json!({
        "direction": finding.direction.name(),
        "phase": finding.phase.map(Phase::id),
        "time_error_s": finding.time_error_s,
        "rms_s": finding.rms_s,
        "between_m": finding.between_m,
        "change_over_range_s": conditions,
        "words": finding.words,
    })
}

fn phase_error_value(error: &PhaseError) -> Value {
    let trends: Map<String, Value> = error
        .trends
        .iter()
        .map(|trend| {
            let value =
                json!({ "change_over_range_s": trend.change, "standard_error_s": finite(trend.standard_error) });
            (trend.condition.id().to_owned(), value)
        })
        .collect();
    json!({
        "direction": error.direction.name(),
        "phase": error.phase.map_or("stroke", Phase::id),
        "strokes": error.strokes,
        "time_error_s": error.mean_s,
        "rms_s": error.rms_s,
        "standard_error_s": finite(error.standard_error_s),
        "is_seen": error.is_seen(),
        "trends": trends,
    })
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// The force that a model lacks, SI.
pub fn force_value(force: &ResidualForce) -> Value {
    let mut axes = Map::new();
    for axis in Axis::ALL {
        let mut directions = Map::new();
        for direction in Direction::ALL {
            let bins: Vec<Value> = force.profile(axis, direction).iter().map(bin_value).collect();
            directions.insert(direction.name().to_owned(), Value::Array(bins));
        }
        axes.insert(axis.id().to_owned(), Value::Object(directions));
    }
    let along: Vec<Value> = force
        .along_stroke()
        .iter()
        .map(|place| {
            json!({ "position_m": place.position_m, "friction_n": place.friction_n, "push_n": place.push_n,
                    "standard_error_n": place.standard_error_n })
        })
        .collect();
    json!({
        "pressure": if force.pressure_is_measured { "measured" } else { "simulated" },
        "along_stroke": along,
        "against": axes,
    })
}

fn bin_value(bin: &Bin) -> Value {
    json!({
        "at": bin.at,
        "force_n": bin.force_n,
        "standard_error_n": bin.standard_error_n,
        "tolerance_error_n": bin.tolerance_error_n,
        "flow_kg_per_s": bin.flow_kg_per_s,
        "runs": bin.runs,
    })
}

fn signature_value(signature: &Signature) -> Value {
    json!({
        "pressure": if signature.is_measured { "measured" } else { "simulated" },
        "friction_band_pa": signature.friction_band_pa,
        "friction_n": signature.friction_n,
        "viscous_n": signature.viscous_n,
        "spring_rate_n_per_m": signature.spring_rate_n_per_m,
        "bench_set_pa": signature.bench_set_pa,
        "closing": signature.closing,
        "opening": signature.opening,
    })
}
