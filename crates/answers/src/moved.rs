//! Values that a fit moved: of parameters, of instruments and of conditions.

use model_lab::diagnosis::{MovedParameter, NuisanceReport};
use serde_json::{Value, json};

/// Fitted parameters for programs, SI.
pub fn parameters(moved: &[MovedParameter]) -> Value {
    moved
        .iter()
        .map(|moved| {
            json!({
                "parameter": moved.id.key(), "unit": moved.id.si_unit(), "tolerance": moved.tolerance,
                "before": moved.before, "after": moved.after, "standard_error": moved.sigma,
                "interval_90": moved.interval_90, "pull": moved.pull, "pull_standard_error": moved.pull_sigma,
                "at_bound": moved.is_at_bound,
            })
        })
        .collect()
}

/// What instruments and conditions were found to be off by, for programs, SI.
pub fn nuisances(found: &[NuisanceReport]) -> Value {
    found
        .iter()
        .map(|nuisance| {
            json!({
                "what": nuisance.what, "run": nuisance.record, "value": nuisance.value,
                "standard_error": nuisance.sigma, "prior_standard_deviation": nuisance.prior,
                "unit": nuisance.unit, "at_bound": nuisance.is_at_bound,
            })
        })
        .collect()
}
