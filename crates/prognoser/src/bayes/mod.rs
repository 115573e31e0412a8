//! The default method: a recursive Bayesian estimate of fault, leak and life.

mod change;
mod config;
mod estimate;
mod estimator;
mod explain;
mod guess;
mod history;
mod hypotheses;
mod model;
mod none;
mod posterior;
mod special;
mod sums;
mod track;
mod view;
mod wide;

pub use change::Change;
pub use config::{BayesConfig, GrowthLaw, Noise, StartPrior};
pub use estimate::{BayesEstimate, FaultProbability};
pub use estimator::BayesEstimator;
pub use posterior::Quantiles;
