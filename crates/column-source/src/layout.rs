//! How a text is laid out: separator, header, units, comments, a last row that is cut off.

use crate::heading::{is_other_unit, understood};
use crate::number::is_gap;

/// Rows that are looked at.
const SAMPLE: usize = 200;
/// Lines above the header at most.
const LONGEST_PREAMBLE: usize = 200;
/// Rows from which on the usual length of a last field is known.
const FEWEST_FOR_LENGTH: usize = 8;

/// Where a text has what.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layout {
    pub delimiter: u8,
    /// Columns of a text without a header; its first row stands where the header would.
    pub unnamed: Option<usize>,
    /// Byte and line of the header.
    pub header_start: usize,
    pub header_line: usize,
    /// Lines with content above it that are no comments.
    pub preamble: usize,
    /// Line of the row of units under the header.
    pub units_line: Option<usize>,
    /// Whether the first column holds names, so that a # can begin one.
    pub names_first: bool,
    /// Where a row that was cut off begins, and its line.
    pub cut: Option<(usize, usize)>,
}

/// A line with content.
#[derive(Debug, Clone, Copy)]
struct Line<'a> {
    start: usize,
    number: usize,
    text: &'a [u8],
}

/// The layout; `None` where no line has any content.
pub(crate) fn find(text: &[u8]) -> Option<Layout> {
    let lines = lines_with_content(text);
    let first = *lines.first()?;
    let sample = sample(&lines);
    let delimiter = delimiter(&sample)
        .unwrap_or_else(|| [b';', b'\t'].into_iter().find(|byte| first.text.contains(byte)).unwrap_or(b','));
    let width = usual_width(&sample, delimiter).unwrap_or_else(|| fields(first.text, delimiter).len());
    let head = &lines[..lines.len().min(LONGEST_PREAMBLE)];
    let numbers = number_columns(&sample, delimiter, width);
    let is_row =
        |line: &Line<'_>| is_data(line.text, delimiter, width) && holds_numbers(line.text, delimiter, &numbers);
    // A line such as "Date;2026-03-01" is no row: what follows it is none.
    let data = (0..head.len()).find(|at| is_row(&head[*at]) && lines.get(at + 1).is_none_or(is_row)).unwrap_or(0);
    let unnamed = is_row(&lines[data]) && has_no_header(&lines, data, delimiter, width);
    let header = if unnamed { data } else { header_above(&head[..data], delimiter, width).unwrap_or(0) };
    let units = (header + 1 < data && is_units(lines[header + 1].text, delimiter)).then(|| lines[header + 1].number);
    let rows = &lines[(header + usize::from(!unnamed)).min(lines.len())..];
    let names_first = names_first(rows, delimiter);
    Some(Layout {
        delimiter,
        unnamed: unnamed.then_some(width),
        header_start: lines[header].start,
        header_line: lines[header].number,
        preamble: header,
        units_line: units,
        names_first,
        cut: cut_row(text, rows, delimiter, width),
    })
}

fn lines_with_content(text: &[u8]) -> Vec<Line<'_>> {
    let mut lines = Vec::new();
    let mut start = 0;
    for (index, whole) in text.split(|byte| *byte == b'\n').enumerate() {
        let line = whole.strip_suffix(b"\r").unwrap_or(whole);
        if !line.trim_ascii().is_empty() && !line.starts_with(b"#") {
            lines.push(Line { start, number: index + 1, text: line });
        }
        start += whole.len() + 1;
    }
    lines
}

/// Lines from the middle of the file's beginning: rows, if it has any.
fn sample<'a>(lines: &[Line<'a>]) -> Vec<Line<'a>> {
    // The last line may be cut off, the first ones are headings.
    let end = lines.len().saturating_sub(usize::from(lines.len() > 3));
    let start = (lines.len() / 4).min(LONGEST_PREAMBLE).min(end);
    lines[start..end].iter().take(SAMPLE).copied().collect()
}

