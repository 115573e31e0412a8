//! What each of a sequence of models says of a log: the end of life with the model as it was, as it was
//! calibrated, and with the effects added.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use leak_table::TableBundle;
use lut_builder::Request;
use prognoser::{Method, Prognoser, Prognosis, Status};
use serde::Serialize;
use valve_file::ValveFile;

use super::log_input::LogInput;
use super::prognose::Ends;
use super::tables;
use crate::cli::LogColumnArgs;
use crate::output::{Align, TextTable};

/// Shares of the log at which the end of life is told.
const SHARES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// The end of life that a model tells after some cycle.
#[derive(Serialize)]
struct Told {
    eol_cycle: Option<f64>,
    #[serde(rename = "eol_bounds")]
    bounds: Option<[f64; 2]>,
}

/// The ends of life of one valve of a log, for every model at every share of the log: of the one that the campaign is of where the
/// log has it, else of the one that stands worst.
pub struct Lives {
    log: String,
    valve: String,
    cycles: Vec<u64>,
    models: Vec<Model>,
}

/// What a model told at those cycles, or why it has no tables.
struct Model {
    name: String,
    told: Result<Vec<Told>, String>,
}

/// The ends of life for programs.
#[derive(Serialize)]
pub struct LivesDocument<'a> {
    log: &'a str,
    valve: &'a str,
    after_cycles: &'a [u64],
    models: Vec<ModelDocument<'a>>,
}

/// What a model told, or why it has no tables.
#[derive(Serialize)]
struct ModelDocument<'a> {
    model: &'a str,
    told: Option<&'a [Told]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    no_tables: Option<&'a str>,
}

impl Lives {
    /// Builds the tables of every model and reads the log with them.
    ///
    /// # Errors
    /// If the log cannot be read or has no rows.
    pub fn read(path: &Path, columns: &LogColumnArgs, models: &[(String, ValveFile)]) -> anyhow::Result<Self> {
        let name_of_valve = models.first().map_or("", |(_, file)| file.name());
        let mut lives =
            Self { log: path.display().to_string(), valve: String::new(), cycles: Vec::new(), models: Vec::new() };
        // Over what the log says of the conditions: a stroke under another pressure is no other wear.
        let request = |file: &ValveFile| -> anyhow::Result<Request> {
            let of_log = tables::for_log(file, path, columns)?;
            Ok(Request { wears: Request::default().wears, ..of_log })
        };
        for (name, file) in models {
            let name = name.clone();
            let built = match request(file).and_then(|request| Ok(tables::build_what(file, &request)?)) {
                Ok(built) => built,
                // What was adopted is worth no less for it.
                Err(error) => {
                    lives.models.push(Model { name, told: Err(format!("{error:#}")) });
                    continue;
                }
            };
            let tables = Arc::new(built.bundle);
            if lives.valve.is_empty() {
                lives.valve = chosen(path, columns, name_of_valve, &tables)?;
            }
            let states = states(path, columns, &lives.valve, Prognoser::new(tables, Method::default()))?;
            let chosen = SHARES.map(|share| {
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place in the log")]
                let place = (share * (states.len() - 1) as f64).round() as usize;
                &states[place]
            });
            lives.cycles = chosen.iter().map(|state| state.cycle).collect();
            lives.models.push(Model { name, told: Ok(chosen.iter().map(|state| Told::of(state)).collect()) });
        }
        Ok(lives)
    }

    /// As a table with its caption.
    pub fn table(&self) -> String {
        let mut text =
            format!("end of life of {} by {} (cycle, 5 to 95 %)\n{}", self.valve, self.log, self.rows().render());
        text.extend(self.reasons().map(|reason| format!("\n{reason}\n")));
        text
    }

    /// Why models have no tables, and what to do about it.
    pub fn reasons(&self) -> impl Iterator<Item = String> {
        self.models
            .iter()
            .filter_map(|model| model.told.as_ref().err().map(|why| format!("{}: no tables, since {why}", model.name)))
    }

