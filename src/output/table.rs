//! Aligned tables for people, as wide as the terminal allows: heads are broken first, then words; words at the end of a
//! row go below it; columns that are still too wide go on below the table. Numbers are never cut.

use report::html::{Cell, Tone};

use super::manner;
use super::paint::paint;
use super::wrap::pieces;

/// On which side the cells of a column stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// For words.
    Left,
    /// For numbers.
    Right,
}

/// Blanks between two columns.
const GAP: usize = 2;
/// Columns that words in a table are given at least.
const LEAST_WORDS: usize = 22;
/// Columns before words that stand below their row.
const BELOW: usize = 4;
/// Lines that a head may be broken into.
const HEAD_LINES: usize = 3;

/// A table that is printed when all rows are known.
#[derive(Debug)]
pub struct TextTable {
    columns: Vec<(String, Align)>,
    rows: Vec<Vec<Cell>>,
}

impl From<TextTable> for report::html::Table {
    fn from(table: TextTable) -> Self {
        Self { columns: table.columns.into_iter().map(|(name, _)| name).collect(), rows: table.rows }
    }
}

impl TextTable {
    /// An empty table. Where no column has a head, none is printed.
    pub fn new(columns: &[(&str, Align)]) -> Self {
        Self { columns: columns.iter().map(|(name, align)| ((*name).to_owned(), *align)).collect(), rows: Vec::new() }
    }

    /// Adds a row; it has a cell for every column.
    pub fn row(&mut self, cells: Vec<String>) {
        self.cells(cells.into_iter().map(Cell::from).collect());
    }

    /// Adds a row of cells that may have a tone.
    pub fn cells(&mut self, cells: Vec<Cell>) {
        debug_assert_eq!(cells.len(), self.columns.len());
        self.rows.push(cells);
    }

    /// The table as text that fits the terminal, with a bold head and colours where they are wanted.
    pub fn render(&self) -> String {
        self.render_beside(0)
    }

    /// The same where something else takes so many columns.
    pub fn render_beside(&self, taken: usize) -> String {
        let manner = manner();
        self.render_with(manner.coloured, manner.columns - taken)
    }

    fn render_with(&self, coloured: bool, columns: usize) -> String {
        let (widths, below) = self.widths(columns);
        let mut out = String::new();
        for (index, block) in blocks(&widths, columns).iter().enumerate() {
            if index > 0 {
                out.push('\n');
            }
            let heads: Vec<Cell> =
                self.columns.iter().map(|(head, _)| Cell { text: head.clone(), tone: Some(Tone::Strong) }).collect();
            let heads = Some(&heads).filter(|heads| heads.iter().any(|head| !head.text.is_empty()));
            for row in heads.into_iter().chain(&self.rows) {
                let tone = |cell: &Cell| cell.tone.filter(|_| coloured);
                let cells = block.iter().map(|column| {
                    let cell = &row[*column];
                    (*column, fill(&cell.text, widths[*column]), tone(cell))
                });
                self.lines(&mut out, &cells.collect::<Vec<_>>(), &widths);
                let last = row.last().filter(|cell| below && index == 0 && !cell.text.is_empty());
                for line in last.map_or_else(Vec::new, |cell| fill(&cell.text, columns - BELOW)) {
                    out.push_str(&" ".repeat(BELOW));
                    out.push_str(&paint(&line, last.and_then(tone)));
                    out.push('\n');
                }
            }
        }
        out
    }

    /// How wide each column is, so that all fit if they can, and whether the last one, not among them, goes below.
    fn widths(&self, columns: usize) -> (Vec<usize>, bool) {
        let cells = |index: usize| self.rows.iter().map(move |row| row[index].text.as_str());
        let longest = |index: usize| cells(index).map(width).max().unwrap_or(0);
        let all: Vec<usize> = (0..self.columns.len()).collect();
        let mut widths: Vec<usize> =
            all.iter().map(|index| longest(*index).max(width(&self.columns[*index].0))).collect();
        if total(&widths) <= columns {
            return (widths, false);
        }
        for index in &all {
            widths[*index] = longest(*index).max(head_width(&self.columns[*index].0));
        }
        // Words give way, the longest first, but none is cut.
        let least = |index: usize| {
            let words = cells(index).chain([self.columns[index].0.as_str()]);
            let word = words.flat_map(pieces).map(|piece| width(&piece)).max().unwrap_or(0);
            word.max(LEAST_WORDS)
        };
        let mut words: Vec<usize> = all.into_iter().filter(|index| self.columns[*index].1 == Align::Left).collect();
        words.sort_by_key(|index| std::cmp::Reverse(widths[*index]));
        let narrowed = |mut widths: Vec<usize>| {
            for index in words.iter().copied().filter(|index| *index < widths.len()).collect::<Vec<_>>() {
                let over = total(&widths).saturating_sub(columns);
                widths[index] = widths[index].min(widths[index].saturating_sub(over).max(least(index)));
            }
            widths
        };
        let fitted = narrowed(widths.clone());
        let ends_in_words =
            self.columns.len() > 2 && self.columns.last().is_some_and(|(_, align)| *align == Align::Left);
        if total(&fitted) <= columns || !ends_in_words {
            return (fitted, false);
        }
        widths.pop();
        (narrowed(widths), true)
    }

