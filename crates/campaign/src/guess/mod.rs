//! What recordings show by themselves: which column is which, in which unit, and which way the valve moves.
//!
//! [`understand`] looks at recordings whose columns nobody has named yet and proposes a campaign. Each guess is said
//! with its reason; what the recordings cannot tell is an [`Unknown`] with the hint that would settle it. Nothing
//! here is used when a campaign is read: a campaign file states what was found out once.

mod agreement;
mod columns;
mod direction;
mod draft;
mod recording;
mod supply;

pub use draft::{DraftRun, draft};
pub use recording::Recording;

use column_source::{Heading, other_unit_at_end, without_unit};
use quantity::Unit;

/// What the user knows already.
#[derive(Debug, Clone, Default)]
pub struct Hints {
    /// The valve's stroke, m.
    pub stroke_m: Option<f64>,
    /// Where the piston rests at its closed and at its open stop, m from the closed one, where a model tells: stops give way.
    pub rests_m: Option<[f64; 2]>,
    /// Atmospheric pressure, Pa absolute.
    pub ambient_pressure_pa: f64,
    /// Columns that are named: channel and name, which may have a unit in brackets that the heading does not have.
    pub columns: Vec<(String, String)>,
    /// Units that are stated: channel and unit. One of no dimension means that a position's ends are the stops.
    pub units: Vec<(String, Unit)>,
    /// Channels that are not to be read although there are columns for them.
    pub left_out: Vec<String>,
    /// Noise of the position, one standard deviation, as a quantity, where it is stated.
    pub position_noise: Option<String>,
    /// Whether a command of 1 (or the higher level) tells the valve to close.
    pub one_closes: Option<bool>,
    /// Why that is known, where it is not the user's word.
    pub closes_because: Option<String>,
    /// Whether the position grows towards the open stop.
    pub grows_to_open: Option<bool>,
}

impl Hints {
    /// The same with the unit parted from a column's name, where the heading has none: `press [barg]`.
    fn parted(&self, first: &Recording) -> Self {
        let mut parted = self.clone();
        for (channel, name) in &mut parted.columns {
            let heading = Heading::new(name);
            if let (true, Some(unit)) = (first.columns_named(name).is_empty(), heading.unit.clone()) {
                parted.units.push((channel.clone(), unit));
                heading.bare().clone_into(name);
            } else if first.columns_named(name).is_empty()
                && let Some((bare, _)) = other_unit_at_end(name)
            {
                // Volts and percent say that the ends are the stops.
                parted.units.extend(Unit::parse("").ok().map(|unit| (channel.clone(), unit)));
                *name = bare.to_owned();
            }
        }
        parted
    }

    /// The unit that is stated of a channel.
    fn unit_of(&self, channel: &str) -> Option<&Unit> {
        self.units.iter().rev().find(|(other, _)| other == channel).map(|(_, unit)| unit)
    }
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
    /// What keeps them from being read as one campaign.
    pub conflicts: Vec<Conflict>,
    /// Channels that `[columns]` is to leave out.
    pub left_out: Vec<String>,
    /// Noise of the position as a quantity, where it is stated.
    pub position_noise: Option<String>,
}

/// The column of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnGuess {
    /// The channel, as in `[columns]`.
    pub channel: &'static str,
    /// Its index.
    pub index: usize,
    /// Its name in the first file.
    pub name: String,
    /// What `[columns]` calls it: its name, without its unit where recordings have it in different ones.
    pub call: String,
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

    /// Its name in the first file without the unit in it.
    #[must_use]
    pub fn bare_name(&self) -> &str {
        without_unit(&self.name)
    }
}

/// `command_from`.
#[derive(Debug, Clone, PartialEq)]
pub struct ThresholdGuess {
    /// The channel or the column's name.
    pub channel: String,
    /// The level: of a pressure as a share of the way from its lowest to its highest in a recording, else in the column's own
    /// numbers.
    pub threshold: f64,
    /// The width, likewise.
    pub hysteresis: f64,
    /// Where it is on its way down, likewise; nothing for a signal that jumps.
    pub release: Option<f64>,
    /// Whether it is a pressure.
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
    /// In which unit the pressure of a channel is.
    PressureUnit(&'static str),
    /// No column tells the command.
    Command,
    /// Whether 1 means close or open, and with it which way the position counts.
    Direction,
}

/// Why recordings cannot be read as one campaign.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Conflict {
    /// A recording lacks a column.
    #[error("{file} has no column \"{name}\"{suggestion} for the {channel}; its columns are {found}")]
    NoColumn {
        /// The channel.
        channel: String,
        /// The name that was looked for.
        name: String,
        /// " (did you mean ...?)", or empty.
        suggestion: String,
        /// The recording.
        file: String,
        /// The columns that it has.
        found: String,
    },
    /// A unit that the reader is told cannot be that of all recordings.
    #[error(
        "the {channel} is in {} in {} and in {} in {}, and one of them does not tell its unit to the end; expected \
         units such as psig, psia or mm in the headings, or a campaign file for each unit", units[0], files[0], units[1], files[1]
    )]
    Units {
        /// The channel.
        channel: String,
        /// Two recordings.
        files: [String; 2],
        /// What each says.
        units: [String; 2],
    },
}

/// Looks at recordings of one recorder.
#[must_use]
pub fn understand(recordings: &[Recording], hints: &Hints) -> Understanding {
    let mut found = Understanding {
        left_out: hints.left_out.clone(),
        position_noise: hints.position_noise.clone(),
        ..Understanding::default()
    };
    let Some(first) = recordings.first() else { return found };
    let hints = &hints.parted(first);
    // From here on all have the columns and the units of the first.
    let alike: Vec<_> = recordings.iter().map(|recording| recording.like(first, hints.ambient_pressure_pa)).collect();
    let alike: Vec<&Recording> = alike.iter().map(AsRef::as_ref).collect();
    columns::assign(&alike, hints, &mut found);
    if found.unknown.is_empty() {
        direction::settle(&alike, hints, &mut found);
    }
    found.supply = alike.iter().map(|recording| supply::find(recording, &found, hints)).collect();
    agreement::find(recordings, hints, &mut found);
    found
}

#[cfg(test)]
mod tests;
