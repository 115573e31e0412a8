//! What every format of records gives.

use std::borrow::Cow;

use crate::{Heading, Notice, RecordError, RecordProblem, listed};

/// A table of columns that is read row by row. To add a format, implement this.
///
/// A file may hold several tables: groups of channels, sheets. Then one is at hand, at first the largest, and
/// [`find_table`] goes to the one that has what is looked for.
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

    /// How many tables the file has.
    fn tables(&self) -> usize {
        1
    }

    /// Goes to one of them, before its first row; they are counted from 0, the largest first.
    fn go_to(&mut self, _table: usize) {}

    /// What messages call the table at hand, as in `group "Bench"`; none where there is only one.
    fn table(&self) -> Option<&str> {
        None
    }

    /// The name of a column without that of the table at hand before it: "Position" for "Bench/Position".
    fn within_table<'a>(&self, name: &'a str) -> &'a str {
        name
    }

    /// The names of all columns for a message, of each table.
    fn listed(&self) -> String {
        listed(self.headings().iter().map(|heading| heading.name.as_str()))
    }

    /// A refusal at a line of this file.
    fn error(&self, line: usize, problem: RecordProblem) -> RecordError {
        RecordError { file: self.file().to_owned(), line, problem }
    }
}

/// Goes to the table in which `find` finds what it looks for, and gives what it found; `found` counts how much of that a
/// table has.
///
/// # Errors
/// That of the table with the most of it where none has all, the largest of them; [`RecordProblem::SeveralTables`] where more than one has.
pub fn find_table<T, E: From<RecordError>>(
    source: &mut dyn ColumnSource,
    find: impl Fn(&dyn ColumnSource) -> Result<T, E>,
    found: impl Fn(&dyn ColumnSource) -> usize,
) -> Result<T, E> {
    let (mut answers, mut most) = (Vec::new(), (0, 0));
    for table in 0..source.tables() {
        source.go_to(table);
        answers.push(find(source));
        let count = found(source);
        if count > most.1 {
            most = (table, count);
        }
    }
    let having: Vec<usize> = (0..answers.len()).filter(|table| answers[*table].is_ok()).collect();
    if let [_, _, ..] = having[..] {
        let name = |table: &usize| {
            source.go_to(*table);
            source.table().unwrap_or_default().to_owned()
        };
        let tables = having.iter().map(name).collect::<Vec<_>>().join(" and ");
        return Err(source.error(1, RecordProblem::SeveralTables { tables }).into());
    }
    let table = having.first().copied().unwrap_or(most.0);
    source.go_to(table);
    answers.swap_remove(table)
}
