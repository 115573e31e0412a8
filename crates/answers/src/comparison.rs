//! `compare` for programs: fractions and SI units throughout.

use std::collections::BTreeMap;

use identify::Stop;
use model_lab::compare::{Comparison, Direction, Finding, Phase, PhaseError, RunComparison, Score, StrokeComparison};
use model_lab::data::Channel;
use model_lab::diagnosis::uncertainty::Certainty;
use model_lab::diagnosis::{NuisanceReport, TakenBy, nuisance_reports, taken};
use model_lab::errors::{Errors, StepReport};
use model_lab::identification::{NuisanceSizes, Subject};
use model_lab::residual_force::{Axis, Bin, ResidualForce, Signature};
use serde::Serialize;
use serde_json::Value;
use valve_file::ValveFile;
use valve_model::Conditions;

use crate::error::ErrorDocument;
use crate::moved::{self, NuisanceDocument};
use crate::steps::StepDocument;
use crate::{CampaignInput, SCHEMA, value_of};

/// A model beside a campaign: as it stands, and allowing for what instruments and conditions may be off by.
#[derive(Debug, Clone)]
pub struct Compared {
    /// As it stands.
    pub comparison: Comparison,
    /// With that fitted and nothing else, as all fits state their errors.
    pub allowing: StepReport,
    /// What they were found to be off by then.
    pub nuisances: Vec<NuisanceReport>,
    /// The error that each kind of them takes then.
    pub taken: Vec<(TakenBy, Errors)>,
}

impl Compared {
    /// A valve file beside a campaign; nothing where its strokes cannot be simulated.
    pub fn new(input: &CampaignInput, file: &ValveFile) -> Option<Self> {
        let subject = Subject::new(file, &input.campaign, &NuisanceSizes::default(), Stop::never());
        let comparison = Comparison::new(&subject, file.valve(), &input.data)?;
        let stated = subject.stated(Stop::never())?;
        let nuisances = nuisance_reports(&stated, &Certainty::new(&stated.problem, &stated.fit), &[]);
        Some(Self { comparison, allowing: StepReport::new("valve file", &stated), nuisances, taken: taken(&stated) })
    }
}

/// What a kind of instruments takes, for programs.
#[derive(Debug, Clone, Serialize)]
struct TakenDocument {
    what: &'static str,
    #[serde(flatten)]
    errors: ErrorDocument,
}

impl From<&(TakenBy, Errors)> for TakenDocument {
    fn from((by, errors): &(TakenBy, Errors)) -> Self {
        Self { what: by.words(), errors: errors.into() }
    }
}

/// A comparison for programs.
#[derive(Debug, Clone, Serialize)]
struct ComparedDocument<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    schema: Option<u32>,
    valve: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    campaign: Option<&'a str>,
    #[serde(flatten)]
    comparison: ComparisonDocument<'a>,
    allowing_for_instruments: StepDocument,
    nuisances: Vec<NuisanceDocument>,
    taken_by_instruments: Vec<TakenDocument>,
    #[serde(skip_serializing_if = "Option::is_none")]
    against: Option<Box<ComparedDocument<'a>>>,
    #[serde(flatten)]
    missing: Option<MissingDocument>,
    #[serde(skip_serializing_if = "Option::is_none")]
    doubts: Option<Vec<String>>,
}

impl<'a> ComparedDocument<'a> {
    fn new(input: &'a CampaignInput, file: &'a ValveFile, compared: &'a Compared) -> Self {
        Self {
            schema: None,
            valve: file.file_name(),
            campaign: None,
            comparison: ComparisonDocument::new(input, &compared.comparison),
            allowing_for_instruments: (&compared.allowing).into(),
            nuisances: moved::nuisances(&compared.nuisances),
            taken_by_instruments: compared.taken.iter().map(TakenDocument::from).collect(),
            against: None,
            missing: None,
            doubts: None,
        }
    }
}

