//! The spring loses force: the valve closes faster and opens more slowly.

use std::borrow::Cow;

use super::share;
use crate::degradation::{Degradation, Moves};
use crate::fault::Direction;

pub(super) const INFO: Degradation = Degradation {
    id: Cow::Borrowed("spring"),
    name: Cow::Borrowed("weakened spring"),
    severity: share("lost share of the spring force", "spring_loss"),
    moves: Moves { close: Some(Direction::Falling), open: Some(Direction::Rising) },
    prior: 1.0,
};
