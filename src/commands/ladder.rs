//! The error after each step, for `explain` and `adopt`.

use model_lab::Scatter;
use model_lab::explain::report::StepReport;
use model_lab::scatter::Origin;
use report::figures::{StaircaseFigure, StaircaseStep};
use serde_json::{Value, json};

use crate::output::{Align, TextTable};

/// The steps as a table.
pub fn table(steps: &[StepReport]) -> String {
    let mut table =
        TextTable::new(&[("step", Align::Left), ("error, fitted", Align::Right), ("error, left out", Align::Right)]);
    for step in steps {
        let left_out = step.held_out_normalised_rms.map_or_else(|| "-".to_owned(), |error| format!("{error:.3}"));
        table.row(vec![step.step.clone(), format!("{:.3}", step.normalised_rms), left_out]);
    }
    table.render()
}

/// The steps for programs.
pub fn value(steps: &[StepReport]) -> Value {
    steps
        .iter()
        .map(|step| {
            json!({
                "step": step.step,
                "normalised_rms": step.normalised_rms,
                "held_out_normalised_rms": step.held_out_normalised_rms,
            })
        })
        .collect()
}

/// The steps as a picture.
pub fn figure(title: &str, subtitle: &str, steps: &[StepReport], scatter: &Scatter) -> StaircaseFigure {
    StaircaseFigure {
        title: title.to_owned(),
        subtitle: subtitle.to_owned(),
        steps: steps
            .iter()
            .map(|step| StaircaseStep {
                name: step.step.clone(),
                fitted: step.normalised_rms,
                held_out: step.held_out_normalised_rms,
            })
            .collect(),
        repeatability: (scatter.origin == Origin::Repeats).then_some(1.0),
    }
}
