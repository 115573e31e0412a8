//! Timing logs of files: the plain form row by row, all others through their columns.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use anyhow::Context;
use log_columns::{ColumnLog, ColumnLogError, ColumnProblem, Wanted};
use prognoser::{LogErrorKind, LogRow, TimingLog};

use crate::cli::LogColumnArgs;
use crate::failure::Hinted;
use crate::output;

/// Bytes that are read at once.
const PIECE: usize = 1 << 16;

/// A timing log that is read to its end.
pub enum LogInput {
    /// The plain form, in constant memory.
    Plain(Box<TimingLog<BufReader<File>>>),
    /// Any other, in memory as a whole.
    Columns(Box<ColumnLog>),
}

impl LogInput {
    /// Opens a log in whatever form it is.
    ///
    /// # Errors
    /// If the file cannot be read, or no stroke times can be told of it; the hint says what would help.
    pub fn open(path: &Path, columns: &LogColumnArgs, empty_is_stalled: bool) -> anyhow::Result<Self> {
        let name = path.display().to_string();
        if columns.is_empty() {
            let file = File::open(path).with_context(|| format!("{name}: cannot be read"))?;
            match TimingLog::new(name.clone(), BufReader::with_capacity(PIECE, file)) {
                Ok(log) => return Ok(Self::Plain(Box::new(log.with_empty_as_stalled(empty_is_stalled)))),
                Err(error) if matches!(error.kind, LogErrorKind::Io(_) | LogErrorKind::Empty) => {
                    return Err(error.into());
                }
                Err(_) => {}
            }
        }
        let bytes = fs::read(path).with_context(|| format!("{name}: cannot be read"))?;
        let wanted = Wanted { columns: columns.column.clone(), valve: columns.valve_name.clone(), empty_is_stalled };
        match ColumnLog::read(&bytes, &name, &wanted) {
            Ok(log) => Ok(Self::Columns(Box::new(log))),
            Err(error @ ColumnLogError::Columns { problem: ColumnProblem::Missing { .. }, .. }) => {
                Err(Hinted::error(error.to_string(), "`valve help formats` has what a timing log may look like"))
            }
            Err(error) => Err(error.into()),
        }
    }

    /// Tells how the file was taken, and what of it was not.
    pub fn announce(&self, name: &Path) {
        if let Self::Columns(log) = self {
            for (line, notice) in log.notices() {
                output::note(&format!("{}:{line}: {notice}", log.name()));
            }
        }
        tell_unknown(&name.display().to_string(), self.unknown_columns());
    }

    fn unknown_columns(&self) -> &[String] {
        match self {
            Self::Plain(log) => log.unknown_columns(),
            Self::Columns(log) => log.unknown_columns(),
        }
    }

    /// The next row, none at the end of the log.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn next_row(&mut self) -> anyhow::Result<Option<LogRow<'_>>> {
        match self {
            Self::Plain(log) => Ok(log.next_row()?),
            Self::Columns(log) => Ok(log.next_row()?),
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
