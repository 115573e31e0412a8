//! Sections about the valve file and its tables.

use leak_table::TableBundle;
use report::figures::TableFigure;
use report::html::{Block, Section, Table};
use valve_file::{FoundValue, HistoryEntry, ValveFile};
use valve_model::Conditions;
use valve_model::simulate::DEFAULT_STEP_S;

use crate::commands::adopt::with_error;
use crate::commands::build_tables;
use answers::figures::simulation::trace;
use answers::strokes::Cycles;
use answers::tables as pictures;

/// A healthy cycle.
pub fn strokes(file: &ValveFile) -> Section {
    let conditions = Conditions::nominal(file.valve().parameters());
    let path = Cycles::simulate(file.valve(), conditions, &file.schedule(), 1, DEFAULT_STEP_S);
    let [close, open] = path.times_s[0];
    let text = |time: Option<f64>| time.map_or_else(|| "not at all".to_owned(), |time| format!("in {time:.4} s"));
    let limits = file.limits();
    let sentence = format!(
        "Simulated without a leak, the valve closes {} and opens {}. Its life ends where a closing takes more \
         than {} s or an opening more than {} s.",
        text(close),
        text(open),
        limits.close_within_s,
        limits.open_within_s
    );
    let figure = trace(file, &conditions, &path).figure();
    Section { title: "Strokes".to_owned(), blocks: vec![Block::Text(sentence), Block::Figure(Box::new(figure))] }
}

/// The tables of all that wears.
pub fn tables(bundle: &TableBundle) -> Section {
    let table = build_tables::summary(bundle).into();
    let figures = pictures::figures(bundle);
    let figure = TableFigure::side_by_side(pictures::title(bundle), "periodic cycles, as simulated", &figures);
    Section { title: "Leaks".to_owned(), blocks: vec![Block::Table(table), Block::Figure(Box::new(figure))] }
}

/// Why there are none.
pub fn no_tables(reason: &dyn std::fmt::Display) -> Section {
    let sentence = format!("This valve file gives no tables for reading a timing log: {reason}.");
    Section { title: "Leaks".to_owned(), blocks: vec![Block::Text(sentence)] }
}

/// What the steps of a history found, effects first. Each step that found anything has fitted all of the valve's own values anew.
fn found(history: &[HistoryEntry]) -> Vec<Vec<String>> {
    let mut last: Vec<&FoundValue> = Vec::new();
    for found in history.iter().map(|entry| &entry.found).filter(|found| !found.is_empty()) {
        let is_new = |other: &FoundValue| found.iter().any(|one| one.effect == other.effect);
        last.retain(|other| other.effect.is_some() && !is_new(other));
        last.extend(found);
    }
    last.sort_by_key(|one| one.effect.is_none());
    let row = |one: &FoundValue| {
        let of = one.effect.clone().unwrap_or_else(|| "valve".to_owned());
        vec![of, one.parameter.clone(), with_error(one.value, one.standard_error, &one.unit).replace("+-", "±")]
    };
    last.into_iter().map(row).collect()
}

/// The valve file itself, and what changed it.
pub fn model(file: &ValveFile) -> Section {
    let mut blocks = Vec::new();
    if !file.history().is_empty() {
        let row = |entry: &HistoryEntry| {
            vec![
                entry.action.clone(),
                entry.campaign.clone(),
                format!("{:.3}", entry.error_before),
                format!("{:.3}", entry.error_after),
            ]
        };
        blocks.push(Block::Text("Steps that changed the model; errors in units of the noise:".to_owned()));
        let columns = ["step", "campaign", "error before", "error after"];
        blocks.push(Block::Table(Table::of_texts(columns, file.history().iter().map(row).collect())));
        let found = found(file.history());
        if !found.is_empty() {
            blocks
                .push(Block::Text("What they found, with one standard deviation of what it may be off by:".to_owned()));
            blocks.push(Block::Table(Table::of_texts(["of", "parameter", "value"], found)));
        }
    }
    blocks.push(Block::Code(file.text().to_owned()));
    Section { title: "Valve file".to_owned(), blocks }
}
