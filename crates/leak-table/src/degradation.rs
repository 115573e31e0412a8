//! What wears, as data: nothing else in this crate or in a builder asks which degradation it has.

use std::borrow::Cow;

use crate::error::TableError;
use crate::id::DegradationId;
use crate::stroke::{Monotone, Stroke};

/// One way in which a valve degrades: a leak, friction, a spring that weakens.
///
/// The severity is 0 in a valve that is as its file says, and grows with wear, whatever wears. A
/// catalogue comes along ([`Degradation::catalogue`]); a builder may be given others, and a bundle
/// read from files carries the descriptions of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Degradation {
    /// The name in files and output: "friction".
    pub id: DegradationId,
    /// In words: "friction of piston and rod".
    pub name: Cow<'static, str>,
    /// In as few words as will do, for a line of text: "friction".
    pub short: Cow<'static, str>,
    /// What it is measured by.
    pub severity: Severity,
    /// Which stroke times it moves, and in which direction.
    pub moves: Moves,
    /// How often it is met, relative to the others of a bundle. All are 1 in the catalogue: nobody has
    /// counted yet.
    pub prior: f64,
}

/// The quantity that says how far a degradation has come.
#[derive(Clone, Debug, PartialEq)]
pub struct Severity {
    /// In words: "leak area".
    pub quantity: Cow<'static, str>,
    /// Its unit in files: "mm2"; empty for a share.
    pub unit: Cow<'static, str>,
    /// Its column in a table's file, unit included: `leak_area_mm2`.
    pub column: Cow<'static, str>,
    /// How many of the file's units make one SI unit: 1e6 for areas in mm2.
    pub per_si: f64,
}

/// The direction in which each stroke time goes as the severity grows. A time without one is hardly
/// moved: it stays as it is over much of the range, and need not tell the severity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Moves {
    /// Of the closing time.
    pub close: Option<Monotone>,
    /// Of the opening time.
    pub open: Option<Monotone>,
}

impl Moves {
    /// The direction of one stroke's time.
    #[must_use]
    pub const fn stroke(self, stroke: Stroke) -> Option<Monotone> {
        match stroke {
            Stroke::Close => self.close,
            Stroke::Open => self.open,
        }
    }
}

impl Severity {
    /// A severity in the unit of files, from SI.
    #[must_use]
    pub fn file_from_si(&self, si: f64) -> f64 {
        si * self.per_si
    }

    /// A severity in SI, from the unit of files.
    #[must_use]
    pub fn si_from_file(&self, in_file: f64) -> f64 {
        in_file / self.per_si
    }

    /// A severity, given in SI, with its unit: "0.25 mm2", "0.4".
    #[must_use]
    pub fn text(&self, si: f64) -> String {
        self.file_text(self.file_from_si(si))
    }

    /// The same from a value in the unit of files.
    pub(crate) fn file_text(&self, in_file: f64) -> String {
        if self.unit.is_empty() { in_file.to_string() } else { format!("{in_file} {}", self.unit) }
    }
}

impl Degradation {
    /// Checks what a manifest may have wrong: ids and columns that no file could have, numbers that are none.
    pub(crate) fn check(&self) -> Result<(), TableError> {
        let refuse =
            |found: String, expected| Err(TableError::Degradation { id: self.id.to_string(), found, expected });
        let plain = |text: &str| {
            let letter = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"-_".contains(&byte);
            !text.is_empty() && text.bytes().all(letter)
        };
        for text in [&*self.id, &*self.severity.column] {
            if !plain(text) {
                return refuse(format!("the name \"{text}\""), "lower-case letters, digits, - and _");
            }
        }
        if !(self.severity.per_si > 0.0 && self.severity.per_si.is_finite()) {
            return refuse(format!("{} file units per SI unit", self.severity.per_si), "a number above 0");
        }
        if !(self.prior > 0.0 && self.prior.is_finite()) {
            return refuse(format!("a prior weight of {}", self.prior), "a number above 0");
        }
        if self.moves.close.or(self.moves.open).is_none() {
            return refuse("no stroke time that it moves".to_owned(), "at least one");
        }
        Ok(())
    }
}
