//! Timing logs as historians and spreadsheets write them, made rows of a timing log.
//!
//! `prognoser` reads one plain form, row by row and as it grows. This crate reads all others, as a whole: any file that
//! `column-source` understands (separators, decimal commas, rows of units, encodings, compressed text, Parquet), whose
//! columns have other names, units and dates. What each column was taken for is a [`Notice`]; what cannot be known, such
//! as the unit of a time, is refused and never guessed.
//!
//! ```
//! use log_columns::{ColumnLog, Wanted};
//!
//! let text = b"Ventil;Datum;Schaltspiel;Schliesszeit [ms];Oeffnungszeit [ms]\nFV-1;1.3.2026;7;2016,0;4103,5\n";
//! let mut log = ColumnLog::read(text, "log.csv", &Wanted::default()).unwrap();
//! let row = log.next_row().unwrap().unwrap();
//! assert_eq!((row.valve, row.reading.cycle, row.reading.close_time_s), ("FV-1", 7, Some(2.016)));
//! assert_eq!(row.time, Some("2026-03-01T00:00:00Z"));
//! ```

mod channel;
mod error;
mod log;
mod notice;
mod places;

pub use channel::{Channel, NamedColumn};
pub use error::{ColumnLogError, ColumnProblem};
pub use log::{ColumnLog, Wanted};
pub use notice::Notice;
