//! MATLAB files up to v7: every vector of numbers is a column, every matrix one for each of its own, or for each of its
//! rows where those are the signals.

use std::io::Read;

use flate2::read::ZlibDecoder;
use matfile::{Array, MatFile, NumericData};

use crate::matrix;
use crate::table::{TableSource, Values};
use crate::{ColumnSource, Heading, RecordError, RecordProblem};

/// Opens a MATLAB file; structures, texts and complex numbers in it are passed over.
pub(crate) fn open(bytes: &[u8], file: &str) -> Result<Box<dyn ColumnSource>, RecordError> {
    let refused = |reason: String| RecordError {
        file: file.to_owned(),
        line: 1,
        problem: RecordProblem::NotATable { format: "MATLAB", reason },
    };
    check(bytes).map_err(|reason| refused(reason.to_owned()))?;
    let parsed = MatFile::parse(bytes).map_err(|error| refused(error.to_string()))?;
    let columns = parsed.arrays().iter().flat_map(columns).collect();
    Ok(Box::new(TableSource::new(file, columns)?))
}

/// Bytes before the first element, and where they tell the order of bytes.
const HEADER: usize = 128;
const ENDIAN: std::ops::Range<usize> = 126..128;

/// Types of the elements that a file has at its top.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

/// Classes of arrays without numbers: cells, structures, objects, texts.
const NO_NUMBERS: std::ops::RangeInclusive<u32> = 1..=4;

/// Looks for what the parser would do sums with that overflow, or print a line of its own about: it trusts every length.
fn check(bytes: &[u8]) -> Result<(), &'static str> {
    let big = bytes.get(ENDIAN) == Some(b"MI");
    let mut rest = bytes.get(HEADER..).unwrap_or_default();
    while let Some((kind, body, after)) = element(rest, big)? {
        match kind {
            MATRIX => check_array(body, big)?,
            COMPRESSED => {
                let mut inside = Vec::new();
                if ZlibDecoder::new(body).read_to_end(&mut inside).is_ok()
                    && let Some((MATRIX, body, _)) = element(&inside, big)?
                {
                    check_array(body, big)?;
                }
            }
            _ => return Err("it has a part that is no array"),
        }
        rest = after;
    }
    Ok(())
}

/// The lengths of an array's parts, and that its sizes multiply to a number of values that there can be.
fn check_array(body: &[u8], big: bool) -> Result<(), &'static str> {
    let Some((_, flags, mut rest)) = element(body, big)? else { return Ok(()) };
    if word(flags, big).is_none_or(|flags| NO_NUMBERS.contains(&(flags & 0xff))) {
        return Ok(());
    }
    let mut sizes = None;
    while let Some((_, part, after)) = element(rest, big)? {
        sizes = sizes.or(Some(part));
        rest = after;
    }
    let mut sizes = sizes.unwrap_or_default().chunks_exact(4).filter_map(|size| word(size, big));
    let product = sizes.try_fold(1_i32, |product, size| product.checked_mul(i32::try_from(size).ok()?));
    product.map(|_| ()).ok_or("the sizes of an array are more than there can be")
}

/// An element's type, its bytes, and what follows it.
type Element<'a> = (u32, &'a [u8], &'a [u8]);

/// The first element; none at the end.
fn element(bytes: &[u8], big: bool) -> Result<Option<Element<'_>>, &'static str> {
    let Some(kind) = word(bytes, big) else { return Ok(None) };
    // Up to four bytes stand within the tag, their number in the upper half of the type.
    let (kind, from, length, whole) = match (kind >> 16, word(bytes.get(4..).unwrap_or_default(), big)) {
        (0, Some(length)) => (kind, 8, length, length.checked_next_multiple_of(if kind == COMPRESSED { 1 } else { 8 })),
        (0, None) => return Err("it ends within a part"),
        (length, _) => (kind & 0xffff, 4, length, Some(4)),
    };
    let short = "a part is longer than the file";
    let (length, whole) = (length as usize, whole.ok_or(short)? as usize);
    let body = bytes.get(from..from + length).ok_or(short)?;
    Ok(Some((kind, body, bytes.get(from + whole..).unwrap_or_default())))
}

fn word(bytes: &[u8], big: bool) -> Option<u32> {
    let bytes = *bytes.first_chunk()?;
    Some(if big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
}

/// The columns of an array: itself if it is a vector, lying or standing.
fn columns(array: &Array) -> Vec<(Heading, Values)> {
    let [rows, count] = array.size().as_slice() else { return Vec::new() };
    let Some(values) = real(array.data()) else { return Vec::new() };
    let name = array.name();
    if rows.checked_mul(*count) != Some(values.len()) || values.is_empty() {
        return Vec::new();
    }
    matrix::columns(name, *rows, values)
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
    #[expect(clippy::cast_lossless, reason = "one line for ten types")]
    {
        numbers!(Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Single, Double)
    }
}
