//! Which column tells what.

use column_source::{ColumnSource, Heading, did_you_mean, named, unit_at_end, without_unit, written_out};
use quantity::{Reference, Unit};

use crate::channel::{Channel, NamedColumn};
use crate::error::ColumnProblem;

/// Pressure from which gauge pressures of a log count, Pa: the standard atmosphere.
const ATMOSPHERE_PA: f64 = 101_325.0;

/// What messages call the valve of a row.
pub(crate) const VALVE: &str = "valve";

/// A column of numbers with a unit.
#[derive(Debug, Clone)]
pub(crate) struct Measured {
    pub index: usize,
    unit: Unit,
    zero: f64,
}

impl Measured {
    /// A number of the column in SI, pressures absolute.
    pub fn si(&self, number: f64) -> f64 {
        self.unit.to_si(number) + self.zero
    }
}

/// The columns of a log.
#[derive(Debug, Clone)]
pub(crate) struct Places {
    pub valve: Option<usize>,
    pub cycle: Option<usize>,
    pub time: Option<usize>,
    /// Closing and opening time.
    pub strokes: [Measured; 2],
    pub supply_pressure: Option<Measured>,
    pub temperature: Option<Measured>,
    /// The columns that were told by their names: "Schliesszeit [ms] as close_time".
    pub taken: Vec<String>,
}

impl Places {
    /// By what the user has named, else by the columns' names; `one_valve`: the whole log is of one, whose name is known.
    pub fn find(source: &dyn ColumnSource, wanted: &[NamedColumn], one_valve: bool) -> Result<Self, ColumnProblem> {
        let headings = source.headings();
        let mut taken = Vec::new();
        let mut place = |channel: Channel| {
            let index = index(source, channel, wanted)?;
            if let Some(index) = index.filter(|_| wanted.iter().all(|one| one.channel != channel)) {
                let heading = &headings[index];
                if plain(heading) != channel.name() {
                    taken.push(format!("{} as {}", heading.name, channel.name()));
                }
            }
            Ok(index)
        };
        let missing = |what, remedy: String| ColumnProblem::Missing { what, found: listed(source), remedy };
        let valve = if one_valve { None } else { place(Channel::Valve)? };
        if valve.is_none() && !one_valve {
            let remedy = "Say which one, --column valve=NAME, or --valve-name NAME if all rows are of one valve";
            return Err(missing(VALVE, remedy.to_owned()));
        }
        let (cycle, time) = (place(Channel::Cycle)?, place(Channel::Time)?);
        let mut measured = |channel: Channel| {
            place(channel)?.map(|index| measured(&headings[index], index, channel, wanted)).transpose()
        };
        let mut stroke = |channel: Channel, what| {
            let remedy = format!("Say which one and in which unit, such as --column {}=NAME", channel.example());
            measured(channel)?.ok_or_else(|| missing(what, remedy))
        };
        let strokes = [stroke(Channel::CloseTime, "closing time")?, stroke(Channel::OpenTime, "opening time")?];
        let (supply_pressure, temperature) = (measured(Channel::SupplyPressure)?, measured(Channel::Temperature)?);
        Ok(Self { valve, cycle, time, strokes, supply_pressure, temperature, taken })
    }

    /// How many of a log's columns a table has.
    pub fn count(source: &dyn ColumnSource, wanted: &[NamedColumn]) -> usize {
        let all = [Channel::Valve, Channel::Cycle, Channel::Time, Channel::CloseTime, Channel::OpenTime];
        all.into_iter().filter(|channel| matches!(index(source, *channel, wanted), Ok(Some(_)))).count()
    }

    /// The columns that are not read.
    pub fn unread<'a>(&self, headings: &'a [Heading]) -> impl Iterator<Item = &'a Heading> {
        let measured = [&self.supply_pressure, &self.temperature].map(|one| one.as_ref().map(|one| one.index));
        let strokes = [0, 1].map(|stroke| Some(self.strokes[stroke].index));
        let read = [[self.valve, self.cycle], [self.time, None], measured, strokes].concat();
        headings.iter().enumerate().filter(move |(index, _)| !read.contains(&Some(*index))).map(|(_, heading)| heading)
    }
}

/// The column of a channel, if there is one.
fn index(source: &dyn ColumnSource, channel: Channel, wanted: &[NamedColumn]) -> Result<Option<usize>, ColumnProblem> {
    let headings = source.headings();
    let found = if let Some(one) = wanted.iter().find(|one| one.channel == channel) {
        let names: Vec<(&str, &str)> = headings.iter().map(|it| (it.name.as_str(), it.bare())).collect();
        let found = named(&names, source.within_table(&one.name));
        if found.is_empty() {
            let suggestion = did_you_mean(names.into_iter(), &one.name);
            let (name, found) = (one.name.clone(), listed(source));
            return Err(ColumnProblem::NoSuchColumn { name, suggestion, found });
        }
        found
    } else {
        let goes_by = |words: &[&str]| {
            (0..headings.len()).filter(|index| words.contains(&&*plain(&headings[*index]))).collect::<Vec<_>>()
        };
        let own = goes_by(&channel.words()[..1]);
        if own.is_empty() { goes_by(channel.words()) } else { own }
    };
    match found[..] {
        [] => Ok(None),
        [index] => Ok(Some(index)),
        [first, second, ..] => Err(ColumnProblem::TwoColumns {
            channel: channel.name(),
            first: headings[first].name.clone(),
            second: headings[second].name.clone(),
        }),
    }
}

/// A heading as the words of a channel are written.
fn plain(heading: &Heading) -> String {
    let plain = written_out(without_unit(heading.bare()));
    let parts = plain.split([' ', '-', '.', '_', '\'', '\u{2019}']).filter(|part| !part.is_empty());
    parts.collect::<Vec<_>>().join("_")
}

/// A column with its unit: as the user has said, as it stands in the file, else refused.
fn measured(
    heading: &Heading,
    index: usize,
    channel: Channel,
    wanted: &[NamedColumn],
) -> Result<Measured, ColumnProblem> {
    let dimension = channel.dimension().expect("only columns with a unit are measured");
    let column = heading.name.clone();
    let said = wanted.iter().find(|one| one.channel == channel).and_then(|one| one.unit.clone());
    let own = || heading.unit.clone().or_else(|| unit_at_end(heading.bare(), dimension));
    let Some(unit) = said.or_else(own) else {
        return Err(ColumnProblem::NoUnit { column, example: channel.example() });
    };
    if !unit.measures(dimension) {
        let (unit, expected) = (unit.text().to_owned(), dimension.expectation());
        return Err(ColumnProblem::WrongUnit { column, unit, expected });
    }
    match unit.reference() {
        Reference::Ambiguous => Err(ColumnProblem::AmbiguousUnit { column, unit: unit.text().to_owned() }),
        Reference::Gauge => Ok(Measured { index, unit, zero: ATMOSPHERE_PA }),
        Reference::Unstated | Reference::Absolute => Ok(Measured { index, unit, zero: 0.0 }),
    }
}

fn listed(source: &dyn ColumnSource) -> String {
    if source.table().is_some() {
        return source.listed();
    }
    source.headings().iter().map(|heading| format!("\"{}\"", heading.name)).collect::<Vec<_>>().join(", ")
}
