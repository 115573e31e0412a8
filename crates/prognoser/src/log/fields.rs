//! The fields of a row, one check each: for the text of a log, and for rows that come as numbers.

use super::conditions::ConditionColumn;
use super::error::LogErrorKind;
use super::layout::{SHOWN, shortened};

/// The word for a stroke that did not arrive.
const STALLED: &str = "stalled";
/// Largest cycle number: beyond it numbers are rounded where they are computed with.
const LARGEST_CYCLE: u64 = 1 << 53;
/// Longest stroke time, s: a day.
const LONGEST_TIME_S: f64 = 86_400.0;
/// What a cycle is.
const CYCLE: &str = "a cycle number: an integer from 0 to 9007199254740992";
/// What a stroke time is.
const TIME: &str =
    "a time in s from 0 to 86400, nothing if it was not measured, or \"stalled\" if the valve did not get there";

/// A stroke of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StrokeField {
    /// Its time, s; none if it was not measured or did not arrive.
    pub time_s: Option<f64>,
    /// Whether it did not arrive.
    pub stalled: bool,
}

/// The columns every log has, in this order, and that of the time of a row.
pub const COLUMNS: [&str; 4] = ["valve", "cycle", "close_time_s", "open_time_s"];
/// See [`COLUMNS`].
pub const TIME_COLUMN: &str = "time";

/// Whether a character has no width or only turns the direction of writing: two names that differ in such look the same.
pub(super) fn is_unseen(letter: char) -> bool {
    matches!(letter, '\u{ad}' | '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}')
}

/// Checks a valve's name.
pub fn valve(name: &str) -> Result<(), LogErrorKind> {
    let refused = |expected| Err(error(COLUMNS[0], name, expected));
    if name.is_empty() {
        return refused("the name of a valve");
    }
    if name.contains(char::is_control) {
        return refused("a name without control characters");
    }
    if !name.is_ascii() && name.contains(is_unseen) {
        return refused(
            "a name without characters that nobody sees; take it out, or the same valve may have two names",
        );
    }
    if name.contains('"') {
        return refused("a name without quotation marks in it");
    }
    Ok(())
}

/// A cycle as text. Programs that have but one kind of number write 7.0, which is whole.
pub fn cycle_of_text(field: &str) -> Result<u64, LogErrorKind> {
    let whole = field.split_once('.').filter(|(_, part)| !part.is_empty() && part.bytes().all(|digit| digit == b'0'));
    whole
        .map_or(field, |(whole, _)| whole)
        .parse()
        .ok()
        .filter(|cycle| *cycle <= LARGEST_CYCLE)
        .ok_or_else(|| error(COLUMNS[1], field, CYCLE))
}

/// A cycle as a number, which has to be whole.
pub fn cycle_of_number(value: f64) -> Result<u64, LogErrorKind> {
    if value.fract() == 0.0 && (0.0..=LARGEST_CYCLE as f64).contains(&value) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole, and within the range")]
        return Ok(value as u64);
    }
    Err(error(COLUMNS[1], &value.to_string(), CYCLE))
}

/// A stroke time as text; nothing is a time that was not measured, or with `empty_is_stalled` a stroke that did not
/// arrive.
pub fn stroke_of_text(column: &'static str, field: &str, empty_is_stalled: bool) -> Result<StrokeField, LogErrorKind> {
    if field.is_empty() {
        return Ok(StrokeField { time_s: None, stalled: empty_is_stalled });
    }
    if field.eq_ignore_ascii_case(STALLED) {
        return Ok(StrokeField { time_s: None, stalled: true });
    }
    // A number that ends in a point was cut off.
    match field.parse::<f64>() {
        Ok(time) if (0.0..=LONGEST_TIME_S).contains(&time) && !field.ends_with('.') => {
            Ok(StrokeField { time_s: Some(time), stalled: false })
        }
        _ => Err(error(column, field, TIME)),
    }
}

/// A stroke time as a number, s: not a number is a time that was not measured, infinity a stroke that did not arrive.
pub fn stroke_of_number(
    column: &'static str,
    time_s: f64,
    empty_is_stalled: bool,
) -> Result<StrokeField, LogErrorKind> {
    if time_s.is_nan() {
        return Ok(StrokeField { time_s: None, stalled: empty_is_stalled });
    }
    if time_s == f64::INFINITY {
        return Ok(StrokeField { time_s: None, stalled: true });
    }
    if (0.0..=LONGEST_TIME_S).contains(&time_s) {
        return Ok(StrokeField { time_s: Some(time_s), stalled: false });
    }
    Err(error(
        column,
        &time_s.to_string(),
        "a time in s from 0 to 86400, NaN if it was not measured, or infinity if the valve did not get there",
    ))
}

impl ConditionColumn {
    /// The value in Pa absolute or in K; none where nothing was written.
    pub fn of_text(self, field: &str) -> Result<Option<f64>, LogErrorKind> {
        if field.is_empty() {
            return Ok(None);
        }
        let si = field.parse::<f64>().ok().and_then(|value| self.si(value));
        si.map(Some).ok_or_else(|| self.refused(field))
    }

    /// The same of a number; not a number is a value that is not known.
    pub fn of_number(self, value: f64) -> Result<Option<f64>, LogErrorKind> {
        if value.is_nan() {
            return Ok(None);
        }
        self.si(value).map(Some).ok_or_else(|| self.refused(&value.to_string()))
    }

    fn refused(self, field: &str) -> LogErrorKind {
        error(self.name(), field, "a number in the unit of the column, or nothing if it is not known")
    }
}

fn error(column: &'static str, field: &str, expected: &'static str) -> LogErrorKind {
    LogErrorKind::Field { column, found: shortened(field, SHOWN), expected }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_mean_what_their_texts_mean() {
        let pressure = ConditionColumn::named("supply_pressure_psig").expect("is a column");
        for (number, text) in
            [(0.25, "0.25"), (0.0, "0"), (86_400.0, "86400"), (f64::NAN, ""), (f64::INFINITY, "stalled")]
        {
            let of_text = stroke_of_text("close_time_s", text, false).expect("is a time");
            assert_eq!(stroke_of_number("close_time_s", number, false).expect("is a time"), of_text, "{text}");
        }
        assert_eq!(
            stroke_of_number("close_time_s", f64::NAN, true).expect("is a stall"),
            StrokeField { time_s: None, stalled: true }
        );
        for (number, text) in [(75.0, "75"), (f64::NAN, "")] {
            assert_eq!(pressure.of_number(number).expect("is one"), pressure.of_text(text).expect("is one"));
        }
        assert_eq!(cycle_of_number(7.0).expect("is one"), cycle_of_text("7").expect("is one"));
        assert_eq!(cycle_of_text("7.00").expect("is whole"), 7);
        for text in ["7.", "7.5", "7.0e1", ".0", "7.0.0"] {
            assert!(cycle_of_text(text).is_err(), "{text}");
        }
    }

    #[test]
    fn what_is_refused_as_text_is_refused_as_a_number() {
        for time in [-1.0, 86_401.0, f64::NEG_INFINITY] {
            assert!(stroke_of_number("open_time_s", time, false).is_err(), "{time}");
        }
        for cycle in [-1.0, 0.5, 1e16, f64::NAN, f64::INFINITY] {
            assert!(cycle_of_number(cycle).is_err(), "{cycle}");
        }
        let kelvin = ConditionColumn::named("temperature_k").expect("is a column");
        for value in [0.0, -3.0, f64::INFINITY] {
            assert!(kelvin.of_number(value).is_err(), "{value}");
        }
    }
}
