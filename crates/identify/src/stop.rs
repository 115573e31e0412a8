//! A wish to stop, shared between threads.

use std::sync::atomic::{AtomicBool, Ordering};

/// Set from outside to end a fit or a search early; what is known by then is returned.
#[derive(Debug, Default)]
pub struct Stop(AtomicBool);

impl Stop {
    /// Nobody has asked yet.
    pub const fn new() -> Self {
        Self(AtomicBool::new(false))
    }

    /// One that nobody ever sets.
    pub fn never() -> &'static Self {
        static NEVER: Stop = Stop::new();
        &NEVER
    }

    /// Asks to stop.
    pub fn ask(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether somebody asked.
    pub fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
