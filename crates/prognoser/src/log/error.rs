//! What can be wrong with a timing log.

use std::io;

use thiserror::Error;

use super::layout::{SHOWN, shortened};

/// An error of a timing log, with its place.
#[derive(Debug, Error)]
#[error("{log}:{line}: {kind}")]
pub struct LogError {
    /// Name of the log.
    pub log: String,
    /// Line, from 1.
    pub line: u64,
    /// What is wrong there.
    #[source]
    pub kind: LogErrorKind,
}

/// What is wrong with a line of a timing log.
#[derive(Debug, Error)]
pub enum LogErrorKind {
    /// The log cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// There is no header.
    #[error("found an empty file, expected a header with valve, cycle, close_time_s and open_time_s")]
    Empty,
    /// A column is missing.
    #[error(
        "found columns \"{found}\", expected also \"{missing}\"; a timing log has valve, cycle, close_time_s and open_time_s (times in seconds), and optionally time"
    )]
    MissingColumn {
        /// The header.
        found: String,
        /// The column that is not there.
        missing: &'static str,
    },
    /// A column is there twice.
    #[error("found column \"{column}\" twice, expected it once; rename or remove one")]
    RepeatedColumn {
        /// The column.
        column: &'static str,
    },
    /// A row has another number of fields than the header.
    #[error("found {found} fields, expected {expected} as in the header")]
    FieldCount {
        /// Fields in the row.
        found: usize,
        /// Fields in the header.
        expected: usize,
    },
    /// A field is not what it should be.
    #[error("{column}: found \"{found}\", expected {expected}")]
    Field {
        /// The column.
        column: &'static str,
        /// The field, shortened if it is long.
        found: String,
        /// What should be there.
        expected: &'static str,
    },
    /// A line is too long to be one of a timing log.
    #[error(
        "found a line of more than {limit} bytes, expected a row of a timing log; is this a text file with line ends?"
    )]
    LongLine {
        /// Longest line accepted, in bytes.
        limit: usize,
    },
    /// A file ends within a line, and what came after it does not go on with it.
    #[error("found \"{found}\" without an end of line before the next file, expected a whole row")]
    Unfinished {
        /// What there is of the line.
        found: String,
    },
    /// A file ends within a row, as it seems.
    #[error(
        "found \"{found}\" where the file ends without an end of line, expected {digits} decimals or more as in all rows before: the \
         number seems to be cut off"
    )]
    CutOff {
        /// The last number of the file.
        found: String,
        /// The fewest decimals of the rows before.
        digits: usize,
    },
    /// A line is not text.
    #[error("found bytes that are not UTF-8, expected text")]
    NotText,
}

impl LogErrorKind {
    /// Whether only one line is no row, and the others may be.
    pub fn is_row(&self) -> bool {
        matches!(
            self,
            Self::FieldCount { .. }
                | Self::Field { .. }
                | Self::NotText
                | Self::LongLine { .. }
                | Self::Unfinished { .. }
                | Self::CutOff { .. }
        )
    }

    pub(super) fn unfinished(text: &str) -> Self {
        Self::Unfinished { found: shortened(text, SHOWN) }
    }
}
