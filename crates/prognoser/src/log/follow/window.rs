//! A growing file through a window: its bytes from the first one that is not used up on, and a few before it by which the
//! place is known again.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// Bytes before a place that are remembered: who finds other bytes there has another file before him.
pub(super) const TRACE: usize = 256;
/// Bytes that are read at once.
const PIECE: usize = 1 << 16;

/// What came of looking for more bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Grown {
    /// There are more.
    More,
    /// There are none yet.
    End,
    /// The file is no longer the one that was read: it is shorter, or holds something else.
    Changed,
}

/// The bytes at hand of a file.
#[derive(Debug)]
pub(super) struct Window {
    pub(super) file: File,
    /// Place of `bytes[0]` in the file.
    start: u64,
    bytes: Vec<u8>,
    /// Where the first byte that is not used up stands in `bytes`.
    next: usize,
    /// Up to where no end of line is in sight.
    searched: usize,
}

impl Window {
    /// A file from a place on.
    pub(super) fn at(file: File, offset: u64) -> io::Result<Self> {
        let start = offset - offset.min(TRACE as u64);
        let mut bytes = Vec::new();
        read_at(&file, start, offset - start, &mut bytes)?;
        let next = bytes.len();
        Ok(Self { file, start, bytes, next, searched: next })
    }

    /// Place of the first byte that is not used up.
    pub(super) fn offset(&self) -> u64 {
        self.start + self.next as u64
    }

    /// The bytes before that place.
    pub(super) fn trace(&self) -> &[u8] {
        &self.bytes[self.next.saturating_sub(TRACE)..self.next]
    }

    /// Up to where the file was read, and the bytes before that place.
    pub(super) fn read_to(&self) -> (u64, &[u8]) {
        (self.start + self.bytes.len() as u64, &self.bytes[self.bytes.len().saturating_sub(TRACE)..])
    }

    /// What is there and not used up.
    pub(super) fn rest(&self) -> &[u8] {
        &self.bytes[self.next..]
    }

    /// The next whole line without its end, if there is one.
    pub(super) fn line(&mut self) -> Option<&[u8]> {
        let from = self.searched.max(self.next);
        let Some(end) = self.bytes[from..].iter().position(|byte| *byte == b'\n').map(|end| from + end) else {
            self.searched = self.bytes.len();
            return None;
        };
        let line = self.next..end;
        self.next = end + 1;
        self.searched = self.next;
        Some(&self.bytes[line])
    }

    /// Lets go of all that is at hand.
    pub(super) fn skip_rest(&mut self) {
        self.next = self.bytes.len();
        self.searched = self.next;
    }

    /// Looks for more.
    pub(super) fn grow(&mut self) -> io::Result<Grown> {
        if self.next > PIECE {
            let gone = self.next - TRACE;
            self.bytes.drain(..gone);
            self.start += gone as u64;
            (self.next, self.searched) = (TRACE, self.searched - gone);
        }
        let before = self.bytes.len();
        let mut new = Vec::new();
        let read = read_at(&self.file, self.start + before as u64, PIECE as u64, &mut new)?;
        // What was read goes on from what was read before only if that is still there.
        let intact = self.holds(&self.file)?;
        if read > 0 && intact {
            self.bytes.append(&mut new);
            return Ok(Grown::More);
        }
        let whole = self.file.metadata()?.len() >= self.start + before as u64;
        Ok(if intact && whole { Grown::End } else { Grown::Changed })
    }

    /// What was read from a place on, as far as it is at hand.
    pub(super) fn from(&self, place: u64) -> &[u8] {
        let from = usize::try_from(place.saturating_sub(self.start)).unwrap_or(usize::MAX);
        self.bytes.get(from..).unwrap_or_default()
    }

    /// Whether another file holds the bytes that were read last, at their place.
    pub(super) fn holds(&self, file: &File) -> io::Result<bool> {
        let (end, trace) = self.read_to();
        holds(file, end, trace)
    }
}

/// Whether a file has these bytes before a place.
pub(super) fn holds(file: &File, end: u64, trace: &[u8]) -> io::Result<bool> {
    let mut found = Vec::with_capacity(trace.len());
    let Some(start) = end.checked_sub(trace.len() as u64) else { return Ok(false) };
    read_at(file, start, trace.len() as u64, &mut found)?;
    Ok(found == trace)
}

/// Appends up to so many bytes from a place on; how many there were.
pub(super) fn read_at(mut file: &File, place: u64, most: u64, into: &mut Vec<u8>) -> io::Result<usize> {
    file.seek(SeekFrom::Start(place))?;
    file.take(most).read_to_end(into)
}
