//! Times written as timestamps.

use jiff::civil::{Date, DateTime, Time};
use jiff::{Timestamp, tz::TimeZone};

use crate::{Notice, NoticeKind};

/// Turns timestamps of one column into seconds from the first of them.
///
/// The first field decides how all are written. A zone or an offset counts where it is written; without one, the
/// clock is taken to run on through the night. Clock times without a date begin a new day where they jump back by
/// more than half a day.
#[derive(Debug, Clone, Default)]
pub struct Clock {
    format: Option<Format>,
    first_ns: i128,
    last_ns: i128,
    days: i128,
    notice: Option<Notice>,
}

/// Turns timestamps and dates of one column into moments: a date alone is its midnight, and without a zone it is UTC.
///
/// The first field decides how all are written.
#[derive(Debug, Clone, Default)]
pub struct Dates {
    format: Option<Format>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Format {
    Zoned,
    Iso,
    IsoZoned,
    Civil(&'static str, &'static str),
    CivilZoned(&'static str, &'static str),
    Clock(&'static str),
    Date(&'static str, &'static str),
}

const DAY_NS: i128 = 86_400_000_000_000;

/// How dates without zone are written, and what that is called.
const CIVIL: [(&str, &str); 8] = [
    ("%d.%m.%Y %H:%M:%S%.f", "day.month.year, without a zone"),
    ("%Y/%m/%d %H:%M:%S%.f", "year/month/day, without a zone"),
    ("%m/%d/%Y %I:%M:%S%.f %p", "month/day/year, without a zone"),
    ("%m/%d/%Y %H:%M:%S%.f", "month/day/year, without a zone"),
    ("%d/%m/%Y %H:%M:%S%.f", "day/month/year, without a zone"),
    ("%d-%m-%Y %H:%M:%S%.f", "day-month-year, without a zone"),
    ("%d.%m.%y %H:%M:%S%.f", "day.month.year, without a zone"),
    ("%d-%b-%Y %H:%M:%S%.f", "day-month-year, without a zone"),
];
/// The same to the minute, as spreadsheets show them.
const MINUTES: [(&str, &str); 4] = [
    ("%Y-%m-%d %H:%M", "year-month-day, without a zone"),
    ("%d.%m.%Y %H:%M", "day.month.year, without a zone"),
    ("%m/%d/%Y %H:%M", "month/day/year, without a zone"),
    ("%d/%m/%Y %H:%M", "day/month/year, without a zone"),
];
/// Dates alone.
const DATES: [(&str, &str); 6] = [
    ("%Y-%m-%d", "year-month-day"),
    ("%Y/%m/%d", "year/month/day"),
    ("%d.%m.%Y", "day.month.year"),
    ("%m/%d/%Y", "month/day/year"),
    ("%d/%m/%Y", "day/month/year"),
    ("%d-%b-%Y", "day-month-year"),
];
const CLOCK: [&str; 2] = ["%H:%M:%S%.f", "%I:%M:%S%.f %p"];

/// What the first ones are called with a zone behind them.
const WITH_ZONE: [&str; 6] = [
    "day.month.year, with its zone",
    "year/month/day, with its zone",
    "month/day/year, with its zone",
    "day/month/year, with its zone",
    "day-month-year, with its zone",
    "year-month-day, with its zone",
];
/// Zones by their name, with what they are ahead of UTC, h.
const ZONES: [(&str, i64); 7] = [("UTC", 0), ("GMT", 0), ("MEZ", 1), ("CET", 1), ("MESZ", 2), ("CEST", 2), ("Z", 0)];

/// A text without the zone behind its time of the day, and how far that is ahead of UTC, s: `+01:00`, `+0100`, `+01`, `UTC`,
/// with or without a blank before it.
fn zone_at_end(text: &str) -> Option<(&str, i64)> {
    let named =
        ZONES.into_iter().find_map(|(name, ahead_h)| Some((text.strip_suffix(name)?.trim_end(), ahead_h * 3600)));
    let offset = || {
        let (moment, offset) = text.split_at(text.rfind(['+', '-'])?);
        let digits: String = offset[1..].chars().filter(|character| *character != ':').collect();
        let known = matches!(offset.len(), 3 | 5 | 6) && digits.bytes().all(|digit| digit.is_ascii_digit());
        let (hours, minutes) = digits.split_at_checked(2).filter(|_| known)?;
        let ahead_s = hours.parse::<i64>().ok()? * 3600 + minutes.parse::<i64>().unwrap_or(0) * 60;
        Some((moment.trim_end(), if offset.starts_with('-') { -ahead_s } else { ahead_s }))
    };
    // The last part of a date is no zone.
    named.or_else(offset).filter(|(moment, _)| moment.contains(':'))
}

/// Whether a date in one column and a time of the day in another one are a moment together.
pub(crate) fn are_a_moment(date: &str, time: &str) -> bool {
    let moment = |text: &str| Clock::recognised(&text.replace(',', ".")).is_some();
    let parted = !date.trim().is_empty() && !date.contains(':') && time.contains(':');
    parted && !moment(date) && moment(&format!("{date} 00:00:00")) && moment(&format!("{date} {time}"))
}

impl Clock {
    /// The forms of time that are read, with examples, for a message.
    pub const FORMS: &str = "2026-11-17 08:36:03.120 (or with a T), 17.11.2026 08:36:03,120, 2026/11/17 08:36:03, \
                             11/17/2026 8:36:03 AM, 17/11/2026 08:36:03, 17-11-2026 08:36:03 or 17-Nov-2026 08:36:03, each \
                             also with a zone such as Z or +01:00 behind it, or 08:36:03.120 alone";

    /// Seconds from the first timestamp, or `None` where the field is none (or written unlike the first).
    pub fn seconds(&mut self, field: &str, line: usize) -> Option<f64> {
        let text = field.trim().replace(',', ".");
        let text = text.as_str();
        let Some(format) = self.format else {
            let (format, ns) = Self::recognised(text)?;
            (self.format, self.first_ns, self.last_ns) = (Some(format), ns, ns);
            let kind = NoticeKind::Timestamps { example: field.trim().to_owned(), format: format.name() };
            self.notice = Some(Notice { line, kind });
            return Some(0.0);
        };
        let mut ns = format.read(text)?;
        if matches!(format, Format::Clock(_)) {
            if ns + self.days * DAY_NS < self.last_ns - DAY_NS / 2 {
                self.days += 1;
            }
            ns += self.days * DAY_NS;
        }
        self.last_ns = ns;
        Some((ns - self.first_ns) as f64 / 1e9)
    }

    /// That times are timestamps, and how they were read; `None` before the first one.
    #[must_use]
    pub fn notice(&self) -> Option<&Notice> {
        self.notice.as_ref()
    }

    fn recognised(text: &str) -> Option<(Format, i128)> {
        let mut all = Format::moments().chain(CLOCK.into_iter().map(Format::Clock));
        all.find_map(|format| Some((format, format.read(text)?)))
    }
}

impl Dates {
    /// The moment in RFC 3339, UTC, or `None` where the field is none (or written unlike the first).
    pub fn rfc3339(&mut self, field: &str) -> Option<String> {
        let text = field.trim().replace(',', ".");
        let format = self.format.or_else(|| Self::recognised(&text))?;
        let moment = Timestamp::from_nanosecond(format.read(&text)?).ok()?;
        self.format = Some(format);
        Some(moment.to_string())
    }

    /// How the fields are written; `None` before the first one.
    #[must_use]
    pub fn written(&self) -> Option<&'static str> {
        self.format.map(Format::name)
    }

    fn recognised(text: &str) -> Option<Format> {
        let dates = DATES.into_iter().map(|(format, name)| Format::Date(format, name));
        let mut all = Format::moments().chain(dates);
        all.find(|format| format.read(text).is_some())
    }
}

impl Format {
    /// How a date with the time of that day may be written.
    fn moments() -> impl Iterator<Item = Self> {
        let civil = || CIVIL.into_iter().chain(MINUTES);
        let zoned = civil().map(|(format, name)| Self::CivilZoned(format, name));
        [Self::Zoned, Self::Iso, Self::IsoZoned]
            .into_iter()
            .chain(civil().map(|(format, name)| Self::Civil(format, name)))
            .chain(zoned)
    }

