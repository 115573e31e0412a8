//! What the program answers about a model and a campaign: documents for programs and sentences for people, the same
//! wherever they are told (on the command line, in a page, in Python).
//!
//! Keys and units of the documents are described in `docs/results.md`.

pub mod adoption;
pub mod calibration;
pub mod comparison;
pub mod error;
pub mod evaluation;
pub mod explanation;
pub mod figures;
mod input;
pub mod moved;
pub mod prognosis;
pub mod samples;
pub mod simulation;
pub mod steps;
pub mod strokes;
pub mod tables;

pub use input::{CampaignInput, InputError, position_error_m};

/// A document as JSON; what is not finite is null.
fn value_of(document: &impl serde::Serialize) -> serde_json::Value {
    // Nothing in a document can fail: its maps have names as keys.
    serde_json::to_value(document).unwrap_or_default()
}

/// The version of all documents, those of a prognosis too; raised when a key changes its name, meaning or unit, or goes.
pub const SCHEMA: u32 = 5;
