//! What makes a file no table of numbers.

/// A refusal with its place.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}:{line}: {problem}")]
pub struct RecordError {
    /// The file.
    pub file: String,
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong.
    pub problem: RecordProblem,
}

/// What is wrong, and what would be right.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordProblem {
    /// No header.
    #[error("the file is empty; expected a header and at least one row")]
    Empty,
    /// Bytes that are not text.
    #[error("is not text (neither UTF-8, UTF-16 nor Windows-1252); save the file as CSV, best in UTF-8")]
    NotText,
    /// A compressed file that cannot be unpacked.
    #[error("cannot be unpacked: {reason}")]
    NotUnpacked {
        /// The reason.
        reason: String,
    },
    /// A compressed file in a program without the means to unpack it.
    #[error("is compressed, and this program was built without gzip; unpack it first")]
    Compressed,
    /// A format whose reader was left out of the program.
    #[error(
        "is a {format} file, and this program was built without a reader for it; build it with \
         `cargo install --path . --features {feature}`, or save the recording as CSV"
    )]
    NotBuilt {
        /// The format.
        format: &'static str,
        /// The feature that has the reader.
        feature: &'static str,
    },
    /// A format that is known and not read.
    #[error("is {format}, which this program does not read; {instead}")]
    NotRead {
        /// The format, with its article.
        format: &'static str,
        /// What to do.
        instead: &'static str,
    },
    /// A file of a format that is read, with something in it that is not.
    #[error("holds {found}, which this program does not read; {instead}")]
    PartNotRead {
        /// What it is.
        found: String,
        /// What to do.
        instead: &'static str,
    },
    /// A file of a format whose content is no table of columns.
    #[error("cannot be read as a {format} file with a table of columns: {reason}")]
    NotATable {
        /// The format.
        format: &'static str,
        /// The reason.
        reason: String,
    },
    /// Several tables that could be meant.
    #[error(
        "{tables} all have the columns that are looked for; expected one: write it before the name of a column, \
         as in \"Bench/Position\""
    )]
    SeveralTables {
        /// The tables.
        tables: String,
    },
    /// A line no recorder writes.
    #[error("a line of {bytes} bytes; expected lines of at most {most} bytes")]
    LongLine {
        /// Its length.
        bytes: usize,
        /// The longest that is read.
        most: usize,
    },
    /// A row of another length than the header.
    #[error("has {found} fields; expected {expected} as in the header")]
    RowLength {
        /// Fields of the row.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// A unit in the heading, and another one in the row of units.
    #[error(
        "column \"{column}\" is in {heading} by its heading and in {below} by the row of units under it; expected one unit: \
         take the wrong one out of the file"
    )]
    TwoUnits {
        /// The column.
        column: String,
        /// The unit in the heading.
        heading: String,
        /// The unit under it.
        below: String,
    },
    /// Text where a number should be.
    #[error("column \"{column}\": \"{found}\" is not a number; expected a number, or nothing for a gap")]
    NotANumber {
        /// The column.
        column: String,
        /// What stands there.
        found: String,
    },
    /// A number that fits two ways of writing.
    #[error(
        "column \"{column}\": \"{found}\" mixes separators; expected a decimal {expected} as in the rest of the file"
    )]
    MixedSeparators {
        /// The column.
        column: String,
        /// What stands there.
        found: String,
        /// "point" or "comma".
        expected: &'static str,
    },
}
