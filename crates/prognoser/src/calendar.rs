//! From cycles to dates.
//!
//! The time between cycles is estimated from the log's dates, the recent ones
//! counting more, with its scatter; a date in the future is the last one plus
//! as many cycles.

use serde::{Deserialize, Serialize};

/// Cycles remembered.
const MEMORY: f64 = 200.0;
/// Standard normal quantile of 0.95: dates by which something must be done are
/// early enough for cycles that come faster than usual.
const Z95: f64 = 1.645;
/// Dates beyond this many days are not told.
const LONGEST_DAYS: f64 = 36_525.0;
const DAY_S: f64 = 86_400.0;
/// A time between cycles that is so many times the longest so far is a pause or a wrong date, which the next date tells; once there
/// were so many of them.
const FAR: f64 = 20.0;
const USUAL_FROM: f64 = 5.0;
/// A longer one is no pause but a clock that was set.
const LONGEST_PAUSE_S: f64 = 5.0 * 365.25 * DAY_S;
/// So many dates in succession that lie far behind the others, and that lie before them, are right.
const FAR_ROWS: u32 = 2;
const BACK_ROWS: u32 = 3;
/// No zone is farther from UTC than this, s.
const FARTHEST_ZONE_S: f64 = 14.0 * 3600.0;

/// What a row's date is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dated {
    /// It goes on from those before.
    Well,
    /// It lies before them, or far behind: it is not used until the next ones say the same.
    Oddly,
    /// It is none.
    Not,
}

/// What is known of the dates of a valve's cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Calendar {
    /// The last cycle with a date, and the date in s since 1970.
    last: Option<(u64, f64)>,
    /// The last row whose date was odd, and how many of that kind there were in succession.
    odd: Option<(u64, f64)>,
    odd_rows: u32,
    longest_s: f64,
    intervals: f64,
    mean_s: f64,
    square_s2: f64,
}

impl Calendar {
    /// Takes in the date of a cycle, and says what it is worth.
    pub(crate) fn add(&mut self, cycle: u64, time: &str) -> Dated {
        let Some(now_s) = seconds(time) else { return Dated::Not };
        let now = (cycle, now_s);
        if self.last.is_some_and(|last| last.0 == cycle) {
            // The second stroke of a cycle whose date is known.
            return Dated::Well;
        }
        if let Some(last) = self.last
            && cycle > last.0
        {
            let interval_s = (now_s - last.1) / (cycle - last.0) as f64;
            let is_back = interval_s < 0.0;
            let is_far = self.intervals >= USUAL_FROM && interval_s > FAR * self.longest_s;
            if is_back || is_far {
                let of_kind = self.odd.filter(|odd| now_s >= odd.1 && (odd.1 < last.1) == is_back);
                self.odd_rows = if of_kind.is_some() { self.odd_rows + 1 } else { 1 };
                if self.odd_rows < if is_back { BACK_ROWS } else { FAR_ROWS } {
                    self.odd = Some(now);
                    return Dated::Oddly;
                }
                if let Some(first) = of_kind.filter(|_| is_far) {
                    self.count(last, first);
                    self.count(first, now);
                }
            } else {
                self.count(last, now);
            }
        }
        (self.last, self.odd, self.odd_rows) = (Some(now), None, 0);
        Dated::Well
    }

    /// Counts the time from one cycle to a later one.
    fn count(&mut self, (before, then_s): (u64, f64), (cycle, now_s): (u64, f64)) {
        let cycles = (cycle - before) as f64;
        let interval_s = (now_s - then_s) / cycles;
        if now_s - then_s > LONGEST_PAUSE_S {
            return;
        }
        self.longest_s = self.longest_s.max(interval_s);
        self.intervals = (self.intervals + 1.0).min(MEMORY);
        let share = 1.0 / self.intervals;
        let off = interval_s - self.mean_s;
        self.mean_s += share * off;
        // The scatter of a single cycle, from the mean of several.
        self.square_s2 += share * ((1.0 - share) * off * off * cycles - self.square_s2);
    }

    /// The date of a cycle to come, its expected one.
    pub(crate) fn date(&self, cycle: f64) -> Option<String> {
        self.after(cycle, 0.0)
    }

    /// The date before which a cycle to come will hardly be.
    pub(crate) fn date_at_the_earliest(&self, cycle: f64) -> Option<String> {
        self.after(cycle, Z95)
    }

