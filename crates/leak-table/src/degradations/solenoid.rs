//! The solenoid valve clogs, or no longer opens all the way: the cylinder fills and vents through less, and both strokes take longer.

use std::borrow::Cow;

use super::share;
use crate::degradation::{Degradation, Moves};
use crate::id::DegradationId;
use crate::stroke::Monotone;

pub(super) const INFO: Degradation = Degradation {
    id: DegradationId::new("solenoid"),
    name: Cow::Borrowed("clogged solenoid"),
    short: Cow::Borrowed("clogged solenoid"),
    severity: share("clogged share of the solenoid's area", "solenoid_blockage"),
    moves: Moves { close: Some(Monotone::Rising), open: Some(Monotone::Rising) },
    prior: 1.0,
};
