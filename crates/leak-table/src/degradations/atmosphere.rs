//! Gas escapes from the pipe to the atmosphere: the valve closes more slowly and opens faster.

use std::borrow::Cow;

use super::LEAK_AREA;
use crate::degradation::{Degradation, Moves};
use crate::id::DegradationId;
use crate::stroke::Monotone;

pub(super) const INFO: Degradation = Degradation {
    id: DegradationId::new("atmosphere"),
    name: Cow::Borrowed("leak to atmosphere"),
    short: Cow::Borrowed("leak to atmosphere"),
    severity: LEAK_AREA,
    moves: Moves { close: Some(Monotone::Rising), open: Some(Monotone::Falling) },
    prior: 1.0,
};
