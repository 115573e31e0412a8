//! The answer of a search: in a sentence, and for programs with the names of the output's contract.

use std::fmt::Write;

use leak_table::mm2_from_m2;
use model_lab::diagnosis::experiment::Experiment;
use model_lab::diagnosis::outside::Outside;
use model_lab::diagnosis::{Explanation, FittedParameter, Verdict};
use serde_json::{Map, Value, json};
use valve_model::EffectKind;
use valve_model::custom::CustomTarget;

use crate::{SCHEMA, error, moved, steps};

/// Effects in words.
pub fn joined(kinds: &[EffectKind]) -> String {
    kinds.iter().map(|kind| kind.id()).collect::<Vec<_>>().join(" + ")
}

fn ids(answer: &Explanation) -> String {
    answer.recommended.iter().map(|kind| kind.id()).collect::<Vec<_>>().join(" and ")
}

/// What was found, each effect with those that it cannot be told from.
fn groups(answer: &Explanation) -> String {
    let group = |kind: &EffectKind| {
        let with = answer.twins.iter().filter(|twin| twin.kind == *kind).flat_map(|twin| &twin.with);
        let names: Vec<&str> = with.map(|other| other.kind.id()).collect();
        if names.is_empty() { kind.id().to_owned() } else { format!("{} (or {})", kind.id(), names.join(", or ")) }
    };
    answer.recommended.iter().map(group).collect::<Vec<_>>().join(" and ")
}

/// The answer in a sentence.
pub fn headline(answer: &Explanation) -> String {
    headline_in(answer, &|rmse_m| format!("{:.3} mm", 1e3 * rmse_m))
}

/// The same with an error of a length, m, told in other words.
pub fn headline_in(answer: &Explanation, length: &dyn Fn(f64) -> String) -> String {
    match answer.verdict {
        Verdict::Adequate => {
            "nothing is missing beyond noise, tolerances and what instruments and conditions may be off by".into()
        }
        Verdict::EffectFound => format!("missing: {}", groups(answer)),
        Verdict::PartlyExplained => {
            format!(
                "missing: {}; that explains most of it, and an error of {} is left",
                groups(answer),
                left(answer, length)
            )
        }
        Verdict::OutsideCatalogue => {
            let missing = format!(
                "something is missing ({} are left), and no effect of the catalogue, nor a pair, explains it",
                left(answer, length)
            );
            match answer.outside.as_ref().and_then(|outside| Some((outside, outside.errors.rmse_m?))) {
                Some((outside, rmse_m)) => format!(
                    "{missing}; a formula for {} {} does, but for {}",
                    acting(outside.axis.target),
                    along(outside.axis.variable),
                    length(rmse_m)
                ),
                None => missing,
            }
        }
        Verdict::NotEnoughData if answer.interrupted && answer.recommended.is_empty() => {
            "the search was cut short before it was known what is missing, if anything is".into()
        }
        Verdict::NotEnoughData if answer.interrupted => {
            format!("something is missing; {} explains part of it, and the search was cut short there", ids(answer))
        }
        Verdict::NotEnoughData => {
            format!("something is missing; {} explains it, and so do too many others", ids(answer))
        }
    }
}

/// What a formula adds, in words.
fn acting(target: CustomTarget) -> &'static str {
    match target {
        CustomTarget::Force => "a force",
        CustomTarget::Friction => "a friction",
        CustomTarget::PipeFlow => "a flow into the pipe",
        CustomTarget::ChamberFlow => "a flow into the chamber",
    }
}

/// What a formula lies along, in words.
fn along(variable: &str) -> &str {
    match variable {
        "x" => "along the stroke",
        "v" => "over the speed",
        "t_since_command" => "after each command",
        other => other,
    }
}

/// The error that is left, in words.
fn left(answer: &Explanation, length: &dyn Fn(f64) -> String) -> String {
    let last = answer.steps.last();
    match last.and_then(|step| step.held_out.and_then(|errors| errors.rmse_m).or(step.errors.rmse_m)) {
        Some(rmse) => length(rmse),
        None => {
            last.and_then(|step| step.errors.time_rmse_s).map_or("some".into(), |rmse| format!("{:.1} ms", 1e3 * rmse))
        }
    }
}

/// The whole answer.
pub fn document(answer: &Explanation, campaign: &str) -> Value {
    let ids = |kinds: &[EffectKind]| kinds.iter().map(|kind| kind.id()).collect::<Vec<_>>();
    let mut indistinguishable = Map::new();
    for twin in &answer.twins {
        let with: Vec<&str> = twin.with.iter().map(|other| other.kind.id()).collect();
        indistinguishable.insert(
            twin.kind.id().into(),
            json!({
                "with": with,
                "delta_log_evidence": twin.with.iter().map(|other| -other.behind).collect::<Vec<_>>(),
                "next_experiment": twin.experiment.as_ref().map(experiment),
            }),
        );
    }
    let candidates: Vec<Value> = answer
        .candidates
        .iter()
        .map(|candidate| {
            let mut value = Value::Object(error::with_held_out(&candidate.errors, candidate.held_out.as_ref()));
            value["effects"] = json!(ids(&candidate.kinds));
            value["parameters"] = parameters(&candidate.parameters);
            value["log_evidence_gain"] = json!(candidate.gain);
            value["probability"] = json!(candidate.probability);
            value["delta_bic"] = json!(candidate.delta_bic);
            value["rejected"] = json!(candidate.rejected);
            value
        })
        .collect();
    let models: Vec<Value> = answer
        .candidates
        .iter()
        .filter_map(|candidate| {
            Some(json!({ "effects": ids(&candidate.kinds), "probability": candidate.probability? }))
        })
        .collect();
    let effects: Map<String, Value> =
        answer.inclusion.iter().map(|(kind, share)| (kind.id().to_owned(), json!(share))).collect();
    json!({
        "schema": SCHEMA,
        "campaign": campaign,
        "verdict": answer.verdict.id(),
        "recommended": ids(&answer.recommended),
        "parameters": parameters(&answer.parameters),
        "calibrated_parameters": moved::parameters(&answer.moved),
        "nuisances": moved::nuisances(&answer.nuisances),
        "indistinguishable": indistinguishable,
        "candidates": candidates,
        "probability": { "effects": effects, "models": models },
        "steps": steps::value(&answer.steps),
        "remainder": {
            "model_error_share_of_stroke": answer.remainder.discrepancy,
            "correlation_time_s": answer.remainder.time_s,
            "log_evidence": answer.remainder.nats,
            "noise_multiplier": answer.remainder.multiplier,
        },
        "residual": answer.outside.as_ref().map(outside),
        "notes": answer.notes,
        "interrupted": answer.interrupted,
    })
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
        .map(|edge| format!("{{ at = \"{:.3} s\", close = {} }}", edge.time_s, edge.closes()))
        .collect();
    let _ = writeln!(text, "commands = [ {} ]\nend = \"{:.3} s\"", commands.join(", "), plan.run.end_s);
    text
}

fn outside(found: &Outside) -> Value {
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
        "custom": { "acts_on": found.effect.target().id(), "formula": found.effect.formula().source(), "parameters": custom },
        "toml": effect_toml(found),
        "log_evidence_gain": found.gain,
        "with_custom": error::with_held_out(&found.errors, found.held_out.as_ref()),
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
