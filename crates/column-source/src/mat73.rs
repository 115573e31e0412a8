//! MATLAB files of v7.3 and other HDF5 files: vectors and matrices of numbers as in older MATLAB files, those of
//! structures and groups under the name of these and a point.

use hdf5_reader::error::{ByteOrder, Error};
use hdf5_reader::group::Group;
use hdf5_reader::{Attribute, Dataset, Datatype, Hdf5File, OpenOptions};

use crate::bits::{floating, signed, unsigned};
use crate::heading::understood;
use crate::matrix;
use crate::table::{TableSource, Values};
use crate::{ColumnSource, Heading, RecordError, RecordProblem};

/// Numbers that are read at most, as bytes; a small file can claim or unpack to anything.
const MOST_BYTES: usize = 2 << 30;
/// Bytes that a byte can unpack to.
const UNPACKED: usize = 1100;
/// Structures within structures that are looked into.
const DEEPEST: usize = 4;
/// Variables that are looked at.
const MOST_VARIABLES: usize = 20_000;
/// What to do about objects of MATLAB's.
const INSTEAD: &str = "save its numbers: for a timeseries `t = ts.Time; x = ts.Data; save(file, 't', 'x', '-v7.3')`";

/// Opens an HDF5 file; texts, cells, complex and sparse numbers and arrays of structures in it are passed over.
pub(crate) fn open(bytes: &[u8], file: &str) -> Result<Box<dyn ColumnSource>, RecordError> {
    let refuse = |problem| RecordError { file: file.to_owned(), line: 1, problem };
    let broken = |reason: String| refuse(RecordProblem::NotATable { format: "MATLAB v7.3 or other HDF5", reason });
    let most = bytes.len().saturating_mul(UNPACKED).min(MOST_BYTES);
    let options = OpenOptions::default()
        .with_max_chunk_bytes(most)
        .with_max_read_bytes(most)
        .with_max_object_header_bytes(bytes.len());
    let mut found = Found { left: most, ..Found::default() };
    Hdf5File::from_vec_with_options(bytes.to_vec(), options)
        .and_then(|opened| found.group(&opened.root_group()?, "", 0))
        .map_err(|error| broken(error.to_string()))?;
    if let Some(reason) = found.too_much {
        return Err(broken(reason));
    }
    let rows = found.columns.iter().map(|(_, values)| values.len()).max().unwrap_or(0);
    let Some((name, class)) = found.objects.first() else {
        return Ok(Box::new(TableSource::new(file, found.columns)?));
    };
    if rows == 0 {
        let found = format!("\"{name}\", an object of MATLAB's class {class}");
        return Err(refuse(RecordProblem::PartNotRead { found, instead: INSTEAD }));
    }
    // Refused when it is asked for.
    let objects = found.objects.iter().map(|(name, class)| {
        let found = format!("an object of MATLAB's class {class}");
        (Heading::new(name), Values::NotRead { rows, found, instead: INSTEAD })
    });
    Ok(Box::new(TableSource::new(file, found.columns.into_iter().chain(objects).collect())?))
}

/// What a file holds.
#[derive(Default)]
struct Found {
    columns: Vec<(Heading, Values)>,
    /// Objects of classes whose content is not known, with the class.
    objects: Vec<(String, String)>,
    looked_at: usize,
    /// Bytes that may still be read.
    left: usize,
    /// Why there is more than can be.
    too_much: Option<String>,
}

impl Found {
    /// Looks at the members of a group, which is a structure of MATLAB's below the top.
    fn group(&mut self, group: &Group, before: &str, depth: usize) -> Result<(), Error> {
        let (mut groups, mut datasets) = group.members()?;
        // As HDF5's own tools list them; the order of a file depends on who wrote it.
        groups.sort_by(|one, other| one.name().cmp(other.name()));
        datasets.sort_by(|one, other| one.name().cmp(other.name()));
        for dataset in datasets {
            self.dataset(&dataset, &format!("{before}{}", dataset.name()))?;
        }
        for inner in groups {
            // What cells refer to, and what objects are made of.
            let hidden = inner.name().starts_with('#');
            if hidden || depth == DEEPEST || self.too_much.is_some() {
                continue;
            }
            let name = format!("{before}{}", inner.name());
            let attributes = inner.attributes()?;
            if has(&attributes, "MATLAB_sparse") {
                self.objects.push((name, "sparse matrix".to_owned()));
            } else {
                self.group(&inner, &format!("{name}."), depth + 1)?;
            }
        }
        Ok(())
    }

