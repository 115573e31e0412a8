//! The `[[history]]` of a valve file: what changed the model, why, and how to go back.

use checked_toml::Document;

use crate::change::{Change, block_of, quoted, replaced};
use crate::{ValveFile, ValveFileError};

/// One step that changed the model.
#[derive(Debug, Clone, PartialEq)]
pub struct HistoryEntry {
    /// What was done, such as "calibrated" or "added dry-friction".
    pub action: String,
    /// The campaign on whose data.
    pub campaign: String,
    /// Normalised rms error before (1: the noise explains it).
    pub error_before: f64,
    /// Normalised rms error after.
    pub error_after: f64,
    /// The edits made, in their order, each with what was there before.
    pub changes: Vec<Change>,
}

impl HistoryEntry {
    /// A step whose edits are filled in by [`ValveFile::with_history`].
    pub fn new(action: impl Into<String>, campaign: impl Into<String>, error_before: f64, error_after: f64) -> Self {
        Self { action: action.into(), campaign: campaign.into(), error_before, error_after, changes: Vec::new() }
    }

    fn to_toml(&self) -> String {
        let number = |value: f64| {
            let text = quantity::format_number(value);
            // TOML tells integers from floats; an error is always a float.
            if text.contains(['.', 'e', 'n']) { text } else { format!("{text}.0") }
        };
        let mut undo = String::new();
        for change in &self.changes {
            undo.push_str("  ");
            undo.push_str(&change.to_toml());
            undo.push_str(",\n");
        }
        let undo = if undo.is_empty() { "[]".to_owned() } else { format!("[\n{undo}]") };
        format!(
            "[[history]]\naction = {}\ncampaign = {}\nerror_before = {}\nerror_after = {}\nundo = {undo}\n",
            quoted(&self.action),
            quoted(&self.campaign),
            number(self.error_before),
            number(self.error_after),
        )
    }
}

pub(crate) fn read(document: &Document) -> Result<Vec<HistoryEntry>, ValveFileError> {
    let mut entries = Vec::new();
    let root = document.root();
    if root.value_span("history").is_some() {
        return Err(root.wrong("history", "a value", "tables, each headed [[history]]").into());
    }
    for section in root.sections("history")? {
        section.allow_only(&["action", "campaign", "error_before", "error_after", "undo"])?;
        let text = |key: &str, meaning: &str| {
            section.text(key, meaning).and_then(|found| found.ok_or_else(|| section.missing(key, meaning)))
        };
        let number = |key: &str, meaning: &str| {
            section.number(key, meaning).and_then(|found| found.ok_or_else(|| section.missing(key, meaning)))
        };
        let mut entry = HistoryEntry::new(
            text("action", "what was done, a text")?,
            text("campaign", "the campaign's name, a text")?,
            number("error_before", "the normalised error before, a number")?,
            number("error_after", "the normalised error after, a number")?,
        );
        for change in section.sections("undo")? {
            entry.changes.push(Change::read(document, &change)?);
        }
        entries.push(entry);
    }
    Ok(entries)
}

impl ValveFile {
    /// Records the edits made since the last record as one step that can be undone.
    pub fn with_history(&self, mut entry: HistoryEntry) -> Result<Self, ValveFileError> {
        entry.changes.clone_from(&self.pending);
        let gap = if self.text().ends_with('\n') { "\n" } else { "\n\n" };
        Self::parse(&format!("{}{gap}{}", self.text(), entry.to_toml()), self.file_name())
    }

    /// The file before its last recorded step: the same text up to the history.
    pub fn reverted(&self) -> Result<Self, ValveFileError> {
        let file = self.file_name();
        let sections = self.document.root().sections("history")?;
        let (Some(section), Some(entry)) = (sections.last(), self.history.last()) else {
            return Err(ValveFileError::NothingToRevert { file: file.to_owned() });
        };
        let misfit =
            |reason: String| ValveFileError::HistoryDoesNotFit { file: file.to_owned(), line: section.line(), reason };
        let mut text = replaced(self.text(), block_of(&self.document, section), "");
        for change in entry.changes.iter().rev() {
            // Between two undone edits the text need not be a valid valve, but it is always TOML.
            let document = Document::parse(&text, file).map_err(|error| misfit(error.to_string()))?;
            text = change.undone(&document).ok_or_else(|| misfit(format!("{} is not there", change.to_toml())))?;
        }
        Self::parse(&text, file).map_err(|error| misfit(error.to_string()))
    }
}
