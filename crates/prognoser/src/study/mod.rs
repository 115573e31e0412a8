//! How good is a prognosis? Whole lives with known ends, run through the same
//! estimators as real logs.
//!
//! # Definitions
//! A life has a leak that grows linearly from its start to the limit, which it
//! reaches at cycle K, a real number. Both timings of the cycles 0, 1, ... below
//! K are read from the truth and get independent Gaussian noise. After every
//! cycle k from [`StudyConfig::first_prediction`] on there is a prediction, the
//! method's best estimate of the remaining life r (whole cycles for least
//! squares, as in the paper). The true one is R = K - k. No prediction at
//! all counts as an error of 100 %.
//!
//! - **Relative accuracy** of a prediction: 1 - |R - r| / R, not below
//!   zero; of a life: the mean over its predictions (Saxena, Celaya, Saha, Saha,
//!   Goebel, "Metrics for Offline Evaluation of Prognostic Performance",
//!   IJPHM 1, 2010, eq. 6, clipped).
//! - **Cycle of convergence**: the first from which on all predictions lie in
//!   the alpha cone, |R - r| <= alpha R. K if there is none.
//! - **Alpha-lambda accuracy** at a fraction lambda of life: the share of lives
//!   whose prediction there lies in the alpha cone (same paper, section 4.2).
//! - **Prognostic horizon**: K minus the first cycle from which on all
//!   predictions of the end are within alpha K of it (same paper, section 4.1).
//! - **Coverage**: the share of predictions whose 5 to 95 % interval holds K.
//! - **Error to bound**: root mean square error of the predicted end over the
//!   Cramer-Rao bound. With `S_j` the sum over the readings so far of
//!   `(T_c'^2 + T_o'^2) k^j / sigma^2`, where `T_c'` and `T_o'` are the
//!   derivatives of the times by the leak at the true leak, and g the growth
//!   per cycle, it is `var(K) >= K^2 / (g^2 S_2)` for a leak known to start at
//!   zero, and `var(K) >= (1/g^2) (1/S_0 + (K - m)^2 / (S_2 - S_1^2/S_0))` with
//!   `m = S_1/S_0` for an unknown start.
//! - **Isolation cycle**: the first from which on the right fault has a
//!   probability above 0.95 (is named, with least squares).

mod bound;
mod life;
mod metrics;
mod noise;
mod run;
pub mod scenario;

pub use bound::{LifeBound, bounds};
pub use life::{LifeTruth, Outliers};
pub use metrics::{Percentiles, StudyResult};
pub use noise::NoiseSource;
pub use run::{PAPER, PaperValue, StudyConfig, TruthTimes, run_study};
