//! Which physical effect is missing.

pub mod candidate;
pub mod held_out;
pub mod lack;
pub mod search;

use std::sync::atomic::{AtomicBool, Ordering};

use valve_model::EffectKind;

/// What a search tells while it runs.
#[derive(Debug, Clone, PartialEq)]
pub enum Progress {
    /// The base model is calibrated.
    Calibrated {
        /// Root mean square of its residuals in units of the noise.
        normalised_rms: f64,
    },
    /// A candidate was fitted.
    Tried {
        /// How many effects it has.
        depth: usize,
        /// How many candidates there are at this depth.
        total: usize,
        /// The effect added.
        kind: EffectKind,
        /// The cost reached.
        cost: f64,
    },
    /// A set of effects was accepted.
    Accepted {
        /// The effects.
        kinds: Vec<EffectKind>,
        /// The lack of fit that remains.
        lack: f64,
    },
    /// Something else is being done.
    Doing(&'static str),
}

/// Where progress goes, and whether to stop.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Called with every piece of progress, from any thread.
    pub report: &'a (dyn Fn(Progress) + Sync),
    /// Set from outside to stop early; what is known by then is returned.
    pub stop: &'a AtomicBool,
}

impl Watch<'_> {
    fn tell(&self, progress: Progress) {
        (self.report)(progress);
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
