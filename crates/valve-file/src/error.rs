//! What can be wrong with a valve file.

use checked_toml::TomlFileError;
use valve_model::ParameterError;
use valve_model::custom::FormulaError;

/// A valve file that was refused, or an edit that cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ValveFileError {
    /// The text itself: syntax, unknown or missing keys, units.
    #[error(transparent)]
    Text(#[from] TomlFileError),
    /// A value that can be read and makes no sense.
    #[error("{file}:{line}: {source}")]
    Impossible {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it.
        source: Box<ParameterError>,
    },
    /// A formula of a custom effect.
    #[error("{file}:{line}: {source}")]
    Formula {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it, and at which character.
        source: Box<FormulaError>,
    },
    /// A formula that is no number somewhere on the way of the valve's own cycle.
    #[error(
        "{file}:{line}: formula of \"{effect}\" is no number {time_s:.3} s after the start of the valve's own cycle; \
         expected one wherever the valve goes, such as sqrt(abs(x)) or log(max(x, 1e-9))"
    )]
    NoNumber {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// The name of the effect.
        effect: String,
        /// When the simulation stopped, s.
        time_s: f64,
    },
    /// There is no such effect in the file.
    #[error("{file}: has no effect \"{effect}\"; it has {present}")]
    NoSuchEffect {
        /// The file.
        file: String,
        /// The id or name asked for.
        effect: String,
        /// Those that are there.
        present: String,
    },
    /// Nothing to go back to.
    #[error("{file}: has no [[history]] entry that can be undone; nothing was adopted or calibrated in it")]
    NothingToRevert {
        /// The file.
        file: String,
    },
    /// The file has been edited by hand so that its history no longer fits.
    #[error("{file}:{line}: this step cannot be undone: {reason}; edit the file by hand instead")]
    HistoryDoesNotFit {
        /// The file.
        file: String,
        /// The line of the history entry.
        line: usize,
        /// What does not fit.
        reason: String,
    },
}
