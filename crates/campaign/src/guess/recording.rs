//! All columns of a file as numbers.

use std::borrow::Cow;

use column_source::{
    Clock, ColumnSource, Comments, Heading, Notice, Switch, any_unit_at_end, listed, named, without_unit,
};
use quantity::{Reference, Unit};

use crate::DataError;
use crate::time_column;
use crate::trace::newest_first;
use crate::words;

/// Of several tables in a file, goes to the one whose names fit the most channels, the largest of them.
fn go_to_best(source: &mut dyn ColumnSource) {
    let mut best = (0, 0);
    for table in 0..source.tables() {
        source.go_to(table);
        let known = |words: &&words::Words| source.headings().iter().any(|one| words::fit(one.bare(), words) > 0);
        let fitting = words::CHANNELS.iter().filter(known).count();
        if fitting > best.1 {
            best = (table, fitting);
        }
    }
    source.go_to(best.0);
}

/// A file with all its columns.
#[derive(Debug, Clone)]
pub struct Recording {
    /// What messages call the file.
    pub file: String,
    /// Names of the columns, as they are written.
    pub names: Vec<String>,
    /// Names without the unit in brackets.
    pub bare: Vec<String>,
    /// Units in brackets or from the row under the header.
    pub units: Vec<Option<Unit>>,
    /// Whether a column is in percent, as its name or the row under the header says.
    pub in_percent: Vec<bool>,
    /// The columns; text and gaps are NaN, timestamps are seconds from the first. Of a column of words such as ON and OFF,
    /// 1 and 0.
    pub columns: Vec<Vec<f64>>,
    /// Which columns hold timestamps.
    pub timestamps: Vec<bool>,
    /// Which columns are of such words, and whether these themselves say close and open.
    pub words: Vec<Option<bool>>,
    /// How the file had to be read.
    pub notices: Vec<Notice>,
}

impl Recording {
    /// Reads a file.
    pub fn read(bytes: &[u8], file: &str) -> Result<Self, DataError> {
        let mut source = column_source::open(bytes, file, Comments::WhereNoNames)?;
        go_to_best(source.as_mut());
        let count = source.headings().len();
        let mut columns = vec![Vec::new(); count];
        let mut clocks = vec![Clock::default(); count];
        let mut switches = vec![Vec::new(); count];
        while let Some(line) = source.next_row()? {
            for (index, (column, clock)) in columns.iter_mut().zip(&mut clocks).enumerate() {
                let stamp = |clock: &mut Clock| clock.seconds(&source.field(index), line).unwrap_or(f64::NAN);
                column.push(if clock.notice().is_some() {
                    stamp(clock)
                } else {
                    source.number(index).unwrap_or_else(|_| stamp(clock))
                });
                let is_text = column.last().is_some_and(|value| value.is_nan());
                switches[index].push(if is_text { Switch::parse(&source.field(index)) } else { None });
            }
        }
        let words = columns.iter_mut().zip(&switches).map(|(column, switches)| take_words(column, switches)).collect();
        let headings = source.headings();
        let timestamps: Vec<bool> = clocks.iter().map(|clock| clock.notice().is_some()).collect();
        // What is no timestamp may fall from row to row for other reasons, unless it is called a time.
        let falls = |index: &usize| {
            (timestamps[*index] || words::is_time(headings[*index].bare())) && newest_first(&columns[*index])
        };
        if (0..count).any(|index| falls(&index)) {
            for (values, is_time) in columns.iter_mut().zip(&timestamps) {
                values.reverse();
                let first_s = values.first().copied().unwrap_or(0.0);
                if *is_time {
                    for value in values {
                        *value -= first_s;
                    }
                }
            }
        }
        let notices = source.notices().iter().chain(clocks.iter().filter_map(Clock::notice));
        Ok(Self {
            file: file.to_owned(),
            names: headings.iter().map(|heading| heading.name.clone()).collect(),
            bare: headings.iter().map(|heading| heading.bare().to_owned()).collect(),
            units: headings.iter().map(|heading| heading.unit.clone()).collect(),
            in_percent: headings.iter().map(is_percent).collect(),
            notices: notices.cloned().collect(),
            columns,
            timestamps,
            words,
        })
    }

    /// The names of the columns for a message.
    #[must_use]
    pub fn listed(&self) -> String {
        listed(self.names.iter().map(String::as_str))
    }

