//! What can be wrong with a TOML file.

use quantity::QuantityError;

/// A refusal with its place.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}: {problem}")]
pub struct TomlFileError {
    /// The file, as it was named to the reader.
    pub file: String,
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong.
    pub problem: Box<Problem>,
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
