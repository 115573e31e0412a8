//! One edit of a valve file, with what undoes it.

use std::fmt::Write;
use std::ops::Range;

use checked_toml::{Document, Section};
use valve_model::ParameterId;

use crate::ValveFileError;
use crate::effects::identity;

/// An edit, and what was there before. Values are kept as they stood in the text.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// A parameter of the base model got another value.
    Parameter {
        /// Its dotted key.
        key: String,
        /// Its value before, as TOML; `None` where it was not written.
        was: Option<String>,
    },
    /// A parameter of an effect got another value.
    EffectParameter {
        /// The effect's id, or the name of a custom one.
        effect: String,
        /// The parameter's key.
        key: String,
        /// Its value before, as TOML; `None` where it was not written.
        was: Option<String>,
    },
    /// An effect was added.
    Added {
        /// Its id, or the name of a custom one.
        effect: String,
    },
    /// An effect was removed.
    Removed {
        /// The text of its table.
        text: String,
        /// The line at which it began.
        line: usize,
    },
}

/// A text as a TOML string.
pub(crate) fn quoted(text: &str) -> String {
    let mut quoted = String::with_capacity(text.len() + 2);
    quoted.push('"');
    for character in text.chars() {
        match character {
            '"' => quoted.push_str("\\\""),
            '\\' => quoted.push_str("\\\\"),
            '\n' => quoted.push_str("\\n"),
            '\r' => quoted.push_str("\\r"),
            '\t' => quoted.push_str("\\t"),
            character if character.is_control() => {
                // Writing to a string cannot fail.
                let _ = write!(quoted, "\\u{:04X}", u32::from(character));
            }
            character => quoted.push(character),
        }
    }
    quoted.push('"');
    quoted
}

impl Change {
    /// The change as an inline table.
    pub(crate) fn to_toml(&self) -> String {
        match self {
            Self::Parameter { key, was } => format!("{{ key = {}{} }}", quoted(key), before(was.as_deref())),
            Self::EffectParameter { effect, key, was } => {
                format!("{{ effect = {}, key = {}{} }}", quoted(effect), quoted(key), before(was.as_deref()))
            }
            Self::Added { effect } => format!("{{ added = {} }}", quoted(effect)),
            Self::Removed { text, line } => format!("{{ removed = {}, line = {line} }}", quoted(text)),
        }
    }

    /// Reads what [`Change::to_toml`] writes.
    pub(crate) fn read(document: &Document, section: &Section<'_>) -> Result<Self, ValveFileError> {
        section.allow_only(&["key", "was", "effect", "added", "removed", "line"])?;
        let text = |key: &str| section.text(key, "a text").map(|found| found.map(str::to_owned));
        let was = section.value_span("was").map(|span| document.text()[span].to_owned());
        if let Some(effect) = text("added")? {
            return Ok(Self::Added { effect });
        }
        if let Some(text) = text("removed")? {
            let line = section.number("line", "a line number")?.ok_or_else(|| section.missing("line", "a number"))?;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a cast saturates; it is checked when used"
            )]
            return Ok(Self::Removed { text, line: line as usize });
        }
        let key = text("key")?.ok_or_else(|| section.missing("key", "the key that was changed"))?;
        match (text("effect")?, was) {
            (Some(effect), was) => Ok(Self::EffectParameter { effect, key, was }),
            (None, was) if was.is_some() || may_be_left_out(&key) => Ok(Self::Parameter { key, was }),
            (None, _) => Err(section.missing("was", "the value before").into()),
        }
    }

    /// The text without this change; `None` where the text does not hold what was changed.
    pub(crate) fn undone(&self, document: &Document) -> Option<String> {
        match self {
            Self::Parameter { key, was } => {
                let (table, name) = key.split_once('.')?;
                let span = document.root().section(table).ok()??.value_span(name)?;
                Some(put_back(document, span, was.as_deref()))
            }
            Self::EffectParameter { effect, key, was } => {
                let span = find_effect(document, effect)?.value_span(key)?;
                Some(put_back(document, span, was.as_deref()))
            }
            Self::Added { effect } => {
                let block = block_of(document, &find_effect(document, effect)?);
                Some(replaced(document.text(), block, ""))
            }
            Self::Removed { text, line } => {
                let whole = document.text();
                let starts = std::iter::once(0).chain(whole.match_indices('\n').map(|(offset, _)| offset + 1));
                let offset = starts.into_iter().nth(line.checked_sub(1)?)?;
                Some(replaced(whole, offset..offset, text))
            }
        }
    }
}

/// The value before as a pair of the inline table, empty where it was not written.
fn before(was: Option<&str>) -> String {
    was.map_or_else(String::new, |was| format!(", was = {was}"))
}

fn may_be_left_out(key: &str) -> bool {
    ParameterId::ALL.iter().any(|id| id.key() == key && id.default_value().is_some())
}

/// The text with the value before in place of the one there; without its line where none was written.
fn put_back(document: &Document, span: Range<usize>, was: Option<&str>) -> String {
    match was {
        Some(was) => replaced(document.text(), span, was),
        None => replaced(document.text(), document.whole_lines(&span), ""),
    }
}

pub(crate) fn replaced(text: &str, range: Range<usize>, by: &str) -> String {
    let mut changed = text.to_owned();
    changed.replace_range(range, by);
    changed
}

/// The table of an effect by its id or name.
pub(crate) fn find_effect<'a>(document: &'a Document, effect: &str) -> Option<Section<'a>> {
    let sections = document.root().sections("effect").ok()?;
    sections.into_iter().find(|section| identity(section).as_deref() == Some(effect))
}

/// The lines of a table, with the blank line before it.
pub(crate) fn block_of(document: &Document, section: &Section<'_>) -> Range<usize> {
    let lines = document.whole_lines(&section.span());
    let blank = document.text()[..lines.start].ends_with("\n\n");
    (lines.start - usize::from(blank))..lines.end
}
