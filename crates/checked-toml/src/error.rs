//! What can be wrong with a TOML file.

use std::fmt::Write;

use quantity::QuantityError;

/// Characters of a line of names that are shown.
const MOST_NAMES: usize = 60;

/// A refusal with its place, and what else is wrong with the file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}: {problem}{}", lines(others))]
pub struct TomlFileError {
    /// The file, as it was named to the reader.
    pub file: String,
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong.
    pub problem: Box<Problem>,
    /// The refusals after it, none with others of its own.
    pub others: Vec<TomlFileError>,
}

/// The most other refusals that are told: whoever mends so many runs the program again.
const MOST_OTHERS: usize = 7;

fn lines(others: &[TomlFileError]) -> String {
    let mut told = String::new();
    // Writing to a string cannot fail.
    for other in others.iter().take(MOST_OTHERS) {
        let _ = write!(told, "\n{other}");
    }
    if let more @ 1.. = others.len().saturating_sub(MOST_OTHERS) {
        let _ = write!(told, "\nand {more} more");
    }
    told
}

/// Gathers refusals, so that all that is wrong with a file is told at once.
#[derive(Debug, Default)]
pub struct Refusals(Vec<TomlFileError>);

impl Refusals {
    /// The value, or nothing and its refusal gathered.
    pub fn keep<T>(&mut self, read: Result<T, TomlFileError>) -> Option<T> {
        read.map_err(|error| self.add(error)).ok()
    }

    /// Gathers a refusal, once.
    pub fn add(&mut self, mut error: TomlFileError) {
        let others = std::mem::take(&mut error.others);
        for error in std::iter::once(error).chain(others) {
            if !self.0.contains(&error) {
                self.0.push(error);
            }
        }
    }

    /// Whether nothing was refused; else the refusals as one, in the order of their lines.
    pub fn none(mut self) -> Result<(), TomlFileError> {
        self.0.sort_by_key(|error| error.line);
        if self.0.is_empty() {
            return Ok(());
        }
        let mut first = self.0.remove(0);
        first.others = self.0;
        Err(first)
    }
}

/// What is wrong, and what would be right.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// The file cannot be opened or read.
    #[error("cannot be read: {reason}")]
    Unreadable {
        /// The operating system's words.
        reason: String,
    },
    /// Bytes that are not text.
    #[error("is not UTF-8 text; save the file as UTF-8")]
    NotText,
    /// Nothing in the file.
    #[error("the file is empty")]
    Empty,
    /// A line no person wrote.
    #[error("a line of {bytes} bytes; expected lines of at most {most} bytes")]
    LongLine {
        /// Its length.
        bytes: usize,
        /// The longest that is read.
        most: usize,
    },
    /// Not TOML.
    #[error("not valid TOML: {message}")]
    Syntax {
        /// The parser's words.
        message: String,
    },
    /// Columns, as in a recording or a log.
    #[error("\"{}\" are names of columns, as in a recording or a log of stroke times; expected a TOML file, with lines such as name = \"FV-101\"", names.chars().take(MOST_NAMES).collect::<String>())]
    Columns {
        /// The line with the names.
        names: String,
    },
    /// A file that other readers are for.
    #[error("\"{key}\" belongs to {found}; expected {expected}")]
    AnotherKind {
        /// A key that tells it.
        key: String,
        /// What the file is.
        found: String,
        /// What was to be read, and where it is named.
        expected: String,
    },
    /// A key that nobody reads.
    #[error("unknown key \"{key}\"{suggestion}; expected one of {known}")]
    UnknownKey {
        /// The key as written, with its table.
        key: String,
        /// " (did you mean ...?)", or empty.
        suggestion: String,
        /// The keys that are known here.
        known: String,
    },
    /// A key that must be there is not.
    #[error("\"{key}\" is missing; expected {meaning}")]
    MissingKey {
        /// The key with its table.
        key: String,
        /// What it means and how it is written.
        meaning: String,
    },
    /// A value of another kind, or one that makes no sense here.
    #[error("{key} is {found}; expected {expected}")]
    WrongValue {
        /// The key with its table.
        key: String,
        /// What was found.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A quantity that cannot be read.
    #[error("{key}: {source}")]
    Quantity {
        /// The key with its table.
        key: String,
        /// What is wrong with it.
        source: QuantityError,
    },
}
