//! TDMS files of National Instruments: LabVIEW, DIAdem, FlexLogger and whoever else writes them.
//!
//! A file is a row of segments, each with what is new about groups and channels and with their values (National
//! Instruments, "TDMS File Format Internal Structure"). A group is a table. Channels of one group that were not sampled
//! at the same times are tables of their own. What a waveform says of its sampling becomes the column `time_s`.

mod bytes;
mod index;
mod scale;
mod segment;
mod values;

use quantity::{Dimension, Unit};

use self::bytes::Fault;
use self::segment::{Channel, Properties, Property};
use self::values::Raw;
use crate::heading::{is_other_unit, understood};
use crate::table::{TableSource, Values};
use crate::tables::{self, NamedTable};
use crate::{ColumnSource, Heading, NoticeKind, RecordError, RecordProblem, any_unit_at_end};

/// Opens a TDMS file.
pub(crate) fn open(bytes: &[u8], file: &str) -> Result<Box<dyn ColumnSource>, RecordError> {
    let refuse = |problem| RecordError { file: file.to_owned(), line: 1, problem };
    let content = segment::read(bytes).map_err(|fault| refuse(problem(fault)))?;
    let mut tables: Vec<NamedTable> = Vec::new();
    for group in &content.groups {
        let parts = parts(content.channels.iter().filter(|channel| channel.group == *group));
        let several = parts.len() > 1;
        for part in parts {
            let rows = part.rows;
            let shown = match &part.sampling {
                _ if !several => format!("group \"{group}\""),
                None => format!("group \"{group}\" (rows: {rows})"),
                Some(sampling) => format!("group \"{group}\" (rows: {rows}, one every {} s)", sampling.increment_s),
            };
            let mut table = TableSource::of(file, part.columns(&content.properties_above(group)));
            if content.cut {
                table.say(NoticeKind::CutRow);
            }
            tables.push(NamedTable { name: group.clone(), shown, table });
        }
    }
    if tables.is_empty() {
        return Err(refuse(RecordProblem::Empty));
    }
    Ok(tables::source(tables))
}

fn problem(fault: Fault) -> RecordProblem {
    match fault {
        Fault::NotRead { found, instead } => RecordProblem::PartNotRead { found, instead },
        Fault::Cut => RecordProblem::NotATable {
            format: "TDMS",
            reason: "it is cut off in the middle; copy the file again from where it was recorded".to_owned(),
        },
        Fault::Broken(reason) => RecordProblem::NotATable { format: "TDMS", reason },
    }
}

/// When the values of a channel were taken.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "the unit is part of the name")]
struct Sampling {
    increment_s: f64,
    offset_s: f64,
    /// Since 1904, where it is known.
    start_s: Option<f64>,
}

impl Sampling {
    /// What the properties of a waveform say; none where its values are not taken in time, as those of a spectrum.
    fn of(properties: &Properties) -> Option<Self> {
        let number = |name| properties.get(name).and_then(Property::number);
        let unit = match properties.get("wf_xunit_string").and_then(Property::text) {
            None | Some("") => 1.0,
            Some(text) => {
                understood(text).filter(|unit| unit.measures(Dimension::Time)).map(|unit| unit.difference_to_si(1.0))?
            }
        };
        let increment_s = number("wf_increment")? * unit;
        let offset_s = number("wf_start_offset").unwrap_or(0.0) * unit;
        let start_s = properties.get("wf_start_time").and_then(Property::seconds);
        (increment_s > 0.0 && increment_s.is_finite() && offset_s.is_finite()).then_some(Self {
            increment_s,
            offset_s,
            start_s,
        })
    }

    /// Whether two channels have the same times, to within half a step.
    fn is_that_of(&self, other: &Self) -> bool {
        let apart_s = self.offset_s - other.offset_s + self.start_s.unwrap_or(0.0) - other.start_s.unwrap_or(0.0);
        self.increment_s == other.increment_s && apart_s.abs() < self.increment_s / 2.0
    }
}

/// Channels of a group with values at the same times.
struct Part<'a> {
    rows: usize,
    sampling: Option<Sampling>,
    channels: Vec<&'a Channel>,
}

/// The channels of a group by length and sampling; those that say nothing of their sampling go with others as long.
fn parts<'a>(channels: impl Iterator<Item = &'a Channel>) -> Vec<Part<'a>> {
    let mut parts: Vec<Part<'_>> = Vec::new();
    let (sampled, others): (Vec<_>, Vec<_>) = channels
        .filter(|channel| channel.raw.len() > 0)
        .map(|channel| (Sampling::of(&channel.properties), channel))
        .partition(|(sampling, _)| sampling.is_some());
    for (sampling, channel) in sampled.into_iter().chain(others) {
        let rows = channel.raw.len();
        let same = |part: &&mut Part<'_>| {
            let together = match (&sampling, &part.sampling) {
                (Some(own), Some(other)) => own.is_that_of(other),
                (None, _) => true,
                (Some(_), None) => false,
            };
            part.rows == rows && together
        };
        match parts.iter_mut().find(same) {
            Some(part) => part.channels.push(channel),
            None => parts.push(Part { rows, sampling, channels: vec![channel] }),
        }
    }
    for part in &mut parts {
        part.channels.sort_by_key(|channel| channel.place);
    }
    parts
}

impl Part<'_> {
    fn columns(&self, above: &[&Properties]) -> Vec<(Heading, Values)> {
        let mut columns: Vec<(Heading, Values)> = Vec::new();
        let mut has_time = false;
        for channel in &self.channels {
            let heading = heading(channel);
            let measures_time = |unit: &Unit| unit.measures(Dimension::Time);
            has_time |= matches!(channel.raw, Raw::Times(_))
                || heading.unit.clone().or_else(|| any_unit_at_end(heading.bare())).as_ref().is_some_and(measures_time);
            columns.push((heading, values(channel, above)));
        }
        if let (Some(sampling), false) = (self.sampling, has_time) {
            let time_s = |row: usize| sampling.offset_s + row as f64 * sampling.increment_s;
            let times_s = Values::Numbers((0..self.rows).map(time_s).collect());
            columns.insert(0, (Heading::new("time_s"), times_s));
        }
        columns
    }
}

/// The name of a channel with the unit in it, else with that of its properties.
fn heading(channel: &Channel) -> Heading {
    let mut heading = Heading::new(&channel.name);
    if heading.unit.is_none() && any_unit_at_end(heading.bare()).is_none() {
        let said = ["unit_string", "NI_UnitDescription"].into_iter().filter_map(|name| channel.properties.get(name));
        let said: Vec<&str> = said.filter_map(Property::text).collect();
        heading.unit = said.iter().find_map(|text| understood(text)).filter(|unit| !unit.text().is_empty());
        heading.other_unit_below = said.into_iter().find(|text| is_other_unit(text)).map(str::to_owned);
    }
    heading
}

/// The values of a channel, scaled where they are codes of a converter.
fn values(channel: &Channel, above: &[&Properties]) -> Values {
    let instead = "save it scaled, or export it as CSV";
    match &channel.raw {
        Raw::Texts(texts) | Raw::Times(texts) => Values::Texts(texts.clone()),
        Raw::Numbers(numbers) => match scale::of(&channel.properties, above) {
            Ok(scale) => Values::Numbers(numbers.iter().map(|number| scale.of(*number)).collect()),
            Err(found) => Values::NotRead { rows: numbers.len(), found, instead },
        },
        Raw::Unknown { rows, what } => Values::NotRead { rows: *rows, found: (*what).to_owned(), instead },
    }
}
