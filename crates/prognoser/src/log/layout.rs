//! The columns of a timing log, and rows by them.

use super::conditions::ConditionColumn;
use super::error::LogErrorKind;
use super::fields::{self, COLUMNS, TIME_COLUMN};
use super::reader::LogRow;
use crate::reading::Reading;

/// Length to which fields are shortened in messages.
pub(super) const SHOWN: usize = 40;
/// Where the columns are.
#[derive(Debug)]
pub(super) struct Layout {
    header: String,
    columns: [usize; 4],
    time: Option<usize>,
    conditions: Vec<(usize, ConditionColumn)>,
    unknown: Vec<String>,
    count: usize,
}

/// What a line below the header is.
pub(super) enum Line {
    /// A row.
    Row,
    /// Blank, or a comment.
    Nothing,
    /// Neither.
    Bad(LogErrorKind),
}

impl Layout {
    /// By a header.
    pub(super) fn new(header: &str) -> Result<Self, LogErrorKind> {
        let names: Vec<&str> = header.split(',').map(unquoted).collect();
        let find = |column: &'static str| {
            let mut places = (0..names.len()).filter(|&i| names[i] == column);
            match (places.next(), places.next()) {
                (_, Some(_)) => Err(LogErrorKind::RepeatedColumn { column }),
                (place, None) => Ok(place),
            }
        };
        let mut columns = [0; 4];
        for (place, column) in columns.iter_mut().zip(COLUMNS) {
            *place = find(column)?
                .ok_or_else(|| LogErrorKind::MissingColumn { found: shortened(header, 4 * SHOWN), missing: column })?;
        }
        let time = find(TIME_COLUMN)?;
        let mut conditions: Vec<(usize, ConditionColumn)> = Vec::new();
        let mut unknown = Vec::new();
        for (place, name) in names.iter().enumerate() {
            if columns.contains(&place) || time == Some(place) {
                continue;
            }
            match ConditionColumn::named(name) {
                Some(column) if conditions.iter().any(|(_, other)| other.is_pressure() == column.is_pressure()) => {
                    return Err(LogErrorKind::RepeatedColumn { column: column.quantity() });
                }
                Some(column) => conditions.push((place, column)),
                None => unknown.push((*name).to_owned()),
            }
        }
        Ok(Self { header: header.to_owned(), columns, time, conditions, unknown, count: names.len() })
    }

    /// The header itself.
    pub(super) fn header(&self) -> &str {
        &self.header
    }

    /// The columns that are not understood.
    pub(super) fn unknown(&self) -> &[String] {
        &self.unknown
    }

    /// Whether a line is blank or a comment. A "#" begins one only where it cannot begin a row: a valve may be called "#12".
    pub(super) fn is_nothing(&self, text: &str) -> bool {
        text.trim_ascii().is_empty() || (text.starts_with('#') && !self.may_be_row(text))
    }

    /// What a line is.
    pub(super) fn line(&self, text: &str, line: u64, empty_is_stalled: bool) -> Line {
        if self.is_nothing(text) {
            return Line::Nothing;
        }
        match self.row(text, line, empty_is_stalled) {
            Ok(_) => Line::Row,
            Err(kind) => Line::Bad(kind),
        }
    }

    /// Whether a line has as many fields as the header, and a cycle where that has it.
    fn may_be_row(&self, text: &str) -> bool {
        let is_number = |field: &str| !field.is_empty() && field.bytes().all(|byte| byte.is_ascii_digit());
        Fields(Some(text)).count() == self.count && Fields(Some(text)).nth(self.columns[1]).is_some_and(is_number)
    }

    /// The last field of a line, if numbers stand there that a file may end within.
    pub(super) fn last_number<'a>(&self, text: &'a str) -> Option<&'a str> {
        let last = self.count - 1;
        let numbers = self.columns[1..].contains(&last) || self.conditions.iter().any(|(place, _)| *place == last);
        numbers.then(|| unquoted(text.rsplit(',').next().unwrap_or(text)))
    }

    /// A row.
    pub(super) fn row<'a>(&self, text: &'a str, line: u64, empty_is_stalled: bool) -> Result<LogRow<'a>, LogErrorKind> {
        let mut wanted = [""; 4];
        let mut time = None;
        let (mut supply_pressure_pa, mut temperature_k) = (None, None);
        let mut count = 0;
        for field in Fields(Some(text)) {
            for (slot, &place) in wanted.iter_mut().zip(&self.columns) {
                if place == count {
                    *slot = field;
                }
            }
            if self.time == Some(count) {
                time = Some(field);
            }
            for (_, column) in self.conditions.iter().filter(|(place, _)| *place == count) {
                let value = column.of_text(field)?;
                if column.is_pressure() {
                    supply_pressure_pa = value;
                } else {
                    temperature_k = value;
                }
            }
            count += 1;
        }
        if count != self.count {
            return Err(LogErrorKind::FieldCount { found: count, expected: self.count });
        }
        let [valve, cycle, close, open] = wanted;
        // No-break spaces too.
        let valve = if valve.is_ascii() { valve } else { valve.trim() };
        fields::valve(valve)?;
        let cycle = fields::cycle_of_text(cycle)?;
        let close = fields::stroke_of_text(COLUMNS[2], close, empty_is_stalled)?;
        let open = fields::stroke_of_text(COLUMNS[3], open, empty_is_stalled)?;
        let reading = Reading {
            cycle,
            close_time_s: close.time_s,
            open_time_s: open.time_s,
            stalled: [close.stalled, open.stalled],
            supply_pressure_pa,
            temperature_k,
        };
        Ok(LogRow { valve, reading, time, line })
    }
}

/// The fields of a line. A field may stand in double quotes and then contain
/// commas; quotes inside quotes are not needed in a log and not understood.
struct Fields<'a>(Option<&'a str>);

impl<'a> Iterator for Fields<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        let rest = self.0?;
        let quoted = rest.trim_start().starts_with('"');
        let from = if quoted {
            let open = rest.find('"')? + 1;
            rest[open..].find('"').map_or(0, |close| open + close)
        } else {
            0
        };
        let comma = rest.as_bytes()[from..].iter().position(|&byte| byte == b',');
        self.0 = comma.map(|comma| &rest[from + comma + 1..]);
        Some(unquoted(comma.map_or(rest, |comma| &rest[..from + comma])))
    }
}

fn unquoted(field: &str) -> &str {
    let field = field.trim_ascii();
    field.strip_prefix('"').and_then(|inner| inner.strip_suffix('"')).unwrap_or(field)
}

pub(super) fn shortened(text: &str, longest: usize) -> String {
    let mut shown = String::new();
    for (count, letter) in text.chars().enumerate() {
        if count == longest {
            shown.push_str("...");
            break;
        }
        if letter.is_control() || fields::is_unseen(letter) {
            shown.extend(letter.escape_default());
        } else {
            shown.push(letter);
        }
    }
    shown
}
