//! How far a build has come.

use leak_table::Fault;

/// What the builder is doing for a fault, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Looking for the leak from which on the valve no longer gets there.
    Range,
    /// Looking for the leaks at which a limit is crossed.
    Limits,
    /// Placing points.
    Points,
}

impl Stage {
    /// What the builder is doing, in words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Range => "range",
            Self::Limits => "limits",
            Self::Points => "points",
        }
    }
}

/// One report: a batch of simulations of one fault is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// The fault.
    pub fault: Fault,
    /// What is being done for it.
    pub stage: Stage,
    /// Leak areas simulated for this fault so far.
    pub simulated_areas: usize,
    /// Share of this fault's work that is done, 0 to 1, never falling; an estimate, since how many
    /// points a curve needs is known only at its end.
    pub share: f64,
}
