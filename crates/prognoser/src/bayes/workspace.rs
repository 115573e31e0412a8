//! Memory that an update works in.

use super::assimilate::Meeting;
use super::ending::{Block, Line};
use super::hypothesis::Hypothesis;
use super::rate_prior::Corrected;

/// What an update fills and no longer needs when it is done. It is kept for the next one, of whichever
/// valve: fresh memory took a fifteenth of the time of a row.
#[derive(Default)]
pub(crate) struct Workspace {
    /// The hypotheses.
    pub hypotheses: Vec<Hypothesis>,
    /// What becomes of them in the course of a cycle.
    pub turning: Turning,
    /// How they meet a reading.
    pub meeting: Meeting,
    /// The weight of each, its prior put in place.
    pub weights: Vec<f64>,
    /// The growth of each, likewise, where it was looked at.
    pub paces: Vec<Option<Corrected>>,
    /// Ways to come to an end.
    pub lines: Vec<Line>,
    /// The same side by side.
    pub blocks: Vec<Block>,
}

/// Hypotheses that turn into each other.
#[derive(Default)]
pub(crate) struct Turning {
    /// The hypotheses after it.
    pub made: Vec<Hypothesis>,
    /// Where those stand that may lead to one kind of wear, and whether they are likely.
    pub sources: Vec<(usize, bool)>,
}