    fn after(&self, cycle: f64, sigmas: f64) -> Option<String> {
        let (last, last_s) = self.last.filter(|_| self.intervals > 0.0)?;
        let cycles = (cycle - last as f64).max(0.0);
        let wait_s = (cycles * self.mean_s - sigmas * (cycles * self.square_s2.max(0.0)).sqrt()).max(0.0);
        (wait_s < LONGEST_DAYS * DAY_S).then(|| rfc3339(last_s + wait_s))
    }
}

/// Seconds since 1970 of an RFC 3339 date.
pub(crate) fn seconds(text: &str) -> Option<f64> {
    let bytes = text.as_bytes();
    let number = |from: usize, to: usize| -> Option<f64> {
        let part = text.get(from..to)?;
        part.bytes().all(|byte| byte.is_ascii_digit()).then(|| part.parse().ok())?
    };
    let separators = [(4, b"--"), (7, b"--"), (10, b"Tt"), (13, b"::"), (16, b"::")];
    let space = bytes.get(10) == Some(&b' ');
    if !separators
        .iter()
        .all(|(at, either)| bytes.get(*at).is_some_and(|byte| either.contains(byte)) || (*at == 10 && space))
    {
        return None;
    }
    let (year, month, day) = (number(0, 4)?, number(5, 7)?, number(8, 10)?);
    let (hour, minute, second) = (number(11, 13)?, number(14, 16)?, number(17, 19)?);
    let in_range = (1.0..=12.0).contains(&month) && day >= 1.0 && hour < 24.0 && minute < 60.0 && second < 61.0;
    let next = if month < 12.0 { days(year, month + 1.0, 1.0) } else { days(year + 1.0, 1.0, 1.0) };
    let is_in_month = days(year, month, day) < next;
    let rest = &text[19..];
    let zone_at = rest.find(['Z', 'z', '+', '-'])?;
    let fraction = if zone_at == 0 { 0.0 } else { format!("0{}", &rest[..zone_at]).parse().ok()? };
    let zone = &rest[zone_at..];
    let offset_s = match zone {
        "Z" | "z" => 0.0,
        _ => {
            let (hours, minutes) = zone.get(1..)?.split_once(':')?;
            let size =
                3600.0 * hours.parse::<u8>().ok().map(f64::from)? + 60.0 * minutes.parse::<u8>().ok().map(f64::from)?;
            if zone.starts_with('-') { -size } else { size }
        }
    };
    let is_date = in_range && is_in_month && f64::abs(offset_s) <= FARTHEST_ZONE_S;
    is_date.then(|| DAY_S * days(year, month, day) + 3600.0 * hour + 60.0 * minute + second + fraction - offset_s)
}

/// Days from 1970 to a date of the Gregorian calendar (H. Hinnant, "chrono-compatible
/// low-level date algorithms", 2013: `days_from_civil`).
fn days(year: f64, month: f64, day: f64) -> f64 {
    let year = if month <= 2.0 { year - 1.0 } else { year };
    let era = (year / 400.0).floor();
    let of_era = year - era * 400.0;
    let shifted = if month > 2.0 { month - 3.0 } else { month + 9.0 };
    let of_year = ((153.0 * shifted + 2.0) / 5.0).floor() + day - 1.0;
    let day_of_era = of_era * 365.0 + (of_era / 4.0).floor() - (of_era / 100.0).floor() + of_year;
    era * 146_097.0 + day_of_era - 719_468.0
}