/// What is missing as a force along the motion, and the valve's signature.
#[derive(Debug, Clone, Serialize)]
struct MissingDocument {
    residual_force: ForceDocument,
    signature: Option<SignatureDocument>,
}

/// The whole answer of `compare`.
pub fn document(
    input: &CampaignInput,
    compared: &Compared,
    against: Option<&(&ValveFile, Compared)>,
    force: Option<&ResidualForce>,
) -> Value {
    value_of(&ComparedDocument {
        schema: Some(SCHEMA),
        campaign: Some(&input.campaign.name),
        doubts: Some(input.doubts()),
        against: against.map(|(file, other)| Box::new(ComparedDocument::new(input, file, other))),
        missing: force.map(|force| MissingDocument {
            residual_force: force.into(),
            signature: force.signature.as_ref().map(SignatureDocument::from),
        }),
        ..ComparedDocument::new(input, &input.file, compared)
    })
}

/// One model beside the campaign.
#[derive(Debug, Clone, Serialize)]
pub struct ComparisonDocument<'a> {
    overall: OverallDocument,
    runs: Vec<RunDocument<'a>>,
    words: Vec<String>,
    findings: Vec<FindingDocument<'a>>,
    by_condition: Vec<PhaseErrorDocument>,
}

impl<'a> ComparisonDocument<'a> {
    /// A model beside the campaign that it was compared with.
    pub fn new(input: &CampaignInput, comparison: &'a Comparison) -> Self {
        let noise_source = input.noise_source();
        Self {
            overall: OverallDocument {
                score: (&comparison.overall).into(),
                noise_m: comparison.noise_m,
                noise_source,
                timing_noise_s: comparison.timing_noise_s,
            },
            runs: comparison.runs.iter().map(|run| RunDocument::new(run, noise_source)).collect(),
            words: comparison.words(),
            findings: comparison.findings.iter().map(FindingDocument::from).collect(),
            by_condition: comparison.phase_errors.iter().map(PhaseErrorDocument::from).collect(),
        }
    }
}

#[derive(Debug, Clone, Serialize)]
struct OverallDocument {
    #[serde(flatten)]
    score: ScoreDocument,
    noise_m: Option<f64>,
    noise_source: &'static str,
    timing_noise_s: Option<f64>,
}

/// Errors of strokes, and of their phases by direction and name.
#[derive(Debug, Clone, Serialize)]
struct ScoreDocument {
    #[serde(flatten)]
    errors: ErrorDocument,
    close_time_error_s: Option<f64>,
    open_time_error_s: Option<f64>,
    phases: BTreeMap<&'static str, BTreeMap<&'static str, PhaseDocument>>,
}

#[derive(Debug, Clone, Serialize)]
struct PhaseDocument {
    rmse_m: Option<f64>,
    share: Option<f64>,
    time_error_s: Option<f64>,
    time_standard_error_s: Option<f64>,
}

impl From<&Score> for ScoreDocument {
    fn from(score: &Score) -> Self {
        let of = |direction: Direction| {
            let phases = score.phases.iter().filter(move |phase| phase.direction == direction);
            phases.map(|phase| {
                let document = PhaseDocument {
                    rmse_m: phase.rmse_m,
                    share: phase.share,
                    time_error_s: phase.time_error_s,
                    time_standard_error_s: phase.time_standard_error_s,
                };
                (phase.phase.id(), document)
            })
        };
        let directions = Direction::ALL.into_iter().filter(|_| !score.phases.is_empty());
        Self {
            errors: (&score.errors).into(),
            close_time_error_s: score.close_time_error_s,
            open_time_error_s: score.open_time_error_s,
            phases: directions.map(|direction| (direction.name(), of(direction).collect())).collect(),
        }
    }
}

#[derive(Debug, Clone, Serialize)]
struct RunDocument<'a> {
    file: &'a str,
    conditions: ConditionsDocument,
    #[serde(flatten)]
    score: ScoreDocument,
    noise_m: Option<f64>,
    noise_source: &'static str,
    channels: Vec<ChannelDocument>,
    strokes: Vec<StrokeDocument>,
}

