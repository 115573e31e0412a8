//! The ladder from healthy to the end of life.

use serde::{Deserialize, Serialize};

use crate::fault_call::FaultCall;
use crate::record::{Prognosis, Status};

/// Cycles before `replace_by_cycle` at which a replacement should be planned.
const PLAN_CYCLES: u64 = 10;
/// What the rungs ask of an end: whether it comes within less than so many cycles.
pub(crate) const ASKED: [f64; 2] = [1.0, PLAN_CYCLES as f64 + 1.0];
/// Rows in a row that must speak for a lower rung before it is taken: a ladder
/// that goes up and down with the noise is not believed.
const CALM_ROWS: u8 = 3;

/// Where a valve stands on the ladder.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ladder {
    status: Status,
    calm: u8,
}

impl Default for Ladder {
    fn default() -> Self {
        Self { status: Status::Unknown, calm: 0 }
    }
}

impl Ladder {
    /// Takes in a row and gives the status after it: up at once, down after a
    /// few rows, or at once if the valve was repaired. Beside it, whether an earlier row still holds it up.
    pub(crate) fn step(&mut self, one: &Prognosis, over: bool, repaired: bool) -> (Status, bool) {
        let now = status(one, over);
        if now >= self.status || repaired {
            *self = Self { status: now, calm: 0 };
        } else {
            self.calm += 1;
            if self.calm >= CALM_ROWS {
                *self = Self { status: now, calm: 0 };
            }
        }
        (self.status, self.status > now)
    }

    /// The status after a row that tells nothing at all: what was healthy is not known to be any more.
    pub(crate) fn untold(&mut self) -> Status {
        if self.status == Status::Healthy {
            *self = Self { status: Status::Unknown, calm: 0 };
        }
        self.status
    }
}

/// The rung that a row alone speaks for.
fn status(one: &Prognosis, over: bool) -> Status {
    if over {
        return Status::EolReached;
    }
    match one.fault {
        FaultCall::None => Status::Healthy,
        FaultCall::Undecided => Status::Unknown,
        _ if one.rul_p50 == Some(0.0) => Status::EolReached,
        _ => match one.replace_by_cycle {
            Some(by) if by <= one.cycle => Status::ActNow,
            Some(by) if by <= one.cycle + PLAN_CYCLES => Status::Plan,
            _ => Status::Watch,
        },
    }
}
