//! The answer of `valve explain` for programs, with the names of the output's contract.

use std::fmt::Write;

use leak_table::mm2_from_m2;
use model_lab::diagnosis::experiment::Experiment;
use model_lab::diagnosis::outside::Outside;
use model_lab::diagnosis::{Explanation, FittedParameter};
use serde_json::{Map, Value, json};
use valve_model::EffectKind;

use super::ladder;

/// The version of the document; raised when a key changes its meaning.
const SCHEMA: u32 = 2;

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
            json!({
                "effects": ids(&candidate.kinds),
                "parameters": parameters(&candidate.parameters),
                "log_evidence_gain": candidate.gain,
                "probability": candidate.probability,
                "normalised_rms": candidate.normalised_rms,
                "held_out_normalised_rms": candidate.held_out_normalised_rms,
                "rmse_m": candidate.rmse_m,
                "delta_bic": candidate.delta_bic,
                "rejected": candidate.rejected,
            })
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
    let nuisances: Vec<Value> = answer
        .nuisances
        .iter()
        .map(|nuisance| {
            json!({
                "what": nuisance.what,
                "run": nuisance.record,
                "value": nuisance.value,
                "standard_error": nuisance.sigma,
                "prior_standard_deviation": nuisance.prior,
                "unit": nuisance.unit,
                "at_bound": nuisance.is_at_bound,
            })
        })
        .collect();
    let moved: Vec<Value> = answer
        .moved
        .iter()
        .map(|moved| {
            json!({
                "key": moved.id.key(), "before": moved.before, "after": moved.after,
                "standard_error": moved.sigma, "pull": moved.pull, "unit": moved.id.si_unit(),
            })
        })
        .collect();
    json!({
        "schema": SCHEMA,
        "campaign": campaign,
        "verdict": answer.verdict.id(),
        "recommended": ids(&answer.recommended),
        "parameters": parameters(&answer.parameters),
        "calibrated_parameters": moved,
        "nuisances": nuisances,
        "indistinguishable": indistinguishable,
        "candidates": candidates,
        "probability": { "effects": effects, "models": models },
        "steps": ladder::value(&answer.steps),
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
        .map(|edge| format!("{{ at = \"{:.3} s\", close = {} }}", edge.time_s, edge.close))
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
        "normalised_rms_with_custom": found.errors.normalised_rms,
        "rmse_m_with_custom": found.errors.rmse_m,
        "held_out_normalised_rms": found.held_out.map(|errors| errors.normalised_rms),
        "held_out_rmse_m": found.held_out.and_then(|errors| errors.rmse_m),
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
