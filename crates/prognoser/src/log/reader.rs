//! Rows of a timing log.

use std::io::BufRead;

use super::conditions::ConditionColumn;
use super::error::{LogError, LogErrorKind};
use super::lines::Lines;
use crate::reading::Reading;

/// The columns every log has, in the order of [`Layout::columns`].
const COLUMNS: [&str; 4] = ["valve", "cycle", "close_time_s", "open_time_s"];
const TIME: &str = "time";
/// The word for a stroke that did not arrive.
const STALLED: &str = "stalled";
/// Length to which fields are shortened in messages.
const SHOWN: usize = 40;

/// One row of a timing log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogRow<'a> {
    /// The valve's name.
    pub valve: &'a str,
    /// Its cycle and times.
    pub reading: Reading,
    /// When it was, as written in the log; none without such a column.
    pub time: Option<&'a str>,
    /// Line of the log, from 1.
    pub line: u64,
}

/// Where the columns are.
struct Layout {
    columns: [usize; 4],
    time: Option<usize>,
    conditions: Vec<(usize, ConditionColumn)>,
    unknown: Vec<String>,
    count: usize,
}

/// A timing log, read row by row in constant memory.
pub struct TimingLog<R> {
    name: String,
    lines: Lines<R>,
    layout: Layout,
    empty_is_stalled: bool,
}

impl<R: BufRead> TimingLog<R> {
    /// Reads the header. `name` is what errors call the log.
    ///
    /// # Errors
    /// If the log is empty, or a column is missing or there twice.
    pub fn new(name: impl Into<String>, source: R) -> Result<Self, LogError> {
        let name = name.into();
        let mut lines = Lines::new(source);
        let layout = match lines.next_line() {
            Ok(Some(header)) => Layout::new(header),
            Ok(None) => Err(LogErrorKind::Empty),
            Err(kind) => Err(kind),
        };
        match layout {
            Ok(layout) => Ok(Self { name, lines, layout, empty_is_stalled: false }),
            Err(kind) => Err(LogError { log: name, line: lines.number(), kind }),
        }
    }

    /// Takes an empty time for a stroke that did not arrive, as logs of older
    /// programs have it.
    #[must_use]
    pub fn with_empty_as_stalled(mut self, empty_is_stalled: bool) -> Self {
        self.empty_is_stalled = empty_is_stalled;
        self
    }

    /// The columns that are not understood and not used.
    pub fn unknown_columns(&self) -> &[String] {
        &self.layout.unknown
    }

    /// The next row, none at the end of the log.
    ///
    /// # Errors
    /// If the row cannot be read; the log is of no further use then.
    pub fn next_row(&mut self) -> Result<Option<LogRow<'_>>, LogError> {
        let line = self.lines.number() + 1;
        // Two steps, since the row borrows the line.
        let at = |line, kind| LogError { log: self.name.clone(), line, kind };
        let text = match self.lines.next_line() {
            Ok(None) => return Ok(None),
            Ok(Some(text)) => text,
            Err(kind) => return Err(at(line, kind)),
        };
        self.layout.row(text, line, self.empty_is_stalled).map(Some).map_err(|kind| at(line, kind))
    }
}

impl Layout {
    fn new(header: &str) -> Result<Self, LogErrorKind> {
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
        let time = find(TIME)?;
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
        Ok(Self { columns, time, conditions, unknown, count: names.len() })
    }

