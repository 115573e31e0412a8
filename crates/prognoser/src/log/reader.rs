//! Rows of a timing log.

use std::io::BufRead;

use super::decimals::Decimals;
use super::error::{LogError, LogErrorKind};
use super::layout::Layout;
use super::lines::Lines;
use crate::reading::Reading;

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

/// A timing log, read row by row in constant memory.
pub struct TimingLog<R> {
    name: String,
    lines: Lines<R>,
    layout: Layout,
    empty_is_stalled: bool,
    decimals: Decimals,
}

impl<R: BufRead> TimingLog<R> {
    /// Reads the header. `name` is what errors call the log.
    ///
    /// # Errors
    /// If the log is empty, or a column is missing or there twice.
    pub fn new(name: impl Into<String>, source: R) -> Result<Self, LogError> {
        let name = name.into();
        let mut lines = Lines::new(source);
        let layout = loop {
            match lines.next_line() {
                Ok(true) if lines.text().is_empty() || lines.text().starts_with('#') => {}
                Ok(true) => break Layout::new(lines.text()),
                Ok(false) => break Err(LogErrorKind::Empty),
                Err(kind) => break Err(kind),
            }
        };
        match layout {
            Ok(layout) => Ok(Self { name, lines, layout, empty_is_stalled: false, decimals: Decimals::default() }),
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
        self.layout.unknown()
    }

    /// The next row, none at the end of the log.
    ///
    /// # Errors
    /// If the row cannot be read. Where only this line is no row ([`LogErrorKind::is_row`]) the next one may be.
    pub fn next_row(&mut self) -> Result<Option<LogRow<'_>>, LogError> {
        loop {
            let line = self.lines.number() + 1;
            let at = |line, kind| LogError { log: self.name.clone(), line, kind };
            match self.lines.next_line() {
                Ok(false) => return Ok(None),
                Ok(true) if self.layout.is_nothing(self.lines.text()) => {}
                Ok(true) => {
                    if let Some(number) = self.layout.last_number(self.lines.text()) {
                        let cut_off = if self.lines.is_ended() { None } else { self.decimals.cut_off(number) };
                        if let Some(kind) = cut_off {
                            return Err(at(line, kind));
                        }
                        self.decimals.add(number);
                    }
                    let row = self.layout.row(self.lines.text(), line, self.empty_is_stalled);
                    return row.map(Some).map_err(|kind| at(line, kind));
                }
                Err(kind) => return Err(at(line, kind)),
            }
        }
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
