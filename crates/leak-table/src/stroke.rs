//! The strokes of a cycle, and which way their times go.

use std::fmt;

use serde::{Deserialize, Serialize};

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
pub enum Monotone {
    /// The stroke takes longer.
    Rising,
    /// The stroke is faster.
    Falling,
}
