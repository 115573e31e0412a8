//! Stroke times that were written down without a trace.

use csv::ByteRecord;
use quantity::Dimension;

use crate::columns::{self, Column};
use crate::conditions;
use crate::csv_text::CsvText;
use crate::error::{DataError, DataProblem};
use crate::types::{RunConditions, TimingRow, ValveFacts};
use crate::warning::{Doubt, Warning};

const KNOWN: [&str; 6] = [
    "supply_pressure_psig",
    "temperature_k",
    "leak_to_atmosphere_mm2",
    "leak_from_supply_mm2",
    "close_time_s",
    "open_time_s",
];

/// Reads a CSV of stroke times: a row a cycle.
pub(crate) fn read(
    bytes: &[u8],
    file: &str,
    valve: &ValveFacts,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<TimingRow>, DataError> {
    let mut csv = CsvText::new(bytes, file)?;
    let find = |channel: &str, dimension: Dimension| {
        // A gauge supply pressure is the usual one here and needs no warning.
        let found = columns::find(&csv, channel, dimension, None, valve.ambient_pressure_pa)?;
        Ok::<_, DataError>(found.map(|(column, _)| column))
    };
    let time = |channel: &str, usual: &str| {
        find(channel, Dimension::Time)?.ok_or_else(|| {
            columns::missing(
                &csv,
                usual,
                &format!("{usual} or {channel}_ms; an empty field where the valve did not get there"),
            )
        })
    };
    let close = time("close_time", "close_time_s")?;
    let open = time("open_time", "open_time_s")?;
    let supply = find("supply_pressure", Dimension::Pressure)?;
    let temperature = find("temperature", Dimension::Temperature)?;
    let to_atmosphere = find("leak_to_atmosphere", Dimension::Area)?;
    let from_supply = find("leak_from_supply", Dimension::Area)?;
    let header_line = csv.header_line();
    let mut warn = |doubt| warnings.push(Warning { file: file.to_owned(), line: header_line, doubt });
    if supply.is_none() {
        warn(Doubt::SupplyAssumed { assumed_kpa: valve.supply_pressure_pa / 1e3 });
    }
    if temperature.is_none() {
        warn(Doubt::TemperatureAssumed { assumed_k: valve.temperature_k });
    }
    let read = [Some(close), Some(open), supply, temperature, to_atmosphere, from_supply];
    let indices: Vec<usize> = read.iter().flatten().map(|column| column.index).collect();
    columns::look_alikes(&csv, &indices, &KNOWN).into_iter().for_each(warn);

    let mut rows = Vec::new();
    let mut far: Vec<(usize, Doubt)> = Vec::new();
    let mut row = ByteRecord::new();
    while let Some(line) = csv.next_row(&mut row)? {
        let or = |column: Option<Column>, missing: f64| match column {
            None => Ok(missing),
            Some(column) => match csv.number(&row, column.index, line)? {
                number if number.is_nan() => {
                    Err(csv.error(line, DataProblem::EmptyCondition { column: csv.headers[column.index].clone() }))
                }
                number => Ok::<_, DataError>(column.to_si(number)),
            },
        };
        let conditions = RunConditions {
            supply_pressure_pa: or(supply, valve.supply_pressure_pa)?,
            temperature_k: or(temperature, valve.temperature_k)?,
            leak_to_atmosphere_m2: or(to_atmosphere, 0.0)?,
            leak_from_supply_m2: or(from_supply, 0.0)?,
        };
        if let Some((key, found, expected)) = conditions::fault(&conditions, valve.ambient_pressure_pa) {
            let problem = DataProblem::ImpossibleCondition { key: key.to_owned(), found, expected };
            return Err(csv.error(line, problem));
        }
        for doubt in conditions::far(&conditions, valve) {
            // Each kind once is enough.
            let kind = std::mem::discriminant(&doubt);
            if far.iter().all(|(_, other)| std::mem::discriminant(other) != kind) {
                far.push((line, doubt));
            }
        }
        let stroke_time = |column: Column| match column.to_si(csv.number(&row, column.index, line)?) {
            time_s if time_s.is_nan() => Ok(None),
            time_s if time_s >= 0.0 => Ok(Some(time_s)),
            time_s => {
                let column = csv.headers[column.index].clone();
                let expected = "a stroke time of 0 s or more, or nothing where the valve did not get there".into();
                Err(csv.error(line, DataProblem::ImpossibleNumber { column, found: time_s, expected }))
            }
        };
        let (close_time_s, open_time_s) = (stroke_time(close)?, stroke_time(open)?);
        rows.push(TimingRow { line, conditions, close_time_s, open_time_s });
    }
    if rows.is_empty() {
        return Err(csv.error(header_line, DataProblem::TooFewRows { rows: 0, expected: 1 }));
    }
    warnings.extend(far.into_iter().map(|(line, doubt)| Warning { file: file.to_owned(), line, doubt }));
    Ok(rows)
}
