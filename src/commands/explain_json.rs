//! The answer of `valve explain` for programs, with the names of the output's contract.

use std::fmt::Write;

use leak_table::mm2_from_m2;
use model_lab::Scatter;
use model_lab::explain::Explanation;
use model_lab::explain::experiment::Experiment;
use model_lab::explain::outside::Outside;
use model_lab::explain::report::FittedParameter;
use serde_json::{Map, Value, json};

use super::ladder;

/// The whole answer.
pub fn document(answer: &Explanation, campaign: &str) -> Value {
    let recommended: Vec<&str> = answer.recommended.iter().map(|kind| kind.id()).collect();
    let mut indistinguishable = Map::new();
    for twin in &answer.twins {
        let with: Vec<&str> = twin.with.iter().map(|other| other.kind.id()).collect();
        indistinguishable.insert(
            twin.kind.id().into(),
            json!({
                "with": with,
                "delta_chi2": twin.with.iter().map(|other| other.behind).collect::<Vec<_>>(),
                "likeness": twin.likeness,
                "next_experiment": twin.experiment.as_ref().map(experiment),
            }),
        );
    }
    let candidates: Vec<Value> = answer
        .candidates
        .iter()
        .map(|candidate| {
            json!({
                "effects": candidate.kinds.iter().map(|kind| kind.id()).collect::<Vec<_>>(),
                "parameters": parameters(&candidate.parameters),
                "normalised_rms": candidate.normalised_rms,
                "held_out_normalised_rms": candidate.held_out_normalised_rms,
                "delta_bic": candidate.delta_bic,
                "delta_chi2": candidate.gain,
                "rejected": candidate.rejected,
            })
        })
        .collect();
    json!({
        "campaign": campaign,
        "verdict": answer.verdict.id(),
        "recommended": recommended,
        "parameters": parameters(&answer.parameters),
        "indistinguishable": indistinguishable,
        "candidates": candidates,
        "steps": ladder::value(&answer.steps),
        "residual": answer.outside.as_ref().map(|found| outside(found, &answer.scatter)),
        "lack_of_fit": answer.lack,
        "scatter": scatter(&answer.scatter),
        "notes": answer.notes,
        "interrupted": answer.interrupted,
    })
}

/// How strokes differ from one to the next, one standard deviation, and where that is known from.
pub fn scatter(scatter: &Scatter) -> Value {
    let sizes: Map<String, Value> =
        scatter.sources().map(|(source, size)| (source.name().to_owned(), json!(size))).collect();
    json!({ "known_from": scatter.origin.id(), "one_sigma": sizes })
}

/// Fitted parameters, SI.
pub fn parameters(fitted: &[FittedParameter]) -> Value {
    fitted
        .iter()
        .map(|parameter| {
            json!({
                "effect": parameter.effect.id(),
                "name": parameter.name,
                "value": parameter.value,
                "standard_error": parameter.sigma,
                "unit": parameter.unit,
            })
        })
        .collect()
}

fn experiment(plan: &Experiment) -> Value {
    json!({
        "purpose": plan.purpose,
        "run": run_toml(plan),
        "record_pressures": plan.pressures,
        "repeats": plan.repeats,
        "separation_chi2": plan.separation,
    })
}

/// A planned run as it is pasted into a campaign file.
pub fn run_toml(plan: &Experiment) -> String {
    let conditions = &plan.run.conditions;
    // Writing to a string cannot fail.
    let mut text = format!(
        "[[run]]\nsupply_pressure = \"{:.2} kPa\"\ntemperature = \"{:.2} K\"\n",
        conditions.supply_pressure_pa * 1e-3,
        conditions.temperature_k
    );
    for (key, area) in
        [("leak_to_atmosphere", conditions.leak_to_atmosphere_m2), ("leak_from_supply", conditions.leak_from_supply_m2)]
    {
        if area > 0.0 {
            let _ = writeln!(text, "{key} = \"{:.4} mm2\"", mm2_from_m2(area));
        }
    }
    let commands: Vec<String> = plan
        .run
        .commands
        .iter()
        .map(|edge| format!("{{ at = \"{:.3} s\", close = {} }}", edge.time_s, edge.close))
        .collect();
    let _ = writeln!(text, "commands = [ {} ]\nend = \"{:.3} s\"", commands.join(", "), plan.run.end_s);
    text
}

fn outside(found: &Outside, scatter: &Scatter) -> Value {
    let custom: Map<String, Value> = found
        .effect
        .parameters()
        .iter()
        .zip(&found.parameter_sigmas)
        .map(|(parameter, sigma)| {
            (
                parameter.name.clone(),
                json!({ "value": parameter.value, "standard_error": sigma, "unit": parameter.unit }),
            )
        })
        .collect();
    json!({
        "acts_on": found.axis.target.id(),
        "along": found.axis.variable,
        "table": { "at": found.knots, "value": found.values, "standard_error": found.sigmas },
        "table_held_out_normalised_rms": found.table_held_out,
        "custom": { "acts_on": found.effect.target().id(), "formula": found.effect.formula().source(), "parameters": custom },
        "toml": effect_toml(found),
        "normalised_rms_with_custom": found.fit.normalised_rms(scatter),
        "held_out_normalised_rms": found.held_out,
    })
}

/// The custom effect as it is pasted into a valve file.
pub fn effect_toml(found: &Outside) -> String {
    let effect = &found.effect;
    // Writing to a string cannot fail.
    let mut text = format!(
        "[[effect]]\nkind = \"custom\"\nname = \"{}\"\nacts_on = \"{}\"\nformula = \"{}\"\n[effect.parameters]\n",
        effect.name(),
        effect.target().id(),
        effect.formula().source()
    );
    for parameter in effect.parameters() {
        let _ = writeln!(
            text,
            "{} = {{ start = {:.6e}, lower = {:.3e}, upper = {:.3e}, unit = \"{}\" }}",
            parameter.name, parameter.value, parameter.lower, parameter.upper, parameter.unit
        );
    }
    text
}
