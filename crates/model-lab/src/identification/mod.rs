//! The valve as a problem of system identification.

pub mod nuisance;
pub mod problem;
pub mod setup;

pub use nuisance::{Entry, Nuisance, NuisanceSizes, nuisances};
pub use problem::ValveProblem;
pub use setup::{Fidelity, Setup};