    fn row<'a>(&self, text: &'a str, line: u64, empty_is_stalled: bool) -> Result<LogRow<'a>, LogErrorKind> {
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
                let value = column.si(field)?;
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
        if valve.is_empty() {
            return Err(field_error(COLUMNS[0], valve, "the name of a valve"));
        }
        let cycle =
            cycle.parse().map_err(|_| field_error(COLUMNS[1], cycle, "a cycle number: an integer of at least 0"))?;
        let stalled =
            [close, open].map(|field| field.eq_ignore_ascii_case(STALLED) || (empty_is_stalled && field.is_empty()));
        let reading = Reading {
            cycle,
            close_time_s: stroke_time(COLUMNS[2], close)?,
            open_time_s: stroke_time(COLUMNS[3], open)?,
            stalled,
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

fn stroke_time(column: &'static str, field: &str) -> Result<Option<f64>, LogErrorKind> {
    if field.is_empty() || field.eq_ignore_ascii_case(STALLED) {
        return Ok(None);
    }
    match field.parse::<f64>() {
        Ok(time) if time.is_finite() && time >= 0.0 => Ok(Some(time)),
        _ => Err(field_error(
            column,
            field,
            "a time in s of at least 0, nothing if it was not measured, or \"stalled\" if the valve did not get there",
        )),
    }
}

pub(super) fn field_error(column: &'static str, field: &str, expected: &'static str) -> LogErrorKind {
    LogErrorKind::Field { column, found: shortened(field, SHOWN), expected }
}

fn shortened(text: &str, longest: usize) -> String {
    match text.char_indices().nth(longest) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<(String, Reading, Option<String>)>, String> {
        let mut log = TimingLog::new("log.csv", text.as_bytes()).map_err(|e| e.to_string())?;
        let mut rows = Vec::new();
        while let Some(row) = log.next_row().map_err(|e| e.to_string())? {
            rows.push((row.valve.to_owned(), row.reading, row.time.map(str::to_owned)));
        }
        Ok(rows)
    }

    const HEADER: &str = "valve,cycle,close_time_s,open_time_s\n";

    #[test]
    fn reads_rows_in_any_column_order_with_missing_times() {
        let rows = read(
            "\u{feff}time,open_time_s,valve,close_time_s,cycle,note\r\n\
             # a comment\n\n\
             2026-01-01T00:00:00Z, 2.5 ,\"DV,1\",,7,x\r\n",
        )
        .expect("is a log");
        let reading = Reading { cycle: 7, open_time_s: Some(2.5), ..Reading::default() };
        assert_eq!(rows, [("DV,1".into(), reading, Some("2026-01-01T00:00:00Z".into()))]);
    }

    #[test]
    fn says_what_is_wrong_and_where() {
        let cases = [
            ("", "log.csv:1: found an empty file"),
            (
                "valve,cycle,close_time_s\n",
                "log.csv:1: found columns \"valve,cycle,close_time_s\", expected also \"open_time_s\"",
            ),
            ("valve,cycle,close_time_ms,open_time_s\n", "expected also \"close_time_s\""),
            ("valve,valve,cycle,close_time_s,open_time_s\n", "column \"valve\" twice"),
        ];
        let rows = [
            ("A,1,2\n", "log.csv:2: found 3 fields, expected 4"),
            ("A,1,2,3,4\n", "log.csv:2: found 5 fields, expected 4"),
            ("A,0,1,2\nA,1,fast,2\n", "log.csv:3: close_time_s: found \"fast\", expected a time in s"),
            ("A,1,NaN,2\n", "log.csv:2: close_time_s: found \"NaN\""),
            ("A,1,1,inf\n", "log.csv:2: open_time_s: found \"inf\""),
            ("A,1,1,-2\n", "log.csv:2: open_time_s: found \"-2\""),
            ("A,-1,1,2\n", "log.csv:2: cycle: found \"-1\""),
            ("A,1.5,1,2\n", "log.csv:2: cycle: found \"1.5\""),
            (",1,1,2\n", "log.csv:2: valve: found \"\""),
        ];
        for (text, expected) in cases {
            let error = read(text).expect_err(text);
            assert!(error.contains(expected), "{error}");
        }
        for (row, expected) in rows {
            let error = read(&format!("{HEADER}{row}")).expect_err(row);
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn a_huge_line_is_refused_before_it_is_in_memory() {
        let mut text = HEADER.to_owned();
        text.push_str(&"9".repeat(10 << 20));
        let error = read(&text).expect_err("no row is that long");
        assert!(error.starts_with("log.csv:2: found a line of more than 65536 bytes"), "{error}");
        let mut log = TimingLog::new("log", text.as_bytes()).expect("header is fine");
        assert!(log.next_row().is_err());
    }

    #[test]
    fn bytes_that_are_not_text_are_refused() {
        let bytes = [HEADER.as_bytes(), b"A\xff,1,1,2\n"].concat();
        let mut log = TimingLog::new("log", &bytes[..]).expect("header is fine");
        assert!(matches!(log.next_row().expect_err("is no text").kind, LogErrorKind::NotText));
    }
}
