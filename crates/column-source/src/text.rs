//! Text with separators: CSV and its relatives.

use std::borrow::Cow;
use std::io::Cursor;
use std::sync::Arc;

use csv::ByteRecord;
use quantity::{Reference, Unit};

use crate::heading::{is_other_unit, understood};
use crate::layout::{self, Layout};
use crate::number::{NumberStyle, is_gap, plain_decimal};
use crate::timestamp::are_a_moment;
use crate::{ColumnSource, Heading, Notice, NoticeKind, RecordError, RecordProblem, decode};

/// The longest line that is read, bytes.
const LONGEST_LINE: usize = 65_536;

/// Where a # begins a comment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comments {
    /// Before the header, and after it unless the first column holds names.
    WhereNoNames,
    /// Before the header alone.
    BeforeHeader,
}

/// A text file whose header has been read.
#[derive(Debug)]
pub struct TextSource {
    file: String,
    text: Arc<[u8]>,
    layout: Layout,
    style: NumberStyle,
    headings: Vec<Heading>,
    reader: csv::Reader<Cursor<Arc<[u8]>>>,
    row: ByteRecord,
    line: usize,
    comments: bool,
    /// Rows have been read.
    begun: bool,
    /// The columns of a date and of the time of that day.
    date_beside: Option<(usize, usize)>,
    notices: Vec<Notice>,
    /// The header and the row of units, as they are written.
    heads: Vec<ByteRecord>,
    /// Rows that were left out because they repeat one of these, and the line of the first header among them.
    repeated: (usize, usize),
}

impl TextSource {
    /// Finds out how a file is written, and reads its header. `file` is what messages call it.
    pub fn new(bytes: &[u8], file: &str, comments: Comments) -> Result<Self, RecordError> {
        let error = |line, problem| RecordError { file: file.to_owned(), line, problem };
        let (mut text, mut notices) = decode::text(bytes).map_err(|(line, problem)| error(line, problem))?;
        for (index, line) in text.split(|byte| *byte == b'\n').enumerate() {
            if line.len() > LONGEST_LINE {
                let problem = RecordProblem::LongLine { bytes: line.len(), most: LONGEST_LINE };
                return Err(error(index + 1, problem));
            }
        }
        let layout = layout::find(&text).ok_or_else(|| error(1, RecordProblem::Empty))?;
        if layout.preamble > 0 {
            let kind = NoticeKind::Preamble { lines: layout.preamble };
            notices.push(Notice { line: layout.header_line, kind });
        }
        if let Some(columns) = layout.unnamed {
            notices.push(Notice { line: layout.header_line, kind: NoticeKind::NoHeader { columns } });
        }
        if let Some((start, line)) = layout.cut {
            text.truncate(start);
            notices.push(Notice { line, kind: NoticeKind::CutRow });
        }
        let comments = comments == Comments::WhereNoNames && !layout.names_first;
        let text: Arc<[u8]> = text.into();
        let mut cursor = Cursor::new(Arc::clone(&text));
        cursor.set_position(layout.header_start as u64);
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(layout.delimiter)
            .comment(comments.then_some(b'#'))
            .from_reader(cursor);
        let mut source = Self {
            file: file.to_owned(),
            style: NumberStyle::PLAIN,
            headings: Vec::new(),
            row: ByteRecord::new(),
            line: layout.header_line,
            text,
            layout,
            reader,
            comments,
            begun: false,
            date_beside: None,
            notices,
            heads: Vec::new(),
            repeated: (0, 0),
        };
        source.read_headings()?;
        source.find_style();
        Ok(source)
    }

