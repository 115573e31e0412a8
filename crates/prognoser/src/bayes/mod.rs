//! The default method: a recursive Bayesian estimate of fault, leak and life.

mod config;
mod estimator;
mod model;
mod posterior;
mod special;
mod sums;
mod track;

pub use config::{BayesConfig, GrowthLaw, Noise, StartPrior};
pub use estimator::{BayesEstimate, BayesEstimator, FaultProbability};
pub use posterior::Quantiles;