    /// A row for each share of the log, a column for each model.
    pub fn rows(&self) -> TextTable {
        let heads = self.models.iter().map(|model| (model.name.as_str(), Align::Right));
        let columns: Vec<(&str, Align)> = std::iter::once(("after cycle", Align::Right)).chain(heads).collect();
        let mut table = TextTable::new(&columns);
        for (row, cycle) in self.cycles.iter().enumerate() {
            let told = self.models.iter().map(|model| match &model.told {
                Ok(told) => told[row].text(),
                Err(_) => "no tables".into(),
            });
            table.row(std::iter::once(cycle.to_string()).chain(told).collect());
        }
        table
    }

    /// The end of life by the whole log, a sentence for every model.
    pub fn words(&self) -> String {
        let told = |model: &Model| match &model.told {
            Ok(told) => told.last().map_or_else(String::new, |told| format!("{}: {}", model.name, told.text())),
            Err(_) => format!("{}: not known (no tables; the section on the life says why)", model.name),
        };
        let all: Vec<String> = self.models.iter().map(told).collect();
        format!("{} ends at cycle (5 to 95 %): {}", self.valve, all.join("; "))
    }

    /// For programs.
    pub fn document(&self) -> LivesDocument<'_> {
        LivesDocument {
            log: &self.log,
            valve: &self.valve,
            after_cycles: &self.cycles,
            models: self.models.iter().map(Model::document).collect(),
        }
    }
}

impl Model {
    fn document(&self) -> ModelDocument<'_> {
        ModelDocument {
            model: &self.name,
            told: self.told.as_deref().ok(),
            no_tables: self.told.as_ref().err().map(String::as_str),
        }
    }
}

/// The valve of a log whose life is told: the one of a name where there is such a one, else the one that stands worst.
fn chosen(path: &Path, columns: &LogColumnArgs, name: &str, tables: &Arc<TableBundle>) -> anyhow::Result<String> {
    let mut prognoser = Prognoser::new(Arc::clone(tables), Method::default());
    let mut log = LogInput::open(path, columns, false)?;
    // It was announced before the long work, and is read here for the first time.
    log.tells();
    log.each(|row| drop(prognoser.push(row)))?;
    if prognoser.knows(name) {
        return Ok(name.to_owned());
    }
    let ends = Ends::of(prognoser.lasts().cloned());
    let worst = ends.iter().next().map(|end| end.row().valve.clone());
    worst.with_context(|| format!("{}: no rows; expected at least one cycle", path.display()))
}

/// The state of a valve of a log after each of its rows.
fn states(
    path: &Path,
    columns: &LogColumnArgs,
    valve: &str,
    mut prognoser: Prognoser,
) -> anyhow::Result<Vec<Prognosis>> {
    let mut states: Vec<Prognosis> = Vec::new();
    LogInput::open(path, columns, false)?.each(|row| {
        if row.valve == valve {
            states.push(prognoser.push(row));
        }
    })?;
    Ok(states)
}

impl Told {
    fn of(state: &Prognosis) -> Self {
        let at = |rul: Option<f64>| Some(state.cycle as f64 + rul?);
        let named = state.fault.wears();
        // Once it is reached no cycles remain, whatever is known of when it was.
        let ahead = named && state.status != Status::EolReached;
        Self {
            eol_cycle: state.eol_cycle.filter(|_| named),
            bounds: at(state.rul_p05).zip(at(state.rul_p95)).map(|(low, high)| [low, high]).filter(|_| ahead),
        }
    }

    fn text(&self) -> String {
        match (self.eol_cycle, self.bounds) {
            (Some(eol), Some([low, high])) => format!("{eol:.1} ({low:.1} to {high:.1})"),
            (Some(eol), None) => format!("{eol:.1}"),
            (None, _) => "no fault named".into(),
        }
    }
}
