//! Parquet files, flat ones: columns of numbers, times and texts.

use bytes::Bytes;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

use crate::table::{TableSource, Values};
use crate::{ColumnSource, Heading, RecordError, RecordProblem};

/// Opens a Parquet file.
pub(crate) fn open(bytes: &[u8], file: &str) -> Result<Box<dyn ColumnSource>, RecordError> {
    let refuse = |line: usize, reason: String| RecordError {
        file: file.to_owned(),
        line,
        problem: RecordProblem::NotATable { format: "Parquet", reason },
    };
    let reader =
        SerializedFileReader::new(Bytes::copy_from_slice(bytes)).map_err(|error| refuse(1, error.to_string()))?;
    let fields = reader.metadata().file_metadata().schema().get_fields();
    let mut columns: Vec<(String, Vec<Cell>)> = Vec::new();
    for field in fields {
        if !field.is_primitive() {
            return Err(refuse(
                1,
                format!("column \"{}\" holds columns itself; expected numbers or texts", field.name()),
            ));
        }
        columns.push((field.name().to_owned(), Vec::new()));
    }
    let rows = reader.get_row_iter(None).map_err(|error| refuse(1, error.to_string()))?;
    for (index, row) in rows.enumerate() {
        let row = row.map_err(|error| refuse(index + 1, error.to_string()))?;
        for ((_, cells), (_, field)) in columns.iter_mut().zip(row.get_column_iter()) {
            cells.push(cell(field));
        }
    }
    let values = |cells: Vec<Cell>| {
        if cells.iter().any(|cell| matches!(cell, Cell::Text(_))) {
            Values::Texts(cells.into_iter().map(Cell::into_text).collect())
        } else {
            Values::Numbers(cells.into_iter().map(Cell::into_number).collect())
        }
    };
    let named = columns.into_iter().map(|(name, cells)| (Heading::new(&name), values(cells))).collect();
    Ok(Box::new(TableSource::new(file, named)?))
}

/// One value.
enum Cell {
    Gap,
    Number(f64),
    Text(String),
}

impl Cell {
    fn into_text(self) -> String {
        match self {
            Self::Gap => String::new(),
            Self::Number(number) => number.to_string(),
            Self::Text(text) => text,
        }
    }

    fn into_number(self) -> f64 {
        if let Self::Number(number) = self { number } else { f64::NAN }
    }
}

#[expect(clippy::cast_precision_loss, reason = "readings are far below 2^52")]
fn cell(field: &Field) -> Cell {
    let time = |time: Result<jiff::Timestamp, jiff::Error>| time.map_or(Cell::Gap, |time| Cell::Text(time.to_string()));
    match field {
        Field::Null => Cell::Gap,
        Field::Bool(value) => Cell::Number(f64::from(u8::from(*value))),
        Field::Byte(value) => Cell::Number(f64::from(*value)),
        Field::Short(value) => Cell::Number(f64::from(*value)),
        Field::Int(value) => Cell::Number(f64::from(*value)),
        Field::Long(value) => Cell::Number(*value as f64),
        Field::UByte(value) => Cell::Number(f64::from(*value)),
        Field::UShort(value) => Cell::Number(f64::from(*value)),
        Field::UInt(value) => Cell::Number(f64::from(*value)),
        Field::ULong(value) => Cell::Number(*value as f64),
        Field::Float(value) => Cell::Number(f64::from(*value)),
        Field::Double(value) => Cell::Number(*value),
        Field::TimestampMillis(value) => time(jiff::Timestamp::from_millisecond(*value)),
        Field::TimestampMicros(value) => time(jiff::Timestamp::from_microsecond(*value)),
        other => Cell::Text(other.to_string().trim_matches('"').to_owned()),
    }
}
