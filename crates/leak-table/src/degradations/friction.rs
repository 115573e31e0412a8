//! Piston and rod rub: both strokes are slower.

use std::borrow::Cow;

use crate::degradation::{Degradation, Moves, Severity};
use crate::id::DegradationId;
use crate::stroke::Monotone;

pub(super) const INFO: Degradation = Degradation {
    id: DegradationId::new("friction"),
    name: Cow::Borrowed("friction of piston and rod"),
    short: Cow::Borrowed("friction"),
    severity: Severity {
        quantity: Cow::Borrowed("added dry friction"),
        unit: Cow::Borrowed("N"),
        column: Cow::Borrowed("friction_force_n"),
        per_si: 1.0,
    },
    moves: Moves { close: Some(Monotone::Rising), open: Some(Monotone::Rising) },
    prior: 1.0,
};