    fn read_headings(&mut self) -> Result<(), RecordError> {
        if let Some(columns) = self.layout.unnamed {
            self.headings = (1..=columns).map(|number| Heading::new(&format!("column {number}"))).collect();
            return Ok(());
        }
        self.read();
        self.heads.push(self.row.clone());
        self.headings = (0..self.row.len()).map(|column| Heading::new(&self.text_of(column))).collect();
        let Some(units_line) = self.layout.units_line else { return Ok(()) };
        self.read();
        self.heads.push(self.row.clone());
        let mut said = Vec::new();
        for column in 0..self.headings.len().min(self.row.len()) {
            let text = self.text_of(column).into_owned();
            let unit = understood(&text).filter(|unit| !unit.text().is_empty());
            if unit.is_none() && is_other_unit(&text) {
                said.push(format!("{} in {text}", self.headings[column].name));
                self.headings[column].other_unit_below = Some(text);
            }
            if let Some(unit) = unit {
                let column_name = &self.headings[column].name;
                if let Some(heading) = self.headings[column].unit.clone() {
                    if is_contrary(&heading, &unit) {
                        let (column, heading) = (column_name.clone(), heading.text().to_owned());
                        let problem = RecordProblem::TwoUnits { column, heading, below: unit.text().to_owned() };
                        return Err(self.error(units_line, problem));
                    }
                    if heading.reference() != unit.reference() && unit.reference() == Reference::Ambiguous {
                        // "barg" over "bar" says more than that.
                        continue;
                    }
                }
                said.push(format!("{} in {}", self.headings[column].name, unit.text()));
                self.headings[column].unit = Some(unit);
            }
        }
        let kind = NoticeKind::UnitsRow { units: said.join(", ") };
        self.notices.push(Notice { line: units_line, kind });
        Ok(())
    }

    /// Finds a date in one column and the time of that day in another one, by the first row.
    fn find_date_beside(&mut self) {
        let fields: Vec<Cow<'_, str>> = (0..self.row.len()).map(|column| self.text_of(column)).collect();
        let is_moment = |date: usize, time: usize| date != time && are_a_moment(&fields[date], &fields[time]);
        let all = (0..fields.len()).flat_map(|date| (0..fields.len()).map(move |time| (date, time)));
        let found: Vec<(usize, usize)> = all.filter(|(date, time)| is_moment(*date, *time)).collect();
        // Of several nobody knows which belong together.
        let [(date, time)] = found[..] else { return };
        self.date_beside = Some((date, time));
        let name = |column: usize| self.headings[column].name.clone();
        let kind = NoticeKind::DateBeside { date: name(date), time: name(time) };
        self.notices.push(Notice { line: self.line, kind });
    }

    /// How numbers are written, from the whole file: a separator can be rare.
    fn find_style(&mut self) {
        let rows = &self.text[self.layout.header_start..];
        let comma_parts = self.layout.delimiter == b',';
        let unusual = |byte: &u8| *byte == b'\'' || *byte >= 0x80 || (if comma_parts { b'"' } else { b',' }) == *byte;
        // A space inside a number cannot be told from one beside it without looking closer.
        if !rows.iter().any(unusual)
            && !rows.windows(3).any(|three| three[1] == b' ' && three[0].is_ascii_digit() && three[2].is_ascii_digit())
        {
            return;
        }
        let Ok(text) = std::str::from_utf8(rows) else { return };
        let above = usize::from(self.layout.unnamed.is_none()) + usize::from(self.layout.units_line.is_some());
        let mut lines = text.lines().enumerate().skip(above);
        let first_line = lines.clone().next().map_or(0, |(index, _)| index);
        let mut fields: Vec<&str> = Vec::new();
        for (_, line) in &mut lines {
            if !line.starts_with('#') {
                let parts = layout::fields(line.as_bytes(), self.layout.delimiter);
                fields.extend(parts.into_iter().filter_map(|field| std::str::from_utf8(layout::bare(field)).ok()));
            }
        }
        let (style, decimal, thousands) = NumberStyle::of(fields.into_iter(), comma_parts);
        let line = self.layout.header_line + first_line;
        if let Some(example) = decimal.filter(|_| style.decimal == b',') {
            let kind = NoticeKind::DecimalComma { example: example.to_owned() };
            self.notices.push(Notice { line, kind });
        }
        if let (Some(example), Some(separator)) = (thousands, style.thousands) {
            let kind = NoticeKind::Thousands { separator, example: example.to_owned() };
            self.notices.push(Notice { line, kind });
        }
        self.style = style;
    }

    /// Reads the next record, whatever it is; false at the end.
    fn read(&mut self) -> bool {
        // Reading from memory cannot fail, and byte records accept any row.
        let found = self.reader.read_byte_record(&mut self.row).unwrap_or(false);
        if found {
            self.line = self.line_of_row();
        }
        found
    }

    /// Whether the row is the header again, or the row of units, as in exports that were appended to one another.
    fn leaves_out_head(&mut self) -> bool {
        let is_same = |head: &ByteRecord| {
            head.len() == self.row.len()
                && head.iter().zip(&self.row).all(|(one, other)| one.trim_ascii() == other.trim_ascii())
        };
        let Some(which) = self.heads.iter().position(is_same) else { return false };
        if which == 0 {
            let first = if self.repeated.0 == 0 { self.line } else { self.repeated.1 };
            self.repeated = (self.repeated.0 + 1, first);
        }
        true
    }

