//! MATLAB files up to v7: every vector of numbers is a column, every matrix one for each of its own, or for each of its
//! rows where those are the signals.

use matfile::{Array, MatFile, NumericData};

use crate::table::{TableSource, Values};
use crate::{ColumnSource, RecordError, RecordProblem};

/// Opens a MATLAB file; structures, texts and complex numbers in it are passed over.
pub(crate) fn open(bytes: &[u8], file: &str) -> Result<Box<dyn ColumnSource>, RecordError> {
    let parsed = MatFile::parse(bytes).map_err(|error| RecordError {
        file: file.to_owned(),
        line: 1,
        problem: RecordProblem::NotATable { format: "MATLAB", reason: error.to_string() },
    })?;
    let columns = parsed.arrays().iter().flat_map(columns).collect();
    Ok(Box::new(TableSource::new(file, columns)?))
}

/// The columns of an array: itself if it is a vector, lying or standing.
fn columns(array: &Array) -> Vec<(String, Values)> {
    let [rows, count] = array.size().as_slice() else { return Vec::new() };
    let Some(values) = real(array.data()) else { return Vec::new() };
    let name = array.name();
    if values.len() != rows * count || values.is_empty() {
        return Vec::new();
    }
    if *rows == 1 || *count == 1 {
        return vec![(name.to_owned(), Values::Numbers(values))];
    }
    let numbered = |(index, signal): (usize, Vec<f64>)| (format!("{name}_{}", index + 1), Values::Numbers(signal));
    let row = |row: usize| values.iter().skip(row).step_by(*rows).copied().collect::<Vec<_>>();
    // Simulink's "To File" lays signals down as rows, the time first.
    if rows < count && row(0).windows(2).all(|pair| pair[1] > pair[0]) {
        return (0..*rows).map(row).enumerate().map(numbered).collect();
    }
    values.chunks(*rows).map(<[f64]>::to_vec).enumerate().map(numbered).collect()
}

/// The numbers of an array; none where they are complex.
fn real(data: &NumericData) -> Option<Vec<f64>> {
    macro_rules! numbers {
        ($($kind:ident),*) => {
            match data {
                $(NumericData::$kind { real, imag: None } => Some(real.iter().map(|value| *value as f64).collect()),)*
                _ => None,
            }
        };
    }
    #[expect(clippy::cast_lossless, clippy::unnecessary_cast, reason = "one line for ten types")]
    {
        numbers!(Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Single, Double)
    }
}
