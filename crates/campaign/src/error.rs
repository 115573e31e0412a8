//! What makes a campaign unusable.

use checked_toml::TomlFileError;
use column_source::{Clock, RecordError, RecordProblem};

/// A campaign that was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CampaignError {
    /// The campaign file itself.
    #[error(transparent)]
    Text(#[from] TomlFileError),
    /// One of the CSV files.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A recording in place of the campaign file that names it.
    #[error(
        "{file}: is a recording ({format}), no campaign file; expected a TOML file that names recordings and their \
         conditions, which `valve init campaign {file}` writes"
    )]
    Recording {
        /// The file.
        file: String,
        /// What it is, such as "a gzip file".
        format: &'static str,
    },
}

/// A refusal of a CSV file with its place.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}:{line}: {problem}")]
pub struct DataError {
    /// The file.
    pub file: String,
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong.
    pub problem: Box<DataProblem>,
}

impl DataError {
    pub(crate) fn new(file: &str, line: usize, problem: DataProblem) -> Self {
        Self { file: file.to_owned(), line, problem: Box::new(problem) }
    }
}

impl From<RecordError> for DataError {
    fn from(error: RecordError) -> Self {
        Self { file: error.file, line: error.line, problem: Box::new(error.problem.into()) }
    }
}

/// What is wrong with a CSV file, and what would be right.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DataProblem {
    /// It cannot be opened or read.
    #[error("cannot be read: {reason} (the campaign names it in line {named_in_line})")]
    Unreadable {
        /// The operating system's words.
        reason: String,
        /// The line of the campaign file.
        named_in_line: usize,
    },
    /// Not a table of numbers.
    #[error(transparent)]
    Record(#[from] RecordProblem),
    /// A time that is neither a number nor a timestamp.
    #[error(
        "column \"{column}\": \"{found}\" is not a number and no time in a form that is read; expected a number, or in each row \
         alike one of these: {}",
        Clock::FORMS
    )]
    NotATime {
        /// The column.
        column: String,
        /// What stands there.
        found: String,
    },
    /// A header and too few rows.
    #[error("has {rows} usable rows; expected at least {expected}")]
    TooFewRows {
        /// How many there are.
        rows: usize,
        /// How many are needed.
        expected: usize,
    },
    /// A column that must be there is not.
    #[error("has no column {column}; expected {expected}; found {found}")]
    MissingColumn {
        /// The column looked for.
        column: String,
        /// How it may be named.
        expected: String,
        /// The columns that are there.
        found: String,
    },
    /// Two columns for one channel.
    #[error("has two columns for {channel}: \"{first}\" and \"{second}\"; say which one in [columns]")]
    TwoColumns {
        /// The channel.
        channel: String,
        /// One column.
        first: String,
        /// The other.
        second: String,
    },
    /// A unit of another kind of quantity.
    #[error("column \"{column}\" is in {unit}; expected {expected}: was the right column named?")]
    WrongUnit {
        /// The column.
        column: String,
        /// Its unit.
        unit: String,
        /// What would be right.
        expected: String,
    },
    /// A unit of another kind, such as percent, that nobody has said the meaning of.
    #[error(
        "column \"{column}\" is in {unit}; expected {expected}: say in [columns] how many {usual} one {unit} is, such as {channel} = {{ name = \"{column}\", unit = \"{usual}\", scale = 0.254 }}"
    )]
    OtherUnit {
        /// The column.
        column: String,
        /// Its unit.
        unit: String,
        /// The channel.
        channel: String,
        /// What would be right.
        expected: String,
        /// The channel's usual unit.
        usual: &'static str,
    },
    /// A unit of pressure that could be gauge or absolute.
    #[error(
        "column \"{column}\" is in {unit}, which does not say from where it counts; give it its unit in [columns], \
         {channel} = {{ name = \"{column}\", unit = \"{unit}a\" }} (absolute) or \"{unit}g\" (gauge)"
    )]
    AmbiguousUnit {
        /// The column.
        column: String,
        /// Its unit.
        unit: String,
        /// The channel.
        channel: String,
    },
    /// A number that makes no sense in its column.
    #[error("column \"{column}\": {found}; expected {expected}")]
    ImpossibleNumber {
        /// The column.
        column: String,
        /// What stands there.
        found: f64,
        /// What would be right.
        expected: String,
    },
    /// A condition that is not given where its column is.
    #[error(
        "column \"{column}\" is empty in this row; expected its value (0 for no leak), or no such column where \
         every row is under the valve file's conditions"
    )]
    EmptyCondition {
        /// The column.
        column: String,
    },
    /// Conditions of a row that make no sense.
    #[error("{key} is {found}; expected {expected}")]
    ImpossibleCondition {
        /// The condition.
        key: String,
        /// What was found, SI.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A time that is not after the one before it.
    #[error("time {found_s} s follows {before_s} s; expected times that increase from row to row")]
    TimeNotIncreasing {
        /// The time of this row, s.
        found_s: f64,
        /// The time of the row before, s.
        before_s: f64,
    },
    /// A command that is neither 0 nor 1.
    #[error(
        "command is {found}; expected 0 (open) or 1 (close); if the channel is a voltage or a pressure, \
         name it in command_from with a threshold"
    )]
    CommandValue {
        /// What stands there.
        found: f64,
    },
    /// There is no stroke to compare.
    #[error(
        "the command is {value} from the first row to the last, so no stroke can be told from another; \
         expected 1 where the valve is told to close and 0 where it is told to open"
    )]
    CommandNeverChanges {
        /// Its only value, 0 or 1.
        value: u8,
    },
    /// The channel that tells the command never crosses the threshold.
    #[error(
        "the {channel} lies between {:.2}{unit} and {:.2}{unit} and never crosses the threshold {threshold:.2}{unit} of \
         command_from with its hysteresis of {hysteresis:.2}{unit}, so no stroke can be told from another; expected a \
         threshold between open and closed in every run", range[0], range[1]
    )]
    NeverCrossed {
        /// The channel or column.
        channel: String,
        /// Its lowest and highest reading.
        range: [f64; 2],
        /// The threshold.
        threshold: f64,
        /// Its whole width.
        hysteresis: f64,
        /// The unit of all of them, after a blank; empty for a column's own numbers.
        unit: &'static str,
    },
    /// The channel that tells the command stays where it is.
    #[error(
        "the {channel} lies between {:.2}{unit} and {:.2}{unit} and hardly moves, so that it tells no command; expected a \
         recording in which the valve is told to move", range[0], range[1]
    )]
    HardlyMoves {
        /// The channel or column.
        channel: String,
        /// Its lowest and highest reading.
        range: [f64; 2],
        /// The unit of both, after a blank; empty for a column's own numbers.
        unit: &'static str,
    },
    /// A channel without a single number.
    #[error("column \"{column}\" holds no number at all; expected readings of the {channel}")]
    NoReadings {
        /// The column.
        column: String,
        /// The channel.
        channel: String,
    },
    /// The recorded motion is larger or smaller than the valve's stroke by a factor.
    #[error("the recorded motion spans {span_mm:.4} mm, the valve's stroke is {stroke_mm:.4} mm; {hint}")]
    WrongScale {
        /// Span of the recorded motion, mm.
        span_mm: f64,
        /// The valve's stroke, mm.
        stroke_mm: f64,
        /// What is likely wrong.
        hint: String,
    },
    /// The position grows where the valve closes.
    #[error(
        "the position grows while the valve is told to close; expected 0 at the closed stop and the stroke \
         at the open one: turn it round in [columns], position = {{ name = \"{column}\", scale = -1.0, \
         offset = \"{stroke_mm} mm\" }}"
    )]
    Mirrored {
        /// The column of the position.
        column: String,
        /// The valve's stroke, mm.
        stroke_mm: f64,
    },
}
