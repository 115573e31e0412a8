//! Gas enters the pipe from the supply: the valve closes faster and opens more slowly.

use std::borrow::Cow;

use super::LEAK_AREA;
use crate::degradation::{Degradation, Moves};
use crate::fault::Direction;

pub(super) const INFO: Degradation = Degradation {
    id: Cow::Borrowed("supply"),
    name: Cow::Borrowed("leak from the supply"),
    severity: LEAK_AREA,
    moves: Moves { close: Some(Direction::Falling), open: Some(Direction::Rising) },
    prior: 1.0,
};
