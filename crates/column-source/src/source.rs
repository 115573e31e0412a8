//! What every format of records gives.

use std::borrow::Cow;

use crate::{Heading, Notice, RecordError, RecordProblem};

/// A table of columns that is read row by row. To add a format, implement this.
pub trait ColumnSource {
    /// What messages call the file.
    fn file(&self) -> &str;

    /// The columns, in the order of the file.
    fn headings(&self) -> &[Heading];

    /// The line of the headings, counted from 1.
    fn header_line(&self) -> usize;

    /// Goes to the next row: its line (of a binary format, its number), or `None` at the end.
    fn next_row(&mut self) -> Result<Option<usize>, RecordError>;

    /// A field of the row at hand as a number; NaN for a gap.
    fn number(&self, column: usize) -> Result<f64, RecordError>;

    /// A field of the row at hand as text.
    fn field(&self, column: usize) -> Cow<'_, str>;

    /// What had to be guessed so far; complete when the last row has been read.
    fn notices(&self) -> &[Notice];

    /// A refusal at a line of this file.
    fn error(&self, line: usize, problem: RecordProblem) -> RecordError {
        RecordError { file: self.file().to_owned(), line, problem }
    }
}
