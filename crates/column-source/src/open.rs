//! Which format a file has: by its first bytes, whatever it is called.

use crate::{ColumnSource, Comments, RecordError, RecordProblem, TextSource};

/// What a file of another format than text is opened by.
type Opener = fn(&[u8], &str) -> Result<Box<dyn ColumnSource>, RecordError>;

/// A format that is told by its first bytes.
struct Format {
    /// Its name, as in "is a Parquet file".
    name: &'static str,
    /// With its article, or as what else such files may be.
    whole: &'static str,
    begins: fn(&[u8]) -> bool,
    reader: Reader,
}

/// Whether a format is read.
#[derive(Clone, Copy)]
#[allow(dead_code, reason = "which of them there are depends on the features")]
enum Reader {
    /// It is.
    Built(Opener),
    /// It would be, with this feature.
    LeftOut(&'static str),
    /// It is not; what to do instead.
    Never(&'static str),
}

/// The reader of a module behind a feature.
macro_rules! reader {
    ($name:ident, $feature:literal, $module:ident) => {
        #[cfg(feature = $feature)]
        const $name: Reader = Reader::Built(crate::$module::open);
        #[cfg(not(feature = $feature))]
        const $name: Reader = Reader::LeftOut($feature);
    };
}

reader!(PARQUET, "parquet", parquet);
reader!(MAT, "mat", mat);
reader!(MAT73, "mat73", mat73);
reader!(TDMS, "tdms", tdms);

/// All formats but text; to add one, write its file and a line here.
const FORMATS: [Format; 7] = [
    Format { name: "Parquet", whole: "a Parquet file", begins: |bytes| bytes.starts_with(b"PAR1"), reader: PARQUET },
    Format { name: "MATLAB", whole: "a MATLAB file", begins: is_mat, reader: MAT },
    Format {
        name: "MATLAB v7.3 or other HDF5",
        whole: "an HDF5 file, such as MATLAB's v7.3",
        begins: is_hdf5,
        reader: MAT73,
    },
    Format { name: "TDMS", whole: "a TDMS file", begins: |bytes| bytes.starts_with(b"TDSm"), reader: TDMS },
    Format {
        name: "TDMS index",
        whole: "the index of a TDMS file (.tdms_index)",
        begins: |bytes| bytes.starts_with(b"TDSh"),
        reader: Reader::Never("name the .tdms file beside it"),
    },
    // Workbooks of a spreadsheet: the newer ones are ZIP archives, the older ones compound files.
    Format {
        name: "Excel",
        whole: "an Excel workbook or another ZIP archive",
        begins: |bytes| bytes.starts_with(b"PK\x03\x04"),
        reader: Reader::Never("save the sheet as CSV: in Excel, Save As, \"CSV UTF-8\"; or unpack the archive"),
    },
    Format {
        name: "Excel 97",
        whole: "an old Excel workbook (.xls)",
        begins: |bytes| bytes.starts_with(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"),
        reader: Reader::Never("save the sheet as CSV: in Excel, Save As, \"CSV UTF-8\""),
    },
];

/// The words that MATLAB and those who write like it begin every file with, or the mark of the byte order; what begins so
/// and is HDF5 inside is MATLAB's v7.3.
fn is_mat(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MATLAB 5.0") || matches!(bytes.get(124..128), Some([0, 1, b'I', b'M'] | [1, 0, b'M', b'I']))
}

/// HDF5 begins after a block of the user's, which MATLAB makes 512 bytes long.
fn is_hdf5(bytes: &[u8]) -> bool {
    [0, 512].iter().any(|start| bytes.get(*start..).is_some_and(|rest| rest.starts_with(b"\x89HDF\r\n\x1a\n")))
}

/// Opens a recording of any format that this program reads. `file` is what messages call it.
///
/// Formats other than text need their features; without them, and for formats that are known but not read, the refusal
/// says what to do.
pub fn open(bytes: &[u8], file: &str, comments: Comments) -> Result<Box<dyn ColumnSource>, RecordError> {
    let Some(format) = FORMATS.iter().find(|format| (format.begins)(bytes)) else {
        return Ok(Box::new(TextSource::new(bytes, file, comments)?));
    };
    let problem = match format.reader {
        Reader::Built(open) => return open(bytes, file),
        Reader::LeftOut(feature) => RecordProblem::NotBuilt { format: format.name, feature },
        Reader::Never(instead) => RecordProblem::NotRead { format: format.whole, instead },
    };
    Err(RecordError { file: file.to_owned(), line: 1, problem })
}

/// What a file is, where it is a recording: "a gzip file", "a table of numbers"; `None` where it is something else.
#[must_use]
pub fn recognised(bytes: &[u8]) -> Option<&'static str> {
    if bytes.starts_with(b"\x1f\x8b") {
        return Some("a gzip file");
    }
    if let Some(format) = FORMATS.iter().find(|format| (format.begins)(bytes)) {
        return Some(format.whole);
    }
    let mut source = TextSource::new(bytes, "", Comments::WhereNoNames).ok()?;
    let columns = source.headings().len();
    let row = source.next_row();
    let numbers = (0..columns).filter(|column| source.number(*column).is_ok_and(f64::is_finite)).count();
    (matches!(row, Ok(Some(_))) && numbers > 1 && numbers + 1 >= columns).then_some("a table of numbers")
}

#[cfg(test)]
mod tests {
    use super::recognised;

    #[test]
    fn recordings_are_told_from_other_files() {
        for (bytes, expected) in [
            (&b"\x1f\x8b\x08\0"[..], Some("a gzip file")),
            (b"TDSm....", Some("a TDMS file")),
            (b"PAR1....", Some("a Parquet file")),
            (b"time_s,command,position_mm\n0.0,1,25.4\n0.1,1,25.3\n", Some("a table of numbers")),
            (b"Zeit;Weg\n0,0;25,4\n0,1;25,3\n", Some("a table of numbers")),
            (b"name = \"a, b, c\"\n[[run]\nfile = \"a.csv\"\n", None),
            (b"just words\nand more of them\n", None),
            (b"", None),
            (b"\xff\xd8\xff\xe0 a picture", None),
        ] {
            assert_eq!(recognised(bytes), expected, "{}", String::from_utf8_lossy(bytes));
        }
    }
}