/// The other way round (the same source: `civil_from_days`), in UTC to the second.
fn rfc3339(seconds: f64) -> String {
    let whole = seconds.floor();
    let day = (whole / DAY_S).floor();
    let of_day = whole - day * DAY_S;
    let z = day + 719_468.0;
    let era = (z / 146_097.0).floor();
    let of_era = z - era * 146_097.0;
    let year = ((of_era - (of_era / 1460.0).floor() + (of_era / 36_524.0).floor() - (of_era / 146_096.0).floor())
        / 365.0)
        .floor();
    let of_year = of_era - (365.0 * year + (year / 4.0).floor() - (year / 100.0).floor());
    let shifted = ((5.0 * of_year + 2.0) / 153.0).floor();
    let day = of_year - ((153.0 * shifted + 2.0) / 5.0).floor() + 1.0;
    let month = if shifted < 10.0 { shifted + 3.0 } else { shifted - 9.0 };
    let year = year + era * 400.0 + f64::from(u8::from(month <= 2.0));
    let (hour, rest) = ((of_day / 3600.0).floor(), of_day % 3600.0);
    let (minute, second) = ((rest / 60.0).floor(), rest % 60.0);
    format!("{year:04.0}-{month:02.0}-{day:02.0}T{hour:02.0}:{minute:02.0}:{second:02.0}Z")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_go_there_and_back() {
        for text in ["1970-01-01T00:00:00Z", "2000-02-29T12:34:56Z", "2026-11-22T23:59:59Z", "2100-03-01T00:00:00Z"] {
            assert_eq!(rfc3339(seconds(text).expect("a date")), text);
        }
        assert_eq!(seconds("2026-01-01T01:00:00.5+01:00"), seconds("2026-01-01T00:00:00.5Z"));
        assert_eq!(seconds("2026-01-01 00:00:00-02:30"), seconds("2026-01-01T02:30:00Z"));
        for text in [
            "",
            "yesterday",
            "2026-13-01T00:00:00Z",
            "2026-01-01",
            "2026-01-01T00:00:00",
            "2026-02-29T00:00:00Z",
            "2026-06-31T00:00:00Z",
            "2026-01-01T00:00:00+99:99",
        ] {
            assert_eq!(seconds(text), None, "{text}");
        }
    }

    #[test]
    fn a_cycle_a_day_ends_as_many_days_later() {
        let mut calendar = Calendar::default();
        for day in 1..=9 {
            assert_eq!(calendar.add(day, &format!("2026-01-0{day}T06:00:00Z")), Dated::Well);
        }
        assert_eq!(calendar.date(19.0).as_deref(), Some("2026-01-19T06:00:00Z"));
        assert_eq!(calendar.date_at_the_earliest(19.0).as_deref(), Some("2026-01-19T06:00:00Z"));
        assert_eq!(Calendar::default().date(3.0), None);
    }

    #[test]
    fn a_date_that_stands_alone_moves_no_other() {
        let date = |day: u64| format!("2026-01-{day:02}T06:00:00Z");
        for wrong in ["2025-01-10T06:00:00Z", "2026-10-01T06:00:00Z", "2126-01-10T06:00:00Z", "1970-01-01T00:00:00Z"] {
            let mut calendar = Calendar::default();
            let told: Vec<Dated> =
                (1..=17).map(|day| calendar.add(day, &if day == 10 { wrong.to_owned() } else { date(day) })).collect();
            assert!(
                told.iter().zip(1..).all(|(told, day)| (*told == Dated::Oddly) == (day == 10)),
                "{wrong}: {told:?}"
            );
            assert_eq!(calendar.date(25.0).as_deref(), Some("2026-01-25T06:00:00Z"), "{wrong}");
        }
        // The last row alone.
        let mut calendar = Calendar::default();
        (1..=16).for_each(|day| {
            calendar.add(day, &date(day));
        });
        assert_eq!(calendar.add(17, "2126-01-17T06:00:00Z"), Dated::Oddly);
        assert_eq!(calendar.date(25.0).as_deref(), Some("2026-01-25T06:00:00Z"));
    }

    #[test]
    fn what_works_in_bursts_ends_after_as_many_bursts() {
        // Ten cycles a minute apart, once a day.
        let mut calendar = Calendar::default();
        let mut odd = 0;
        for cycle in 0..200_u64 {
            let time = format!("2026-01-{:02}T06:{:02}:00Z", 1 + cycle / 10, cycle % 10);
            odd += usize::from(calendar.add(cycle, &time) == Dated::Oddly);
        }
        assert_eq!(odd, 1, "a first pause may be a wrong date, and the next date says that it is none");
        let date = calendar.date(299.0).expect("a date");
        assert!(date.starts_with("2026-01-29") || date.starts_with("2026-01-30"), "{date}");
    }

    #[test]
    fn a_clock_that_is_set_right_is_believed() {
        let mut calendar = Calendar::default();
        for day in 1..=8 {
            calendar.add(day, &format!("1970-01-0{day}T00:00:00Z"));
        }
        let told: Vec<Dated> = (9..=20).map(|day| calendar.add(day, &format!("2026-01-{day:02}T00:00:00Z"))).collect();
        assert_eq!(told[..3], [Dated::Oddly, Dated::Well, Dated::Well], "{told:?}");
        assert_eq!(calendar.date(25.0).as_deref(), Some("2026-01-25T00:00:00Z"));
    }
}
