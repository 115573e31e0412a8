//! Bytes in the order that a segment has them in.

use crate::bits::unsigned;

/// Why a file cannot be read.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Fault {
    /// It ends too early.
    Cut,
    /// It cannot be as it is.
    Broken(String),
    /// It may be right, and is not read.
    NotRead { found: String, instead: &'static str },
}

/// Bytes still to be read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bytes<'a> {
    pub rest: &'a [u8],
    /// Whether the highest byte of a number comes first.
    pub big: bool,
}

impl<'a> Bytes<'a> {
    pub fn take(&mut self, length: u64) -> Result<&'a [u8], Fault> {
        let length = usize::try_from(length).map_err(|_| Fault::Cut)?;
        let (taken, rest) = self.rest.split_at_checked(length).ok_or(Fault::Cut)?;
        self.rest = rest;
        Ok(taken)
    }

    pub fn u32(&mut self) -> Result<u32, Fault> {
        let word = unsigned(self.take(4)?, self.big);
        // Four bytes fit.
        Ok(u32::try_from(word).unwrap_or_default())
    }

    pub fn u64(&mut self) -> Result<u64, Fault> {
        Ok(unsigned(self.take(8)?, self.big))
    }

    /// A text with its length before it.
    pub fn text(&mut self) -> Result<String, Fault> {
        let length = self.u32()?;
        Ok(String::from_utf8_lossy(self.take(length.into())?).into_owned())
    }
}
