//! Rows that come as Python's own values.

use prognoser::fields::{self, COLUMNS, StrokeField, TIME_COLUMN};
use prognoser::{ConditionColumn, Reading};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::error::refused;

/// One row of a log.
pub struct OwnedRow {
    /// The valve's name.
    pub valve: String,
    /// Its cycle, times and conditions.
    pub reading: Reading,
    /// When it was.
    pub time: Option<String>,
}

/// A value of a field.
enum Value {
    Text(String),
    Number(f64),
}

impl Value {
    fn of(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if value.is_none() {
            return Ok(Self::Number(f64::NAN));
        }
        if let Ok(text) = value.cast::<PyString>() {
            return Ok(Self::Text(text.to_str()?.trim_ascii().to_owned()));
        }
        Ok(Self::Number(value.extract()?))
    }

    fn stroke(&self, column: &'static str, empty_is_stalled: bool) -> PyResult<StrokeField> {
        match self {
            Self::Text(text) => fields::stroke_of_text(column, text, empty_is_stalled),
            Self::Number(time_s) => fields::stroke_of_number(column, *time_s, empty_is_stalled),
        }
        .map_err(refused)
    }
}

/// Reads a row by the names of a log's columns; others are not used.
pub fn read(row: &Bound<'_, PyDict>, empty_is_stalled: bool) -> PyResult<OwnedRow> {
    let mut reading = Reading { stalled: [empty_is_stalled; 2], ..Reading::default() };
    let (mut valve, mut cycle, mut time) = (None, None, None);
    for (key, value) in row {
        let key: String = key.extract()?;
        if key == COLUMNS[0] {
            valve = Some(value.str()?.to_str()?.to_owned());
        } else if key == COLUMNS[1] {
            cycle = Some(match Value::of(&value)? {
                Value::Text(text) => fields::cycle_of_text(&text),
                Value::Number(number) => fields::cycle_of_number(number),
            });
        } else if key == COLUMNS[2] {
            let field = Value::of(&value)?.stroke(COLUMNS[2], empty_is_stalled)?;
            (reading.close_time_s, reading.stalled[0]) = (field.time_s, field.stalled);
        } else if key == COLUMNS[3] {
            let field = Value::of(&value)?.stroke(COLUMNS[3], empty_is_stalled)?;
            (reading.open_time_s, reading.stalled[1]) = (field.time_s, field.stalled);
        } else if key == TIME_COLUMN {
            // A date has its own way to be written; a text is as it is.
            let written = value.call_method0("isoformat").unwrap_or(value);
            time = if written.is_none() { None } else { Some(written.str()?.to_str()?.to_owned()) };
        } else if let Some(column) = ConditionColumn::named(&key) {
            let si = match Value::of(&value)? {
                Value::Text(text) => column.of_text(&text),
                Value::Number(number) => column.of_number(number),
            };
            let place = if column.is_pressure() { &mut reading.supply_pressure_pa } else { &mut reading.temperature_k };
            *place = si.map_err(refused)?;
        }
    }
    let missing = |name: &str| refused(format!("a row without {name:?}, expected at least valve and cycle"));
    let valve = valve.ok_or_else(|| missing(COLUMNS[0]))?;
    fields::valve(&valve).map_err(refused)?;
    reading.cycle = cycle.ok_or_else(|| missing(COLUMNS[1]))?.map_err(refused)?;
    Ok(OwnedRow { valve, reading, time })
}
