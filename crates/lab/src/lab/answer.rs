//! What a search has found, as the page shows it.

use answers::CampaignInput;
use answers::explanation;
use model_lab::diagnosis::experiment::{DECISIVE, Experiment};
use model_lab::diagnosis::{Explanation, Indistinguishable};
use serde::Serialize;
use serde_json::Value;
use valve_model::{CommandEdge, Valve};

use super::model::{EffectValues, Model};
use super::simulate::positions_mm;

/// Points of a prediction of a planned run.
const POINTS: u32 = 600;

/// What a search has found.
#[derive(Debug, Clone, Serialize)]
pub struct Found {
    headline: String,
    document: Value,
    model: Model,
    /// Models that differ from it by a standard deviation each, in independent ways.
    spread: Vec<Model>,
    twins: Vec<Twins>,
    noise_mm: Option<f64>,
}

/// A recommended effect, and what cannot be told from it.
#[derive(Debug, Clone, Serialize)]
struct Twins {
    effect: &'static str,
    with: Vec<Twin>,
    experiment: Option<PlannedExperiment>,
}

#[derive(Debug, Clone, Serialize)]
struct Twin {
    effect: &'static str,
    /// How much less probable it is, nats.
    behind: f64,
    model: Model,
    spread: Vec<Model>,
    parameters: Vec<explanation::EffectParameterDocument>,
}

/// A run that would tell two of them apart, and what each predicts of it.
#[derive(Debug, Clone, Serialize)]
struct PlannedExperiment {
    purpose: String,
    separation: f64,
    decides: bool,
    pressures: bool,
    repeats: usize,
    toml: String,
    time_s: Vec<f64>,
    position_mm: Vec<Vec<f64>>,
    plan: PlannedRun,
}

/// What is done in a run, SI.
#[derive(Debug, Clone, Serialize)]
struct PlannedRun {
    commands: Vec<PlannedCommand>,
    end_s: f64,
    supply_pressure_pa: f64,
    temperature_k: f64,
    leak_to_atmosphere_m2: f64,
    leak_from_supply_m2: f64,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct PlannedCommand {
    at_s: f64,
    close: bool,
}

/// The answer of a search: in words, as `valve explain` tells it to programs, and every model of it as sliders.
pub fn answer(found: &Explanation, input: &CampaignInput) -> Found {
    Found {
        headline: explanation::headline(found),
        document: explanation::document(found, input),
        model: explained_model(found),
        spread: found.spread.iter().map(|valve| of_valve(found, valve)).collect(),
        twins: found.indistinguishable.iter().map(|twins| twins_of(found, twins)).collect(),
        noise_mm: found.noise_m.map(|noise| 1e3 * noise),
    }
}

/// The sliders of a valve, effects and the parameters that may move.
pub fn sliders(valve: &Valve, moved: impl Iterator<Item = (&'static str, f64)>) -> Model {
    let finite = |value: &f64| value.is_finite().then_some(*value);
    Model {
        parameters: moved.map(|(key, value)| (key.to_owned(), value)).collect(),
        effects: valve
            .effects()
            .iter()
            .map(|effect| EffectValues {
                name: effect.kind().id().to_owned(),
                values: effect.values().iter().map(finite).collect(),
            })
            .collect(),
        custom: valve
            .custom()
            .iter()
            .map(|effect| EffectValues {
                name: effect.name().to_owned(),
                values: effect.parameters().iter().map(|parameter| finite(&parameter.value)).collect(),
            })
            .collect(),
    }
}

/// The recommended model, as sliders.
pub fn explained_model(found: &Explanation) -> Model {
    sliders(&found.valve, found.moved.iter().map(|moved| (moved.id.key(), moved.after)))
}

/// Another valve of an answer as sliders, the parameters that may move taken along.
fn of_valve(found: &Explanation, valve: &Valve) -> Model {
    sliders(valve, found.moved.iter().map(|moved| (moved.id.key(), valve.parameters().get(moved.id))))
}

/// What cannot be told from a recommended effect, each as sliders, and the run that would tell.
fn twins_of(found: &Explanation, twins: &Indistinguishable) -> Twins {
    let with = twins.with.iter().map(|other| Twin {
        effect: other.kind.id(),
        behind: other.behind,
        model: of_valve(found, &other.valve),
        spread: other.spread.iter().map(|valve| of_valve(found, valve)).collect(),
        parameters: explanation::parameters(&other.parameters),
    });
    Twins {
        effect: twins.kind.id(),
        with: with.collect(),
        experiment: twins.experiment.as_ref().map(|plan| planned(found, twins, plan)),
    }
}

/// The run that would tell, as the recommended model and the closest of the others predict it.
fn planned(found: &Explanation, twins: &Indistinguishable, plan: &Experiment) -> PlannedExperiment {
    let time_s: Vec<f64> = (0..=POINTS).map(|i| plan.run.end_s * f64::from(i) / f64::from(POINTS)).collect();
    let valves = [&found.valve].into_iter().chain(twins.with.first().map(|other| &other.valve));
    let position_mm = valves.map(|valve| positions_mm(valve, &plan.run, &time_s)).collect();
    let conditions = plan.run.conditions;
    let command = |edge: &CommandEdge| PlannedCommand { at_s: edge.time_s, close: edge.closes() };
    PlannedExperiment {
        purpose: plan.purpose.clone(),
        separation: plan.separation,
        decides: plan.separation >= DECISIVE,
        pressures: plan.pressures,
        repeats: plan.replicates,
        toml: explanation::run_toml(plan),
        time_s,
        position_mm,
        plan: PlannedRun {
            commands: plan.run.commands.iter().map(command).collect(),
            end_s: plan.run.end_s,
            supply_pressure_pa: conditions.supply_pressure_pa,
            temperature_k: conditions.temperature_k,
            leak_to_atmosphere_m2: conditions.leak_to_atmosphere_m2,
            leak_from_supply_m2: conditions.leak_from_supply_m2,
        },
    }
}
