//! Rows of a log whose columns were found.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use column_source::{ColumnSource, Comments, Dates, Heading, RecordError, find_table};
use prognoser::fields::{self, StrokeField};
use prognoser::{LogError, LogErrorKind, LogRow, Reading};

use crate::channel::NamedColumn;
use crate::error::{ColumnLogError, ColumnProblem};
use crate::notice::Notice;
use crate::places::{Measured, Places, VALVE};

/// The word for a stroke that did not arrive.
const STALLED: &str = "stalled";
/// Longest field that is shown, characters.
const SHOWN: usize = 40;

/// What the user says of a log.
#[derive(Debug, Clone, Default)]
pub struct Wanted {
    /// Columns by name; all others are found by their own.
    pub columns: Vec<NamedColumn>,
    /// The valve that all rows are of.
    pub valve: Option<String>,
    /// An empty time means that the stroke did not arrive, not that it was not measured.
    pub empty_is_stalled: bool,
}

/// Finds the columns, in the table that has them.
fn find_places(source: &mut dyn ColumnSource, wanted: &Wanted, one_valve: bool) -> Result<Places, ColumnLogError> {
    find_table(
        source,
        |source| {
            let (file, line) = (source.file().to_owned(), source.header_line());
            Places::find(source, &wanted.columns, one_valve).map_err(|problem| ColumnLogError::Columns {
                file,
                line,
                problem,
            })
        },
        |source| Places::count(source, &wanted.columns),
    )
}

/// Whether nothing in a log speaks for several valves: its cycles rise from row to row, or its times stand there without cycles, and
/// no other column could be names, words or whole numbers of which some come again.
fn is_of_one(bytes: &[u8], name: &str, wanted: &Wanted) -> bool {
    let Ok(mut source) = column_source::open(bytes, name, Comments::WhereNoNames) else { return false };
    let Ok(places) = find_places(source.as_mut(), wanted, true) else { return false };
    let unread = places.unread(source.headings()).map(|heading| heading.name.clone()).collect::<Vec<_>>();
    let mut seen: Vec<(usize, HashSet<String>, bool)> = (0..source.headings().len())
        .filter(|index| unread.contains(&source.headings()[*index].name))
        .map(|index| (index, HashSet::new(), false))
        .collect();
    let mut last = f64::NEG_INFINITY;
    while let Ok(Some(_)) = source.next_row() {
        if let Some(column) = places.cycle {
            match source.number(column) {
                Ok(cycle) if cycle > last => last = cycle,
                _ => return false,
            }
        }
        for (index, names, comes_again) in &mut seen {
            let field = source.field(*index).trim().to_owned();
            let may_name = source.number(*index).map_or(true, |number| number.fract() == 0.0);
            if may_name && !field.is_empty() {
                *comes_again |= !names.insert(field);
            }
        }
    }
    let names_valves = |(_, names, comes_again): &(usize, HashSet<String>, bool)| *comes_again && names.len() > 1;
    (places.cycle.is_some() || places.time.is_some()) && !seen.iter().any(names_valves)
}

/// A timing log with columns of any name and unit, in memory as a whole.
pub struct ColumnLog {
    source: Box<dyn ColumnSource>,
    places: Places,
    empty_is_stalled: bool,
    /// The name that all rows have, else that of the row at hand.
    valve: String,
    /// Rows of each valve so far, where no column tells the cycle.
    counted: HashMap<String, u64>,
    dates: Dates,
    time: Option<String>,
    /// The line of a row that was looked at and not given yet, or why there is none.
    looked_at: Option<Result<usize, RecordError>>,
    unknown: Vec<String>,
    notices: Vec<(usize, Notice)>,
}

