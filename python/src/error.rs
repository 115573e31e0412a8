//! What is refused.

use std::fmt::Display;

use pyo3::PyErr;
use pyo3::exceptions::PyValueError;

pyo3::create_exception!(
    valve_prognosis,
    ValveError,
    PyValueError,
    "What was asked for or read cannot be used; the message says what was found, and what would be right."
);

/// A refusal in the words of the crate that refuses.
pub fn refused(error: impl Display) -> PyErr {
    ValveError::new_err(error.to_string())
}

/// The same with what to do about it.
pub fn refused_with_hint(error: impl Display, hint: Option<impl Display>) -> PyErr {
    match hint {
        Some(hint) => ValveError::new_err(format!("{error}\nhint: {hint}")),
        None => refused(error),
    }
}
