//! Tables as CSV.

use std::path::Path;

use crate::condition_table::{ConditionTable, NodeTimes};
use crate::degradation::Degradation;
use crate::error::{RowError, TableError};
use crate::fault::Fault;
use crate::leak_pair::LeakPairTable;
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

/// The columns of the two severities in a table of both leaks.
const BOTH_LEAKS: &str = "leak_to_atmosphere_mm2,leak_from_supply_mm2";

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

/// The header of a table of both leaks.
fn pair_header() -> String {
    format!("{BOTH_LEAKS},{},{}", Stroke::Close.column(), Stroke::Open.column())
}

/// A table of both leaks as text, rounded alike; without times where a stroke is not finished.
pub(crate) fn pair_to_csv(table: &LeakPairTable) -> String {
    let mut text = pair_header();
    text.push('\n');
    let mut times = table.times_s().iter();
    for atmosphere in table.areas_m2(Fault::Atmosphere) {
        for (supply, times) in table.areas_m2(Fault::Supply).iter().zip(&mut times) {
            let area = |fault: Fault, area: f64| fault.degradation().severity.file_from_si(area);
            let [a, b] = [area(Fault::Atmosphere, *atmosphere), area(Fault::Supply, *supply)];
            let times =
                times.map_or_else(|| ",".to_owned(), |[close, open]| format!("{close:.DECIMALS$},{open:.DECIMALS$}"));
            text.extend([&format!("{a:.DECIMALS$},{b:.DECIMALS$},"), &times, "\n"]);
        }
    }
    text
}

/// The table of both leaks in bytes read from `path`, with the tables of each alone.
pub(crate) fn pair_from_csv(
    bytes: &[u8],
    path: &Path,
    tables: [&SeverityTable; 2],
    info: ConditionInfo,
) -> Result<LeakPairTable, TableError> {
    let rows = Rows::read(bytes, path, pair_header())?;
    let severity = |row: usize, fault: Fault| {
        let in_file = rows.number(row, fault as usize, "a number")?;
        Ok::<_, TableError>(fault.degradation().severity.si_from_file(in_file))
    };
    let (mut areas, mut times) = ([Vec::new(), Vec::new()], Vec::new());
    for row in 0..rows.records.len() {
        let at = [severity(row, Fault::Atmosphere)?, severity(row, Fault::Supply)?];
        let columns = areas[1].len();
        if at[1] == 0.0 {
            areas[0].push(at[0]);
        }
        if areas[0].len() == 1 {
            areas[1].push(at[1]);
        } else if areas[0].last() != Some(&at[0]) || areas[1].get(row % columns.max(1)) != Some(&at[1]) {
            return Err(rows.refused(RowError::LeakGrid { rows: rows.records.len() }));
        }
        let time = |column: usize| rows.number(row, column, "a time in s, or nothing for both");
        let nothing = [2, 3].iter().all(|column| rows.records[row][*column].trim().is_empty());
        times.push(if nothing { None } else { Some([time(2)?, time(3)?]) });
    }
    LeakPairTable::new(areas, times, tables, info).map_err(|source| rows.refused(source))
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
