//! The valve as a problem of system identification.

pub mod catalogue;
mod cycles;
mod fidelity;
pub mod force_balance;
mod known;
pub mod nuisance;
pub mod problem;
mod rounded;
mod rows;
mod scattered;
mod sensor_curve;
pub mod setup;
pub mod start;
mod turns;

pub use catalogue::{Catalogue, Subject};
pub use known::Known;
pub use nuisance::{Entry, Nuisance, NuisanceSizes, nuisances};
pub use problem::ValveProblem;
pub use setup::Setup;
