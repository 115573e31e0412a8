//! The vent path clogs: the valve opens more slowly. It closes as before until it no longer vents in time for the next closing, which then starts early.

use std::borrow::Cow;

use super::share;
use crate::degradation::{Degradation, Moves};
use crate::id::DegradationId;
use crate::stroke::Monotone;

pub(super) const INFO: Degradation = Degradation {
    id: DegradationId::new("exhaust"),
    name: Cow::Borrowed("clogged exhaust"),
    short: Cow::Borrowed("clogged exhaust"),
    severity: share("clogged share of the vent area", "exhaust_blockage"),
    moves: Moves { close: None, open: Some(Monotone::Rising) },
    prior: 1.0,
};
