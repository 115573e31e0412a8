//! A table that lies in memory: what binary formats become.

use std::borrow::Cow;

use crate::{ColumnSource, Heading, Notice, NoticeKind, RecordError, RecordProblem};

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Values {
    /// Numbers; NaN for a gap.
    Numbers(Vec<f64>),
    /// Texts, such as timestamps and names.
    #[cfg_attr(
        not(any(feature = "parquet", feature = "tdms")),
        expect(dead_code, reason = "MATLAB files give numbers alone")
    )]
    Texts(Vec<String>),
    /// Something else: a column that is there and refused when it is asked for.
    #[cfg(any(feature = "mat73", feature = "tdms"))]
    NotRead {
        /// How many values.
        rows: usize,
        /// What they are.
        found: String,
        /// What to do.
        instead: &'static str,
    },
}

impl Values {
    /// How many.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Numbers(numbers) => numbers.len(),
            Self::Texts(texts) => texts.len(),
            #[cfg(any(feature = "mat73", feature = "tdms"))]
            Self::NotRead { rows, .. } => *rows,
        }
    }
}

/// Columns by name, all as long as each other. The rows are counted from 1, and so is the header.
#[derive(Debug)]
pub(crate) struct TableSource {
    file: String,
    headings: Vec<Heading>,
    columns: Vec<Values>,
    /// Rows that were begun.
    row: usize,
    notices: Vec<Notice>,
}

impl TableSource {
    /// A table of named columns. Of columns of several lengths the longest are the recording; others, such as a sampling
    /// rate, are left out, and that is said.
    #[cfg(any(feature = "mat", feature = "mat73", feature = "parquet"))]
    pub(crate) fn new(file: &str, named: Vec<(Heading, Values)>) -> Result<Self, RecordError> {
        let rows = named.iter().map(|(_, values)| values.len()).max().unwrap_or(0);
        if rows == 0 {
            return Err(RecordError { file: file.to_owned(), line: 1, problem: RecordProblem::Empty });
        }
        let (kept, others): (Vec<_>, Vec<_>) = named.into_iter().partition(|(_, values)| values.len() == rows);
        let mut notices = Vec::new();
        if !others.is_empty() {
            let names: Vec<String> = others.into_iter().map(|(heading, _)| heading.name).collect();
            notices.push(Notice { line: 1, kind: NoticeKind::OtherLengths { names: names.join(", "), rows } });
        }
        Ok(Self { notices, ..Self::of(file, kept) })
    }

    /// A table of columns that are all as long as each other.
    pub(crate) fn of(file: &str, columns: Vec<(Heading, Values)>) -> Self {
        let (headings, columns) = columns.into_iter().unzip();
        Self { file: file.to_owned(), headings, columns, row: 0, notices: Vec::new() }
    }

    /// Says something of how the file was read.
    #[cfg(feature = "tdms")]
    pub(crate) fn say(&mut self, kind: NoticeKind) {
        self.notices.push(Notice { line: 1, kind });
    }

    /// How many values there are.
    #[cfg(feature = "tdms")]
    pub(crate) fn values(&self) -> usize {
        self.columns.iter().map(Values::len).sum()
    }

    /// Goes back before the first row.
    #[cfg(feature = "tdms")]
    pub(crate) fn rewind(&mut self) {
        self.row = 0;
    }
}

impl ColumnSource for TableSource {
    fn file(&self) -> &str {
        &self.file
    }

    fn headings(&self) -> &[Heading] {
        &self.headings
    }

    fn header_line(&self) -> usize {
        1
    }

    fn next_row(&mut self) -> Result<Option<usize>, RecordError> {
        let rows = self.columns.first().map_or(0, Values::len);
        if self.row >= rows {
            return Ok(None);
        }
        self.row += 1;
        Ok(Some(self.row))
    }

    fn number(&self, column: usize) -> Result<f64, RecordError> {
        match &self.columns[column] {
            Values::Numbers(numbers) => match numbers[self.row - 1] {
                number if number.is_infinite() => {
                    let column = self.headings[column].name.clone();
                    Err(self.error(self.row, RecordProblem::NotANumber { column, found: number.to_string() }))
                }
                number => Ok(number),
            },
            Values::Texts(texts) => {
                let text = texts[self.row - 1].trim();
                if text.is_empty() {
                    return Ok(f64::NAN);
                }
                text.parse().map_err(|_| {
                    let column = self.headings[column].name.clone();
                    self.error(self.row, RecordProblem::NotANumber { column, found: text.to_owned() })
                })
            }
            #[cfg(any(feature = "mat73", feature = "tdms"))]
            Values::NotRead { found, instead, .. } => {
                let found = format!("{found} in column \"{}\"", self.headings[column].name);
                Err(self.error(self.row, RecordProblem::PartNotRead { found, instead }))
            }
        }
    }

    fn field(&self, column: usize) -> Cow<'_, str> {
        match &self.columns[column] {
            Values::Numbers(numbers) if numbers[self.row - 1].is_nan() => Cow::Borrowed(""),
            Values::Numbers(numbers) => Cow::Owned(numbers[self.row - 1].to_string()),
            Values::Texts(texts) => Cow::Borrowed(&texts[self.row - 1]),
            #[cfg(any(feature = "mat73", feature = "tdms"))]
            Values::NotRead { .. } => Cow::Borrowed(""),
        }
    }

    fn notices(&self) -> &[Notice] {
        &self.notices
    }
}