impl ColumnLog {
    /// Finds out how a file is written and what its columns are. `name` is what messages call it.
    ///
    /// # Errors
    /// If it is no table, or the valve, a stroke time or its unit cannot be told.
    pub fn read(bytes: &[u8], name: &str, wanted: &Wanted) -> Result<Self, ColumnLogError> {
        let mut source = column_source::open(bytes, name, Comments::WhereNoNames)?;
        let line = source.header_line();
        let mut valve = wanted.valve.clone();
        let found = find_places(source.as_mut(), wanted, valve.is_some());
        let places = match found {
            Err(ColumnLogError::Columns { problem: ColumnProblem::Missing { what: VALVE, .. }, .. })
                if is_of_one(bytes, name, wanted) =>
            {
                valve = Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned());
                find_places(source.as_mut(), wanted, true)?
            }
            found => found?,
        };
        let mut notices: Vec<(usize, Notice)> =
            source.notices().iter().map(|one| (one.line, one.kind.clone().into())).collect();
        if let (None, Some(valve)) = (&wanted.valve, &valve) {
            notices.push((line, Notice::OneValve(valve.clone())));
        }
        if !places.taken.is_empty() {
            notices.push((line, Notice::Taken(places.taken.join(", "))));
        }
        if places.cycle.is_none() {
            notices.push((line, Notice::Counted));
        }
        let unknown = places.unread(source.headings()).map(|heading| heading.name.clone()).collect();
        let mut log = Self {
            source,
            places,
            empty_is_stalled: wanted.empty_is_stalled,
            valve: valve.unwrap_or_default(),
            counted: HashMap::new(),
            dates: Dates::default(),
            time: None,
            looked_at: None,
            unknown,
            notices,
        };
        log.looked_at = log.source.next_row().transpose();
        log.look_at_dates();
        Ok(log)
    }

    /// How the first date is written, so that it can be told before any row.
    fn look_at_dates(&mut self) {
        let (Some(Ok(line)), Some(column)) = (&self.looked_at, self.places.time) else { return };
        let line = *line;
        let example = shown(&self.source.field(column));
        let notice = match self.dates.rfc3339(&example) {
            // What is written so says its zone.
            Some(_) if example.contains('T') && self.dates.written() == Some("a time with its zone") => return,
            Some(moment) if full_year(moment.clone(), &example).is_none() => {
                Notice::ShortYears { column: self.heading(column).name.clone(), example }
            }
            Some(_) => {
                let written = self.dates.written().unwrap_or_default();
                let zone = if written.contains("zone") && !written.contains("without") { "" } else { ", taken as UTC" };
                Notice::Dates { example, written, zone }
            }
            None => Notice::NoDates { column: self.heading(column).name.clone(), example },
        };
        self.notices.push((line, notice));
    }

    /// What messages call the log.
    #[must_use]
    pub fn name(&self) -> &str {
        self.source.file()
    }

    /// What the file does not say by itself and how it was taken, each with its line.
    #[must_use]
    pub fn notices(&self) -> &[(usize, Notice)] {
        &self.notices
    }

    /// The columns that are not understood and not used.
    #[must_use]
    pub fn unknown_columns(&self) -> &[String] {
        &self.unknown
    }

    /// The next row, none at the end of the log.
    ///
    /// # Errors
    /// If the row cannot be read. Where only this one is none ([`ColumnLogError::is_row`]) the next one may be.
    pub fn next_row(&mut self) -> Result<Option<LogRow<'_>>, ColumnLogError> {
        let next = self.looked_at.take().or_else(|| self.source.next_row().transpose()).transpose()?;
        let Some(line) = next else { return Ok(None) };
        if let Some(column) = self.places.valve {
            self.valve = self.source.field(column).trim().to_owned();
        }
        fields::valve(&self.valve).map_err(|kind| self.wrong(line, kind))?;
        let cycle = if let Some(column) = self.places.cycle {
            self.cycle(line, column)?
        } else {
            // A row of which the rest cannot be read was a cycle as well.
            let count = self.counted.entry(self.valve.clone()).or_default();
            *count += 1;
            *count
        };
        let close = self.stroke(line, &self.places.strokes[0], "close_time_s")?;
        let open = self.stroke(line, &self.places.strokes[1], "open_time_s")?;
        let supply_pressure_pa = self.condition(line, self.places.supply_pressure.as_ref(), "supply_pressure")?;
        let temperature_k = self.condition(line, self.places.temperature.as_ref(), "temperature")?;
        self.time = self.date(line)?;
        let reading = Reading {
            cycle,
            close_time_s: close.time_s,
            open_time_s: open.time_s,
            stalled: [close.stalled, open.stalled],
            supply_pressure_pa,
            temperature_k,
        };
        Ok(Some(LogRow { valve: &self.valve, reading, time: self.time.as_deref(), line: line as u64 }))
    }

    fn heading(&self, column: usize) -> &Heading {
        &self.source.headings()[column]
    }

    fn wrong(&self, line: usize, kind: LogErrorKind) -> ColumnLogError {
        LogError { log: self.source.file().to_owned(), line: line as u64, kind }.into()
    }

    fn stroke(&self, line: usize, place: &Measured, column: &'static str) -> Result<StrokeField, ColumnLogError> {
        if self.source.field(place.index).trim().eq_ignore_ascii_case(STALLED) {
            return Ok(StrokeField { time_s: None, stalled: true });
        }
        let time_s = place.si(self.source.number(place.index)?);
        fields::stroke_of_number(column, time_s, self.empty_is_stalled).map_err(|kind| self.wrong(line, kind))
    }

    fn condition(
        &self,
        line: usize,
        place: Option<&Measured>,
        column: &'static str,
    ) -> Result<Option<f64>, ColumnLogError> {
        let Some(place) = place else { return Ok(None) };
        let si = place.si(self.source.number(place.index)?);
        if si.is_nan() {
            return Ok(None);
        }
        if si.is_finite() && si > 0.0 {
            return Ok(Some(si));
        }
        let found = shown(&self.source.field(place.index));
        let expected = "a pressure or temperature above zero, or nothing if it is not known";
        Err(self.wrong(line, LogErrorKind::Field { column, found, expected }))
    }

    fn cycle(&self, line: usize, column: usize) -> Result<u64, ColumnLogError> {
        // As text where it is one, so that no digit is rounded away.
        let of_text = fields::cycle_of_text(self.source.field(column).trim());
        of_text.or_else(|refused| match self.source.number(column) {
            Ok(number) => fields::cycle_of_number(number).map_err(|_| self.wrong(line, refused)),
            Err(_) => Err(self.wrong(line, refused)),
        })
    }

    /// The date of the row at hand: in UTC where dates are understood, as it is written where none is.
    fn date(&mut self, line: usize) -> Result<Option<String>, ColumnLogError> {
        let Some(column) = self.places.time else { return Ok(None) };
        let field = self.source.field(column);
        if field.trim().is_empty() {
            return Ok(None);
        }
        let moment = self.dates.rfc3339(&field);
        match (moment, self.dates.written()) {
            (Some(moment), _) => Ok(Some(full_year(moment, &field).unwrap_or_else(|| shown(&field)))),
            (None, None) => Ok(Some(shown(&field))),
            (None, Some(expected)) => {
                let (column, found) = (self.heading(column).name.clone(), shown(&field));
                let problem = ColumnProblem::OtherDate { column, found, expected };
                Err(ColumnLogError::Columns { file: self.source.file().to_owned(), line, problem })
            }
        }
    }
}

/// A moment with its century: of a year with two digits this one, where the date is written as 31.12.26 and can be nothing else. None
/// where two digits may be the year or the day.
fn full_year(moment: String, field: &str) -> Option<String> {
    let Some(rest) = moment.strip_prefix("00") else { return Some(moment) };
    let date = field.split_whitespace().next().unwrap_or_default();
    (date.matches('.').count() == 2).then(|| format!("20{rest}"))
}

/// A field as it may be shown: of bounded length, without control characters.
fn shown(field: &str) -> String {
    field.trim().chars().filter(|character| !character.is_control()).take(SHOWN).collect()
}
