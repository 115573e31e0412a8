//! The default method: a Bayesian estimate of fault, severity, growth and life.
//!
//! A valve's state is a mixture of Gaussians (`hypothesis.rs`): each is one
//! hypothesis of what wears, by which law, and how steadily. Severity, growth and
//! the valve's own healthy times are Gaussian under it; which hypothesis is true
//! is what the data decide. Every cycle the hypotheses move on, may change into
//! each other, meet the reading and are weighed; the unlikely ones are dropped.

mod assimilate;
mod bank;
mod config;
mod ending;
mod estimate;
mod estimator;
mod hypothesis;
mod law;
mod motion;
mod noise;
mod plant;
mod rate_prior;
mod special;
mod start;
mod state;
mod two_leaks;
mod wide;
mod workspace;

pub(crate) use assimilate::PROPER_FROM;
pub use config::{BayesConfig, GrowthLaw, GrowthPrior, Noise, StartPrior};
pub use ending::{LONGEST, Quantiles};
pub(crate) use estimate::Wanted;
pub use estimate::{BayesEstimate, Change, FaultProbability};
pub use estimator::BayesEstimator;
pub(crate) use plant::healthy_times_s;
pub use state::{STATE_VERSION, ValveRecord};
pub(crate) use workspace::Workspace;