    fn say_repeated(&mut self) {
        let (rows, line) = std::mem::take(&mut self.repeated);
        if rows > 0 {
            self.notices.push(Notice { line, kind: NoticeKind::HeaderAgain { rows } });
        }
    }

    /// The line at which the row begins. The reader places a row before the comments and empty lines that it skips.
    fn line_of_row(&self) -> usize {
        let Some(position) = self.row.position() else { return self.layout.header_line };
        // Files are far shorter than the largest index.
        let index = |number: u64| usize::try_from(number).unwrap_or(usize::MAX);
        let mut line = self.layout.header_line + index(position.line()) - 1;
        let mut start = self.layout.header_start + index(position.byte());
        while let Some(byte) = self.text.get(start) {
            if !(matches!(byte, b'\n' | b'\r') || *byte == b'#' && self.comments) {
                break;
            }
            let Some(length) = self.text[start..].iter().position(|byte| *byte == b'\n') else { break };
            line += 1;
            start += length + 1;
        }
        line
    }

    fn text_of(&self, column: usize) -> Cow<'_, str> {
        String::from_utf8_lossy(self.bytes(column))
    }

    fn bytes(&self, column: usize) -> &[u8] {
        self.row.get(column).unwrap_or_default().trim_ascii()
    }
}

/// Whether numbers in both units mean different things.
fn is_contrary(one: &Unit, other: &Unit) -> bool {
    let size = |unit: &Unit| (unit.dimension(), unit.to_si(0.0), unit.to_si(1.0));
    let references = [one.reference(), other.reference()];
    let is_open = references.contains(&Reference::Ambiguous);
    let is_gauge = references.map(|reference| reference == Reference::Gauge);
    size(one) != size(other) || !is_open && is_gauge[0] != is_gauge[1]
}

impl ColumnSource for TextSource {
    fn file(&self) -> &str {
        &self.file
    }

    fn headings(&self) -> &[Heading] {
        &self.headings
    }

    fn header_line(&self) -> usize {
        self.layout.header_line
    }

    fn next_row(&mut self) -> Result<Option<usize>, RecordError> {
        loop {
            if !self.read() {
                self.say_repeated();
                return Ok(None);
            }
            // A line of spaces is no row.
            let blank = self.row.len() == 1 && self.headings.len() > 1 && self.bytes(0).is_empty();
            if !blank && !self.leaves_out_head() {
                break;
            }
        }
        let (found, expected) = (self.row.len(), self.headings.len());
        // Some recorders end each row with a separator and the header without one.
        let ended = found == expected + 1 && self.bytes(expected).is_empty();
        if found != expected && !ended {
            return Err(self.error(self.line, RecordProblem::RowLength { found, expected }));
        }
        if !std::mem::replace(&mut self.begun, true) {
            self.find_date_beside();
        }
        Ok(Some(self.line))
    }

    fn number(&self, column: usize) -> Result<f64, RecordError> {
        let field = self.bytes(column);
        let plain = self.style == NumberStyle::PLAIN || !field.contains(&b'.');
        if plain && let Some(number) = plain_decimal(field) {
            return Ok(number);
        }
        if is_gap(field) {
            return Ok(f64::NAN);
        }
        let text = String::from_utf8_lossy(field);
        if let Some(number) = self.style.parse(&text) {
            return Ok(number);
        }
        let column = self.headings.get(column).map_or_else(String::new, |heading| heading.name.clone());
        let found: String = text.chars().take(40).collect();
        let number_like = found.chars().all(|c| c.is_ascii_digit() || "+-.,".contains(c)) && found.contains([',', '.']);
        let problem = if number_like && (found.contains(',') || self.style != NumberStyle::PLAIN) {
            let expected = if self.style.decimal == b',' { "comma" } else { "point" };
            RecordProblem::MixedSeparators { column, found, expected }
        } else {
            RecordProblem::NotANumber { column, found }
        };
        Err(self.error(self.line, problem))
    }

    fn field(&self, column: usize) -> Cow<'_, str> {
        match self.date_beside {
            Some((date, time)) if time == column => format!("{} {}", self.text_of(date), self.text_of(time)).into(),
            _ => self.text_of(column),
        }
    }

    fn notices(&self) -> &[Notice] {
        &self.notices
    }
}
