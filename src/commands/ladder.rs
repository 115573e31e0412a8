//! The error after each step, for `explain` and `adopt`.

use model_lab::diagnosis::StepReport;
use report::figures::{StaircaseFigure, StaircaseStep};

use crate::output::{Align, TextTable};

/// The steps as a table: errors in mm (or ms) and in units of the noise, fitted and held out.
pub fn table(steps: &[StepReport]) -> String {
    let has_traces = steps.iter().any(|step| step.rmse_m.is_some());
    let unit = if has_traces { ("error (mm)", "held out (mm)") } else { ("error (ms)", "") };
    let mut columns = vec![("step", Align::Left), (unit.0, Align::Right)];
    if has_traces {
        columns.push((unit.1, Align::Right));
    }
    columns.extend([("in noise", Align::Right), ("held out", Align::Right)]);
    let mut table = TextTable::new(&columns);
    let shown =
        |value: Option<f64>, digits: usize| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"));
    for step in steps {
        let mut row = vec![step.step.clone()];
        if has_traces {
            row.push(shown(step.rmse_m.map(|rmse| 1e3 * rmse), 4));
            row.push(shown(step.held_out_rmse_m.map(|rmse| 1e3 * rmse), 4));
        } else {
            row.push(shown(step.time_rmse_s.map(|rmse| 1e3 * rmse), 3));
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
