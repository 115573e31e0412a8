//! From the sliders back to a valve file.

use std::path::{Path, PathBuf};

use model_lab::compare::Comparison;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use similar::{ChangeTag, TextDiff};
use valve_file::{HistoryEntry, ValveFile};

use super::model::Model;
use super::subject::Subject;
use super::{LifeTeller, Output, Writer};
use crate::site::Refusal;

/// The valve file that says a model, with a step in its history: the errors are those of `valve compare`.
fn adopted(subject: &Subject, model: &Model) -> Result<ValveFile, Refusal> {
    let input = &subject.input;
    let new = model.file(&input.file)?;
    if new.text() == input.file.text() {
        return Ok(new);
    }
    let error = |file: &ValveFile| {
        Comparison::new(&subject.identified, file.valve(), &input.data)
            .map(|comparison| comparison.overall.errors.normalised_rms)
            .ok_or_else(|| Refusal::new("the strokes of this model cannot be simulated"))
    };
    let action = model.action(&input.file);
    let entry = HistoryEntry::new(action, &input.campaign.name, error(&input.file)?, error(&new)?);
    new.with_history(entry).map_err(Refusal::new)
}

/// What would be written.
#[derive(Debug, Clone, Serialize)]
pub struct Preview {
    version: u64,
    changes: bool,
    /// Every line after its sign: "-" of the file on disk, "+" of the new one, " " of both.
    diff: Vec<(&'static str, String)>,
    path: String,
}

/// What became of a file that was to be written.
#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Written {
    /// It is written.
    Written(String),
    /// It is there already, and the user has not agreed to replace it.
    Exists(String),
}

/// What would be written: the text, how it differs from the file on disk, and where it could go.
pub fn preview(subject: &Subject, model: &Model) -> Result<Preview, Refusal> {
    let new = adopted(subject, model)?;
    let old = subject.input.file.text();
    let difference = TextDiff::from_lines(old, new.text());
    let diff = difference
        .iter_all_changes()
        .map(|change| {
            let sign = match change.tag() {
                ChangeTag::Delete => "-",
                ChangeTag::Insert => "+",
                ChangeTag::Equal => " ",
            };
            (sign, change.value().trim_end_matches('\n').to_owned())
        })
        .collect();
    Ok(Preview {
        version: subject.version,
        changes: new.text() != old,
        diff,
        path: free_path(Path::new(subject.input.file.file_name())).display().to_string(),
    })
}

/// The end of life that a log tells, with the valve file's model and with that of the sliders.
pub fn lives(subject: &Subject, model: &Model, told: &LifeTeller) -> Result<Value, Refusal> {
    let old = &subject.input.file;
    let new = model.file(old)?;
    let mut models = vec![("valve file".to_owned(), old.clone())];
    if new.text() != old.text() {
        models.push(("sliders".to_owned(), new));
    }
    told(&models).map_err(Refusal::new)
}

/// A name beside the valve file that is not taken: valve-better.toml, valve-better-2.toml.
fn free_path(valve: &Path) -> PathBuf {
    let stem = valve.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = |number: u32| {
        let ending = if number == 1 { String::new() } else { format!("-{number}") };
        valve.with_file_name(format!("{stem}-better{ending}.toml"))
    };
    (1..1000).map(name).find(|path| !path.exists()).unwrap_or_else(|| name(1))
}

/// A file to be written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    model: Model,
    path: String,
    /// Whether the user has agreed to replace what is there.
    replace: bool,
}

/// Writes the valve file by `writer`. What exists is replaced only if the user has agreed to that (else the answer says that it
/// exists), the valve file that was read included; of the other files that were read none is ever replaced.
pub fn write(subject: &Subject, request: &Request, writer: &Writer) -> Result<Written, Refusal> {
    let path = Path::new(request.path.trim());
    if path.extension().is_none_or(|extension| extension != "toml") {
        return Err(Refusal::new(format!("{}: expected a name that ends in .toml", path.display())));
    }
    if path.exists() && !request.replace {
        return Ok(Written::Exists(path.display().to_string()));
    }
    let valve = Path::new(subject.input.file.file_name());
    let keep: Vec<PathBuf> = subject.input.files().into_iter().filter(|file| file != valve).collect();
    let text = adopted(subject, &request.model)?;
    writer(&Output { path, bytes: text.text().as_bytes(), replace: request.replace, keep: &keep })
        .map_err(Refusal::new)?;
    Ok(Written::Written(path.display().to_string()))
}
