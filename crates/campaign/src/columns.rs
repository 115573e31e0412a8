//! Which column holds which channel, and how its numbers become SI.

use checked_toml::{QuantityKind, Section, TomlFileError};
use quantity::{Dimension, Reference, Unit, suggest};

use crate::csv_text::CsvText;
use crate::error::{DataError, DataProblem};
use crate::warning::Doubt;

/// The channels of a trace and what they measure.
pub(crate) const CHANNELS: [(&str, Dimension); 6] = [
    ("time", Dimension::Time),
    ("command", Dimension::Pure),
    ("position", Dimension::Length),
    ("chamber_pressure", Dimension::Pressure),
    ("pipe_pressure", Dimension::Pressure),
    ("supply_pressure", Dimension::Pressure),
];

/// What `[columns]` says of one channel.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mapping {
    pub channel: String,
    name: Option<String>,
    unit: Option<Unit>,
    scale: Option<f64>,
    offset: Option<f64>,
}

impl Mapping {
    /// A column that is read as it stands.
    pub fn raw(name: &str) -> Self {
        Self { name: Some(name.to_owned()), ..Self::default() }
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

/// Reads `[columns]`.
pub(crate) fn read_mappings(root: &Section<'_>) -> Result<Vec<Mapping>, TomlFileError> {
    let Some(columns) = root.section("columns")? else { return Ok(Vec::new()) };
    columns.allow_only(&CHANNELS.map(|(name, _)| name))?;
    let mut mappings = Vec::new();
    for (channel, dimension) in CHANNELS {
        if !columns.has(channel) {
            continue;
        }
        let mut mapping = Mapping { channel: channel.to_owned(), ..Mapping::default() };
        let expected = "the column's name, or { name, unit, scale, offset }";
        if columns.value_span(channel).is_some()
            && let Ok(Some(name)) = columns.text(channel, expected)
        {
            mapping.name = Some(name.to_owned());
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
        _ => Err(table.wrong("unit", format!("\"{text}\"{hint}"), dimension.expectation())),
    }
}

/// The names a channel's column goes by when `[columns]` does not name it: the channel with a unit at its end.
fn unit_in_name(header: &str, channel: &str, dimension: Dimension) -> Option<&'static str> {
    let header = header.to_ascii_lowercase();
    let rest = header.strip_prefix(channel)?;
    if dimension == Dimension::Pure {
        return rest.is_empty().then_some("");
    }
    dimension.unit_ignoring_case(rest.strip_prefix('_')?)
}

/// Finds a channel's column; `None` where the file has none.
pub(crate) fn find(
    csv: &CsvText<'_>,
    channel: &str,
    dimension: Dimension,
    mapping: Option<&Mapping>,
    ambient_pressure_pa: f64,
) -> Result<Option<(Column, Option<Doubt>)>, DataError> {
    let empty = Mapping::default();
    let mapping = mapping.unwrap_or(&empty);
    let (index, named_unit) = if let Some(name) = &mapping.name {
        let found = csv.headers.iter().position(|header| header == name);
        let index = found.ok_or_else(|| missing(csv, name, "the name given in [columns]"))?;
        (index, unit_in_name(name, channel, dimension))
    } else {
        let mut found = csv
            .headers
            .iter()
            .enumerate()
            .filter_map(|(index, header)| unit_in_name(header, channel, dimension).map(|unit| (index, unit)));
        let Some((index, unit)) = found.next() else { return Ok(None) };
        if let Some((second, _)) = found.next() {
            let (first, second) = (csv.headers[index].clone(), csv.headers[second].clone());
            let problem = DataProblem::TwoColumns { channel: channel.to_owned(), first, second };
            return Err(csv.error(csv.header_line(), problem));
        }
        (index, Some(unit))
    };
    let named_unit = named_unit.and_then(|unit| Unit::parse(unit).ok());
    // A channel that is named without any unit is in that of the usual column (position_mm and so on).
    let usual = || Unit::parse(usual_unit(dimension)).ok();
    let Some(unit) = mapping.unit.clone().or(named_unit).or_else(usual) else { return Ok(None) };
    let gauge = unit.reference() == Reference::Gauge;
    let scale = mapping.scale.unwrap_or(1.0);
    let zero = unit.to_si(0.0) + if gauge { ambient_pressure_pa } else { 0.0 };
    let column =
        Column { index, factor: scale * unit.difference_to_si(1.0), offset: zero + mapping.offset.unwrap_or(0.0) };
    let doubt = gauge.then(|| Doubt::GaugeColumn {
        column: csv.headers[index].clone(),
        unit: unit.text().to_owned(),
        ambient_kpa: ambient_pressure_pa / 1e3,
    });
    Ok(Some((column, doubt)))
}

fn usual_unit(dimension: Dimension) -> &'static str {
    match dimension {
        Dimension::Length => "mm",
        Dimension::Pressure => "kPa",
        other => other.si_unit(),
    }
}

/// The refusal of a file that lacks a column.
pub(crate) fn missing(csv: &CsvText<'_>, column: &str, expected: &str) -> DataError {
    let hint = suggest::did_you_mean(column, csv.headers.iter().map(String::as_str));
    let problem = DataProblem::MissingColumn {
        column: format!("\"{column}\"{hint}"),
        expected: expected.to_owned(),
        found: csv.headers.iter().map(|header| format!("\"{header}\"")).collect::<Vec<_>>().join(", "),
    };
    csv.error(csv.header_line(), problem)
}

/// Columns that are not read but look like one of these.
pub(crate) fn look_alikes(csv: &CsvText<'_>, read: &[usize], known: &[&str]) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    for (index, header) in csv.headers.iter().enumerate() {
        if !read.contains(&index)
            && let Some(known) = suggest::nearest(header, known.iter().copied())
        {
            doubts.push(Doubt::UnreadColumn { column: header.clone(), known: known.to_owned() });
        }
    }
    doubts
}
