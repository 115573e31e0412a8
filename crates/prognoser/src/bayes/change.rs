//! When the assumption fails: has something changed, and what?
//!
//! After every cycle the residuals are watched. Once they look suspicious, the
//! last readings are fitted anew under other stories, and a story replaces the
//! present one if it makes those readings so much more probable that it
//! outweighs how rarely such a thing happens.

use super::hypotheses::{Hypotheses, LastView};

/// Weight of the newest residual in the running mean.
const NEWEST: f64 = 0.25;
/// Running mean of standardised residuals that is suspicious: 4.2 standard
/// deviations, sqrt(w / (2 - w)) each.
const SUSPICIOUS_MEAN: f64 = 1.6;
/// Residuals count up to this many standard deviations.
const CLIP: f64 = 4.0;
/// Cycles in a row with a reading taken for a glitch that are suspicious.
const MISFITS: u32 = 3;
/// Logarithm of how rarely something changes. It also covers what the
/// bounds of the evidence are too wide by.
pub(crate) const LN_RARE: f64 = 15.0;

/// What has changed, as far as the readings tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The valve is healthy again: it was repaired or replaced.
    Repaired,
    /// The leak stepped to another value or grows at another pace.
    Broken,
    /// The leak does not grow by the same amount but by the same factor every
    /// cycle.
    Exponential,
    /// Nothing but the estimate, which had taken readings for glitches or
    /// glitches for readings.
    Reread,
}

/// Cycles without suspicion after which attempts in vain are forgotten.
const CALM: u32 = 50;
/// Longest pause between attempts, in cycles.
const LONGEST_PAUSE: u32 = 256;

/// A pause that doubles with every attempt in vain.
#[derive(Clone, Copy, Debug, Default)]
struct Pause {
    left: u32,
    length: u32,
}

impl Pause {
    /// Whether it is time for an attempt, which is taken to be in vain.
    fn over(&mut self, shortest: u32) -> bool {
        if self.left > 0 {
            return false;
        }
        self.length = (2 * self.length).clamp(shortest, LONGEST_PAUSE);
        self.left = self.length;
        true
    }
}

/// Watches residuals and says when to look closer.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Watch {
    mean: [f64; 2],
    misfits: u32,
    calm: u32,
    change: Pause,
    law: Pause,
}

/// What to look for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Suspicion {
    /// Something has changed.
    pub change: bool,
    /// The law of growth is another one. Looked for less often: it takes many
    /// fits.
    pub law: bool,
}

impl Watch {
    /// Takes in the residuals of a cycle.
    pub(crate) fn look(&mut self, all: &Hypotheses) -> Suspicion {
        let LastView { inlier, surprise, .. } = all.view_of_last();
        let mut drifting = false;
        for (mean, z) in self.mean.iter_mut().zip(surprise) {
            if let Some(z) = z {
                *mean += NEWEST * (z.clamp(-CLIP, CLIP) - *mean);
            }
            drifting |= mean.abs() > SUSPICIOUS_MEAN;
        }
        self.misfits = if inlier.iter().any(|p| *p < 0.5) { self.misfits + 1 } else { 0 };
        self.change.left = self.change.left.saturating_sub(1);
        self.law.left = self.law.left.saturating_sub(1);
        if !drifting && self.misfits < MISFITS {
            self.calm += 1;
            if self.calm > CALM {
                (self.change, self.law) = (Pause::default(), Pause::default());
            }
            return Suspicion { change: false, law: false };
        }
        self.calm = 0;
        // A run of misfits is looked at in any case, once.
        let fresh = self.misfits == MISFITS;
        Suspicion { change: self.change.over(2) || fresh, law: self.law.over(8) }
    }

    /// Starts over.
    pub(crate) fn reset(&mut self) {
        *self = Self::default();
    }
}
