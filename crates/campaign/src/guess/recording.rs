//! All columns of a file as numbers.

use column_source::{Clock, Comments, Notice};
use quantity::Unit;

use crate::DataError;

/// A file with all its columns.
#[derive(Debug, Clone)]
pub struct Recording {
    /// What messages call the file.
    pub file: String,
    /// Names of the columns, as they are written.
    pub names: Vec<String>,
    /// Names without the unit in brackets.
    pub bare: Vec<String>,
    /// Units in brackets or from the row under the header.
    pub units: Vec<Option<Unit>>,
    /// The columns; text and gaps are NaN, timestamps are seconds from the first.
    pub columns: Vec<Vec<f64>>,
    /// Which columns hold timestamps.
    pub timestamps: Vec<bool>,
    /// How the file had to be read.
    pub notices: Vec<Notice>,
}

impl Recording {
    /// Reads a file.
    pub fn read(bytes: &[u8], file: &str) -> Result<Self, DataError> {
        let mut source = column_source::open(bytes, file, Comments::WhereNoNames)?;
        let count = source.headings().len();
        let mut columns = vec![Vec::new(); count];
        let mut clocks = vec![Clock::default(); count];
        while let Some(line) = source.next_row()? {
            for (index, (column, clock)) in columns.iter_mut().zip(&mut clocks).enumerate() {
                let stamp = |clock: &mut Clock| clock.seconds(&source.field(index), line).unwrap_or(f64::NAN);
                column.push(if clock.notice().is_some() {
                    stamp(clock)
                } else {
                    source.number(index).unwrap_or_else(|_| stamp(clock))
                });
            }
        }
        let headings = source.headings();
        let notices = source.notices().iter().chain(clocks.iter().filter_map(Clock::notice));
        Ok(Self {
            file: file.to_owned(),
            names: headings.iter().map(|heading| heading.name.clone()).collect(),
            bare: headings.iter().map(|heading| heading.bare().to_owned()).collect(),
            units: headings.iter().map(|heading| heading.unit.clone()).collect(),
            notices: notices.cloned().collect(),
            columns,
            timestamps: clocks.iter().map(|clock| clock.notice().is_some()).collect(),
        })
    }
}
