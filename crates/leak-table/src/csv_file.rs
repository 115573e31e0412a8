//! A table as CSV. The only place where areas become mm2 and back.

use std::path::Path;

use crate::error::TableError;
use crate::fault::{Fault, Stroke};
use crate::table::{LeakPoint, LeakTable};
use crate::{m2_from_mm2, mm2_from_m2};

/// The header of every table.
pub(crate) const HEADER: &str = "leak_area_mm2,close_time_s,open_time_s";
/// Decimals of an area in mm2 and of a time in s: a square nanometre and a
/// nanosecond are finer than anything a table is used for.
const DECIMALS: usize = 9;

/// An area in mm2, rounded to what a file holds.
pub(crate) fn round_area_mm2(area_mm2: f64) -> f64 {
    (area_mm2 * 1e9).round() / 1e9
}

/// The table as text. Areas and times are rounded to nine decimals, so that
/// reading and writing again gives the same bytes.
pub(crate) fn to_csv(points: &[LeakPoint]) -> String {
    let time = |time_s: Option<f64>| time_s.map_or_else(String::new, |t| format!("{t:.DECIMALS$}"));
    let mut text = String::from(HEADER);
    text.push('\n');
    for point in points {
        let area = format!("{:.DECIMALS$}", mm2_from_m2(point.leak_area_m2));
        let (close, open) = (time(point.close_time_s), time(point.open_time_s));
        for field in [
            &area, ",", &close, ",", &open, "
",
        ] {
            text.push_str(field);
        }
    }
    text
}

/// The table in bytes read from `path`.
pub(crate) fn from_csv(bytes: &[u8], path: &Path, fault: Fault) -> Result<LeakTable, TableError> {
    let mut reader = csv::ReaderBuilder::new().from_reader(bytes);
    let malformed = |error: &csv::Error| TableError::Field {
        path: path.to_path_buf(),
        line: error.position().map_or(1, csv::Position::line),
        found: format!("a malformed row ({error})"),
        expected: "rows of three fields",
    };
    let header = reader.headers().map_err(|e| malformed(&e))?;
    let found = header.iter().collect::<Vec<_>>().join(",");
    if found != HEADER {
        return Err(TableError::Columns { path: path.to_path_buf(), found, expected: HEADER });
    }
    let mut points = Vec::new();
    let mut lines = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| malformed(&e))?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |column: usize, expected: &'static str| {
            record[column].trim().parse::<f64>().map_err(|_| TableError::Field {
                path: path.to_path_buf(),
                line,
                found: format!("\"{}\" as {}", &record[column], HEADER.split(',').nth(column).unwrap_or("")),
                expected,
            })
        };
        let time = |column: usize| {
            if record[column].trim().is_empty() {
                return Ok(None);
            }
            number(column, "a time in s, or nothing").map(Some)
        };
        points.push(LeakPoint {
            leak_area_m2: m2_from_mm2(number(0, "an area in mm2")?),
            close_time_s: time(1)?,
            open_time_s: time(2)?,
        });
        lines.push(usize::try_from(line).unwrap_or(usize::MAX));
    }
    LeakTable::new(fault, points).map_err(|source| TableError::Rows {
        path: path.to_path_buf(),
        line: source.row().and_then(|row| lines.get(row).copied()).unwrap_or(1),
        source,
    })
}

/// A table as it is after writing and reading: areas and times rounded to what
/// a file holds.
pub(crate) fn rounded(points: &[LeakPoint]) -> Vec<LeakPoint> {
    let round = |value: f64| format!("{value:.DECIMALS$}").parse().unwrap_or(value);
    points
        .iter()
        .map(|point| LeakPoint {
            leak_area_m2: m2_from_mm2(round(mm2_from_m2(point.leak_area_m2))),
            close_time_s: point.time_s(Stroke::Close).map(round),
            open_time_s: point.time_s(Stroke::Open).map(round),
        })
        .collect()
}
