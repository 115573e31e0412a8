//! What was guessed.

/// A guess with its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Notice {
    /// The line, counted from 1.
    pub line: usize,
    /// What was guessed.
    pub kind: NoticeKind,
}

/// What was guessed, in words.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoticeKind {
    /// Another encoding than UTF-8.
    #[error("read as {encoding}")]
    Encoding {
        /// Its name.
        encoding: &'static str,
    },
    /// Lines above the header.
    #[error("lines before the header were skipped: {lines}")]
    Preamble {
        /// How many.
        lines: usize,
    },
    /// No header.
    #[error("no line names the columns; from left to right they are called \"column 1\" to \"column {columns}\"")]
    NoHeader {
        /// How many.
        columns: usize,
    },
    /// A date and a time of the day in two columns.
    #[error("the date in \"{date}\" and the time of the day in \"{time}\" were taken together")]
    DateBeside {
        /// The column of the date.
        date: String,
        /// The column of the time.
        time: String,
    },
    /// Rows from the last to the first.
    #[error("the rows run from the newest to the oldest; they were turned round")]
    NewestFirst,
    /// A row of units.
    #[error("the row under the header was taken as units: {units}")]
    UnitsRow {
        /// The units that were understood, with their columns.
        units: String,
    },
    /// Decimal commas.
    #[error("numbers such as \"{example}\" were read with a decimal comma")]
    DecimalComma {
        /// The first of them.
        example: String,
    },
    /// Thousands separators.
    #[error("\"{separator}\" in numbers such as \"{example}\" was taken as a thousands separator")]
    Thousands {
        /// The separator.
        separator: char,
        /// The first of them.
        example: String,
    },
    /// Columns of other lengths.
    #[error("not as long as the recording of {rows} rows, and left out: {names}")]
    OtherLengths {
        /// Their names.
        names: String,
        /// Rows of the recording.
        rows: usize,
    },
    /// Other tables of the same file.
    #[error("{taken} was read, and not {others}")]
    OtherTables {
        /// The table that was read.
        taken: String,
        /// The others.
        others: String,
    },
    /// The header within the rows.
    #[error("{}; left out", if *rows == 1 { "one row is the header again".to_owned() } else { format!("{rows} rows are the header again") })]
    HeaderAgain {
        /// How many.
        rows: usize,
    },
    /// The last row was cut off.
    #[error("the last row is cut off; it was left out")]
    CutRow,
    /// Times are timestamps.
    #[error("the time is a timestamp such as \"{example}\", read as {format}")]
    Timestamps {
        /// The first of them.
        example: String,
        /// How it was read.
        format: &'static str,
    },
}
