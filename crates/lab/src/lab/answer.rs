//! What a search has found, as the page shows it.

use answers::explanation;
use model_lab::diagnosis::experiment::DECISIVE;
use model_lab::diagnosis::{Explanation, Indistinguishable};
use serde_json::{Value, json};
use valve_model::Valve;

use super::model::{EffectValues, Model};
use super::simulate::positions_mm;

/// The answer of a search: in words, as `valve explain` tells it to programs, and every model of it as sliders.
pub fn answer(found: &Explanation, campaign: &str) -> Value {
    json!({
        "headline": explanation::headline(found),
        "document": explanation::document(found, campaign),
        "model": explained_model(found),
        "spread": found.spread.iter().map(|valve| of_valve(found, valve)).collect::<Vec<_>>(),
        "twins": found.indistinguishable.iter().map(|twins| twin(found, twins)).collect::<Vec<_>>(),
        "noise_mm": found.noise_m.map(|noise| 1e3 * noise),
    })
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
fn twin(found: &Explanation, twins: &Indistinguishable) -> Value {
    let with: Vec<Value> = twins
        .with
        .iter()
        .map(|other| {
            json!({ "effect": other.kind.id(), "behind": other.behind, "model": of_valve(found, &other.valve),
                    "spread": other.spread.iter().map(|valve| of_valve(found, valve)).collect::<Vec<_>>(),
                    "parameters": explanation::parameters(&other.parameters) })
        })
        .collect();
    let experiment = twins.experiment.as_ref().map(|plan| {
        let points = 600_u32;
        let times_s: Vec<f64> = (0..=points).map(|i| plan.run.end_s * f64::from(i) / f64::from(points)).collect();
        let valves = [&found.valve].into_iter().chain(twins.with.first().map(|other| &other.valve));
        let positions: Vec<Vec<f64>> = valves.map(|valve| positions_mm(valve, &plan.run, &times_s)).collect();
        let commands: Vec<Value> =
            plan.run.commands.iter().map(|edge| json!({ "at_s": edge.time_s, "close": edge.closes() })).collect();
        json!({
            "purpose": plan.purpose,
            "separation": plan.separation,
            "decides": plan.separation >= DECISIVE,
            "pressures": plan.pressures,
            "repeats": plan.replicates,
            "toml": explanation::run_toml(plan),
            "time_s": times_s,
            "position_mm": positions,
            "plan": {
                "commands": commands,
                "end_s": plan.run.end_s,
                "supply_pressure_pa": plan.run.conditions.supply_pressure_pa,
                "temperature_k": plan.run.conditions.temperature_k,
                "leak_to_atmosphere_m2": plan.run.conditions.leak_to_atmosphere_m2,
                "leak_from_supply_m2": plan.run.conditions.leak_from_supply_m2,
            },
        })
    });
    json!({ "effect": twins.kind.id(), "with": with, "experiment": experiment })
}