    fn name(self) -> &'static str {
        match self {
            Self::Zoned | Self::IsoZoned => "a time with its zone",
            Self::CivilZoned(_, name) => {
                let date = name.trim_end_matches(", without a zone");
                WITH_ZONE.into_iter().find(|with| with.starts_with(date)).unwrap_or("a time with its zone")
            }
            Self::Iso => "year-month-day, without a zone",
            Self::Civil(_, name) | Self::Date(_, name) => name,
            Self::Clock(_) => "a time of the day",
        }
    }

    fn read(self, text: &str) -> Option<i128> {
        let civil = |at: DateTime| Some(at.to_zoned(TimeZone::UTC).ok()?.timestamp().as_nanosecond());
        match self {
            Self::Zoned => Some(text.parse::<Timestamp>().ok()?.as_nanosecond()),
            // A bare date would be taken for midnight.
            Self::Iso if text.contains(':') => civil(text.parse::<DateTime>().ok()?),
            Self::Iso => None,
            Self::IsoZoned => Self::Iso.read_with_zone(text),
            Self::CivilZoned(format, name) => Self::Civil(format, name).read_with_zone(text),
            Self::Civil(format, _) => civil(DateTime::strptime(format, text).ok()?),
            Self::Clock(format) => {
                let at = Time::strptime(format, text).ok()?;
                civil(DateTime::from_parts(jiff::civil::date(2000, 1, 1), at))
            }
            Self::Date(format, _) => civil(Date::strptime(format, text).ok()?.to_datetime(Time::midnight())),
        }
    }

