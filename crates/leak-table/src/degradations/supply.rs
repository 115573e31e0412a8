//! Gas enters the pipe from the supply: the valve closes faster and opens more slowly.

use std::borrow::Cow;

use super::LEAK_AREA;
use crate::degradation::{Degradation, Moves};
use crate::id::DegradationId;
use crate::stroke::Monotone;

pub(super) const INFO: Degradation = Degradation {
    id: DegradationId::new("supply"),
    name: Cow::Borrowed("leak from the supply"),
    short: Cow::Borrowed("leak from the supply"),
    severity: LEAK_AREA,
    moves: Moves { close: Some(Monotone::Falling), open: Some(Monotone::Rising) },
    prior: 1.0,
};
