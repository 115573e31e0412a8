//! What can be wrong with a table, its files and its manifest.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::conditions::ConditionsError;
use crate::stroke::Stroke;

/// Why rows are not a table. Rows count from 0, the header left out.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RowError {
    /// A severity is negative or not a number.
    #[error("{quantity}: found {found}, expected a number of at least 0")]
    Severity {
        /// Index of the row.
        row: usize,
        /// What it is, in words.
        quantity: String,
        /// The severity with its unit.
        found: String,
    },
    /// The severities do not rise.
    #[error(
        "{quantity}: found {found} after {previous}, expected it to rise strictly from row to row; sort the rows and drop repeats"
    )]
    SeverityOrder {
        /// Index of the row.
        row: usize,
        /// What it is, in words.
        quantity: String,
        /// The severity with its unit.
        found: String,
        /// The severity of the row before it.
        previous: String,
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
    /// The severities of two leaks are no grid.
    #[error(
        "found {rows} rows, expected every pair of severities, each leak evenly from 0 at 4 to 65 places, with positive times and those of the sound valve among them"
    )]
    LeakGrid {
        /// Number of rows.
        rows: usize,
    },
    /// A time is present although a smaller severity has none.
    #[error(
        "{stroke} time: found a time after a row without one, expected that a valve which does not get there does not when it is more worn"
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
    /// A table over conditions is no full grid of nodes.
    #[error(
        "found {nodes} nodes for {pressures} pressures and {temperatures} temperatures, expected as many severities from 0 on at each pressure and temperature, and at most 17 of either; build the tables again"
    )]
    Grid {
        /// Number of different pressures.
        pressures: usize,
        /// Number of different temperatures.
        temperatures: usize,
        /// Number of nodes.
        nodes: usize,
    },
    /// A time that is monotone at the nodes of a table over conditions is not between them.
    #[error(
        "{stroke} time: found it to turn at {share} of the table's end at {supply_pressure_pa} Pa and {temperature_k} K, expected it to be strictly monotone; build the tables over a smaller range of conditions"
    )]
    NotMonotoneBetween {
        /// The stroke.
        stroke: Stroke,
        /// The share of the end at which it turns.
        share: f64,
        /// The supply pressure, Pa.
        supply_pressure_pa: f64,
        /// The temperature, K.
        temperature_k: f64,
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
            Self::Severity { row, .. }
            | Self::SeverityOrder { row, .. }
            | Self::Time { row, .. }
            | Self::TimeAfterGap { row, .. }
            | Self::NotMonotone { row, .. } => Some(row),
            Self::TooFew { .. } | Self::LeakGrid { .. } | Self::Grid { .. } | Self::NotMonotoneBetween { .. } => None,
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
    #[error("{}: found tables of format version {found}, expected at most {expected}; build them again with this program, or use the program that wrote them", path.display())]
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
        expected: String,
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
    /// A degradation has two tables.
    #[error("found two tables of \"{id}\", expected one")]
    Twice {
        /// The degradation's id.
        id: String,
    },
    /// A leak has no table.
    #[error("found no table of \"{id}\", expected tables of both leaks, the leak to atmosphere first")]
    LeakMissing {
        /// The leak's id.
        id: String,
    },
    /// A description of a degradation cannot be right.
    #[error("fault \"{id}\": found {found}, expected {expected}")]
    Degradation {
        /// The degradation's id.
        id: String,
        /// What is there.
        found: String,
        /// What should be there.
        expected: &'static str,
    },
    /// Neither limit is crossed inside the table of a degradation.
    #[error(
        "fault \"{id}\": found no {quantity} in the table at which a limit is crossed, expected one; give limits that are crossed before the table ends"
    )]
    LimitOutside {
        /// The degradation's id.
        id: String,
        /// What its severity is, in words.
        quantity: String,
    },
    /// A limit lies outside its table.
    #[error(
        "fault \"{id}\": found the {stroke} limit at {found}, expected it above 0 and inside the table, which ends at {last}"
    )]
    Limit {
        /// The degradation's id.
        id: String,
        /// The stroke whose limit it is.
        stroke: Stroke,
        /// The severity at the limit, with its unit.
        found: String,
        /// The table's last severity, with its unit.
        last: String,
    },
    /// Conditions that a table was not built for.
    #[error(transparent)]
    Conditions(#[from] ConditionsError),
}
