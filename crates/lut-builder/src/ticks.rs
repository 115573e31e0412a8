//! Severities as whole numbers of the last digit that a table's file holds.

use leak_table::Severity;

/// A severity in units of 1e-9 of its file's unit: 1e-9 mm2 for a leak.
pub(crate) type Ticks = u64;

const TICKS_PER_UNIT: f64 = 1e9;

/// The severity in SI: the very number that reading the table's file gives.
pub(crate) fn si(severity: &Severity, ticks: Ticks) -> f64 {
    severity.si_from_file(ticks as f64 / TICKS_PER_UNIT)
}

/// The nearest ticks to a severity in SI; 0 for a negative one.
pub(crate) fn nearest(severity: &Severity, si: f64) -> Ticks {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates at the ends, which is meant"
    )]
    let ticks = (severity.file_from_si(si) * TICKS_PER_UNIT).round() as Ticks;
    ticks
}

/// The `count` ticks that cut the gap between two into equal parts; fewer where it is narrow.
pub(crate) fn between(low: Ticks, high: Ticks, count: u64) -> Vec<Ticks> {
    let mut ticks: Vec<Ticks> = (1..=count).map(|i| low + (high - low) * i / (count + 1)).collect();
    ticks.dedup();
    ticks.retain(|tick| *tick > low && *tick < high);
    ticks
}

#[cfg(test)]
mod tests {
    use leak_table::Degradation;

    use super::*;

    #[test]
    fn severities_are_those_of_the_file() {
        for degradation in Degradation::catalogue() {
            let severity = &degradation.severity;
            for ticks in [1, 654_321_987, 123_456_789_012] {
                let text = format!("{:.9}", severity.file_from_si(si(severity, ticks)));
                let read = severity.si_from_file(text.parse().expect("a number"));
                assert_eq!(read, si(severity, ticks));
                assert_eq!(nearest(severity, read), ticks);
            }
        }
    }

    #[test]
    fn between_stays_inside() {
        assert_eq!(between(0, 8, 3), [2, 4, 6]);
        assert_eq!(between(5, 7, 7), [6]);
        assert!(between(5, 6, 7).is_empty());
    }
}
