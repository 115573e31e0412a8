//! How many decimals the last number of each row has, by which one is told that is cut off where a file ends.

use super::error::LogErrorKind;
use super::layout::{SHOWN, shortened};

/// Rows before the last one by which it is judged: of fewer, all may happen to be long.
const ENOUGH: usize = 4;

/// The decimals of numbers so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decimals {
    fewest: usize,
    rows: usize,
}

impl Default for Decimals {
    fn default() -> Self {
        Self { fewest: usize::MAX, rows: 0 }
    }
}

impl Decimals {
    /// Takes in the last number of a row as it is written. What is no number is not looked at.
    pub(super) fn add(&mut self, number: &str) {
        if let Some(decimals) = decimals(number) {
            self.fewest = self.fewest.min(decimals);
            self.rows += 1;
        }
    }

    /// The refusal of a number at which a file ends without an end of line, if it has fewer decimals than all before.
    pub(super) fn cut_off(&self, number: &str) -> Option<LogErrorKind> {
        let is_short = decimals(number).is_some_and(|decimals| decimals < self.fewest);
        (is_short && self.rows >= ENOUGH)
            .then(|| LogErrorKind::CutOff { found: shortened(number, SHOWN), digits: self.fewest })
    }
}

/// The digits behind the point, or the comma, of a number.
fn decimals(number: &str) -> Option<usize> {
    if !number.starts_with(|first: char| first.is_ascii_digit() || first == '-' || first == '+') {
        return None;
    }
    Some(number.bytes().rev().position(|byte| byte == b'.' || byte == b',').unwrap_or(0))
}
