//! Which column holds which channel, and how its numbers become SI.

use checked_toml::{QuantityKind, Section, TomlFileError};
use column_source::{ColumnSource, Heading, did_you_mean, named, unit_at_end};
use quantity::{Dimension, Reference, Unit, suggest};

use crate::error::{DataError, DataProblem};
use crate::warning::Doubt;

/// What `[columns]` says of a channel that is not to be read although a recording has it.
pub(crate) const LEFT_OUT: &str = "none";
/// Channels without which nothing can be read.
const NEEDED: [&str; 4] = ["time", "position", "close_time", "open_time"];

/// A channel's name and what it measures.
pub(crate) type Channel = (&'static str, Dimension);

/// The channels of a trace.
pub(crate) const CHANNELS: [Channel; 6] = [
    ("time", Dimension::Time),
    ("command", Dimension::Pure),
    ("position", Dimension::Length),
    ("chamber_pressure", Dimension::Pressure),
    ("pipe_pressure", Dimension::Pressure),
    ("supply_pressure", Dimension::Pressure),
];

/// The columns of stroke times.
pub(crate) const TIMING_CHANNELS: [Channel; 6] = [
    ("close_time", Dimension::Time),
    ("open_time", Dimension::Time),
    ("supply_pressure", Dimension::Pressure),
    ("temperature", Dimension::Temperature),
    ("leak_to_atmosphere", Dimension::Area),
    ("leak_from_supply", Dimension::Area),
];

/// What `[columns]` says of one channel.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mapping {
    pub channel: String,
    name: Option<String>,
    unit: Option<Unit>,
    scale: Option<f64>,
    offset: Option<f64>,
    pub left_out: bool,
}

impl Mapping {
    /// A column that is read as it stands.
    pub fn raw(name: &str) -> Self {
        Self { name: Some(name.to_owned()), ..Self::default() }
    }

    /// The name that is given.
    pub fn named(&self) -> Option<&str> {
        self.name.as_deref()
    }
}

/// A column of one file: its index, and `si = number * factor + offset`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Column {
    pub index: usize,
    factor: f64,
    offset: f64,
}

impl Column {
    pub fn to_si(self, number: f64) -> f64 {
        number * self.factor + self.offset
    }
}

/// Reads the table `columns` of `parent`.
pub(crate) fn read_mappings(parent: &Section<'_>, channels: &[Channel]) -> Result<Vec<Mapping>, TomlFileError> {
    let Some(columns) = parent.section("columns")? else { return Ok(Vec::new()) };
    columns.allow_only(&channels.iter().map(|(name, _)| *name).collect::<Vec<_>>())?;
    let mut mappings = Vec::new();
    for &(channel, dimension) in channels {
        if !columns.has(channel) {
            continue;
        }
        let mut mapping = Mapping { channel: channel.to_owned(), ..Mapping::default() };
        let expected = "the column's name, or { name, unit, scale, offset }";
        if columns.value_span(channel).is_some()
            && let Ok(Some(name)) = columns.text(channel, expected)
        {
            mapping.left_out = name == LEFT_OUT;
            mapping.name = Some(name.to_owned());
            if mapping.left_out && NEEDED.contains(&channel) {
                let found = format!("\"{LEFT_OUT}\", which leaves the channel out");
                return Err(columns.wrong(channel, found, format!("a column: nothing is read without the {channel}")));
            }
        } else if let Some(table) = columns.section(channel)? {
            table.allow_only(&["name", "unit", "scale", "offset"])?;
            mapping.name = table.text("name", "the column's name")?.map(str::to_owned);
            if let Some(text) = table.text("unit", "a unit")? {
                mapping.unit = Some(unit(&table, text, dimension)?);
            }
            mapping.scale = table.number("scale", "a number that multiplies the column, such as -1.0")?;
            if mapping.scale.is_some_and(|scale| scale == 0.0 || !scale.is_finite()) {
                return Err(table.wrong("scale", "no usable number", "a number other than 0"));
            }
            let kind = match dimension {
                Dimension::Pressure => QuantityKind::PressureDifference,
                Dimension::Temperature => QuantityKind::TemperatureDifference,
                _ => QuantityKind::Si(dimension.si_unit()),
            };
            mapping.offset = table.quantity("offset", kind)?;
        }
        mappings.push(mapping);
    }
    Ok(mappings)
}

fn unit(table: &Section<'_>, text: &str, dimension: Dimension) -> Result<Unit, TomlFileError> {
    let hint = suggest::did_you_mean(text, dimension.units().iter().copied());
    match Unit::parse(text) {
        Ok(unit) if unit.measures(dimension) && unit.reference() != Reference::Ambiguous => Ok(unit),
        Ok(unit) if unit.measures(dimension) => Err(table.wrong(
            "unit",
            format!("\"{text}\""),
            format!("{text}g (gauge, above the atmosphere) or {text}a (absolute)"),
        )),
        _ if dimension == Dimension::Length && matches!(text, "%" | "percent" | "pct") => Err(table.wrong(
            "unit",
            format!("\"{text}\""),
            "unit = \"mm\" with the length of one percent of the stroke in mm as its scale",
        )),
        _ => Err(table.wrong("unit", format!("\"{text}\"{hint}"), dimension.expectation())),
    }
}

