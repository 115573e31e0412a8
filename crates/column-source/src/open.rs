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
    Ok(Box::new(TextSource::new(bytes, file, comments)?))
}
