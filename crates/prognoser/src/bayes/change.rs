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

/// Watches residuals and counts down between attempts.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Watch {
    mean: [f64; 2],
    misfits: u32,
    pause: u32,
    wait: u32,
}

impl Watch {
    /// Takes in the residuals of a cycle and says whether to look closer.
    pub(crate) fn look(&mut self, all: &Hypotheses) -> bool {
        let LastView { inlier, surprise, .. } = all.view_of_last();
        let mut drifting = false;
        for (mean, z) in self.mean.iter_mut().zip(surprise) {
            if let Some(z) = z {
                *mean += NEWEST * (z.clamp(-CLIP, CLIP) - *mean);
            }
            drifting |= mean.abs() > SUSPICIOUS_MEAN;
        }
        if inlier.iter().any(|p| *p < 0.5) {
            self.misfits += 1;
        } else {
            self.misfits = 0;
        }
        let suspicious = drifting || self.misfits >= 3;
        if !suspicious {
            (self.pause, self.wait) = (0, 0);
            return false;
        }
        if self.pause > 0 {
            self.pause -= 1;
            return false;
        }
        true
    }

    /// Nothing was found: wait longer before looking again.
    pub(crate) fn in_vain(&mut self) {
        self.wait = (2 * self.wait).clamp(2, 1024);
        self.pause = self.wait;
    }

    /// Starts over.
    pub(crate) fn reset(&mut self) {
        *self = Self::default();
    }
}
