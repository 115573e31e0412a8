//! A TOML text with its file's name and the places of its lines.

use std::ops::Range;
use std::path::Path;

use crate::{Problem, Section, TomlFileError};

/// The longest line that is read, bytes: far above what anybody writes by hand, and short enough
/// for messages and memory.
const LONGEST_LINE: usize = 65_536;

/// Reads a file as text. A failure carries the file and, for bytes that are no text, the line.
pub fn read_text(path: &Path) -> Result<String, TomlFileError> {
    let file = path.display().to_string();
    let at = |line, problem| TomlFileError { file: file.clone(), line, problem: Box::new(problem), others: Vec::new() };
    let bytes = std::fs::read(path).map_err(|error| at(1, Problem::Unreadable { reason: error.to_string() }))?;
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..good].split(|byte| *byte == b'\n').count();
        at(line, Problem::NotText)
    })
}

/// A parsed TOML file.
#[derive(Debug, Clone)]
pub struct Document {
    file: String,
    lines: Vec<usize>,
    parsed: toml_edit::Document<String>,
}

/// The first line of a text that is no comment, where it is names of columns: with separators, and with nothing that keys
/// and tables have.
fn column_names(text: &str) -> Option<&str> {
    let line = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'))?;
    let separators = [',', ';', '\t'].map(|separator| line.matches(separator).count());
    (separators.iter().any(|count| *count > 0) && !line.contains(['=', '['])).then_some(line)
}

impl Document {
    /// Parses a text; `file` is its name in messages.
    pub fn parse(text: &str, file: &str) -> Result<Self, TomlFileError> {
        let lines: Vec<usize> =
            std::iter::once(0).chain(text.match_indices('\n').map(|(offset, _)| offset + 1)).collect();
        let at = |line, problem| TomlFileError {
            file: file.to_owned(),
            line,
            problem: Box::new(problem),
            others: Vec::new(),
        };
        if text.trim().is_empty() {
            return Err(at(1, Problem::Empty));
        }
        for (index, line) in text.lines().enumerate() {
            if line.len() > LONGEST_LINE {
                return Err(at(index + 1, Problem::LongLine { bytes: line.len(), most: LONGEST_LINE }));
            }
        }
        let parsed = toml_edit::Document::parse(text.to_owned()).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            let message = error.message().trim().replace('\n', "; ");
            let problem = match column_names(text) {
                Some(names) => Problem::Columns { names: names.to_owned() },
                None => Problem::Syntax { message },
            };
            at(line_of(&lines, offset), problem)
        })?;
        Ok(Self { file: file.to_owned(), lines, parsed })
    }

    /// The file's name, as given.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The whole text.
    #[must_use]
    pub fn text(&self) -> &str {
        self.parsed.raw()
    }

    /// The table at the root.
    #[must_use]
    pub fn root(&self) -> Section<'_> {
        Section::new(self, self.parsed.as_table(), String::new(), 0)
    }

    /// The line of a byte of the text, counted from 1.
    #[must_use]
    pub fn line_of(&self, offset: usize) -> usize {
        line_of(&self.lines, offset)
    }

    /// The bytes of whole lines that hold this range, with the newline at the end.
    #[must_use]
    pub fn whole_lines(&self, range: &Range<usize>) -> Range<usize> {
        let first = self.line_of(range.start) - 1;
        let last = self.line_of(range.end.max(range.start + 1) - 1);
        self.lines[first]..self.lines.get(last).copied().unwrap_or(self.text().len())
    }

    /// A refusal at a line of this file.
    #[must_use]
    pub fn error_at(&self, line: usize, problem: Problem) -> TomlFileError {
        TomlFileError { file: self.file.clone(), line, problem: Box::new(problem), others: Vec::new() }
    }
}

fn line_of(lines: &[usize], offset: usize) -> usize {
    lines.partition_point(|start| *start <= offset).max(1)
}
