//! The valve file: TOML text to checked parameters and back, comments kept.
//!
//! A [`ValveFile`] is a text that has passed every check, together with what it
//! says in SI. Editing replaces only the bytes of the values concerned, so that
//! comments, order and the user's units stay; each edit is checked again.
//! [`ValveFile::with_history`] records the edits made since the last record in a
//! `[[history]]` table, and [`ValveFile::reverted`] undoes the last such step.
//!
//! # Pressures
//! `pneumatics.supply_pressure` may be gauge (it counts from
//! `pneumatics.ambient_pressure`) or absolute. `ambient_pressure` is absolute,
//! gauge units are refused. The `pressure` of the effect `back-pressure` counts
//! from the atmosphere: gauge and bare units are taken as such a difference,
//! `psia` and `bara` are refused.

mod canonical;
mod change;
mod check;
mod doubt;
mod edit;
mod effects;
mod error;
mod file;
mod history;
mod meaning;

pub use change::Change;
pub use doubt::ValveDoubt;
pub use error::ValveFileError;
pub use file::{Tolerance, ValveFile};
pub use history::{FoundValue, HistoryEntry};
