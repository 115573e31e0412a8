//! What is named as the fault of a valve.

use leak_table::{Degradation, DegradationId, Fault};
use serde::{Serialize, Serializer};

/// The fault named for a valve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultCall {
    /// Something that the tables have wears.
    Wears(DegradationId),
    /// Leaks of both kinds at once.
    BothLeaks,
    /// Times drift as no table has it.
    Other,
    /// The valve does not degrade.
    None,
    /// The data do not decide.
    Undecided,
}

impl FaultCall {
    /// All that can be named with the catalogue's tables: kinds of wear in their order, then what no table has.
    pub fn catalogue() -> impl Iterator<Item = Self> {
        let wears = Degradation::catalogue().iter().map(|degradation| Self::Wears(degradation.id));
        wears.chain([Self::BothLeaks, Self::Other])
    }

    /// The name used in output.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Wears(id) => id.name(),
            Self::BothLeaks => "both-leaks",
            Self::Other => "other",
            Self::None => "none",
            Self::Undecided => "undecided",
        }
    }

    /// The fault of a name that [`name`](Self::name) gave.
    pub(crate) fn read(name: &str) -> Self {
        let others = [Self::BothLeaks, Self::Other, Self::None, Self::Undecided];
        others.into_iter().find(|fault| fault.name() == name).unwrap_or_else(|| Self::Wears(DegradationId::read(name)))
    }

    /// Whether something is named that wears.
    pub const fn wears(self) -> bool {
        !matches!(self, Self::None | Self::Undecided)
    }

    /// The kind of leak, if a single one is named.
    pub fn fault(self) -> Option<Fault> {
        Fault::ALL.into_iter().find(|fault| self == (*fault).into())
    }
}

impl From<Fault> for FaultCall {
    fn from(fault: Fault) -> Self {
        Self::Wears(fault.degradation().id)
    }
}

impl Serialize for FaultCall {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}