    fn dataset(&mut self, dataset: &Dataset, name: &str) -> Result<(), Error> {
        self.looked_at += 1;
        if self.looked_at > MOST_VARIABLES {
            self.too_much = Some(format!("it has more than {MOST_VARIABLES} variables"));
        }
        if self.too_much.is_some() {
            return Ok(());
        }
        let attributes = dataset.attributes();
        let text = |name: &str| attributes.iter().find(|one| one.name == name).and_then(|one| one.read_string().ok());
        let class = text("MATLAB_class");
        // Before the numbers of an object stands how it is to be put together.
        if has(&attributes, "MATLAB_object_decode") || class.as_deref().is_some_and(is_object) {
            self.objects.push((name.to_owned(), class.unwrap_or_default()));
            return Ok(());
        }
        let no_numbers = matches!(class.as_deref(), Some("char" | "cell" | "function_handle" | "canonical empty"));
        let Some(number) = number(dataset.dtype()).filter(|_| !no_numbers && !has(&attributes, "MATLAB_empty")) else {
            return Ok(());
        };
        let (rows, count) = match *dataset.shape() {
            [] => (1, 1),
            [rows] => (rows, 1),
            // MATLAB has its columns first, and so stands here turned round.
            [count, rows] if class.is_some() => (rows, count),
            [rows, count] => (rows, count),
            _ => return Ok(()),
        };
        let size = dataset.raw_byte_len()?;
        let Some(left) = self.left.checked_sub(size) else {
            self.too_much = Some(format!("\"{name}\" has {rows} x {count} numbers, more than such a file can hold"));
            return Ok(());
        };
        self.left = left;
        let bytes = dataset.read_raw_bytes()?;
        let mut values: Vec<f64> = bytes.chunks_exact(number.size).map(|value| number.value(value)).collect();
        let (Ok(rows), Ok(count)) = (usize::try_from(rows), usize::try_from(count)) else { return Ok(()) };
        if values.is_empty() || rows.checked_mul(count) != Some(values.len()) {
            return Ok(());
        }
        if class.is_none() && rows > 1 && count > 1 {
            values = (0..count).flat_map(|column| values.iter().skip(column).step_by(count).copied()).collect();
        }
        let unit = ["units", "unit", "Units", "Unit"].into_iter().find_map(|name| understood(&text(name)?));
        for (mut heading, values) in matrix::columns(name, rows, values) {
            heading.unit = heading.unit.or_else(|| unit.clone().filter(|unit| !unit.text().is_empty()));
            self.columns.push((heading, values));
        }
        Ok(())
    }
}

fn has(attributes: &[Attribute], name: &str) -> bool {
    attributes.iter().any(|attribute| attribute.name == name)
}

/// Whether a class is none of MATLAB's plain ones.
fn is_object(class: &str) -> bool {
    let plain = [
        "double",
        "single",
        "logical",
        "char",
        "cell",
        "struct",
        "function_handle",
        "canonical empty",
        "int8",
        "uint8",
        "int16",
        "uint16",
        "int32",
        "uint32",
        "int64",
        "uint64",
    ];
    !plain.contains(&class)
}

/// How a number is written.
#[derive(Clone, Copy)]
struct Number {
    size: usize,
    big: bool,
    kind: Kind,
}

#[derive(Clone, Copy)]
enum Kind {
    Signed,
    Unsigned,
    Floating,
}

/// How the numbers of a type are written; none of a type that has none.
fn number(datatype: &Datatype) -> Option<Number> {
    let (size, order, kind) = match datatype {
        Datatype::FixedPoint { size, signed: true, byte_order } => (*size, byte_order, Kind::Signed),
        Datatype::FixedPoint { size, byte_order, .. } => (*size, byte_order, Kind::Unsigned),
        Datatype::FloatingPoint { size, byte_order } => (*size, byte_order, Kind::Floating),
        // h5py has booleans as an enumeration.
        Datatype::Enum { base, .. } => return number(base),
        _ => return None,
    };
    let known = match kind {
        Kind::Floating => [4, 8].contains(&size),
        _ => [1, 2, 4, 8].contains(&size),
    };
    known.then_some(Number { size: size.into(), big: *order == ByteOrder::BigEndian, kind })
}

impl Number {
    fn value(self, bytes: &[u8]) -> f64 {
        match self.kind {
            Kind::Signed => signed(bytes, self.big) as f64,
            Kind::Unsigned => unsigned(bytes, self.big) as f64,
            Kind::Floating => floating(bytes, self.big),
        }
    }
}
