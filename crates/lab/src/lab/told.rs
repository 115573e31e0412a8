//! What the pages of a lab are told without asking.

use serde::Serialize;

use super::jobs::Status;

/// An event.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Told {
    /// The first thing that a page hears.
    Hello {
        /// Which start of the program this is.
        started_ms: u64,
        /// How often the files were read.
        version: u64,
        /// Why the files as they are now cannot be used.
        trouble: Option<String>,
        /// What runs.
        job: Status,
    },
    /// The files were read anew.
    Changed {
        /// How often they were read.
        version: u64,
    },
    /// The files as they are now cannot be used.
    Trouble {
        /// Why.
        message: String,
    },
    /// A job has begun.
    Started {
        /// Its number.
        job: u64,
        /// Its name.
        kind: &'static str,
    },
    /// A job is over.
    Finished {
        /// Its number.
        job: u64,
        /// Its name.
        kind: &'static str,
    },
    /// A search has fitted a set of effects.
    Tried {
        /// The effects.
        effects: Vec<&'static str>,
        /// Its evidence against the model without any, nats.
        log_evidence: f64,
        /// What is left, in units of the noise.
        error: f64,
        /// How many sets are being fitted.
        of: usize,
    },
    /// A search goes on from a set of effects.
    Reached {
        /// The effects.
        effects: Vec<&'static str>,
        /// What the step has gained, nats.
        gain: f64,
    },
    /// A search does something else.
    Doing {
        /// In words.
        what: &'static str,
    },
}
