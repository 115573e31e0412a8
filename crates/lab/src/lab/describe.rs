//! What the page needs to know once: the valve, the runs, the catalogue with its ranges, all in the user's units.

use checked_toml::Document;
use model_lab::data::{Channel, same_conditions};
use quantity::{Dimension, Quantity, Reference, Unit, format_number};
use serde::Serialize;
use valve_file::ValveFile;
use valve_model::custom::CustomParameter;
use valve_model::effects::{DefaultValue, EffectParameter, Search};
use valve_model::{EffectKind, ParameterId};

use super::model::Model;
use super::subject::Subject;

/// A tolerated parameter slides over this many tolerances to each side.
const TOLERANCES: f64 = 4.0;

/// Everything that stays while the sliders move.
#[derive(Debug, Serialize)]
pub struct Description {
    version: u64,
    valve: NamedFile,
    campaign: NamedFile,
    stroke_mm: f64,
    doubts: Vec<String>,
    runs: Vec<RunInfo>,
    channels: Vec<&'static str>,
    parameters: Vec<Tolerated>,
    effects: Vec<EffectInfo>,
    custom: Vec<EffectInfo>,
    model: Model,
    /// Whether a timing log was given; nothing on a page without a server.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub has_log: Option<bool>,
}

#[derive(Debug, Serialize)]
struct NamedFile {
    name: String,
    file: String,
}

#[derive(Debug, Serialize)]
struct RunInfo {
    name: String,
    is_trace: bool,
    end_s: Option<f64>,
    /// Runs under the same conditions have the same number.
    condition: usize,
    supply_kpa: f64,
    supply_kpa_gauge: f64,
    temperature_k: f64,
    leak_to_atmosphere_mm2: f64,
    leak_from_supply_mm2: f64,
}

/// A unit with its way from SI: shown = si * factor + shift.
#[derive(Debug, Serialize)]
struct UnitInfo {
    name: String,
    factor: f64,
    shift: f64,
}

/// A parameter with a tolerance, SI.
#[derive(Debug, Serialize)]
struct Tolerated {
    key: &'static str,
    unit: UnitInfo,
    value: f64,
    tolerance: f64,
    lower: f64,
    upper: f64,
}

/// An effect of the catalogue, or of the user's own, of which less is known.
#[derive(Debug, Serialize)]
struct EffectInfo {
    id: String,
    summary: String,
    equation: String,
    #[serde(flatten)]
    known: Option<KnownEffect>,
    parameters: Vec<ParameterInfo>,
}

#[derive(Debug, Serialize)]
struct KnownEffect {
    symptom: &'static str,
    typical_sizes: &'static str,
    confused_with: &'static [&'static str],
    source: &'static str,
    acts_on: &'static str,
}

/// A value of an effect, SI.
#[derive(Debug, Serialize)]
struct ParameterInfo {
    name: String,
    meaning: String,
    unit: UnitInfo,
    lower: f64,
    typical: f64,
    upper: f64,
    first: Option<f64>,
    follows: Option<usize>,
    at_least: Option<usize>,
    refinement: bool,
}

impl Description {
    /// Of files that have been read.
    pub fn new(subject: &Subject) -> Self {
        let input = &subject.input;
        let file = &input.file;
        Self {
            version: subject.version,
            valve: NamedFile { name: file.name().to_owned(), file: file.file_name().to_owned() },
            campaign: NamedFile { name: input.campaign.name.clone(), file: input.campaign_path.display().to_string() },
            stroke_mm: 1e3 * file.valve().parameters().stroke_m,
            doubts: input.doubts(),
            runs: runs(subject),
            channels: channels(subject).into_iter().map(|(_, name)| name).collect(),
            parameters: parameters(file),
            effects: EffectKind::ALL.iter().map(|kind| effect(*kind, file)).collect(),
            custom: custom(file),
            model: Model::of(file),
            has_log: None,
        }
    }

    /// The same where nothing can be switched on or moved.
    pub fn without_sliders(mut self) -> Self {
        self.effects.clear();
        self.custom.clear();
        self.parameters.clear();
        self
    }
}

fn runs(subject: &Subject) -> Vec<RunInfo> {
    let data = &subject.input.data;
    let mut groups: Vec<usize> = Vec::new();
    let of_runs = data.runs.iter().map(|run| &run.run.conditions);
    let all: Vec<_> = of_runs.chain(data.timing_groups.iter().map(|group| &group.conditions)).collect();
    (0..all.len())
        .map(|unit| {
            let conditions = all[unit];
            let known = groups.iter().position(|group| same_conditions(all[*group], conditions));
            let condition = known.unwrap_or_else(|| {
                groups.push(unit);
                groups.len() - 1
            });
            let ambient_pa = subject.input.file.valve().parameters().ambient_pressure_pa;
            RunInfo {
                name: data
                    .runs
                    .get(unit)
                    .map_or_else(|| format!("stroke times {}", unit + 1 - data.runs.len()), |run| run.name.clone()),
                is_trace: unit < data.runs.len(),
                end_s: data.runs.get(unit).map(|run| run.run.end_s),
                condition,
                supply_kpa: conditions.supply_pressure_pa * 1e-3,
                supply_kpa_gauge: (conditions.supply_pressure_pa - ambient_pa) * 1e-3,
                temperature_k: conditions.temperature_k,
                leak_to_atmosphere_mm2: conditions.leak_to_atmosphere_m2 * 1e6,
                leak_from_supply_mm2: conditions.leak_from_supply_m2 * 1e6,
            }
        })
        .collect()
}

