//! TOML tables read key by key, with file and line in every refusal.
//!
//! The readers of valve files and of campaigns share this: a [`Document`] knows
//! its file's name and where each line begins, a [`Section`] gives text,
//! numbers and quantities by key, and refuses keys that nobody asked for, and
//! [`Refusals`] tell all that is wrong at once.

mod document;
mod error;
mod section;

pub use document::{Document, read_text};
pub use error::{Problem, Refusals, TomlFileError};
pub use section::{QuantityKind, Section};
