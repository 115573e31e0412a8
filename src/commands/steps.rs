//! Errors, and the error after each step: in every verb alike.

use model_lab::errors::{Errors, StepReport};
use quantity::Dimension;

use crate::output::{Align, TextTable, told_in};

/// An error in one line, in the units of the user.
pub fn words(errors: &Errors) -> String {
    let unit = told_in(Dimension::Length);
    answers::error::words(errors, &|metres| format!("{} {}", unit.number(metres, 4), unit.name()))
}

/// The steps as a text, and what the last one leaves.
pub fn table(steps: &[StepReport]) -> String {
    let left = steps.last().map_or_else(String::new, |last| format!("left: {}\n", words(&last.errors)));
    rows(steps).render() + &left
}

/// The steps as a table: errors in mm (or ms) and in units of the noise, fitted and held out.
pub fn rows(steps: &[StepReport]) -> TextTable {
    let has_traces = steps.iter().any(|step| step.errors.rmse_m.is_some());
    let told = told_in(if has_traces { Dimension::Length } else { Dimension::Time });
    let [error, held_out] = ["error", "held out"].map(|name| format!("{name} ({})", told.name()));
    let columns = [
        ("step", Align::Left),
        (error.as_str(), Align::Right),
        (&held_out, Align::Right),
        ("in noise", Align::Right),
        ("held out", Align::Right),
    ];
    let mut table = TextTable::new(&columns);
    let size = |errors: &Errors| {
        let (si, digits) = if has_traces { (errors.rmse_m, 4) } else { (errors.time_rmse_s, 3) };
        si.map_or_else(|| "-".to_owned(), |si| told.number(si, digits))
    };
    let or_dash = |shown: Option<String>| shown.unwrap_or_else(|| "-".to_owned());
    for step in steps {
        let held_out = step.held_out.as_ref();
        table.row(vec![
            step.told(),
            size(&step.errors),
            or_dash(held_out.map(size)),
            format!("{:.3}", step.errors.normalised_rms),
            or_dash(held_out.map(|errors| format!("{:.3}", errors.normalised_rms))),
        ]);
    }
    table
}
