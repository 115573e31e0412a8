//! The error after each step, for `explain` and `adopt`.

use model_lab::diagnosis::StepReport;
use quantity::Dimension;
use report::figures::{StaircaseFigure, StaircaseStep};

use crate::output::{Align, TextTable, told_in};

/// The steps as a table: errors in mm (or ms) and in units of the noise, fitted and held out.
pub fn table(steps: &[StepReport]) -> String {
    let has_traces = steps.iter().any(|step| step.rmse_m.is_some());
    let told = told_in(if has_traces { Dimension::Length } else { Dimension::Time });
    let [error, held_out] = ["error", "held out"].map(|name| format!("{name} ({})", told.name()));
    let mut columns = vec![("step", Align::Left), (error.as_str(), Align::Right)];
    if has_traces {
        columns.push((&held_out, Align::Right));
    }
    columns.extend([("in noise", Align::Right), ("held out", Align::Right)]);
    let mut table = TextTable::new(&columns);
    let shown =
        |value: Option<f64>, digits: usize| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"));
    let size = |si: Option<f64>, digits: usize| si.map_or_else(|| "-".to_owned(), |si| told.number(si, digits));
    for step in steps {
        let mut row = vec![step.step.clone()];
        if has_traces {
            row.push(size(step.rmse_m, 4));
            row.push(size(step.held_out_rmse_m, 4));
        } else {
            row.push(size(step.time_rmse_s, 3));
        }
        row.push(format!("{:.3}", step.normalised_rms));
        row.push(shown(step.held_out_normalised_rms, 3));
        table.row(row);
    }
    table.render()
}

/// The steps as a picture.
pub fn figure(title: &str, subtitle: &str, steps: &[StepReport]) -> StaircaseFigure {
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
        repeatability: None,
    }
}
