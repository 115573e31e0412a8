//! Tables as CSV.

use std::path::Path;

use crate::condition_table::{ConditionTable, NodeTimes};
use crate::degradation::Degradation;
use crate::error::{RowError, TableError};
use crate::manifest::ConditionInfo;
use crate::stroke::Stroke;
use crate::table::{SeverityPoint, SeverityTable};

/// Decimals of a severity in its file's unit and of a time in s: a square nanometre and a nanosecond are
/// finer than anything a table is used for.
const DECIMALS: usize = 9;
/// The same as a number.
const UNITS: f64 = 1e9;
/// The columns before the severity in a table over conditions.
const CONDITIONS: &str = "supply_pressure_kpa,temperature_k,";
/// One kPa in Pa.
const PA_PER_KPA: f64 = 1e3;

/// A number of a file, rounded to the decimals that files hold.
pub(crate) fn rounded(in_file: f64) -> f64 {
    (in_file * UNITS).round() / UNITS
}

/// The header of a degradation's table.
pub(crate) fn header(degradation: &Degradation) -> String {
    format!("{},{},{}", degradation.severity.column, Stroke::Close.column(), Stroke::Open.column())
}

/// The table as text. Severities and times are rounded to nine decimals, so that
/// reading and writing again gives the same bytes.
pub(crate) fn to_csv(degradation: &Degradation, points: &[SeverityPoint]) -> String {
    let time = |time_s: Option<f64>| time_s.map_or_else(String::new, |t| format!("{t:.DECIMALS$}"));
    let mut text = header(degradation);
    text.push('\n');
    for point in points {
        let severity = format!("{:.DECIMALS$}", degradation.severity.file_from_si(point.severity));
        let (close, open) = (time(point.close_time_s), time(point.open_time_s));
        text.extend([&severity, ",", &close, ",", &open, "\n"]);
    }
    text
}

/// A table over conditions as text, rounded alike.
pub(crate) fn conditions_to_csv(table: &ConditionTable) -> String {
    let degradation = table.degradation();
    let mut text = format!("{CONDITIONS}{}\n", header(degradation));
    let temperatures = table.temperatures_k().len();
    for index in 0..table.node_count() {
        let pressure = table.pressures_pa()[index / temperatures] / PA_PER_KPA;
        let temperature = table.temperatures_k()[index % temperatures];
        let node = table.node(index);
        for (knot, share) in table.shares().iter().enumerate() {
            let severity = degradation.severity.file_from_si(share * node.end);
            let fields = [pressure, temperature, severity, node.close_time_s[knot], node.open_time_s[knot]];
            text.push_str(&fields.map(|field| format!("{field:.DECIMALS$}")).join(","));
            text.push('\n');
        }
    }
    text
}

/// The fields of a file row by row, with the line of each row.
struct Rows<'a> {
    path: &'a Path,
    header: String,
    records: Vec<csv::StringRecord>,
}

impl<'a> Rows<'a> {
    fn read(bytes: &[u8], path: &'a Path, header: String) -> Result<Self, TableError> {
        let mut reader = csv::ReaderBuilder::new().from_reader(bytes);
        let malformed = |error: &csv::Error| TableError::Field {
            path: path.to_path_buf(),
            line: error.position().map_or(1, csv::Position::line),
            found: format!("a malformed row ({error})"),
            expected: "as many fields in each row as in the header",
        };
        let found = reader.headers().map_err(|e| malformed(&e))?.iter().collect::<Vec<_>>().join(",");
        if found != header {
            return Err(TableError::Columns { path: path.to_path_buf(), found, expected: header });
        }
        let records = reader.records().collect::<Result<_, _>>().map_err(|e| malformed(&e))?;
        Ok(Self { path, header, records })
    }

    fn line(&self, row: usize) -> u64 {
        self.records.get(row).and_then(csv::StringRecord::position).map_or(1, csv::Position::line)
    }

    fn number(&self, row: usize, column: usize, expected: &'static str) -> Result<f64, TableError> {
        let field = &self.records[row][column];
        field.trim().parse::<f64>().map_err(|_| TableError::Field {
            path: self.path.to_path_buf(),
            line: self.line(row),
            found: format!("\"{field}\" as {}", self.header.split(',').nth(column).unwrap_or("")),
            expected,
        })
    }

