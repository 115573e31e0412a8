//! What a column of a timing log tells, and by which names it goes.

use std::fmt;
use std::str::FromStr;

use column_source::unit_at_end;
use quantity::{Dimension, Unit};

/// What a column of a timing log tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// The valve's name.
    Valve,
    /// The number of the cycle.
    Cycle,
    /// The closing time.
    CloseTime,
    /// The opening time.
    OpenTime,
    /// When the cycle was.
    Time,
    /// The supply pressure during the cycle.
    SupplyPressure,
    /// The temperature during the cycle.
    Temperature,
}

impl Channel {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Valve,
        Self::Cycle,
        Self::CloseTime,
        Self::OpenTime,
        Self::Time,
        Self::SupplyPressure,
        Self::Temperature,
    ];

    /// Its name in a plain timing log, without the unit.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.words()[0]
    }

    /// What its numbers measure, where they have a unit.
    #[must_use]
    pub fn dimension(self) -> Option<Dimension> {
        match self {
            Self::Valve | Self::Cycle | Self::Time => None,
            Self::CloseTime | Self::OpenTime => Some(Dimension::Time),
            Self::SupplyPressure => Some(Dimension::Pressure),
            Self::Temperature => Some(Dimension::Temperature),
        }
    }

    /// The name that the column would have in a plain timing log, as an example.
    pub(crate) fn example(self) -> &'static str {
        match self {
            Self::CloseTime => "close_time_ms",
            Self::OpenTime => "open_time_ms",
            Self::SupplyPressure => "supply_pressure_barg",
            Self::Temperature => "temperature_degc",
            Self::Valve | Self::Cycle | Self::Time => self.name(),
        }
    }

    /// The names by which it is known, in English, German and French: small letters, words joined by underscores,
    /// umlauts and accents written out.
    pub(crate) fn words(self) -> &'static [&'static str] {
        match self {
            Self::Valve => {
                &["valve", "valve_id", "valve_name", "tag", "tag_name", "asset", "ventil", "armatur", "vanne"]
            }
            Self::Cycle => &[
                "cycle",
                "cycles",
                "cycle_number",
                "cycle_no",
                "cycle_count",
                "no",
                "nr",
                "lfd_nr",
                "stroke_number",
                "zyklus",
                "zyklen",
                "zyklus_nr",
                "schaltspiel",
                "schaltspiele",
                "hubzahl",
                "hub_nr",
            ],
            Self::CloseTime => &[
                "close_time",
                "closing_time",
                "close",
                "closing",
                "time_to_close",
                "t_close",
                "stroke_time_close",
                "schliesszeit",
                "schliessen",
                "laufzeit_zu",
                "zeit_zu",
                "temps_fermeture",
                "temps_de_fermeture",
                "fermeture",
            ],
            Self::OpenTime => &[
                "open_time",
                "opening_time",
                "open",
                "opening",
                "time_to_open",
                "t_open",
                "stroke_time_open",
                "oeffnungszeit",
                "oeffnen",
                "laufzeit_auf",
                "zeit_auf",
                "temps_ouverture",
                "temps_d_ouverture",
                "ouverture",
            ],
            Self::Time => &[
                "time",
                "utc",
                "time_utc",
                "timestamp",
                "date",
                "datetime",
                "date_time",
                "datum",
                "zeit",
                "zeitstempel",
                "zeitpunkt",
                "horodatage",
            ],
            Self::SupplyPressure => &[
                "supply_pressure",
                "supply",
                "air_pressure",
                "instrument_air",
                "versorgungsdruck",
                "zuluft",
                "zuluftdruck",
                "netzdruck",
                "steuerluft",
                "alimentation",
                "pression_alimentation",
            ],
            Self::Temperature => &["temperature", "temp", "ambient_temperature", "temperatur", "umgebungstemperatur"],
        }
    }
}

/// A column that the user has named: `close_time_ms=Laufzeit ZU` takes the column "Laufzeit ZU" for a closing time in ms.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedColumn {
    /// What it tells.
    pub channel: Channel,
    /// Its unit, where that was said.
    pub unit: Option<Unit>,
    /// Its name in the file.
    pub name: String,
}

impl fmt::Display for NamedColumn {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.channel.name())?;
        if let Some(unit) = &self.unit {
            write!(formatter, "_{}", unit.text())?;
        }
        write!(formatter, "={}", self.name)
    }
}

impl FromStr for NamedColumn {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let example = "such as close_time_ms=\"Laufzeit ZU\"";
        let (plain, name) =
            text.split_once('=').ok_or_else(|| format!("a column and its name are needed, {example}"))?;
        let (plain, name) = (plain.trim().to_lowercase(), name.trim());
        if name.is_empty() {
            return Err(format!("no name behind the equals sign, expected one, {example}"));
        }
        for channel in Channel::ALL {
            let Some(rest) = plain.strip_prefix(channel.name()) else { continue };
            if rest.is_empty() {
                return Ok(Self { channel, unit: None, name: name.to_owned() });
            }
            if let Some(dimension) = channel.dimension()
                && rest.rfind('_') == Some(0)
            {
                let unit = unit_at_end(&plain, dimension).ok_or_else(|| {
                    format!("{:?} is no unit of {}; expected {}", &rest[1..], channel.name(), dimension.expectation())
                })?;
                return Ok(Self { channel, unit: Some(unit), name: name.to_owned() });
            }
        }
        let known: Vec<&str> = Channel::ALL.into_iter().map(Channel::example).collect();
        Err(format!("found {plain:?}, expected one of {}, {example}", known.join(", ")))
    }
}
