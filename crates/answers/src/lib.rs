//! What the program answers about a model and a campaign: documents for programs and sentences for people, the same
//! wherever they are told (on the command line, in a page).
//!
//! Keys and units of the documents are described in `docs/formats.md`.

pub mod calibration;
pub mod comparison;
pub mod explanation;
mod input;
pub mod steps;

pub use input::{CampaignInput, InputError};
