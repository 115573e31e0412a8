//! What a search goes through: a problem for every set of candidates.

use crate::fit::{Fit, FitOptions};
use crate::held_out::HeldOut;
use crate::problem::Problem;
use crate::stop::Stop;

/// A set of candidates by index, rising.
pub type Set = Vec<usize>;

/// How exactly a set is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// A few of the records, cheaply: for a first look at many sets.
    Screen,
    /// Cheaply, for the way.
    Low,
    /// As it is reported.
    High,
}

/// A set that was fitted.
#[derive(Debug, Clone)]
pub struct Model<P> {
    /// The set.
    pub set: Set,
    /// How exactly.
    pub level: Level,
    /// Its problem.
    pub problem: P,
    /// Its fit.
    pub fit: Fit,
    /// What it predicts of records that were held out; nothing where it was fitted cheaply, or to a single record.
    pub held_out: Option<HeldOut>,
}

/// A family of problems: one for every set of candidates.
pub trait Family: Sync {
    /// A problem of the family.
    type Member: Problem + Send;

    /// How many candidates there are.
    fn candidates(&self) -> usize;

    /// The problem of a set; nothing where its effects exclude one another.
    fn member(&self, set: &[usize], level: Level) -> Option<Self::Member>;

    /// The same problem, predicted more exactly than is usual for what decides; nothing where it is as exact as it can be.
    fn finer(&self, _member: &Self::Member) -> Option<Self::Member> {
        None
    }

    /// A point of a problem at one level as one of the same set at another; coordinates that only the other has are
    /// at their prior means.
    fn carried(&self, from: &Self::Member, u: &[f64], to: &Self::Member) -> Vec<f64>;

    /// Where fits of a set start that know nothing; the best of them is taken.
    fn cold(&self, member: &Self::Member) -> Vec<Vec<f64>>;

    /// Where fits of a set start from the optimum of another; the best of them is taken.
    fn warm(&self, member: &Self::Member, from: &Self::Member, u: &[f64]) -> Vec<Vec<f64>>;

    /// For each coordinate of a problem, which coordinate of another one of the same level, or of a wider one, it is. Of
    /// those that are new, the first is the size of an effect that is off at zero.
    fn shared(&self, from: &Self::Member, to: &Self::Member) -> Vec<Option<usize>>;

    /// Whether a set that was fitted to the end leaves as little as was asked for: no more is looked for then.
    fn is_enough(&self, _model: &Model<Self::Member>) -> bool {
        false
    }

    /// What is known of the errors, and how a fit goes on.
    fn options(&self) -> FitOptions;

    /// Called as a set has been fitted.
    fn tell(&self, _news: News<'_>) {}

    /// Whether somebody asked to stop.
    fn stop(&self) -> &Stop {
        Stop::never()
    }
}

/// What a search tells.
#[derive(Debug, Clone, Copy)]
pub enum News<'a> {
    /// A set has been fitted; how many of how many in this round.
    Fitted {
        /// The set.
        set: &'a [usize],
        /// Its logarithm of the evidence, nats.
        log_evidence: f64,
        /// Root mean square of what it leaves, in units of the noise as the fit found it.
        rms: f64,
        /// Sets in this round.
        of: usize,
    },
    /// The search goes on from a set.
    Reached {
        /// The set.
        set: &'a [usize],
        /// Its gain of evidence over the empty set, nats.
        gain: f64,
    },
}