#[derive(Debug, Clone, Serialize)]
struct ChannelDocument {
    channel: &'static str,
    rmse: f64,
    noise: f64,
    normalised_rms: f64,
}

impl<'a> RunDocument<'a> {
    fn new(run: &'a RunComparison, noise_source: &'static str) -> Self {
        let position = run.channels.iter().find(|score| score.channel == Channel::Position);
        let channels = run.channels.iter().map(|score| ChannelDocument {
            channel: match score.channel {
                Channel::Position => "position_m",
                Channel::ChamberPressure => "chamber_pressure_pa",
                Channel::PipePressure => "pipe_pressure_pa",
            },
            rmse: score.rmse,
            noise: score.noise,
            normalised_rms: score.normalised_rms,
        });
        Self {
            file: &run.file,
            conditions: (&run.conditions).into(),
            score: (&run.score).into(),
            noise_m: position.map(|score| score.noise),
            noise_source,
            channels: channels.collect(),
            strokes: run.strokes.iter().map(StrokeDocument::from).collect(),
        }
    }
}

#[derive(Debug, Clone, Serialize)]
struct StrokeDocument {
    direction: &'static str,
    command_s: f64,
    measured_s: Option<f64>,
    simulated_s: Option<f64>,
    time_error_s: Option<f64>,
    levels: Vec<LevelDocument>,
}

#[derive(Debug, Clone, Serialize)]
struct LevelDocument {
    travelled: f64,
    measured_s: Option<f64>,
    simulated_s: Option<f64>,
}

impl From<&StrokeComparison> for StrokeDocument {
    fn from(stroke: &StrokeComparison) -> Self {
        let limit = stroke.levels.last();
        let levels = stroke.levels.iter().map(|level| LevelDocument {
            travelled: level.travelled,
            measured_s: level.measured_s,
            simulated_s: level.simulated_s,
        });
        Self {
            direction: stroke.window.direction.name(),
            command_s: stroke.window.command_s,
            measured_s: limit.and_then(|level| level.measured_s),
            simulated_s: limit.and_then(|level| level.simulated_s),
            time_error_s: stroke.time_error_s(),
            levels: levels.collect(),
        }
    }
}

/// Conditions of a run, SI.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ConditionsDocument {
    supply_pressure_pa: f64,
    temperature_k: f64,
    leak_to_atmosphere_m2: f64,
    leak_from_supply_m2: f64,
}

impl From<&Conditions> for ConditionsDocument {
    fn from(conditions: &Conditions) -> Self {
        Self {
            supply_pressure_pa: conditions.supply_pressure_pa,
            temperature_k: conditions.temperature_k,
            leak_to_atmosphere_m2: conditions.leak_to_atmosphere_m2,
            leak_from_supply_m2: conditions.leak_from_supply_m2,
        }
    }
}

#[derive(Debug, Clone, Serialize)]
struct FindingDocument<'a> {
    direction: &'static str,
    phase: Option<&'static str>,
    time_error_s: f64,
    rms_s: f64,
    between_m: Option<(f64, f64)>,
    change_over_range_s: BTreeMap<&'static str, f64>,
    words: &'a str,
}

impl<'a> From<&'a Finding> for FindingDocument<'a> {
    fn from(finding: &'a Finding) -> Self {
        Self {
            direction: finding.direction.name(),
            phase: finding.phase.map(Phase::id),
            time_error_s: finding.time_error_s,
            rms_s: finding.rms_s,
            between_m: finding.between_m,
            change_over_range_s: finding
                .conditions
                .iter()
                .map(|(condition, change)| (condition.id(), *change))
                .collect(),
            words: &finding.words,
        }
    }
}

#[derive(Debug, Clone, Serialize)]
struct PhaseErrorDocument {
    direction: &'static str,
    phase: &'static str,
    strokes: usize,
    time_error_s: f64,
    rms_s: f64,
    standard_error_s: f64,
    is_seen: bool,
    trends: BTreeMap<&'static str, TrendDocument>,
}

