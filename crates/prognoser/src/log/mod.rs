//! Timing logs: read from anything, line by line, also while they grow.

mod conditions;
mod decimals;
mod error;
pub mod fields;
mod follow;
mod layout;
mod lines;
mod reader;

pub use conditions::ConditionColumn;
pub use error::{LogError, LogErrorKind};
pub use follow::{FollowNotice, FollowOptions, Followed, FollowedLog, LogPosition};
pub use reader::{LogRow, TimingLog};
