//! An error: the same words in every document, and the same line in every text.

use model_lab::errors::Errors;
use serde::Serialize;

/// The errors for programs.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct ErrorDocument {
    normalised_rms: Option<f64>,
    rmse_m: Option<f64>,
    share_of_stroke: Option<f64>,
    time_rmse_s: Option<f64>,
}

impl From<&Errors> for ErrorDocument {
    fn from(errors: &Errors) -> Self {
        Self {
            normalised_rms: Some(errors.normalised_rms),
            rmse_m: errors.rmse_m,
            share_of_stroke: errors.share_of_stroke,
            time_rmse_s: errors.time_rmse_s,
        }
    }
}

/// The same with those on what was held out; null where nothing was.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct BothErrors {
    #[serde(flatten)]
    errors: ErrorDocument,
    held_out_normalised_rms: Option<f64>,
    held_out_rmse_m: Option<f64>,
    held_out_share_of_stroke: Option<f64>,
    held_out_time_rmse_s: Option<f64>,
}

impl BothErrors {
    /// The errors of a fit, and of its predictions of what was held out.
    pub fn new(errors: &Errors, held_out: Option<&Errors>) -> Self {
        let held = held_out.map(ErrorDocument::from).unwrap_or_default();
        Self {
            errors: errors.into(),
            held_out_normalised_rms: held.normalised_rms,
            held_out_rmse_m: held.rmse_m,
            held_out_share_of_stroke: held.share_of_stroke,
            held_out_time_rmse_s: held.time_rmse_s,
        }
    }
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
