//! What the program answers about a model and a campaign: documents for programs and sentences for people, the same
//! wherever they are told (on the command line, in a page).
//!
//! Keys and units of the documents are described in `docs/formats.md`.

pub mod calibration;
pub mod comparison;
pub mod error;
pub mod explanation;
mod input;
pub mod moved;
pub mod steps;

pub use input::{CampaignInput, InputError};

/// The version of the documents; raised when a key changes its name or meaning.
pub const SCHEMA: u32 = 3;
