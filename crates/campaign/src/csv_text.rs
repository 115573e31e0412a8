//! CSV text: header, rows and numbers, with the line of everything.

use csv::ByteRecord;

use crate::error::{DataError, DataProblem};

/// The longest line that is read, bytes.
const LONGEST_LINE: usize = 65_536;

/// A CSV text whose header has been read.
pub(crate) struct CsvText<'a> {
    file: &'a str,
    bytes: &'a [u8],
    pub headers: Vec<String>,
    header_line: usize,
    reader: csv::Reader<&'a [u8]>,
    /// Fields are parted by semicolons or tabs, so that a comma is a decimal point.
    decimal_comma: bool,
}

impl<'a> CsvText<'a> {
    /// Checks the text and reads its header. Fields may be parted by comma, semicolon or tab;
    /// lines that begin with # are comments.
    pub fn new(bytes: &'a [u8], file: &'a str) -> Result<Self, DataError> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let error = |line, problem| DataError::new(file, line, problem);
        if let Err(bad) = std::str::from_utf8(bytes) {
            let line = bytes[..bad.valid_up_to()].split(|byte| *byte == b'\n').count();
            return Err(error(line, DataProblem::NotText));
        }
        let mut header = None;
        for (index, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
            if line.len() > LONGEST_LINE {
                let problem = DataProblem::LongLine { bytes: line.len(), most: LONGEST_LINE };
                return Err(error(index + 1, problem));
            }
            if header.is_none() && !line.starts_with(b"#") && !line.trim_ascii().is_empty() {
                header = Some(line);
            }
        }
        let header = header.ok_or_else(|| error(1, DataProblem::Empty))?;
        let delimiter = [b';', b'\t'].into_iter().find(|byte| header.contains(byte)).unwrap_or(b',');
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(delimiter)
            .comment(Some(b'#'))
            .from_reader(bytes);
        let mut record = ByteRecord::new();
        // Reading from memory cannot fail, and byte records accept any row.
        let found = reader.read_byte_record(&mut record).unwrap_or(false);
        if !found {
            return Err(error(1, DataProblem::Empty));
        }
        let headers = record.iter().map(|field| String::from_utf8_lossy(field).trim().to_owned()).collect();
        let header_line = line_of(bytes, &record);
        Ok(Self { file, bytes, headers, header_line, reader, decimal_comma: delimiter != b',' })
    }

    /// The line of the header.
    pub fn header_line(&self) -> usize {
        self.header_line
    }

    pub fn error(&self, line: usize, problem: DataProblem) -> DataError {
        DataError::new(self.file, line, problem)
    }

    /// Reads the next row into `row`: its line, or `None` at the end.
    pub fn next_row(&mut self, row: &mut ByteRecord) -> Result<Option<usize>, DataError> {
        loop {
            if !self.reader.read_byte_record(row).unwrap_or(false) {
                return Ok(None);
            }
            // A line of spaces is no row.
            let blank = row.len() == 1 && self.headers.len() > 1 && row[0].trim_ascii().is_empty();
            if !blank {
                break;
            }
        }
        let line = line_of(self.bytes, row);
        if row.len() != self.headers.len() {
            let problem = DataProblem::RowLength { found: row.len(), expected: self.headers.len() };
            return Err(self.error(line, problem));
        }
        Ok(Some(line))
    }

    /// A field as a number; NaN for a gap (nothing, "nan", "na", "null" or "-").
    pub fn number(&self, row: &ByteRecord, column: usize, line: usize) -> Result<f64, DataError> {
        let field = row.get(column).unwrap_or_default().trim_ascii();
        if let Some(number) = plain_decimal(field) {
            return Ok(number);
        }
        if field.is_empty() || [&b"nan"[..], b"na", b"null", b"-"].iter().any(|gap| field.eq_ignore_ascii_case(gap)) {
            return Ok(f64::NAN);
        }
        let mut text = String::from_utf8_lossy(field).into_owned();
        if self.decimal_comma {
            text = text.replacen(',', ".", 1);
        }
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => {
                let column = self.headers[column].clone();
                let found = text.chars().take(40).collect();
                Err(self.error(line, DataProblem::NotANumber { column, found }))
            }
        }
    }
}

