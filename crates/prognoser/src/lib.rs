//! From timing logs and leak tables to fault, leak, end of life.

pub mod bayes;
mod reading;
pub mod study;

pub use reading::Reading;
