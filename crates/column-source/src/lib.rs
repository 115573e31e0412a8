//! Columns of numbers as recorders and spreadsheets write them.
//!
//! A [`ColumnSource`] gives headings and then row by row numbers and texts, whatever the format behind it. The one for
//! text, [`TextSource`], finds out for itself how a file is written: bytes (gzip, UTF-8, UTF-16, Windows-1252),
//! separators (comma, semicolon, tab), lines before the header, a row of units under it, decimal commas, thousands
//! separators, comments, a last row that was cut off, columns without names, a date beside a time of the day. Every such guess that is not the plain case is a [`Notice`].
//! Times may be numbers or timestamps ([`Clock`]). [`open`] knows every format by its first bytes.
//!
//! It knows no valve, and what a column means is the caller's business.

#[cfg(any(feature = "mat73", feature = "tdms"))]
mod bits;
mod decode;
mod error;
mod heading;
mod layout;
#[cfg(feature = "mat")]
mod mat;
#[cfg(feature = "mat73")]
mod mat73;
#[cfg(any(feature = "mat", feature = "mat73"))]
mod matrix;
mod naming;
mod notice;
mod number;
mod open;
#[cfg(feature = "parquet")]
mod parquet;
mod source;
mod switch;
#[cfg(any(feature = "mat", feature = "mat73", feature = "parquet", feature = "tdms"))]
mod table;
#[cfg(feature = "tdms")]
mod tables;
#[cfg(feature = "tdms")]
mod tdms;
mod text;
mod timestamp;

pub use error::{RecordError, RecordProblem};
pub use heading::{Heading, other_unit_at_end};
pub use naming::{any_unit_at_end, did_you_mean, listed, named, unit_at_end, without_unit, written_out};
pub use notice::{Notice, NoticeKind};
pub use open::{open, recognised};
pub use source::{ColumnSource, find_table};
pub use switch::Switch;
pub use text::{Comments, TextSource};
pub use timestamp::{Clock, Dates};