    /// The moment of a text with its zone at the end, the rest of it being in this format.
    fn read_with_zone(self, text: &str) -> Option<i128> {
        let (moment, offset_s) = zone_at_end(text)?;
        Some(self.read(moment)? - i128::from(offset_s) * 1_000_000_000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(fields: &[&str]) -> Vec<Option<f64>> {
        let mut clock = Clock::default();
        fields.iter().enumerate().map(|(line, field)| clock.seconds(field, line + 2)).collect()
    }

    #[test]
    fn timestamps_become_seconds_from_the_first() {
        for fields in [
            ["2026-03-01T12:00:00.500Z", "2026-03-01T13:00:01.750+01:00"],
            ["2026-03-01 12:00:00.500", "2026-03-01 12:00:01.750"],
            ["01.03.2026 12:00:00,500", "01.03.2026 12:00:01,750"],
            ["3/1/2026 11:59:59.500 AM", "3/1/2026 12:00:00.750 PM"],
            ["13/01/2026 12:00:00.5", "13/01/2026 12:00:01.75"],
            ["2026/03/01 12:00:00.5", "2026/03/01 12:00:01.75"],
            ["17.11.2026 08:36:03,120 +01:00", "17.11.2026 08:36:04,370 +01:00"],
            ["17.11.2026 08:36:03.120+01:00", "17.11.2026 07:36:04.370+00:00"],
            ["17.11.2026 08:36:03.120 +0100", "17.11.2026 06:36:04.370 -01"],
            ["11/17/2026 8:36:03.120 AM UTC", "11/17/2026 8:36:04.370 AM UTC"],
            ["2026-11-17 08:36:03,120 +01:00", "2026-11-17 08:36:04,370 +01:00"],
            ["17-11-2026 08:36:03.120 MEZ", "17-11-2026 09:36:04.370 MESZ"],
            ["23:59:59.500", "00:00:00.750"],
        ] {
            assert_eq!(seconds(&fields), [Some(0.0), Some(1.25)], "{fields:?}");
        }
        // Over the night in which clocks are put back, the zone counts.
        assert_eq!(seconds(&["2026-10-25T02:59:59+02:00", "2026-10-25T02:00:00+01:00"]), [Some(0.0), Some(1.0)]);
    }

    #[test]
    fn a_date_and_a_time_of_the_day_are_a_moment() {
        for (date, time) in [
            ("2024-11-27", "23:59:00"),
            ("2024-11-27", "23:59"),
            ("27.11.2024", "23:59:00,250"),
            ("27.11.24", "23:59:00"),
            ("11/27/2024", "11:59:00.5 PM"),
            ("27-Nov-2024", "23:59:00"),
        ] {
            assert!(are_a_moment(date, time), "{date} {time}");
        }
        for (date, time) in
            [("2024-11-27", "7.25"), ("7", "23:59:00"), ("", "23:59:00"), ("2024-11-27", ""), ("1.5", "2.5")]
        {
            assert!(!are_a_moment(date, time), "{date} {time}");
        }
    }

    #[test]
    fn dates_are_moments_in_utc() {
        for (field, moment) in [
            ("2026-03-01T13:00:01.5+01:00", "2026-03-01T12:00:01.5Z"),
            ("2026-03-01 12:00:00", "2026-03-01T12:00:00Z"),
            ("01.03.2026 12:00", "2026-03-01T12:00:00Z"),
            ("01.03.2026", "2026-03-01T00:00:00Z"),
            ("2026-03-01", "2026-03-01T00:00:00Z"),
            ("3/1/2026 2:00:00 PM", "2026-03-01T14:00:00Z"),
            ("01-Mar-2026", "2026-03-01T00:00:00Z"),
        ] {
            assert_eq!(Dates::default().rfc3339(field).as_deref(), Some(moment), "{field}");
        }
        let mut dates = Dates::default();
        assert!(dates.rfc3339("3/1/2026").is_some());
        assert_eq!((dates.rfc3339("13/1/2026"), dates.written()), (None, Some("month/day/year")));
        for field in ["", "12:00:00", "7", "yesterday", "45000.5"] {
            assert_eq!(Dates::default().rfc3339(field), None, "{field}");
        }
    }

    #[test]
    fn what_is_no_timestamp_is_none() {
        for field in
            ["", "fast", "2026-03-01", "12", "25:00:00", "17.11.2026 08:36:03 +é1", "+", "17.11.2026 +01:00", "+01:00"]
        {
            assert_eq!(Clock::default().seconds(field, 2), None, "{field}");
        }
        assert_eq!(seconds(&["12:00:00", "2026-03-01 12:00:01"])[1], None);
        let mut clock = Clock::default();
        clock.seconds("01.03.2026 12:00:00,500", 4);
        let said = clock.notice().unwrap();
        let words =
            "the time is a timestamp such as \"01.03.2026 12:00:00,500\", read as day.month.year, without a zone";
        assert_eq!((said.line, said.kind.to_string().as_str()), (4, words));
    }
}
