//! study
pub mod noise;