#[derive(Debug, Clone, Serialize)]
struct TrendDocument {
    change_over_range_s: f64,
    standard_error_s: f64,
}

impl From<&PhaseError> for PhaseErrorDocument {
    fn from(error: &PhaseError) -> Self {
        let trends = error.trends.iter().map(|trend| {
            let document = TrendDocument { change_over_range_s: trend.change, standard_error_s: trend.standard_error };
            (trend.condition.id(), document)
        });
        Self {
            direction: error.direction.name(),
            phase: error.phase.map_or("stroke", Phase::id),
            strokes: error.strokes,
            time_error_s: error.mean_s,
            rms_s: error.rms_s,
            standard_error_s: error.standard_error_s,
            is_seen: error.is_seen(),
            trends: trends.collect(),
        }
    }
}

/// The force that a model lacks, SI.
#[derive(Debug, Clone, Serialize)]
pub struct ForceDocument {
    pressure: &'static str,
    along_stroke: Vec<PlaceDocument>,
    /// By axis and direction.
    against: BTreeMap<&'static str, BTreeMap<&'static str, Vec<BinDocument>>>,
}

#[derive(Debug, Clone, Serialize)]
struct PlaceDocument {
    position_m: f64,
    friction_n: f64,
    push_n: f64,
    standard_error_n: f64,
}

#[derive(Debug, Clone, Serialize)]
struct BinDocument {
    at: f64,
    force_n: f64,
    standard_error_n: f64,
    tolerance_error_n: f64,
    flow_kg_per_s: Option<f64>,
    runs: usize,
}

impl From<&Bin> for BinDocument {
    fn from(bin: &Bin) -> Self {
        Self {
            at: bin.at,
            force_n: bin.force_n,
            standard_error_n: bin.standard_error_n,
            tolerance_error_n: bin.tolerance_error_n,
            flow_kg_per_s: bin.flow_kg_per_s,
            runs: bin.runs,
        }
    }
}

impl From<&ResidualForce> for ForceDocument {
    fn from(force: &ResidualForce) -> Self {
        let bins = |axis: Axis, direction: Direction| {
            (direction.name(), force.profile(axis, direction).iter().map(BinDocument::from).collect())
        };
        let of_axis =
            |axis: Axis| (axis.id(), Direction::ALL.into_iter().map(|direction| bins(axis, direction)).collect());
        let places = force.along_stroke();
        let along_stroke = places.iter().map(|place| PlaceDocument {
            position_m: place.position_m,
            friction_n: place.friction_n,
            push_n: place.push_n,
            standard_error_n: place.standard_error_n,
        });
        Self {
            pressure: source_of(force.pressure_is_measured),
            along_stroke: along_stroke.collect(),
            against: Axis::ALL.into_iter().map(of_axis).collect(),
        }
    }
}

/// Where a pressure comes from.
fn source_of(is_measured: bool) -> &'static str {
    if is_measured { "measured" } else { "simulated" }
}

#[derive(Debug, Clone, Serialize)]
struct SignatureDocument {
    pressure: &'static str,
    friction_band_pa: f64,
    friction_n: f64,
    viscous_n: f64,
    spring_rate_n_per_m: f64,
    bench_set_pa: [f64; 2],
    closing: Vec<[f64; 2]>,
    opening: Vec<[f64; 2]>,
}

impl From<&Signature> for SignatureDocument {
    fn from(signature: &Signature) -> Self {
        Self {
            pressure: source_of(signature.is_measured),
            friction_band_pa: signature.friction_band_pa,
            friction_n: signature.friction_n,
            viscous_n: signature.viscous_n,
            spring_rate_n_per_m: signature.spring_rate_n_per_m,
            bench_set_pa: signature.bench_set_pa,
            closing: signature.closing.clone(),
            opening: signature.opening.clone(),
        }
    }
}
