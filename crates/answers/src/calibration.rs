//! The answer of a calibration: in a sentence, and for programs.

use model_lab::calibrate::{Calibration, Verdict};
use serde_json::{Map, Value, json};

use crate::{CampaignInput, SCHEMA, moved, steps};

/// The verdict in a sentence.
pub fn verdict_words(calibration: &Calibration) -> &'static str {
    match calibration.verdict {
        Verdict::Explained => "calibration within the tolerances explains everything",
        Verdict::SomethingLeft => "something small is left that calibration does not explain",
        Verdict::BeyondTolerance => "something beyond the tolerances is there: physics is missing from the model",
    }
}

/// The whole answer.
pub fn document(input: &CampaignInput, calibration: &Calibration) -> Value {
    let names: Vec<&str> = calibration.parameters.iter().map(|parameter| parameter.id.key()).collect();
    let count = names.len();
    let correlations: Vec<Vec<f64>> =
        (0..count).map(|row| (0..count).map(|column| calibration.correlations[(row, column)]).collect()).collect();
    let singular: Vec<Value> = calibration
        .singular
        .iter()
        .map(|direction| {
            let changes: Map<String, Value> =
                direction.changes.iter().map(|(id, change)| (id.key().to_owned(), json!(change))).collect();
            json!({ "information": direction.information, "changes": changes, "words": direction.words })
        })
        .collect();
    json!({
        "schema": SCHEMA,
        "valve": input.file.file_name(),
        "campaign": input.campaign.name,
        "verdict": calibration.verdict.id(),
        "verdict_words": verdict_words(calibration),
        "strayed": calibration.has_strayed,
        "reasons": calibration.reasons,
        "parameters": moved::parameters(&calibration.parameters),
        "correlations": { "parameters": names, "matrix": correlations },
        "not_fixed": singular,
        "nuisances": moved::nuisances(&calibration.nuisances),
        "steps": steps::value(&calibration.steps),
    })
}
