//! System identification for records whose instruments, conditions and models are all a little wrong.
//!
//! A [`Problem`] predicts the rows of records from coordinates with priors. Its errors are white noise and a model
//! error that is a Markov process in time ([`noise`]); [`fit()`] finds the coordinates, [`variance`] the errors' sizes,
//! and the logarithm of the [evidence](normal::Posterior::log_evidence) is the one currency in which models are
//! compared. The crate knows no valve.

mod envelope;
pub mod fit;
pub mod held_out;
mod horizon;
pub mod left;
pub mod noise;
pub mod normal;
pub mod problem;
pub mod select;
pub mod soft;
pub mod special;
pub mod stop;
pub mod variance;

pub use fit::{Fit, FitOptions, fit};
pub use noise::{GroupNoise, Noise, Smoothness};
pub use problem::{Coordinate, Difference, Differences, Linear, Problem, Record, Request, Row, Scope, Series};
pub use stop::Stop;
pub use variance::GroupPrior;
