//! What recordings show by themselves: which column is which, in which unit, and which way the valve moves.
//!
//! [`understand`] looks at recordings whose columns nobody has named yet and proposes a campaign. Each guess is said
//! with its reason; what the recordings cannot tell is an [`Unknown`] with the hint that would settle it. Nothing
//! here is used when a campaign is read: a campaign file states what was found out once.

mod columns;
mod direction;
mod draft;
mod levels;
mod recording;
mod supply;
mod words;

pub use draft::{DraftRun, draft};
pub use recording::Recording;

/// What the user knows already.
#[derive(Debug, Clone, Default)]
pub struct Hints {
    /// The valve's stroke, m.
    pub stroke_m: Option<f64>,
    /// Atmospheric pressure, Pa absolute.
    pub ambient_pressure_pa: f64,
    /// Columns that are named: channel and name.
    pub columns: Vec<(String, String)>,
    /// Whether a command of 1 (or the higher level) tells the valve to close.
    pub one_closes: Option<bool>,
    /// Whether the position grows towards the open stop.
    pub grows_to_open: Option<bool>,
}

/// What recordings hold, as far as they tell.
#[derive(Debug, Clone, Default)]
pub struct Understanding {
    /// The columns that are used.
    pub columns: Vec<ColumnGuess>,
    /// How the command is told, where no column holds 0 and 1.
    pub threshold: Option<ThresholdGuess>,
    /// The supply pressure of each recording, where it shows.
    pub supply: Vec<Option<SupplyGuess>>,
    /// Every guess in words, with its reason.
    pub said: Vec<String>,
    /// What the recordings cannot tell.
    pub unknown: Vec<Unknown>,
}

/// The column of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnGuess {
    /// The channel, as in `[columns]`.
    pub channel: &'static str,
    /// Its index.
    pub index: usize,
    /// Its name in the file.
    pub name: String,
    /// Its unit, where `[columns]` has to say it.
    pub unit: Option<String>,
    /// What its numbers are multiplied with, 1 for nothing.
    pub scale: f64,
    /// What is added, SI.
    pub offset: f64,
    /// SI for one of its numbers, scale and offset not counted.
    pub factor: f64,
}

impl ColumnGuess {
    /// Whether `[columns]` has nothing to say: the reader finds the column by itself.
    #[must_use]
    pub fn is_plain(&self, found_by_itself: bool) -> bool {
        found_by_itself && self.unit.is_none() && self.scale == 1.0 && self.offset == 0.0
    }
}

/// `command_from`.
#[derive(Debug, Clone, PartialEq)]
pub struct ThresholdGuess {
    /// The channel or the column's name.
    pub channel: String,
    /// The level, in the column's own numbers or Pa.
    pub threshold: f64,
    /// The width, likewise.
    pub hysteresis: f64,
    /// Whether both are pressures in Pa.
    pub is_pressure: bool,
    /// Whether the valve is told to close above it.
    pub above_closes: bool,
}

/// A supply pressure that a recording shows.
#[derive(Debug, Clone, PartialEq)]
pub struct SupplyGuess {
    /// As a quantity, such as "75 psig".
    pub text: String,
    /// Where it stands.
    pub from: &'static str,
}

/// What cannot be known from the recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unknown {
    /// No column is the time.
    Time,
    /// No column, or more than one, may be the position.
    Position,
    /// In which unit the position is.
    PositionUnit,
    /// No column tells the command.
    Command,
    /// Whether 1 means close or open, and with it which way the position counts.
    Direction,
}

/// Looks at recordings of one recorder.
#[must_use]
pub fn understand(recordings: &[Recording], hints: &Hints) -> Understanding {
    let mut found = Understanding::default();
    let Some(first) = recordings.first() else { return found };
    columns::assign(recordings, hints, &mut found);
    if found.unknown.is_empty() {
        direction::settle(recordings, hints, &mut found);
    }
    found.supply = recordings.iter().map(|recording| supply::find(recording, &found, hints)).collect();
    for recording in recordings {
        let names = |recording: &Recording| recording.names.clone();
        if names(recording) != names(first) {
            let file = &recording.file;
            found
                .said
                .push(format!("{file} has other columns than {}; they are looked for by the same names", first.file));
        }
    }
    found
}

#[cfg(test)]
mod tests;
