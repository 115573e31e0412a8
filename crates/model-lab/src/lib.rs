//! Compares the valve model with measurements, calibrates it and finds missing physics.
//!
//! Everything here is judged by the forward simulation: a [`Space`] says which parameters may move, a [`Dataset`] holds
//! what was recorded, [`identification`] brings both together, and [`errors`] says how large an error is.

pub mod calibrate;
pub mod compare;
pub mod crossing;
pub mod data;
pub mod diagnosis;
mod driving;
pub mod errors;
pub mod forward;
pub mod identification;
pub mod residual_force;
mod rounding;
pub mod space;
pub mod strange_times;

pub use data::Dataset;
pub use space::Space;
