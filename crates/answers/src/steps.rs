//! The error after each step of a model sequence.

use model_lab::errors::StepReport;
use serde_json::{Value, json};

use crate::error;

/// The steps for programs.
pub fn value(steps: &[StepReport]) -> Value {
    steps.iter().map(step).collect()
}

/// One step for programs.
pub fn step(step: &StepReport) -> Value {
    let mut value = error::with_held_out(&step.errors, step.held_out.as_ref());
    value.insert("step".to_owned(), json!(step.step));
    value.insert("model_error_share_of_stroke".to_owned(), json!(step.discrepancy));
    value.insert("correlation_time_s".to_owned(), json!(step.correlation_time_s));
    Value::Object(value)
}
