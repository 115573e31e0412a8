//! The spring loses force: the valve closes faster and opens more slowly.

use std::borrow::Cow;

use super::share;
use crate::degradation::{Degradation, Moves};
use crate::id::DegradationId;
use crate::stroke::Monotone;

pub(super) const INFO: Degradation = Degradation {
    id: DegradationId::new("spring"),
    name: Cow::Borrowed("weakened spring"),
    short: Cow::Borrowed("weak spring"),
    severity: share("lost share of the spring force", "spring_loss"),
    moves: Moves { close: Some(Monotone::Falling), open: Some(Monotone::Rising) },
    prior: 1.0,
};
