//! What can be wrong with a table, its files and its manifest.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::fault::{Fault, Stroke};
use crate::mm2_from_m2;

/// Why rows are not a leak table. Rows count from 0, the header left out.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RowError {
    /// A leak area is negative or not a number.
    #[error("leak area: found {} mm2, expected a number of at least 0", mm2_from_m2(*found_m2))]
    Area {
        /// Index of the row.
        row: usize,
        /// The area in m2.
        found_m2: f64,
    },
    /// The areas do not rise.
    #[error(
        "leak area: found {} mm2 after {} mm2, expected areas to rise strictly; sort the rows and drop repeats",
        mm2_from_m2(*found_m2), mm2_from_m2(*previous_m2)
    )]
    AreaOrder {
        /// Index of the row.
        row: usize,
        /// The area in m2.
        found_m2: f64,
        /// The area of the row before it.
        previous_m2: f64,
    },
    /// A time is negative or not a number.
    #[error(
        "{stroke} time: found {found_s} s, expected a number of at least 0, or nothing where the valve does not get there"
    )]
    Time {
        /// Index of the row.
        row: usize,
        /// The stroke.
        stroke: Stroke,
        /// The time in s.
        found_s: f64,
    },
    /// A time is present although a smaller leak has none.
    #[error(
        "{stroke} time: found a time after a row without one, expected that a valve which does not get there at a smaller leak does not at a larger one"
    )]
    TimeAfterGap {
        /// Index of the row.
        row: usize,
        /// The stroke.
        stroke: Stroke,
    },
    /// A time does not go on in the direction of the ones before it.
    #[error(
        "{stroke} time: found {found_s} s after {previous_s} s, expected the column to be strictly monotone; build the tables again, over a smaller range if the valve itself does this"
    )]
    NotMonotone {
        /// Index of the row.
        row: usize,
        /// The stroke.
        stroke: Stroke,
        /// The time in s.
        found_s: f64,
        /// The time of the row before it.
        previous_s: f64,
    },
    /// A column has fewer than two times.
    #[error(
        "{stroke} time: found {found} rows with a time from the first on, expected at least 2; the valve must stroke while it is healthy"
    )]
    TooFew {
        /// The stroke.
        stroke: Stroke,
        /// Number of rows with a time.
        found: usize,
    },
}

impl RowError {
    /// Index of the row at fault, the header left out; none if it is the whole
    /// column.
    pub fn row(&self) -> Option<usize> {
        match *self {
            Self::Area { row, .. }
            | Self::AreaOrder { row, .. }
            | Self::Time { row, .. }
            | Self::TimeAfterGap { row, .. }
            | Self::NotMonotone { row, .. } => Some(row),
            Self::TooFew { .. } => None,
        }
    }
}

/// Why a bundle of tables cannot be made, read or written.
#[derive(Debug, Error)]
pub enum TableError {
    /// A file or directory cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The directory has no manifest.
    #[error("{}: found no manifest.json, expected one beside the tables; is this the directory that `valve build-tables --out` wrote?", dir.display())]
    ManifestMissing {
        /// The directory.
        dir: PathBuf,
    },
    /// The manifest is not what it should be.
    #[error("{}:{line}: found a manifest that cannot be used ({message}), expected one as `valve build-tables` writes it; build the tables again", path.display())]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// The manifest has a format version this program does not know.
    #[error("{}: found tables of format version {found}, expected {expected}; build them again with this program, or use the program that wrote them", path.display())]
    Version {
        /// The manifest.
        path: PathBuf,
        /// The version found.
        found: String,
        /// The version this program reads.
        expected: u32,
    },
    /// A table is shorter than its manifest says.
    #[error("{}: found {found} bytes, expected {expected} as the manifest says: the table is truncated; build the tables again or copy them again", path.display())]
    Truncated {
        /// The table.
        path: PathBuf,
        /// Its length in bytes.
        found: u64,
        /// The length the manifest gives.
        expected: u64,
    },
    /// A table's content is not what its manifest says.
    #[error("{}: found content with hash {found}, expected {expected} as the manifest says: the table was changed after it was built; build the tables again or restore the file", path.display())]
    Hash {
        /// The table.
        path: PathBuf,
        /// Hash of the file.
        found: String,
        /// Hash in the manifest.
        expected: String,
    },
    /// The tables were built from another model.
    #[error("{}: found tables of valve \"{valve}\" built from model {found}, expected model {expected}; build tables from the given valve file", dir.display())]
    Model {
        /// The directory.
        dir: PathBuf,
        /// The valve's name in the manifest.
        valve: String,
        /// Model hash in the manifest.
        found: String,
        /// Model hash asked for.
        expected: String,
    },
    /// A table's header is not right.
    #[error("{}:1: found columns \"{found}\", expected \"{expected}\"; build the tables again", path.display())]
    Columns {
        /// The table.
        path: PathBuf,
        /// The header found.
        found: String,
        /// The header expected.
        expected: &'static str,
    },
    /// A table has a field or a row that cannot be read.
    #[error("{}:{line}: found {found}, expected {expected}; build the tables again", path.display())]
    Field {
        /// The table.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// What is there.
        found: String,
        /// What should be there.
        expected: &'static str,
    },
    /// A table's rows do not make a table.
    #[error("{}:{line}: {source}", path.display())]
    Rows {
        /// The table.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        source: RowError,
    },
    /// A table's row count is not the manifest's.
    #[error("{}: found {found} rows, expected {expected} as the manifest says; build the tables again", path.display())]
    RowCount {
        /// The table.
        path: PathBuf,
        /// Rows found.
        found: usize,
        /// Rows the manifest gives.
        expected: usize,
    },
    /// A table was given for the wrong fault.
    #[error("found a table of fault \"{found}\", expected \"{expected}\"")]
    WrongFault {
        /// The table's fault.
        found: Fault,
        /// The fault expected.
        expected: Fault,
    },
    /// Neither limit is crossed inside the table of a fault.
    #[error(
        "fault \"{fault}\": found no leak area in the table at which a limit is crossed, expected one; give limits that the leak reaches before the table ends"
    )]
    LimitOutside {
        /// The fault.
        fault: Fault,
    },
    /// A limit area lies outside its table.
    #[error("fault \"{fault}\": found the {stroke} limit at {} mm2, expected it above 0 and inside the table, which ends at {} mm2", mm2_from_m2(*found_m2), mm2_from_m2(*last_m2))]
    LimitArea {
        /// The fault.
        fault: Fault,
        /// The stroke whose limit it is.
        stroke: Stroke,
        /// The limit area in m2.
        found_m2: f64,
        /// The table's last area in m2.
        last_m2: f64,
    },
}
