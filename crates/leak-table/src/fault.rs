//! The two leaks, of which every bundle has a table.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::degradation::Degradation;

/// The two leaks, of which every bundle has a table. They are degradations like others; this is a
/// short name for them.
///
/// Where the pipe between solenoid and actuator leaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Fault {
    /// Gas escapes from the pipe to the atmosphere: the valve closes more
    /// slowly and opens faster.
    Atmosphere,
    /// Gas enters the pipe from the supply: the valve closes faster and opens
    /// more slowly.
    Supply,
}

impl Fault {
    /// The leak of the other kind.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Atmosphere => Self::Supply,
            Self::Supply => Self::Atmosphere,
        }
    }

    /// Both faults, in the order used throughout.
    pub const ALL: [Self; 2] = [Self::Atmosphere, Self::Supply];

    /// The name used in files and output.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Atmosphere => "atmosphere",
            Self::Supply => "supply",
        }
    }

    /// The leak as one of the list of degradations.
    #[must_use]
    pub fn degradation(self) -> &'static Degradation {
        &Degradation::catalogue()[self as usize]
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Fault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|fault| fault.name() == text)
            .ok_or_else(|| format!("found fault \"{text}\", expected \"atmosphere\" or \"supply\""))
    }
}