/// Whether a heading is a channel's own name, with its unit behind it: "position_mm", "Chamber pressure (kPa)".
fn is_channel(heading: &Heading, channel: &str, dimension: Dimension) -> bool {
    let name = heading.bare().to_ascii_lowercase().replace(' ', "_");
    if name == channel {
        return dimension == Dimension::Pure || heading.unit.is_some();
    }
    dimension != Dimension::Pure
        && name.strip_prefix(channel).is_some_and(|rest| rest.rfind('_') == Some(0))
        && unit_at_end(&name, dimension).is_some()
}

/// Finds a channel's column; `None` where the file has none.
pub(crate) fn find(
    source: &dyn ColumnSource,
    (channel, dimension): Channel,
    mapping: Option<&Mapping>,
    ambient_pressure_pa: f64,
) -> Result<Option<Column>, DataError> {
    let empty = Mapping::default();
    let mapping = mapping.unwrap_or(&empty);
    if mapping.left_out {
        return Ok(None);
    }
    let headings = source.headings();
    let found: Vec<usize> = match &mapping.name {
        None => (0..headings.len()).filter(|index| is_channel(&headings[*index], channel, dimension)).collect(),
        Some(name) => {
            let all: Vec<_> = headings.iter().map(|it| (it.name.as_str(), it.bare())).collect();
            named(&all, source.within_table(name))
        }
    };
    let error = |problem| DataError::new(source.file(), source.header_line(), problem);
    let index = match (found[..].first(), found.get(1)) {
        (Some(index), None) => *index,
        (Some(first), Some(second)) => {
            let (first, second) = (headings[*first].name.clone(), headings[*second].name.clone());
            return Err(error(DataProblem::TwoColumns { channel: channel.to_owned(), first, second }));
        }
        (None, _) => {
            let Some(name) = &mapping.name else { return Ok(None) };
            return Err(missing(source, name, "the name given in [columns]"));
        }
    };
    let heading = &headings[index];
    let own = heading.unit.clone().filter(|_| dimension != Dimension::Pure);
    let own = own.or_else(|| unit_at_end(heading.bare(), dimension));
    let is_stated = mapping.unit.is_some() || mapping.scale.is_some();
    if own.is_none()
        && !is_stated
        && dimension != Dimension::Pure
        && let Some(unit) = heading.other_unit()
    {
        let (column, unit) = (heading.name.clone(), unit.to_owned());
        let (expected, usual) = (dimension.expectation(), usual_unit(dimension));
        return Err(error(DataProblem::OtherUnit { column, unit, channel: channel.to_owned(), expected, usual }));
    }
    // A channel that is named without any unit is in that of the usual column (position_mm and so on).
    let usual = || Unit::parse(usual_unit(dimension)).ok();
    let Some(unit) = mapping.unit.clone().or(own).or_else(usual) else { return Ok(None) };
    let (column, written) = (heading.name.clone(), unit.text().to_owned());
    if !unit.measures(dimension) {
        return Err(error(DataProblem::WrongUnit { column, unit: written, expected: dimension.expectation() }));
    }
    if unit.reference() == Reference::Ambiguous {
        return Err(error(DataProblem::AmbiguousUnit { column, unit: written, channel: channel.to_owned() }));
    }
    let gauge = unit.reference() == Reference::Gauge;
    let scale = mapping.scale.unwrap_or(1.0);
    let zero = unit.to_si(0.0) + if gauge { ambient_pressure_pa } else { 0.0 };
    let offset = zero + mapping.offset.unwrap_or(0.0);
    Ok(Some(Column { index, factor: scale * unit.difference_to_si(1.0), offset }))
}

/// How many of these channels a table has.
pub(crate) fn count(source: &dyn ColumnSource, channels: &[Channel], mappings: &[Mapping]) -> usize {
    let has = |channel: &&Channel| {
        let mapping = mappings.iter().find(|mapping| mapping.channel == channel.0);
        matches!(find(source, **channel, mapping, 0.0), Ok(Some(_)))
    };
    channels.iter().filter(has).count()
}

fn usual_unit(dimension: Dimension) -> &'static str {
    match dimension {
        Dimension::Length => "mm",
        Dimension::Pressure => "kPa",
        other => other.si_unit(),
    }
}

/// The refusal of a file that lacks a column.
pub(crate) fn missing(source: &dyn ColumnSource, column: &str, expected: &str) -> DataError {
    let hint = did_you_mean(source.headings().iter().map(|heading| (heading.name.as_str(), heading.bare())), column);
    let problem = DataProblem::MissingColumn {
        column: format!("\"{column}\"{hint}"),
        expected: expected.to_owned(),
        found: source.listed(),
    };
    DataError::new(source.file(), source.header_line(), problem)
}

/// Columns that are not read but look like one of these.
pub(crate) fn look_alikes(source: &dyn ColumnSource, read: &[usize], known: &[&str]) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    for (index, heading) in source.headings().iter().enumerate() {
        let header = &heading.name;
        if !read.contains(&index)
            && let Some(known) = suggest::nearest(header, known.iter().copied())
        {
            doubts.push(Doubt::UnreadColumn { column: header.clone(), known: known.to_owned() });
        }
    }
    doubts
}
