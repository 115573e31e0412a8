//! The error after each step of a model sequence.

use model_lab::errors::StepReport;
use serde::Serialize;

use crate::error::BothErrors;

/// A step for programs.
#[derive(Debug, Clone, Serialize)]
pub struct StepDocument {
    step: String,
    #[serde(flatten)]
    errors: BothErrors,
    model_error_share_of_stroke: Option<f64>,
    correlation_time_s: Option<f64>,
}

impl From<&StepReport> for StepDocument {
    fn from(step: &StepReport) -> Self {
        Self {
            step: step.step.clone(),
            errors: BothErrors::new(&step.errors, step.held_out.as_ref()),
            model_error_share_of_stroke: step.discrepancy,
            correlation_time_s: step.correlation_time_s,
        }
    }
}

/// The steps for programs.
pub fn documents(steps: &[StepReport]) -> Vec<StepDocument> {
    steps.iter().map(StepDocument::from).collect()
}
