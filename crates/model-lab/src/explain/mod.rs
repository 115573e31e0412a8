//! Which physical effect is missing.

pub mod candidate;
