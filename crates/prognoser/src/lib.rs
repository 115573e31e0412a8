//! From timing logs and leak tables to fault, leak, end of life and remaining
//! useful life.
//!
//! ```text
//! log ──> TimingLog ──> Prognoser (a state per valve) ──> Prognosis per row
//!                          │
//!            TableBundle ──┴──> BayesEstimator or OlsEstimator
//! ```
//!
//! Nothing is simulated here: the leak tables are all that is known about the
//! valve. The state of a valve has a fixed size.
//!
//! [`study`] runs whole lives with known ends through the same estimators and
//! says how good they are.

pub mod bayes;
mod calendar;
mod fault_call;
mod intermittent;
mod kept;
mod learn;
mod log;
mod mistakes;
mod notice;
mod ols;
mod output;
mod prognoser;
mod reading;
mod record;
mod repeats;
mod status;
pub mod study;

pub use fault_call::FaultCall;
pub use learn::{Learned, Learner, PRIOR_VALVES, PRIOR_VERSION, PriorError, Repeated};
pub use log::{
    ConditionColumn, FollowNotice, FollowOptions, Followed, FollowedLog, LogError, LogErrorKind, LogPosition, LogRow,
    TimingLog, fields,
};
pub use notice::Notice;
pub use ols::{OlsEstimate, OlsEstimator};
pub use prognoser::{Method, Prognoser, ValveState};
pub use reading::Reading;
pub use record::{Prognosis, Status};
