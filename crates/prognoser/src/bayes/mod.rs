//! The default method: a recursive Bayesian estimate of fault, leak and life.

mod change;
mod config;
mod estimator;
mod history;
mod hypotheses;
mod model;
mod none;
mod posterior;
mod special;
mod sums;
mod track;

pub use change::Change;
pub use config::{BayesConfig, GrowthLaw, Noise, StartPrior};
pub use estimator::{BayesEstimate, BayesEstimator, FaultProbability};
pub use posterior::Quantiles;
