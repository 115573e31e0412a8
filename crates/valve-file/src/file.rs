//! The checked valve file.

use checked_toml::Document;
use valve_model::{Limits, ParameterId, Schedule, Valve};

use crate::{Change, HistoryEntry};

/// How well a parameter is known beforehand; such a parameter may be calibrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// The parameter.
    pub parameter: ParameterId,
    /// One standard deviation as a fraction of the value, more than 0 and at most 1.
    /// It refers to the SI value, for the supply pressure to the absolute one.
    pub relative_sigma: f64,
}

/// A valve file that passed every check.
#[derive(Debug, Clone)]
pub struct ValveFile {
    pub(crate) document: Document,
    pub(crate) name: String,
    pub(crate) valve: Valve,
    pub(crate) schedule: Schedule,
    pub(crate) limits: Limits,
    pub(crate) tolerances: Vec<Tolerance>,
    pub(crate) history: Vec<HistoryEntry>,
    /// Edits made since the last history entry.
    pub(crate) pending: Vec<Change>,
}

impl ValveFile {
    /// The whole text, as it would be written.
    #[must_use]
    pub fn text(&self) -> &str {
        self.document.text()
    }

    /// What messages call the file.
    #[must_use]
    pub fn file_name(&self) -> &str {
        self.document.file()
    }

    /// The valve's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The valve: parameters, switches and effects, checked.
    #[must_use]
    pub fn valve(&self) -> &Valve {
        &self.valve
    }

    /// When the commands of a cycle are given.
    #[must_use]
    pub fn schedule(&self) -> Schedule {
        self.schedule
    }

    /// The longest acceptable stroke times.
    #[must_use]
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// The parameters that may be calibrated, in the order of the file.
    #[must_use]
    pub fn tolerances(&self) -> &[Tolerance] {
        &self.tolerances
    }

    /// The steps that changed the model, oldest first.
    #[must_use]
    pub fn history(&self) -> &[HistoryEntry] {
        &self.history
    }
}

impl std::fmt::Display for ValveFile {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.text())
    }
}
