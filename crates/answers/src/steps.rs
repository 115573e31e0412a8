//! The error after each step of a model sequence.

use model_lab::diagnosis::StepReport;
use serde_json::{Value, json};

/// The steps for programs.
pub fn value(steps: &[StepReport]) -> Value {
    steps
        .iter()
        .map(|step| {
            json!({
                "step": step.step,
                "normalised_rms": step.normalised_rms,
                "held_out_normalised_rms": step.held_out_normalised_rms,
                "rmse_m": step.rmse_m,
                "held_out_rmse_m": step.held_out_rmse_m,
                "time_rmse_s": step.time_rmse_s,
                "model_error_share_of_stroke": step.discrepancy,
            })
        })
        .collect()
}
