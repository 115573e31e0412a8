//! Timing logs of files: the plain form row by row, all others through their columns.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use anyhow::Context;
use log_columns::{ColumnLog, ColumnLogError, ColumnProblem, Wanted};
use prognoser::{LogErrorKind, LogRow, TimingLog};

use super::same_names::SameNames;
use crate::cli::LogColumnArgs;
use crate::failure::Hinted;
use crate::output;

/// Bytes that are read at once.
const PIECE: usize = 1 << 16;

/// Skipped lines that are told one by one.
const TOLD: u64 = 12;

/// A timing log that is read to its end.
pub struct LogInput {
    name: String,
    form: Form,
    /// Whether what is odd is told: once, where a log is read several times.
    tells: bool,
}

enum Form {
    /// The plain form, in constant memory.
    Plain(Box<TimingLog<BufReader<File>>>),
    /// Any other, in memory as a whole.
    Columns(Box<ColumnLog>),
}

/// What comes next in a log.
pub enum Line<'a> {
    /// A row.
    Row(LogRow<'a>),
    /// A line that is none; those behind it may be.
    Skipped(anyhow::Error),
    /// Nothing.
    End,
}

impl LogInput {
    /// Opens a log in whatever form it is.
    ///
    /// # Errors
    /// If the file cannot be read, or no stroke times can be told of it; the hint says what would help.
    pub fn open(path: &Path, columns: &LogColumnArgs, empty_is_stalled: bool) -> anyhow::Result<Self> {
        let name = path.display().to_string();
        let form = Form::open(path, &name, columns, empty_is_stalled)?;
        Ok(Self { name, form, tells: false })
    }

    /// Tells how the file was taken, and what of it was not, now and while it is read.
    pub fn announce(&mut self) {
        self.tells = true;
        if let Form::Columns(log) = &self.form {
            for (line, notice) in log.notices() {
                output::note(&format!("{}:{line}: {notice}", log.name()));
            }
        }
        tell_unknown(&self.name, self.unknown_columns());
    }

    /// Tells what is odd while it is read.
    pub fn tells(&mut self) {
        self.tells = true;
    }

    fn unknown_columns(&self) -> &[String] {
        match &self.form {
            Form::Plain(log) => log.unknown_columns(),
            Form::Columns(log) => log.unknown_columns(),
        }
    }

    /// What comes next.
    ///
    /// # Errors
    /// If the log cannot be read any further.
    pub fn next(&mut self) -> anyhow::Result<Line<'_>> {
        self.form.next()
    }

    /// Does something with each row. Lines that are none are skipped, told and counted, and names that look alike are asked about,
    /// where the log was announced.
    ///
    /// # Errors
    /// If the log cannot be read any further, or none of its lines is a row.
    pub fn each(mut self, mut take: impl FnMut(&LogRow<'_>)) -> anyhow::Result<()> {
        let (mut rows, mut skips, mut names) = (0_u64, Skips::default(), SameNames::default());
        loop {
            match self.form.next()? {
                Line::Row(row) => {
                    rows += 1;
                    if self.tells
                        && let Some(words) = names.meet(row.valve)
                    {
                        output::note(&format!("{}:{}: {words}", self.name, row.line));
                    }
                    take(&row);
                }
                Line::Skipped(error) => {
                    let words = skips.take(&error, "line");
                    if self.tells && skips.count() <= most_skips() {
                        output::note(&words);
                    }
                }
                Line::End => break,
            }
        }
        skips.refuse_all(rows)?;
        if self.tells {
            skips.finish(&self.name, "line");
            names.untold().iter().for_each(|words| output::note(&format!("{}: {words}", self.name)));
        }
        Ok(())
    }
}

impl Form {
    fn open(path: &Path, name: &str, columns: &LogColumnArgs, empty_is_stalled: bool) -> anyhow::Result<Self> {
        if columns.is_empty() {
            let file = File::open(path).with_context(|| format!("{name}: cannot be read"))?;
            match TimingLog::new(name.to_owned(), BufReader::with_capacity(PIECE, file)) {
                Ok(log) => return Ok(Self::Plain(Box::new(log.with_empty_as_stalled(empty_is_stalled)))),
                Err(error) if matches!(error.kind, LogErrorKind::Io(_) | LogErrorKind::Empty) => {
                    return Err(error.into());
                }
                Err(_) => {}
            }
        }
        let bytes = fs::read(path).with_context(|| format!("{name}: cannot be read"))?;
        let wanted = Wanted { columns: columns.column.clone(), valve: columns.valve_name.clone(), empty_is_stalled };
        match ColumnLog::read(&bytes, name, &wanted) {
            Ok(log) => Ok(Self::Columns(Box::new(log))),
            Err(error @ ColumnLogError::Columns { problem: ColumnProblem::Missing { .. }, .. }) => {
                Err(Hinted::error(error.to_string(), "`valve help formats` has what a timing log may look like"))
            }
            Err(error) => Err(error.into()),
        }
    }

    fn next(&mut self) -> anyhow::Result<Line<'_>> {
        let next = match self {
            Self::Plain(log) => log.next_row().map_err(|error| (error.kind.is_row(), error.into())),
            Self::Columns(log) => log.next_row().map_err(|error| (error.is_row(), error.into())),
        };
        match next {
            Ok(Some(row)) => Ok(Line::Row(row)),
            Ok(None) => Ok(Line::End),
            Err((true, error)) => Ok(Line::Skipped(error)),
            Err((false, error)) => Err(error),
        }
    }
}

/// Lines that are no rows of which a log that is read once tells one by one.
pub fn most_skips() -> u64 {
    if output::is_verbose() { u64::MAX } else { TOLD }
}

/// Lines of a log, or messages, that were no rows.
#[derive(Debug, Default)]
pub struct Skips {
    count: u64,
    /// What was wrong with the first.
    first: Option<String>,
}

impl Skips {
    /// How many there were so far.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Counts one, and tells what is wrong with it.
    pub fn take(&mut self, error: &anyhow::Error, unit: &str) -> String {
        self.count += 1;
        let error = format!("{error}");
        let so_far = if self.count == 1 { String::new() } else { format!(" ({} so far)", self.count) };
        let words = format!("{error}; the {unit} is skipped{so_far}");
        self.first.get_or_insert(error);
        words
    }

    /// Tells how many there were.
    pub fn finish(&self, log: &str, unit: &str) {
        match self.count {
            0 => {}
            1 => output::note(&format!("{log}: 1 {unit} was no row and was skipped")),
            count => output::note(&format!("{log}: {count} {unit}s were no rows and were skipped")),
        }
    }

    /// Refuses a log of which nothing could be read.
    ///
    /// # Errors
    /// If lines were skipped and there was no row.
    pub fn refuse_all(&self, rows: u64) -> anyhow::Result<()> {
        match &self.first {
            Some(first) if rows == 0 => {
                let others = if self.count == 1 { "" } else { "; no other line is a row either" };
                Err(Hinted::error(
                    format!("{first}{others}"),
                    "`valve help formats` has what a timing log may look like",
                ))
            }
            _ => Ok(()),
        }
    }
}

/// Tells which columns of a log are not understood: a supply pressure among them changes every answer.
pub fn tell_unknown(log: &str, columns: &[String]) {
    for column in columns {
        output::note(&format!(
            "{log}: column {column:?} is not understood and not used; --column NAME={column:?} says what it is, and `valve help \
             formats` what a log may hold"
        ));
    }
}
