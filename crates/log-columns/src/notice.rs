//! What had to be taken for something.

use column_source::NoticeKind;
use thiserror::Error;

/// Something that the file does not say by itself, and how it was taken.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Notice {
    /// How the file is written.
    #[error("{0}")]
    Read(#[from] NoticeKind),
    /// Columns by their names.
    #[error("columns were taken by their names: {0}")]
    Taken(String),
    /// No column of valves, and nothing that speaks for more than one.
    #[error(
        "no column tells the valve: all rows are taken for those of one, called {0} after the file; --valve-name NAME calls it otherwise"
    )]
    OneValve(String),
    /// No column of cycles.
    #[error("no column tells the cycle: the rows of each valve were counted from 1")]
    Counted,
    /// Dates.
    #[error("dates such as \"{example}\" were read as {written}{zone}")]
    Dates {
        /// The first.
        example: String,
        /// How it is written.
        written: &'static str,
        /// What was assumed of the zone.
        zone: &'static str,
    },
    /// Dates of which it cannot be told what is the year.
    #[error(
        "column \"{column}\" has dates such as \"{example}\", whose year has two digits and may be the day as well; no dates are told of \
         the future; write the year with four digits, as in 2026-01-31"
    )]
    ShortYears {
        /// The column.
        column: String,
        /// The first field.
        example: String,
    },
    /// A column of dates that are none.
    #[error(
        "column \"{column}\" has no dates that are understood, such as \"{example}\"; no dates are told of the future"
    )]
    NoDates {
        /// The column.
        column: String,
        /// The first field.
        example: String,
    },
}
