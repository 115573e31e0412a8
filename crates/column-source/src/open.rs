//! Which format a file has: by its first bytes, whatever it is called.

use crate::{ColumnSource, Comments, RecordError, RecordProblem, TextSource};

/// Opens a recording of any format that this program reads. `file` is what messages call it.
///
/// Parquet and MATLAB files need the features `parquet` and `mat`; without them, and for formats that are known but not
/// read, the refusal says what to do.
pub fn open(bytes: &[u8], file: &str, comments: Comments) -> Result<Box<dyn ColumnSource>, RecordError> {
    let refuse = |problem| Err(RecordError { file: file.to_owned(), line: 1, problem });
    if bytes.starts_with(b"PAR1") {
        #[cfg(feature = "parquet")]
        return crate::parquet::open(bytes, file);
        #[cfg(not(feature = "parquet"))]
        return refuse(RecordProblem::NotBuilt { format: "Parquet", feature: "parquet" });
    }
    // The words that MATLAB and those who write like it begin every file with, and the mark of the byte order.
    if bytes.starts_with(b"MATLAB 5.0") || matches!(bytes.get(124..128), Some([0, 1, b'I', b'M'] | [1, 0, b'M', b'I']))
    {
        #[cfg(feature = "mat")]
        return crate::mat::open(bytes, file);
        #[cfg(not(feature = "mat"))]
        return refuse(RecordProblem::NotBuilt { format: "MATLAB", feature: "mat" });
    }
    // HDF5 begins after a block of the user's, which MATLAB makes 512 bytes long.
    if [0, 512].iter().any(|start| bytes.get(*start..).is_some_and(|rest| rest.starts_with(b"\x89HDF\r\n\x1a\n"))) {
        let instead = "save it with `save(file, '-v7')`, or as CSV";
        return refuse(RecordProblem::NotRead { format: "an HDF5 file, such as MATLAB's v7.3", instead });
    }
    if bytes.starts_with(b"TDSm") {
        let instead = "export it as CSV, from DIAdem, Excel with NI's add-in, or Python with npTDMS";
        return refuse(RecordProblem::NotRead { format: "a TDMS file", instead });
    }
    // Workbooks of a spreadsheet: the newer ones are ZIP archives, the older ones compound files.
    if bytes.starts_with(b"PK\x03\x04") {
        let instead = "save the sheet as CSV: in Excel, Save As, \"CSV UTF-8\"; or unpack the archive";
        return refuse(RecordProblem::NotRead { format: "an Excel workbook or another ZIP archive", instead });
    }
    if bytes.starts_with(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1") {
        let instead = "save the sheet as CSV: in Excel, Save As, \"CSV UTF-8\"";
        return refuse(RecordProblem::NotRead { format: "an old Excel workbook (.xls)", instead });
    }
    Ok(Box::new(TextSource::new(bytes, file, comments)?))
}

/// What a file is, where it is a recording: "a gzip file", "a table of numbers"; `None` where it is something else.
#[must_use]
pub fn recognised(bytes: &[u8]) -> Option<&'static str> {
    if bytes.starts_with(b"\x1f\x8b") {
        return Some("a gzip file");
    }
    let mut source = match open(bytes, "", Comments::WhereNoNames) {
        Ok(source) => source,
        Err(error) => {
            return match error.problem {
                RecordProblem::NotBuilt { format: "Parquet", .. } => Some("a Parquet file"),
                RecordProblem::NotBuilt { .. } => Some("a MATLAB file"),
                RecordProblem::NotRead { format, .. } => Some(format),
                _ => None,
            };
        }
    };
    let columns = source.headings().len();
    let row = source.next_row();
    let numbers = (0..columns).filter(|column| source.number(*column).is_ok_and(f64::is_finite)).count();
    (matches!(row, Ok(Some(_))) && numbers > 1 && numbers + 1 >= columns)
        .then(|| if bytes.starts_with(b"PAR1") { "a Parquet file" } else { "a table of numbers" })
}

#[cfg(test)]
mod tests {
    use super::recognised;

    #[test]
    fn recordings_are_told_from_other_files() {
        for (bytes, expected) in [
            (&b"\x1f\x8b\x08\0"[..], Some("a gzip file")),
            (b"TDSm....", Some("a TDMS file")),
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
