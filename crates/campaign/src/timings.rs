//! Stroke times that were written down without a trace.

use column_source::{ColumnSource, Comments, find_table};

use crate::columns::{self, Column, Mapping, TIMING_CHANNELS};
use crate::conditions;
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

/// All columns that a file of stroke times has, and the two that it must have.
type Found = ([Option<Column>; TIMING_CHANNELS.len()], Column, Column);

fn find_columns(source: &dyn ColumnSource, mappings: &[Mapping], valve: &ValveFacts) -> Result<Found, DataError> {
    let mut found = [None; TIMING_CHANNELS.len()];
    for (channel, slot) in TIMING_CHANNELS.into_iter().zip(&mut found) {
        let mapping = mappings.iter().find(|mapping| mapping.channel == channel.0);
        *slot = columns::find(source, channel, mapping, valve.ambient_pressure_pa)?;
    }
    let needed = |column: Option<Column>, channel: &str| {
        column.ok_or_else(|| {
            let usual = format!("{channel}_s");
            let expected = format!(
                "{usual}, {channel}_ms, or its name in [timings.columns]; an empty field where the valve did not get there"
            );
            columns::missing(source, &usual, &expected)
        })
    };
    Ok((found, needed(found[0], "close_time")?, needed(found[1], "open_time")?))
}

/// Reads a file of stroke times: a row a cycle.
pub(crate) fn read(
    bytes: &[u8],
    file: &str,
    mappings: &[Mapping],
    valve: &ValveFacts,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<TimingRow>, DataError> {
    let mut source = column_source::open(bytes, file, Comments::WhereNoNames)?;
    let (found, close, open) = find_table(
        source.as_mut(),
        |source| find_columns(source, mappings, valve),
        |source| columns::count(source, &TIMING_CHANNELS, mappings),
    )?;
    let [_, _, supply, temperature, to_atmosphere, from_supply] = found;
    let header_line = source.header_line();
    let mut warn = |doubt| warnings.push(Warning { file: file.to_owned(), line: header_line, doubt });
    if supply.is_none() {
        warn(Doubt::SupplyAssumed { assumed_kpa: valve.supply_pressure_pa / 1e3 });
    }
    if temperature.is_none() {
        warn(Doubt::TemperatureAssumed { assumed_k: valve.temperature_k });
    }
    let indices: Vec<usize> = found.iter().flatten().map(|column| column.index).collect();
    columns::look_alikes(source.as_ref(), &indices, &KNOWN).into_iter().for_each(warn);

    let mut rows = Vec::new();
    let mut far: Vec<(usize, Doubt)> = Vec::new();
    while let Some(line) = source.next_row()? {
        let error = |problem| DataError::new(file, line, problem);
        let name = |column: Column| source.headings()[column.index].name.clone();
        let or = |column: Option<Column>, missing: f64| match column {
            None => Ok(missing),
            Some(column) => match source.number(column.index)? {
                number if number.is_nan() => Err(error(DataProblem::EmptyCondition { column: name(column) })),
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
            return Err(error(problem));
        }
        for doubt in conditions::far(&conditions, valve) {
            // Each kind once is enough.
            let kind = std::mem::discriminant(&doubt);
            if far.iter().all(|(_, other)| std::mem::discriminant(other) != kind) {
                far.push((line, doubt));
            }
        }
        let stroke_time = |column: Column| match column.to_si(source.number(column.index)?) {
            time_s if time_s.is_nan() => Ok(None),
            time_s if time_s >= 0.0 => Ok(Some(time_s)),
            time_s => {
                let column = name(column);
                let expected = "a stroke time of 0 s or more, or nothing where the valve did not get there".into();
                Err(error(DataProblem::ImpossibleNumber { column, found: time_s, expected }))
            }
        };
        let (close_time_s, open_time_s) = (stroke_time(close)?, stroke_time(open)?);
        rows.push(TimingRow { line, conditions, close_time_s, open_time_s });
    }
    if rows.is_empty() {
        return Err(DataError::new(file, header_line, DataProblem::TooFewRows { rows: 0, expected: 1 }));
    }
    let notices = source.notices().iter().map(|notice| (notice.line, Doubt::Read(notice.kind.clone())));
    warnings.extend(notices.chain(far).map(|(line, doubt)| Warning { file: file.to_owned(), line, doubt }));
    Ok(rows)
}