/// The separator that parts most lines into the same number of fields.
fn delimiter(sample: &[Line<'_>]) -> Option<u8> {
    // A comma may be a decimal one, so it comes last.
    [b';', b'\t', b','].into_iter().find(|byte| {
        usual_width(sample, *byte).is_some_and(|width| {
            let same = sample.iter().filter(|line| fields(line.text, *byte).len() == width).count();
            width > 1 && same * 5 >= sample.len() * 4
        })
    })
}

/// The commonest number of fields.
fn usual_width(sample: &[Line<'_>], delimiter: u8) -> Option<usize> {
    let mut widths: Vec<usize> = sample.iter().map(|line| fields(line.text, delimiter).len()).collect();
    widths.sort_unstable();
    widths.chunk_by(|one, other| one == other).max_by_key(|chunk| chunk.len()).map(|chunk| chunk[0])
}

/// The fields of a line; separators in quotation marks do not count.
pub(crate) fn fields(line: &[u8], delimiter: u8) -> Vec<&[u8]> {
    let (mut fields, mut start, mut quoted) = (Vec::new(), 0, false);
    for (index, byte) in line.iter().enumerate() {
        if *byte == b'"' {
            quoted = !quoted;
        } else if *byte == delimiter && !quoted {
            fields.push(&line[start..index]);
            start = index + 1;
        }
    }
    fields.push(&line[start..]);
    fields
}

pub(crate) fn bare(field: &[u8]) -> &[u8] {
    let field = field.trim_ascii();
    field.strip_prefix(b"\"").and_then(|field| field.strip_suffix(b"\"")).unwrap_or(field).trim_ascii()
}

/// Whether a field is a number, roughly: digits, signs, separators, a time.
fn is_numeric(field: &[u8]) -> bool {
    let field = bare(field);
    let body = field.trim_ascii_start().strip_prefix(b"-").unwrap_or(field);
    body.iter().any(u8::is_ascii_digit)
        && body.first().is_some_and(|first| first.is_ascii_digit() || b"+.,-".contains(first))
}

/// Whether a line holds readings: at least one number, and hardly anything that is neither a number nor a gap.
fn is_data(line: &[u8], delimiter: u8, width: usize) -> bool {
    let fields = fields(line, delimiter);
    let numbers = fields.iter().filter(|field| is_numeric(field)).count();
    let gaps = fields.iter().filter(|field| is_gap(bare(field))).count();
    fields.len() == width && numbers > 0 && 2 * (numbers + gaps) >= fields.len()
}

/// Which columns hold numbers in most rows.
fn number_columns(sample: &[Line<'_>], delimiter: u8, width: usize) -> Vec<bool> {
    let rows = sample.iter().map(|line| fields(line.text, delimiter)).filter(|fields| fields.len() == width);
    let rows: Vec<_> = rows.collect();
    let numbers = |column: usize| rows.iter().filter(|fields| is_numeric(fields[column])).count();
    (0..width).map(|column| 2 * numbers(column) > rows.len()).collect()
}

/// Whether a line has a number, or a gap, in every column that holds numbers: what a recorder says of its channels above
/// the header has words there.
fn holds_numbers(line: &[u8], delimiter: u8, numbers: &[bool]) -> bool {
    let fields = fields(line, delimiter);
    fields.iter().zip(numbers).all(|(field, number)| !number || is_numeric(field) || is_gap(bare(field)))
}

/// The header among the lines above the first row: the fullest one without numbers, else the last one.
fn header_above(lines: &[Line<'_>], delimiter: u8, width: usize) -> Option<usize> {
    let names = |line: &Line<'_>| {
        let fields = fields(line.text, delimiter);
        if fields.len() != width || fields.iter().any(|field| is_numeric(field)) {
            return 0;
        }
        fields.iter().filter(|field| !bare(field).is_empty()).count()
    };
    let most = lines.iter().map(names).max().filter(|most| *most > 0);
    match most {
        Some(most) => lines.iter().position(|line| names(line) == most),
        None => lines.len().checked_sub(1),
    }
}

/// Whether a text has rows alone, or notes above them that name no columns: its first row is written like the second one,
/// and no line above has as many fields.
fn has_no_header(lines: &[Line<'_>], data: usize, delimiter: u8, width: usize) -> bool {
    let kinds = |line: &Line<'_>| fields(line.text, delimiter).into_iter().map(is_numeric).collect::<Vec<_>>();
    let alike = lines.get(data + 1).is_some_and(|next| {
        // What is a number in the second row is one in the first, or a gap there.
        let first = fields(lines[data].text, delimiter);
        let second = kinds(next);
        first.iter().zip(&second).all(|(field, number)| is_numeric(field) == *number || is_gap(bare(field)))
    });
    // Some recorders end each row with a separator and the header without one.
    let names = |line: &Line<'_>| {
        let found = fields(line.text, delimiter).len();
        found >= width || found > 1 && found + 1 == width
    };
    alike && !lines[..data].iter().any(names)
}

/// Whether a line under the header is a row of units.
fn is_units(line: &[u8], delimiter: u8) -> bool {
    let fields = fields(line, delimiter);
    let text = |field: &[u8]| String::from_utf8_lossy(bare(field)).into_owned();
    let known = fields.iter().filter(|field| understood(&text(field)).is_some() || is_other_unit(&text(field))).count();
    let real = fields.iter().filter(|field| understood(&text(field)).is_some_and(|unit| !unit.text().is_empty()));
    real.count() > 0 && 2 * known >= fields.len() && !fields.iter().any(|field| is_numeric(field))
}

/// Whether the first column of most rows holds words.
fn names_first(rows: &[Line<'_>], delimiter: u8) -> bool {
    let sample = &rows[..rows.len().min(SAMPLE)];
    let first = sample.iter().map(|line| bare(fields(line.text, delimiter)[0]));
    let words = first.filter(|field| !is_numeric(field) && !is_gap(field)).count();
    2 * words > sample.len()
}

/// A last row without its end: too few fields, or a last field shorter than every other one.
fn cut_row(text: &[u8], rows: &[Line<'_>], delimiter: u8, width: usize) -> Option<(usize, usize)> {
    if text.ends_with(b"\n") || text.ends_with(b"\r") {
        return None;
    }
    let (last, others) = rows.split_last()?;
    let of_last = fields(last.text, delimiter);
    let length = |line: &Line<'_>| fields(line.text, delimiter).last().map_or(0, |field| field.len());
    let usual = others.iter().rev().take(SAMPLE).map(length).min();
    let shorter = others.len() >= FEWEST_FOR_LENGTH && usual.is_some_and(|usual| length(last) < usual);
    (!others.is_empty() && (of_last.len() < width || of_last.len() == width && shorter))
        .then_some((last.start, last.number))
}