    fn refused(&self, source: RowError) -> TableError {
        let line = source.row().map_or(1, |row| self.line(row));
        let line = usize::try_from(line).unwrap_or(usize::MAX);
        TableError::Rows { path: self.path.to_path_buf(), line, source }
    }
}

/// The table in bytes read from `path`.
pub(crate) fn from_csv(bytes: &[u8], path: &Path, degradation: &Degradation) -> Result<SeverityTable, TableError> {
    let rows = Rows::read(bytes, path, header(degradation))?;
    let time = |row: usize, column: usize| {
        if rows.records[row][column].trim().is_empty() {
            return Ok(None);
        }
        rows.number(row, column, "a time in s, or nothing").map(Some)
    };
    let point = |row: usize| {
        Ok(SeverityPoint {
            severity: degradation.severity.si_from_file(rows.number(row, 0, "a number")?),
            close_time_s: time(row, 1)?,
            open_time_s: time(row, 2)?,
        })
    };
    let points = (0..rows.records.len()).map(point).collect::<Result<_, TableError>>()?;
    SeverityTable::new(degradation, points).map_err(|source| rows.refused(source))
}

/// The table over conditions in bytes read from `path`; `info` is what the manifest says of it.
pub(crate) fn conditions_from_csv(
    bytes: &[u8],
    path: &Path,
    degradation: &Degradation,
    info: ConditionInfo,
) -> Result<ConditionTable, TableError> {
    let rows = Rows::read(bytes, path, format!("{CONDITIONS}{}", header(degradation)))?;
    let numbers = |row: usize| -> Result<[f64; 5], TableError> {
        let mut numbers = [0.0; 5];
        for (column, number) in numbers.iter_mut().enumerate() {
            *number = rows.number(row, column, "a number")?;
        }
        Ok(numbers)
    };
    let all: Vec<[f64; 5]> = (0..rows.records.len()).map(numbers).collect::<Result<_, _>>()?;
    let nodes: Vec<&[[f64; 5]]> = all.chunk_by(|a, b| a[..2] == b[..2]).collect();
    let mut pressures: Vec<f64> = nodes.iter().map(|node| node[0][0] * PA_PER_KPA).collect();
    pressures.dedup();
    let per_pressure = nodes.len() / pressures.len().max(1);
    let temperatures: Vec<f64> = nodes.iter().take(per_pressure).map(|node| node[0][1]).collect();
    let ends: Vec<f64> = nodes.iter().map(|node| node[node.len() - 1][2]).collect();
    let shares: Vec<f64> =
        nodes.first().map_or_else(Vec::new, |node| node.iter().map(|row| row[2] / ends[0]).collect());
    let mut row = 0;
    for (index, node) in nodes.iter().enumerate() {
        for (knot, numbers) in node.iter().enumerate() {
            let expected = shares.get(knot).map(|share| share * ends[index]);
            // Both the share and what is compared with it are rounded.
            let rounding = (2.0 + 2.0 * ends[index] / ends[0]) / UNITS;
            let in_grid = expected.is_some_and(|expected| (numbers[2] - expected).abs() <= rounding)
                && node.len() == shares.len()
                && Some(&numbers[1]) == temperatures.get(index % per_pressure.max(1));
            if !in_grid {
                return Err(TableError::Field {
                    path: path.to_path_buf(),
                    line: rows.line(row),
                    found: format!(
                        "{} {} at {} kPa and {} K",
                        degradation.severity.column, numbers[2], numbers[0], numbers[1]
                    ),
                    expected: "the same shares of the last severity at each pressure and temperature",
                });
            }
            row += 1;
        }
    }
    let node = |(node, end): (&&[[f64; 5]], &f64)| NodeTimes {
        end: degradation.severity.si_from_file(*end),
        close_time_s: node.iter().map(|row| row[3]).collect(),
        open_time_s: node.iter().map(|row| row[4]).collect(),
    };
    let nodes: Vec<NodeTimes> = nodes.iter().zip(&ends).map(node).collect();
    ConditionTable::new(degradation, pressures, temperatures, shares, &nodes, info)
        .map_err(|source| rows.refused(source))
}
