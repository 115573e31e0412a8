//! Aligned tables for people. Plain text, but for a bold head on a terminal.

use std::fmt::Write;

/// On which side the cells of a column stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// For words.
    Left,
    /// For numbers.
    Right,
}

/// A table that is printed when all rows are known.
#[derive(Debug)]
pub struct TextTable {
    columns: Vec<(String, Align)>,
    rows: Vec<Vec<String>>,
}

impl From<TextTable> for report::html::Table {
    fn from(table: TextTable) -> Self {
        Self { columns: table.columns.into_iter().map(|(name, _)| name).collect(), rows: table.rows }
    }
}

impl TextTable {
    /// An empty table.
    pub fn new(columns: &[(&str, Align)]) -> Self {
        Self { columns: columns.iter().map(|(name, align)| ((*name).to_owned(), *align)).collect(), rows: Vec::new() }
    }

    /// Adds a row; it has a cell for every column.
    pub fn row(&mut self, cells: Vec<String>) {
        debug_assert_eq!(cells.len(), self.columns.len());
        self.rows.push(cells);
    }

    /// The table as text, with a bold head where stdout is a terminal that wants colour.
    pub fn render(&self) -> String {
        self.render_with(super::manner().coloured)
    }

    fn render_with(&self, bold: bool) -> String {
        let width = |index: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(index)).map(|cell| cell.chars().count());
            cells.chain([self.columns[index].0.chars().count()]).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let mut out = String::new();
        let head: Vec<&str> = self.columns.iter().map(|(name, _)| name.as_str()).collect();
        if bold {
            out.push_str("\u{1b}[1m");
        }
        out.push_str(&self.line(&head, &widths));
        if bold {
            out.push_str("\u{1b}[0m");
        }
        out.push('\n');
        for row in &self.rows {
            let cells: Vec<&str> = row.iter().map(String::as_str).collect();
            out.push_str(&self.line(&cells, &widths));
            out.push('\n');
        }
        out
    }

    fn line(&self, cells: &[&str], widths: &[usize]) -> String {
        let mut line = String::new();
        for (index, cell) in cells.iter().enumerate() {
            if index > 0 {
                line.push_str("  ");
            }
            let width = widths[index];
            // Writing to a string cannot fail.
            let _ = match self.columns[index].1 {
                Align::Left => write!(line, "{cell:<width$}"),
                Align::Right => write!(line, "{cell:>width$}"),
            };
        }
        line.truncate(line.trim_end().len());
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let mut table = TextTable::new(&[("fault", Align::Left), ("area (mm²)", Align::Right)]);
        table.row(vec!["atmosphere".to_owned(), "0.5".to_owned()]);
        table.row(vec!["none".to_owned(), "12.25".to_owned()]);
        let expected = "fault       area (mm²)\natmosphere         0.5\nnone             12.25\n";
        assert_eq!(table.render_with(false), expected);
        assert!(table.render_with(true).starts_with("\u{1b}[1mfault"));
    }
}
