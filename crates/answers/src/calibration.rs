//! The answer of a calibration: in a sentence, and for programs.

use std::collections::BTreeMap;

use model_lab::calibrate::{Calibration, Verdict};
use serde::Serialize;
use serde_json::Value;

use crate::moved::{NuisanceDocument, ParameterDocument};
use crate::steps::StepDocument;
use crate::{CampaignInput, SCHEMA, moved, steps, value_of};

/// The verdict in a sentence.
pub fn verdict_words(calibration: &Calibration) -> &'static str {
    match calibration.verdict {
        Verdict::Explained => "calibration within the tolerances explains everything",
        Verdict::SomethingLeft => "something small is left that calibration does not explain",
        Verdict::ValuesBeyondTolerance => {
            "values beyond their tolerances explain everything: either they were believed wrongly, or they stand in for physics that is missing"
        }
        Verdict::BeyondTolerance => "something beyond the tolerances is there: physics is missing from the model",
    }
}

/// A calibration for programs.
#[derive(Debug, Clone, Serialize)]
struct CalibrationDocument<'a> {
    schema: u32,
    valve: &'a str,
    campaign: &'a str,
    verdict: &'static str,
    verdict_words: &'static str,
    prior_data_conflict: bool,
    reasons: &'a [String],
    parameters: Vec<ParameterDocument>,
    correlations: Correlations,
    not_fixed: Vec<NotFixed<'a>>,
    nuisances: Vec<NuisanceDocument>,
    steps: Vec<StepDocument>,
    doubts: Vec<String>,
}

/// Which parameters the records tell apart.
#[derive(Debug, Clone, Serialize)]
struct Correlations {
    parameters: Vec<&'static str>,
    matrix: Vec<Vec<f64>>,
}

/// A combination of parameters that the records do not fix.
#[derive(Debug, Clone, Serialize)]
struct NotFixed<'a> {
    information: f64,
    changes: BTreeMap<&'static str, f64>,
    words: &'a str,
}

/// The whole answer.
pub fn document(input: &CampaignInput, calibration: &Calibration) -> Value {
    let names: Vec<&'static str> = calibration.parameters.iter().map(|parameter| parameter.id.key()).collect();
    let count = names.len();
    let row = |row: usize| (0..count).map(|column| calibration.correlations[(row, column)]).collect();
    let not_fixed = calibration.non_identifiable.iter().map(|combination| NotFixed {
        information: combination.information,
        changes: combination.changes.iter().map(|(id, change)| (id.key(), *change)).collect(),
        words: &combination.words,
    });
    value_of(&CalibrationDocument {
        schema: SCHEMA,
        valve: input.file.file_name(),
        campaign: &input.campaign.name,
        verdict: calibration.verdict.id(),
        verdict_words: verdict_words(calibration),
        prior_data_conflict: calibration.has_prior_conflict,
        reasons: &calibration.reasons,
        parameters: calibration.found().map(ParameterDocument::from).collect(),
        correlations: Correlations { parameters: names, matrix: (0..count).map(row).collect() },
        not_fixed: not_fixed.collect(),
        nuisances: moved::nuisances(&calibration.nuisances),
        steps: steps::documents(&calibration.steps),
        doubts: input.doubts(),
    })
}
