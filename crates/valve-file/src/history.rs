//! The `[[history]]` of a valve file: what changed the model, why, and how to go back.

use checked_toml::{Document, Section};

use crate::change::{Change, block_of, quoted, replaced};
use crate::{ValveFile, ValveFileError};

/// A value that a step found, and how sure it is.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundValue {
    /// The id of the effect that has the parameter; nothing for one of the valve itself.
    pub effect: Option<String>,
    /// The name of the effect's parameter, or the dotted key of the valve's.
    pub parameter: String,
    /// The value, SI.
    pub value: f64,
    /// One standard deviation of what it may be off by, SI.
    pub standard_error: f64,
    /// The SI unit of both; empty for a share.
    pub unit: String,
}

impl FoundValue {
    fn to_toml(&self) -> String {
        let effect = self.effect.as_deref().map_or_else(String::new, |effect| format!("effect = {}, ", quoted(effect)));
        format!(
            "{{ {effect}parameter = {}, value = {}, standard_error = {}, unit = {} }}",
            quoted(&self.parameter),
            float(self.value),
            float(self.standard_error),
            quoted(&self.unit),
        )
    }

    fn read(section: &Section<'_>) -> Result<Self, ValveFileError> {
        section.allow_only(&["effect", "parameter", "value", "standard_error", "unit"])?;
        let text = |key: &str| section.text(key, "a text").map(|found| found.map(str::to_owned));
        let number = |key: &str| {
            let meaning = "a number in SI units";
            section.number(key, meaning).and_then(|found| found.ok_or_else(|| section.missing(key, meaning)))
        };
        Ok(Self {
            effect: text("effect")?,
            parameter: text("parameter")?.ok_or_else(|| section.missing("parameter", "the parameter's name"))?,
            value: number("value")?,
            standard_error: number("standard_error")?,
            unit: text("unit")?.unwrap_or_default(),
        })
    }
}

/// A number as a float of TOML, which tells integers from floats.
fn float(value: f64) -> String {
    let text = quantity::format_number(value);
    if text.contains(['.', 'e', 'n']) { text } else { format!("{text}.0") }
}

/// Entries of a list, each on a line of its own.
fn listed(entries: impl Iterator<Item = String>) -> String {
    let lines = entries.map(|entry| format!("  {entry},\n")).collect::<Vec<_>>().concat();
    if lines.is_empty() { "[]".to_owned() } else { format!("[\n{lines}]") }
}

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
    /// What it found, with how sure that is; older files do not say.
    pub found: Vec<FoundValue>,
    /// The edits made, in their order, each with what was there before.
    pub changes: Vec<Change>,
}

impl HistoryEntry {
    /// A step whose edits are filled in by [`ValveFile::with_history`].
    pub fn new(action: impl Into<String>, campaign: impl Into<String>, error_before: f64, error_after: f64) -> Self {
        let (action, campaign) = (action.into(), campaign.into());
        Self { action, campaign, error_before, error_after, found: Vec::new(), changes: Vec::new() }
    }

    /// The same with what was found. A value that nothing is known of how sure it is does not stand there.
    #[must_use]
    pub fn with_found(mut self, found: Vec<FoundValue>) -> Self {
        self.found = found;
        self.found.retain(|one| one.value.is_finite() && one.standard_error.is_finite());
        self
    }

    fn to_toml(&self) -> String {
        let found = if self.found.is_empty() {
            String::new()
        } else {
            format!("found = {}\n", listed(self.found.iter().map(FoundValue::to_toml)))
        };
        format!(
            "[[history]]\naction = {}\ncampaign = {}\nerror_before = {}\nerror_after = {}\n{found}undo = {}\n",
            quoted(&self.action),
            quoted(&self.campaign),
            float(self.error_before),
            float(self.error_after),
            listed(self.changes.iter().map(Change::to_toml)),
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
        section.allow_only(&["action", "campaign", "error_before", "error_after", "found", "undo"])?;
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
        for found in section.sections("found")? {
            entry.found.push(FoundValue::read(&found)?);
        }
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
