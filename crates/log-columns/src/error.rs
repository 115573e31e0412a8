//! What makes a file no timing log.

use column_source::{RecordError, RecordProblem};
use prognoser::LogError;
use thiserror::Error;

/// Why a file, or a row of it, cannot be read as a timing log.
#[derive(Debug, Error)]
pub enum ColumnLogError {
    /// It is no table of columns.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A value is none that a timing log could have.
    #[error(transparent)]
    Row(#[from] LogError),
    /// Its columns are not those of a timing log.
    #[error("{file}:{line}: {problem}")]
    Columns {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong.
        problem: ColumnProblem,
    },
}

impl ColumnLogError {
    /// Whether only one row is none, and the others may be.
    #[must_use]
    pub fn is_row(&self) -> bool {
        match self {
            Self::Record(error) => matches!(
                error.problem,
                RecordProblem::RowLength { .. }
                    | RecordProblem::NotANumber { .. }
                    | RecordProblem::MixedSeparators { .. }
                    | RecordProblem::LongLine { .. }
            ),
            Self::Row(error) => error.kind.is_row(),
            Self::Columns { problem, .. } => matches!(problem, ColumnProblem::OtherDate { .. }),
        }
    }
}

/// What is wrong with the columns, and what would be right.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ColumnProblem {
    /// A column that must be there was not found.
    #[error("no column tells the {what}; there are {found}. {remedy}")]
    Missing {
        /// What it should tell.
        what: &'static str,
        /// The columns.
        found: String,
        /// What to do.
        remedy: String,
    },
    /// A column that the user has named is not there.
    #[error("there is no column \"{name}\"{suggestion}; there are {found}")]
    NoSuchColumn {
        /// Its name.
        name: String,
        /// A name that is like it, or nothing.
        suggestion: String,
        /// The columns.
        found: String,
    },
    /// Two columns could be the same.
    #[error("both \"{first}\" and \"{second}\" could be {channel}; say which: --column {channel}=NAME")]
    TwoColumns {
        /// What they could tell.
        channel: &'static str,
        /// One.
        first: String,
        /// The other.
        second: String,
    },
    /// Numbers without a unit.
    #[error("column \"{column}\" has no unit; say it: --column {example}=\"{column}\"")]
    NoUnit {
        /// The column.
        column: String,
        /// The name of such a column with a unit.
        example: &'static str,
    },
    /// A unit of something else.
    #[error("column \"{column}\" is in {unit}; expected {expected}")]
    WrongUnit {
        /// The column.
        column: String,
        /// Its unit.
        unit: String,
        /// What would be right.
        expected: String,
    },
    /// A unit that can mean two things.
    #[error(
        "column \"{column}\" is in {unit}, which does not say from where it counts; say it: \
         --column supply_pressure_{unit}g=\"{column}\" above the atmosphere, or {unit}a for absolute"
    )]
    AmbiguousUnit {
        /// The column.
        column: String,
        /// Its unit.
        unit: String,
    },
    /// A date that is written unlike the ones before it.
    #[error("column \"{column}\": found \"{found}\", expected {expected} as in the rows before")]
    OtherDate {
        /// The column.
        column: String,
        /// What stands there.
        found: String,
        /// How the others are written.
        expected: &'static str,
    },
}
