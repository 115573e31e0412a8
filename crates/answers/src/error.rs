//! An error: the same words in every document, and the same line in every text.

use model_lab::errors::Errors;
use serde_json::{Map, Value, json};

/// The errors for programs: `normalised_rms`, `rmse_m`, `share_of_stroke`, `time_rmse_s`.
pub fn value(errors: &Errors) -> Value {
    Value::Object(fields(errors, ""))
}

/// The same with those on what was held out, each with `held_out_` before its name; null where nothing was.
pub fn with_held_out(errors: &Errors, held_out: Option<&Errors>) -> Map<String, Value> {
    let mut all = fields(errors, "");
    let mut held = fields(held_out.unwrap_or(&Errors::default()), "held_out_");
    if held_out.is_none() {
        held.values_mut().for_each(|value| *value = Value::Null);
    }
    all.append(&mut held);
    all
}

fn fields(errors: &Errors, before: &str) -> Map<String, Value> {
    [
        ("normalised_rms", json!(errors.normalised_rms)),
        ("rmse_m", json!(errors.rmse_m)),
        ("share_of_stroke", json!(errors.share_of_stroke)),
        ("time_rmse_s", json!(errors.time_rmse_s)),
    ]
    .into_iter()
    .map(|(key, value)| (format!("{before}{key}"), value))
    .collect()
}

/// The errors in one line, lengths told by `length`.
pub fn words(errors: &Errors, length: &dyn Fn(f64) -> String) -> String {
    let mut parts = Vec::new();
    if let Some(rmse_m) = errors.rmse_m {
        let share =
            errors.share_of_stroke.map_or_else(String::new, |share| format!(" ({:.2} % of the stroke)", 100.0 * share));
        parts.push(format!("{}{share}", length(rmse_m)));
    }
    if let Some(time_s) = errors.time_rmse_s {
        parts.push(format!("{:.1} ms of the stroke times", 1e3 * time_s));
    }
    parts.push(format!("{:.3} times the noise", errors.normalised_rms));
    parts.join(", ")
}
