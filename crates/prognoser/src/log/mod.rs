//! Timing logs: read from anything, line by line, also while they grow.

mod conditions;
mod error;
mod follow;
mod lines;
mod reader;

pub use error::{LogError, LogErrorKind};
pub use follow::{FollowFailure, FollowedFile};
pub use reader::{LogRow, TimingLog};
