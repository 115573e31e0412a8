//! What can be wrong with a pattern or a payload.

use prognoser::LogErrorKind;
use thiserror::Error;

/// Why a text is no pattern of topics.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("topic {found:?}: {problem}")]
pub struct PatternError {
    /// The text.
    pub found: String,
    /// What is wrong with it, and what would be right.
    pub problem: &'static str,
}

/// Why a message holds no reading.
#[derive(Debug, Error)]
pub enum PayloadError {
    /// It is not JSON.
    #[error("found a payload that is not JSON ({reason}), expected an object such as {{\"cycle\": 7, ...}}")]
    NotJson {
        /// What the parser says.
        reason: String,
    },
    /// It is JSON of another kind.
    #[error("found {found} as payload, expected an object such as {{\"cycle\": 7, ...}}")]
    NotObject {
        /// What it is.
        found: &'static str,
    },
    /// A field is not there.
    #[error("found no field {field:?} in the payload, expected {expected}")]
    Missing {
        /// The field.
        field: String,
        /// What should be there.
        expected: &'static str,
    },
    /// A field is of another kind.
    #[error("{field}: found {found}, expected {expected}")]
    Kind {
        /// The field.
        field: String,
        /// What it is.
        found: String,
        /// What should be there.
        expected: &'static str,
    },
    /// The topic has no name where it should.
    #[error("found no name of a valve in the topic, expected one where {{valve}} stands")]
    NoName,
    /// A value is none that a timing log could have.
    #[error(transparent)]
    Value(#[from] LogErrorKind),
}