/// The line at which a row begins. The reader places a row before the comments and empty lines that it skips.
fn line_of(bytes: &[u8], record: &ByteRecord) -> usize {
    let Some(position) = record.position() else { return 1 };
    // Files are far shorter than the largest index.
    let index = |number: u64| usize::try_from(number).unwrap_or(usize::MAX);
    let (mut line, mut start) = (index(position.line()), index(position.byte()));
    while let Some(b'#' | b'\n' | b'\r') = bytes.get(start) {
        let Some(length) = bytes[start..].iter().position(|byte| *byte == b'\n') else { break };
        line += 1;
        start += length + 1;
    }
    line
}

/// A short decimal number such as "-25.945"; `None` for everything else. Digits below 2^53 divided
/// by a power of ten below 10^22 round correctly (Clinger, "How to read floating point numbers
/// accurately", 1990).
fn plain_decimal(field: &[u8]) -> Option<f64> {
    const POWERS: [f64; 16] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
    let (negative, digits) = match field {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, field),
    };
    // Fifteen digits and a point; more need not fit.
    if digits.is_empty() || digits.len() > 16 {
        return None;
    }
    let (mut mantissa, mut count, mut decimals) = (0u64, 0usize, None);
    for &byte in digits {
        match byte {
            b'0'..=b'9' => {
                mantissa = mantissa * 10 + u64::from(byte - b'0');
                count += 1;
            }
            b'.' if decimals.is_none() => decimals = Some(count),
            _ => return None,
        }
    }
    if count == 0 || count > 15 {
        return None;
    }
    let value = mantissa as f64 / POWERS[count - decimals.unwrap_or(count)];
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_decimals_are_read_as_the_standard_library_does() {
        for text in ["0", "-0.0", "25.945", "+1.5", "0.001", "123456789012345", "0.12345678901234", ".5", "7."] {
            let fast = plain_decimal(text.as_bytes()).unwrap();
            assert_eq!(fast.to_bits(), text.parse::<f64>().unwrap().to_bits(), "{text}");
        }
        for text in ["", "-", ".", "1e3", "1.2.3", "1234567890123456", "x", "1 "] {
            assert_eq!(plain_decimal(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn separators_comments_and_gaps_are_understood() {
        let text = "\u{feff}# recorder 7\r\na;b\r\n1,5;\r\n\r\n# pause\r\n-2e-1;NaN\r\n";
        let mut csv = CsvText::new(text.as_bytes(), "t.csv").unwrap();
        assert_eq!(csv.headers, ["a", "b"]);
        let mut row = ByteRecord::new();
        assert_eq!(csv.next_row(&mut row).unwrap(), Some(3));
        assert_eq!(csv.number(&row, 0, 3).unwrap(), 1.5);
        assert!(csv.number(&row, 1, 3).unwrap().is_nan());
        assert_eq!(csv.next_row(&mut row).unwrap(), Some(6));
        assert_eq!(csv.number(&row, 0, 6).unwrap(), -0.2);
        assert_eq!(csv.next_row(&mut row).unwrap(), None);
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_line() {
        let refusal = |bytes: &[u8]| CsvText::new(bytes, "t.csv").err().unwrap().to_string();
        assert!(refusal(b"").starts_with("t.csv:1: the file is empty"));
        assert!(refusal(b"# only a comment\n").starts_with("t.csv:1: the file is empty"));
        assert!(refusal(b"a,b\n1,\xff\n").starts_with("t.csv:2: is not UTF-8"));
        let long = [b"a,b\n".as_slice(), &vec![b'1'; 10_000_000]].concat();
        assert!(refusal(&long).starts_with("t.csv:2: a line of 10000000 bytes"));
    }
}
