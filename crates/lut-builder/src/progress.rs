//! How far a build has come.

/// What the builder is doing for a degradation, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Looking for the severity from which on the valve no longer gets there.
    Range,
    /// Looking for the severities at which a limit is crossed.
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

/// One report: a batch of simulations of one degradation is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Which degradation: its place among those that are built, from 0.
    pub place: usize,
    /// What is being done for it.
    pub stage: Stage,
    /// Severities simulated for it so far.
    pub simulated: usize,
    /// Share of its work that is done, 0 to 1, never falling; an estimate, since how many
    /// points a curve needs is known only at its end.
    pub share: f64,
}
