//! Lines of bounded length from any reader.

use std::io::{BufRead, Read};

use super::error::LogErrorKind;

/// Longest line of a timing log, in bytes. A row has some 50.
pub(crate) const LONGEST_LINE: usize = 64 * 1024;

/// Reads lines one after the other into a buffer of bounded size.
pub(crate) struct Lines<R> {
    source: R,
    buffer: Vec<u8>,
    number: u64,
    is_ended: bool,
}

impl<R: BufRead> Lines<R> {
    pub(crate) fn new(source: R) -> Self {
        Self { source, buffer: Vec::new(), number: 0, is_ended: true }
    }

    /// Number of the line read last, from 1.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// Reads the next line; says whether there was one.
    pub(crate) fn next_line(&mut self) -> Result<bool, LogErrorKind> {
        self.buffer.clear();
        self.number += 1;
        let limit = LONGEST_LINE as u64 + 1;
        let read = (&mut self.source).take(limit).read_until(b'\n', &mut self.buffer)?;
        if read == 0 {
            return Ok(false);
        }
        if self.buffer.len() > LONGEST_LINE && self.buffer.last() != Some(&b'\n') {
            self.buffer.clear();
            return Err(LogErrorKind::LongLine { limit: LONGEST_LINE });
        }
        self.is_ended = self.buffer.last() == Some(&b'\n');
        if self.number == 1 && self.buffer.starts_with(b"\xEF\xBB\xBF") {
            self.buffer.drain(..3);
        }
        let end = self.buffer.trim_ascii_end().len();
        self.buffer.truncate(end);
        if std::str::from_utf8(&self.buffer).is_err() {
            self.buffer.clear();
            return Err(LogErrorKind::NotText);
        }
        Ok(true)
    }

    /// Whether the line that was read has an end: the last one of a file may not.
    pub(crate) fn is_ended(&self) -> bool {
        self.is_ended
    }

    /// The line that was read, without its end.
    pub(crate) fn text(&self) -> &str {
        std::str::from_utf8(&self.buffer).unwrap_or_default()
    }
}