/// The channels that any run has, with their names.
pub fn channels(subject: &Subject) -> Vec<(Channel, &'static str)> {
    let has = |wanted: Channel| {
        let mut channels = subject.input.data.runs.iter().flat_map(|run| &run.channels);
        channels.any(|channel| channel.channel == wanted)
    };
    [(Channel::Position, "position"), (Channel::ChamberPressure, "chamber"), (Channel::PipePressure, "pipe")]
        .into_iter()
        .filter(|(channel, _)| has(*channel))
        .collect()
}

fn unit(text: &str, factor: f64, shift: f64) -> UnitInfo {
    UnitInfo { name: text.to_owned(), factor, shift }
}

fn si_unit(unit_: &Unit, ambient_pa: f64) -> UnitInfo {
    let gauge = if unit_.reference() == Reference::Gauge { ambient_pa } else { 0.0 };
    let zero = unit_.from_si(-gauge);
    unit(unit_.text(), unit_.from_si(1.0 - gauge) - zero, zero)
}

/// The unit in which people read it where the file does not say.
fn handy_unit(si: &str) -> UnitInfo {
    let name = match si {
        "m" => "mm",
        "m2" => "mm2",
        "m3" => "cm3",
        "s" => "ms",
        "Pa" => "kPa",
        "Pa s/kg" => "MPa s/kg",
        other => other,
    };
    Unit::parse(name).map_or_else(|_| unit(si, 1.0, 0.0), |unit| si_unit(&unit, 0.0))
}

/// The unit in which the file writes a parameter.
fn unit_in_file(file: &ValveFile, id: ParameterId) -> Option<Unit> {
    let document = Document::parse(file.text(), file.file_name()).ok()?;
    let section = document.root().section(id.section()).ok()??;
    let text = section.text(id.name(), "").ok()??;
    Some(Quantity::parse(text, Dimension::of_si_unit(id.si_unit())?).ok()?.unit().clone())
}

/// The tolerated parameters with the range that their tolerances leave them.
fn parameters(file: &ValveFile) -> Vec<Tolerated> {
    let valve = file.valve().parameters();
    file.tolerances()
        .iter()
        .map(|tolerance| {
            let id = tolerance.parameter;
            let value = valve.get(id);
            let at = |tolerances: f64| value * (tolerances * tolerance.relative_sigma).exp();
            Tolerated {
                key: id.key(),
                unit: unit_in_file(file, id)
                    .map_or_else(|| handy_unit(id.si_unit()), |unit| si_unit(&unit, valve.ambient_pressure_pa)),
                value,
                tolerance: tolerance.relative_sigma,
                lower: at(-TOLERANCES),
                upper: at(TOLERANCES),
            }
        })
        .collect()
}

fn effect(kind: EffectKind, file: &ValveFile) -> EffectInfo {
    let info = kind.info();
    let parameters = kind.parameters().iter().enumerate();
    EffectInfo {
        id: info.id.to_owned(),
        summary: info.summary.to_owned(),
        equation: info.equation.to_owned(),
        known: Some(KnownEffect {
            symptom: info.symptom,
            typical_sizes: info.typical_sizes,
            confused_with: info.confused_with,
            source: info.source,
            acts_on: info.acts_on.part(),
        }),
        parameters: parameters.map(|(index, parameter)| effect_parameter(index, parameter, file)).collect(),
    }
}

fn effect_parameter(index: usize, parameter: &EffectParameter, file: &ValveFile) -> ParameterInfo {
    let range = (parameter.range)(file.valve().parameters());
    let finite = |value: f64| value.is_finite().then_some(value);
    let follows = match parameter.default {
        DefaultValue::SameAs(other) => Some(other),
        _ => None,
    };
    // What it is as soon as the effect is switched on: the size typical, the shape as where it is left out.
    let first = match parameter.default {
        DefaultValue::Value(value) if index > 0 => value,
        _ => range.typical,
    };
    let at_least = match parameter.search {
        Search::ExcessOver { other, .. } => Some(other),
        _ => None,
    };
    ParameterInfo {
        name: parameter.name.to_owned(),
        meaning: parameter.meaning.to_owned(),
        unit: handy_unit(parameter.si_unit),
        lower: range.lower,
        typical: range.typical,
        upper: range.upper,
        first: finite(first),
        follows,
        at_least,
        refinement: parameter.is_refinement(),
    }
}

fn custom(file: &ValveFile) -> Vec<EffectInfo> {
    let parameter = |parameter: &CustomParameter| ParameterInfo {
        name: parameter.name.clone(),
        meaning: format!("between {} and {}", format_number(parameter.lower), format_number(parameter.upper)),
        unit: Unit::parse(&parameter.unit)
            .map_or_else(|_| unit(&parameter.unit, 1.0, 0.0), |found| si_unit(&found, 0.0)),
        lower: parameter.lower,
        typical: 0.5 * (parameter.lower + parameter.upper),
        upper: parameter.upper,
        first: Some(parameter.value),
        follows: None,
        at_least: None,
        refinement: false,
    };
    let of_file = file.valve().custom().iter();
    of_file
        .map(|effect| EffectInfo {
            id: effect.name().to_owned(),
            summary: format!("your own, acts as {}", effect.target().id()),
            equation: effect.formula().source().to_owned(),
            known: None,
            parameters: effect.parameters().iter().map(parameter).collect(),
        })
        .collect()
}
