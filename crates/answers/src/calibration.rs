//! The answer of a calibration: in a sentence, and for programs.

use model_lab::Scatter;
use model_lab::calibrate::{Calibration, Verdict};
use model_lab::scatter::Origin;
use serde_json::{Map, Value, json};

use crate::CampaignInput;
use crate::comparison::comparison_value;

/// The verdict in a sentence.
pub fn verdict_words(calibration: &Calibration) -> &'static str {
    match (calibration.verdict, calibration.scatter.origin) {
        (Verdict::Explained, Origin::Repeats) => "calibration and repeatability explain everything",
        (Verdict::Explained, Origin::Unknown) => "calibration within the tolerances explains everything",
        (Verdict::Explained, Origin::Supposed) => "calibration and strokes that differ would explain everything",
        (Verdict::BeyondTolerance, _) => "something beyond the tolerances is there: physics is missing from the model",
    }
}

/// The whole answer.
pub fn document(input: &CampaignInput, calibration: &Calibration) -> Value {
    let parameters: Vec<Value> = calibration
        .parameters
        .iter()
        .map(|parameter| {
            json!({
                "parameter": parameter.id.key(),
                "unit": parameter.id.si_unit(),
                "tolerance": parameter.tolerance,
                "before": parameter.before,
                "after": parameter.after,
                "standard_error": parameter.standard_error,
                "interval_90": parameter.interval_90,
                "shift_tolerances": parameter.shift,
                "shift_standard_error": parameter.shift_error,
            })
        })
        .collect();
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
    let held_out = calibration.held_out.as_ref();
    let repeatability = calibration.repeatability.as_ref().map(|found| {
        let sources: Map<String, Value> =
            found.sources.iter().map(|(source, size)| ((*source).to_owned(), json!(size))).collect();
        json!({ "normalised_rms": found.normalised, "position_m": found.position_m,
                "stroke_time_s": found.stroke_time_s, "one_sigma": sources })
    });
    json!({
        "valve": input.file.file_name(),
        "campaign": input.campaign.name,
        "verdict": calibration.verdict.id(),
        "verdict_words": verdict_words(calibration),
        "strayed": calibration.has_strayed(),
        "reasons": calibration.reasons,
        "parameters": parameters,
        "correlations": { "parameters": names, "matrix": correlations },
        "not_fixed": singular,
        "normalised_rms": {
            "before": calibration.before.overall.normalised_rms,
            "after": calibration.after.overall.normalised_rms,
        },
        "held_out_normalised_rms": held_out.map(|held_out| {
            json!({ "before": held_out.before, "after": held_out.after, "parts": held_out.parts })
        }),
        "repeatability": repeatability,
        "scatter": scatter(&calibration.scatter),
        "chi2_per_reading": calibration.lack_of_fit.chi2_per_reading,
        "inflation": calibration.inflation,
        "before": comparison_value(input, &calibration.before),
        "after": comparison_value(input, &calibration.after),
    })
}

/// How strokes differ from one to the next, one standard deviation, and where that is known from.
fn scatter(scatter: &Scatter) -> Value {
    let sizes: Map<String, Value> =
        scatter.sources().map(|(source, size)| (source.name().to_owned(), json!(size))).collect();
    json!({ "known_from": scatter.origin.id(), "one_sigma": sizes })
}
