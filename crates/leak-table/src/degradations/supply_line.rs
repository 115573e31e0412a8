//! The fill path clogs, as does a solenoid at its supply port: the valve closes more slowly. It opens as before until it no longer fills in time for the next opening, which then starts early.

use std::borrow::Cow;

use super::share;
use crate::degradation::{Degradation, Moves};
use crate::id::DegradationId;
use crate::stroke::Monotone;

pub(super) const INFO: Degradation = Degradation {
    id: DegradationId::new("supply-line"),
    name: Cow::Borrowed("clogged supply line"),
    short: Cow::Borrowed("clogged supply line"),
    severity: share("clogged share of the fill area", "supply_blockage"),
    moves: Moves { close: Some(Monotone::Rising), open: None },
    prior: 1.0,
};
