//! Types of values, and the values of a channel.

use super::bytes::Fault;
use crate::bits::{floating, signed, unsigned};

/// Seconds from the beginning of TDMS times, 1904, to that of Unix times, 1970.
const UNIX_EPOCH_S: i64 = 2_082_844_800;

/// A type of values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Signed(u8),
    Unsigned(u8),
    Single,
    Double,
    Boolean,
    Text,
    Time,
    /// No number of ours, so many bytes long.
    Unknown(u8, &'static str),
}

/// The values of a channel so far.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Raw {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
    /// Times in RFC 3339, UTC.
    Times(Vec<String>),
    Unknown {
        rows: usize,
        what: &'static str,
    },
}

impl Kind {
    /// The type of a code; none where nobody can say how long its values are.
    pub fn of(code: u32) -> Option<Self> {
        Some(match code {
            1 => Self::Signed(1),
            2 => Self::Signed(2),
            3 => Self::Signed(4),
            4 => Self::Signed(8),
            5 => Self::Unsigned(1),
            6 => Self::Unsigned(2),
            7 => Self::Unsigned(4),
            8 => Self::Unsigned(8),
            9 | 0x19 => Self::Single,
            10 | 0x1a => Self::Double,
            0x20 => Self::Text,
            0x21 => Self::Boolean,
            0x44 => Self::Time,
            0x0008_000c => Self::Unknown(8, "complex numbers"),
            0x0010_000d => Self::Unknown(16, "complex numbers"),
            _ => return None,
        })
    }

    /// Bytes of a value; a text has its end here, and itself elsewhere.
    pub fn size(self) -> u64 {
        match self {
            Self::Signed(size) | Self::Unsigned(size) | Self::Unknown(size, _) => size.into(),
            Self::Boolean => 1,
            Self::Single | Self::Text => 4,
            Self::Double => 8,
            Self::Time => 16,
        }
    }

    /// A value of a type with numbers.
    pub fn number(self, bytes: &[u8], big: bool) -> f64 {
        match self {
            Self::Signed(_) => signed(bytes, big) as f64,
            Self::Unsigned(_) => unsigned(bytes, big) as f64,
            Self::Boolean => f64::from(u8::from(unsigned(bytes, big) != 0)),
            Self::Single | Self::Double => floating(bytes, big),
            Self::Text | Self::Time | Self::Unknown(..) => f64::NAN,
        }
    }

    /// No values yet.
    pub fn none(self) -> Raw {
        match self {
            Self::Text => Raw::Texts(Vec::new()),
            Self::Time => Raw::Times(Vec::new()),
            Self::Unknown(_, what) => Raw::Unknown { rows: 0, what },
            _ => Raw::Numbers(Vec::new()),
        }
    }
}

impl Raw {
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(numbers) => numbers.len(),
            Self::Texts(texts) | Self::Times(texts) => texts.len(),
            Self::Unknown { rows, .. } => *rows,
        }
    }

    /// Takes a value of a type with a fixed length.
    pub fn push(&mut self, kind: Kind, bytes: &[u8], big: bool) {
        match self {
            Self::Numbers(numbers) => numbers.push(kind.number(bytes, big)),
            Self::Times(texts) => texts.push(time(bytes, big).map(shown).unwrap_or_default()),
            Self::Texts(texts) => texts.push(String::new()),
            Self::Unknown { rows, .. } => *rows += 1,
        }
    }

    /// Takes texts: first where each ends, then all of them.
    pub fn push_texts(&mut self, ends: &[u8], all: &[u8], big: bool) -> Result<(), Fault> {
        let Self::Texts(texts) = self else { return Ok(()) };
        let mut start = 0;
        for end in ends.chunks_exact(4) {
            let end = usize::try_from(unsigned(end, big)).unwrap_or(usize::MAX);
            let text = all.get(start..end).ok_or_else(|| Fault::Broken("a text ends where no text is".to_owned()))?;
            texts.push(String::from_utf8_lossy(text).into_owned());
            start = end;
        }
        Ok(())
    }
}

/// A time as seconds since 1904 and the part of a second behind them, in 2^-64 s.
pub(super) fn time(bytes: &[u8], big: bool) -> Option<(i64, u64)> {
    let (first, last) = bytes.split_at_checked(8)?;
    let (seconds, fraction) = if big { (first, last) } else { (last, first) };
    Some((signed(seconds, big), unsigned(fraction, big)))
}

/// A time in RFC 3339; nothing for one that was never set.
fn shown((seconds, fraction): (i64, u64)) -> String {
    if (seconds, fraction) == (0, 0) {
        return String::new();
    }
    let nanoseconds = (u128::from(fraction) * 1_000_000_000) >> 64;
    let moment = seconds.checked_sub(UNIX_EPOCH_S).zip(i32::try_from(nanoseconds).ok());
    moment
        .and_then(|(seconds, nanoseconds)| jiff::Timestamp::new(seconds, nanoseconds).ok())
        .map_or_else(String::new, |moment| moment.to_string())
}
