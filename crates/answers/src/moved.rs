//! Values that a fit moved: of parameters, of instruments and of conditions.

use model_lab::diagnosis::{MovedParameter, NuisanceReport};
use serde::Serialize;

/// A fitted parameter for programs, SI.
#[derive(Debug, Clone, Serialize)]
pub struct ParameterDocument {
    parameter: &'static str,
    unit: &'static str,
    tolerance: f64,
    before: f64,
    after: f64,
    standard_error: f64,
    interval_90: (f64, f64),
    pull: f64,
    pull_standard_error: f64,
    at_bound: bool,
}

impl From<&MovedParameter> for ParameterDocument {
    fn from(moved: &MovedParameter) -> Self {
        Self {
            parameter: moved.id.key(),
            unit: moved.id.si_unit(),
            tolerance: moved.tolerance,
            before: moved.before,
            after: moved.after,
            standard_error: moved.sigma,
            interval_90: moved.interval_90,
            pull: moved.pull,
            pull_standard_error: moved.pull_sigma,
            at_bound: moved.is_at_bound,
        }
    }
}

/// Fitted parameters for programs.
pub fn parameters(moved: &[MovedParameter]) -> Vec<ParameterDocument> {
    moved.iter().map(ParameterDocument::from).collect()
}

/// What to think of values that ended further off than their tolerances let one expect; nothing where none did.
pub fn far_off(moved: &[MovedParameter]) -> Option<String> {
    let far: Vec<String> = moved
        .iter()
        .filter(|one| one.is_far())
        .map(|one| format!("{} is {:+.1} tolerances off", one.id.key(), one.pull))
        .collect();
    (!far.is_empty()).then(|| {
        format!(
            "{}: its tolerance is stated too narrowly, or the valve file is wrong about something else (weight and orientation, \
             bore, spring, supply); sizes of effects are only as sure as that",
            far.join(", ")
        )
    })
}

/// What an instrument or a condition was found to be off by, for programs, SI.
#[derive(Debug, Clone, Serialize)]
pub struct NuisanceDocument {
    what: &'static str,
    run: Option<String>,
    value: f64,
    standard_error: f64,
    prior_standard_deviation: f64,
    unit: &'static str,
    at_bound: bool,
}

impl From<&NuisanceReport> for NuisanceDocument {
    fn from(found: &NuisanceReport) -> Self {
        Self {
            what: found.what,
            run: found.record.clone(),
            value: found.value,
            standard_error: found.sigma,
            prior_standard_deviation: found.prior,
            unit: found.unit,
            at_bound: found.is_at_bound,
        }
    }
}

/// What instruments and conditions were found to be off by, for programs.
pub fn nuisances(found: &[NuisanceReport]) -> Vec<NuisanceDocument> {
    found.iter().map(NuisanceDocument::from).collect()
}

#[cfg(test)]
mod tests {
    use valve_model::ParameterId;

    use super::*;

    #[test]
    fn values_far_off_their_tolerances_are_doubted_by_name() {
        let moved = |id, pull| MovedParameter {
            id,
            before: 1.0,
            after: 1.1,
            sigma: 0.01,
            interval_90: (1.08, 1.12),
            tolerance: 0.03,
            pull,
            pull_sigma: 0.3,
            is_at_bound: false,
        };
        let near = moved(ParameterId::SpringStiffness, 2.9);
        assert_eq!(far_off(&[near]), None);
        let words = far_off(&[near, moved(ParameterId::PreloadCompression, -4.19)]).expect("one is far");
        assert!(words.starts_with("spring.preload_compression is -4.2 tolerances off: its tolerance"), "{words}");
        assert!(!words.contains("  "), "{words}");
    }
}
