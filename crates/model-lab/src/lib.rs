//! Compares the valve model with measurements, calibrates it and finds missing physics.
//!
//! Everything here is judged by the forward simulation: a [`Space`] says which parameters may move,
//! a [`Dataset`] holds what was recorded in units of its noise, [`fit()`] brings both together.

pub mod calibrate;
pub mod certainty;
pub mod compare;
pub mod data;
pub mod diagnosis;
pub mod fit;
pub mod forward;
pub mod identification;
pub mod repeats;
pub mod residual_force;
pub mod scatter;
pub mod space;

pub use data::Dataset;
pub use fit::{Fit, FitOptions, fit};
pub use scatter::Scatter;
pub use space::Space;
