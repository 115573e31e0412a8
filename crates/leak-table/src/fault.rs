//! The names of what is tabulated: faults, strokes, directions.

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

/// One of the two strokes of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stroke {
    /// From the close command to the closed position.
    Close,
    /// From the open command to the open position.
    Open,
}

impl Stroke {
    /// Both strokes, in the order of a cycle.
    pub const ALL: [Self; 2] = [Self::Close, Self::Open];

    /// The column of a table or a timing log that holds this stroke's time.
    #[must_use]
    pub const fn column(self) -> &'static str {
        match self {
            Self::Close => "close_time_s",
            Self::Open => "open_time_s",
        }
    }
}

impl fmt::Display for Stroke {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Close => "closing",
            Self::Open => "opening",
        })
    }
}

/// Which way a time goes as the severity grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// The stroke takes longer.
    Rising,
    /// The stroke is faster.
    Falling,
}