    /// A column's unit: in brackets, in the row of units, or at the end of its name.
    pub(super) fn unit(&self, index: usize) -> Option<Unit> {
        self.units[index].clone().or_else(|| any_unit_at_end(&self.bare[index]))
    }

    /// The columns of this name, looked for as the reader of campaigns does.
    pub(super) fn columns_named(&self, name: &str) -> Vec<usize> {
        named(&self.headings().collect::<Vec<_>>(), name)
    }

    /// The names with and without the unit in brackets.
    pub(super) fn headings(&self) -> impl Iterator<Item = (&str, &str)> {
        self.names.iter().map(String::as_str).zip(self.bare.iter().map(String::as_str))
    }

    /// The column that another recording has at an index: of the same name, else of the same name without a unit.
    pub(super) fn same_as(&self, other: &Self, index: usize) -> Option<usize> {
        let (whole, bare) = (&other.names[index], &other.bare[index]);
        let by_name =
            [whole, bare, without_unit(bare)].into_iter().find_map(|name| match self.columns_named(name)[..] {
                [only] => Some(only),
                _ => None,
            });
        // The time goes by many names: each recording's own is recognised by itself.
        by_name.or_else(|| self.time().filter(|_| other.time() == Some(index)))
    }

    /// The column that is the time by itself, as the reader of campaigns recognises it.
    fn time(&self) -> Option<usize> {
        let columns = (0..self.names.len())
            .map(|index| (self.bare[index].as_str(), self.units[index].clone(), self.timestamps[index]));
        time_column::by_itself(columns)
    }

    /// This recording with the columns of another one, in its order and in its units; what it lacks is NaN.
    pub(super) fn like<'a>(&'a self, other: &Self, ambient_pressure_pa: f64) -> Cow<'a, Self> {
        if self.names == other.names && self.units == other.units {
            return Cow::Borrowed(self);
        }
        let rows = self.columns.first().map_or(0, Vec::len);
        let column = |index: usize| {
            let Some(own) = self.same_as(other, index) else { return (vec![f64::NAN; rows], false) };
            let mut values = self.columns[own].clone();
            // Timestamps are seconds, whatever the heading says.
            let second = || Unit::parse("s").ok();
            let unit = |of: &Self, index: usize| if of.timestamps[index] { second() } else { of.unit(index) };
            if let (Some(from), Some(to)) = (unit(self, own), unit(other, index))
                && from.text() != to.text()
                && from.dimension() == to.dimension()
            {
                let above = |unit: &Unit| if unit.reference() == Reference::Gauge { ambient_pressure_pa } else { 0.0 };
                let shift = above(&from) - above(&to);
                for value in &mut values {
                    *value = to.from_si(from.to_si(*value) + shift);
                }
            }
            (values, self.timestamps[own])
        };
        let (columns, timestamps) = (0..other.names.len()).map(column).unzip();
        Cow::Owned(Self {
            file: self.file.clone(),
            names: other.names.clone(),
            bare: other.bare.clone(),
            units: other.units.clone(),
            in_percent: other.in_percent.clone(),
            columns,
            timestamps,
            words: (0..other.names.len()).map(|index| self.words[self.same_as(other, index)?]).collect(),
            notices: self.notices.clone(),
        })
    }
}

/// Puts 1 and 0 into a column that holds no number and words of a command; whether these say close and open, where it
/// was such a column.
fn take_words(column: &mut [f64], switches: &[Option<Switch>]) -> Option<bool> {
    let first = switches.iter().flatten().next().filter(|_| column.iter().all(|value| value.is_nan()))?;
    for (value, switch) in column.iter_mut().zip(switches) {
        *value = switch.map_or(f64::NAN, Switch::number);
    }
    Some(first.is_direction)
}

/// How headings say percent beside the sign for it.
const PERCENT: [&str; 6] = ["pct", "perc", "percent", "prozent", "pourcent", "percentage"];

/// Whether a heading says percent: `Position [%]`, `pos_pct`, or a row of units under it.
fn is_percent(heading: &Heading) -> bool {
    let says = |text: &str| {
        let mut words = text.split(|character: char| !character.is_alphabetic()).map(str::to_lowercase);
        text.contains('%') || words.any(|word| PERCENT.contains(&word.as_str()))
    };
    says(&heading.name) || heading.other_unit_below.as_deref().is_some_and(says)
}