    /// One row: as many lines as its longest cell.
    fn lines(&self, out: &mut String, cells: &[(usize, Vec<String>, Option<Tone>)], widths: &[usize]) {
        let count = cells.iter().map(|(_, lines, _)| lines.len()).max().unwrap_or(0);
        for number in 0..count {
            let mut line = String::new();
            // Blanks are written when something follows them.
            let mut blanks = 0;
            for (place, (column, lines, tone)) in cells.iter().enumerate() {
                let text = lines.get(number).map_or("", String::as_str);
                let room = widths[*column].saturating_sub(width(text));
                let before = if self.columns[*column].1 == Align::Right { room } else { 0 };
                blanks += before + if place > 0 { GAP } else { 0 };
                if !text.is_empty() {
                    line.push_str(&" ".repeat(blanks));
                    line.push_str(&paint(text, *tone));
                    blanks = 0;
                }
                blanks += room - before;
            }
            out.push_str(&line);
            out.push('\n');
        }
    }
}

/// The columns in groups that fit one after the other, the first column in each.
fn blocks(widths: &[usize], columns: usize) -> Vec<Vec<usize>> {
    let mut blocks = vec![Vec::new()];
    let mut taken = 0;
    for (index, width) in widths.iter().enumerate() {
        let is_full = taken > 0 && taken + GAP + width > columns;
        if is_full && blocks.last().is_some_and(|block: &Vec<usize>| block.len() > 1) {
            blocks.push(vec![0]);
            taken = widths[0];
        }
        if let Some(block) = blocks.last_mut() {
            block.push(index);
        }
        taken += if taken > 0 { GAP + width } else { *width };
    }
    blocks
}

fn total(widths: &[usize]) -> usize {
    widths.iter().sum::<usize>() + GAP * widths.len().saturating_sub(1)
}

fn width(text: &str) -> usize {
    text.chars().count()
}

/// The least width at which a head has no more lines than it may have.
fn head_width(head: &str) -> usize {
    let longest = pieces(head).iter().map(|piece| width(piece)).max().unwrap_or(0);
    (longest..width(head)).find(|columns| fill(head, *columns).len() <= HEAD_LINES).unwrap_or(width(head))
}

/// A text in lines of at most so many columns, where its words allow it.
fn fill(text: &str, columns: usize) -> Vec<String> {
    if width(text) <= columns {
        return vec![text.to_owned()];
    }
    let mut lines: Vec<String> = Vec::new();
    for piece in pieces(text) {
        match lines.last_mut() {
            Some(line) if width(line) + 1 + width(&piece) <= columns => {
                line.push(' ');
                line.push_str(&piece);
            }
            _ => lines.push(piece),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(cells: &[&[&str]], table: &mut TextTable) {
        for row in cells {
            table.row(row.iter().map(|cell| (*cell).to_owned()).collect());
        }
    }

    #[test]
    fn columns_line_up() {
        let mut table = TextTable::new(&[("fault", Align::Left), ("area (mm²)", Align::Right)]);
        rows(&[&["atmosphere", "0.5"], &["none", "12.25"]], &mut table);
        let expected = "fault       area (mm²)\natmosphere         0.5\nnone             12.25\n";
        assert_eq!(table.render_with(false, 80), expected);
        assert!(table.render_with(true, 80).starts_with("\u{1b}[1mfault"));
    }

    #[test]
    fn a_narrow_terminal_breaks_heads_then_words_then_puts_them_below() {
        let columns = [("valve", Align::Left), ("cycles left", Align::Right), ("caveat", Align::Left)];
        let mut table = TextTable::new(&columns);
        rows(&[&["FV-101", "12.5", "both leaks are as likely as one, see the log"]], &mut table);
        assert_eq!(
            table.render_with(false, 40),
            "valve   cycles  caveat\n          left\nFV-101    12.5  both leaks are as likely\n\
             \x20               as one, see the log\n"
        );
        assert_eq!(
            table.render_with(false, 34),
            "valve   cycles\n          left\n    caveat\nFV-101    12.5\n    both leaks are as likely as\n    one, see the log\n"
        );
    }

    #[test]
    fn numbers_that_do_not_fit_go_on_below_with_the_name_repeated() {
        let mut table = TextTable::new(&[("run", Align::Left), ("error", Align::Right), ("in noise", Align::Right)]);
        rows(&[&["close-75psig.csv", "1.2345678", "123.45"]], &mut table);
        assert_eq!(
            table.render_with(false, 28),
            "run                   error\nclose-75psig.csv  1.2345678\n\nrun                   in\n\
             \x20                  noise\nclose-75psig.csv  123.45\n"
        );
    }

    #[test]
    fn colours_take_no_room() {
        let mut table = TextTable::new(&[("state", Align::Left), ("cycle", Align::Right)]);
        table.cells(vec![Cell::toned("act-now", Tone::Bad), "5".to_owned().into()]);
        table.cells(vec![Cell::toned("plan", Tone::Caution), "12".to_owned().into()]);
        let plain = table.render_with(false, 80);
        let coloured = table.render_with(true, 80);
        assert_ne!(plain, coloured);
        let mut bare = coloured;
        for code in ["\u{1b}[1;31m", "\u{1b}[33m", "\u{1b}[1m", "\u{1b}[0m"] {
            bare = bare.replace(code, "");
        }
        assert_eq!(bare, plain);
    }
}
