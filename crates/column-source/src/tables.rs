//! Several tables of one file: groups of channels, sheets.

use std::borrow::Cow;

use crate::table::TableSource;
use crate::{ColumnSource, Heading, Notice, NoticeKind, RecordError, listed};

/// A table with its names.
#[derive(Debug)]
pub(crate) struct NamedTable {
    /// What stands before the name of a column to tell the table, as in "Bench/Position".
    pub name: String,
    /// What messages call it, as in `group "Bench"`.
    pub shown: String,
    pub table: TableSource,
}

/// The tables, the largest first, with one of them at hand.
#[derive(Debug)]
pub(crate) struct TablesSource {
    tables: Vec<NamedTable>,
    at: usize,
}

/// A source of these tables, of which there is at least one.
pub(crate) fn source(mut tables: Vec<NamedTable>) -> Box<dyn ColumnSource> {
    if let [_] = tables[..] {
        return Box::new(tables.remove(0).table);
    }
    // Sorting is stable: of tables that are alike the first one of the file comes first.
    tables.sort_by_key(|named| std::cmp::Reverse(named.table.values()));
    let shown: Vec<String> = tables.iter().map(|named| named.shown.clone()).collect();
    for (index, named) in tables.iter_mut().enumerate() {
        let others = shown.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, shown)| shown.as_str());
        let others = others.collect::<Vec<_>>().join(", ");
        named.table.say(NoticeKind::OtherTables { taken: shown[index].clone(), others });
    }
    Box::new(TablesSource { tables, at: 0 })
}

impl TablesSource {
    fn at_hand(&self) -> &TableSource {
        &self.tables[self.at].table
    }
}

impl ColumnSource for TablesSource {
    fn file(&self) -> &str {
        self.at_hand().file()
    }

    fn headings(&self) -> &[Heading] {
        self.at_hand().headings()
    }

    fn header_line(&self) -> usize {
        self.at_hand().header_line()
    }

    fn next_row(&mut self) -> Result<Option<usize>, RecordError> {
        self.tables[self.at].table.next_row()
    }

    fn number(&self, column: usize) -> Result<f64, RecordError> {
        self.at_hand().number(column)
    }

    fn field(&self, column: usize) -> Cow<'_, str> {
        self.at_hand().field(column)
    }

    fn notices(&self) -> &[Notice] {
        self.at_hand().notices()
    }

    fn tables(&self) -> usize {
        self.tables.len()
    }

    fn go_to(&mut self, table: usize) {
        self.at = table;
        self.tables[table].table.rewind();
    }

    fn table(&self) -> Option<&str> {
        Some(&self.tables[self.at].shown)
    }

    fn within_table<'a>(&self, name: &'a str) -> &'a str {
        let own = name.strip_prefix(self.tables[self.at].name.as_str()).and_then(|rest| rest.strip_prefix('/'));
        own.unwrap_or(name)
    }

    fn listed(&self) -> String {
        let of = |named: &NamedTable| {
            format!("{}: {}", named.shown, listed(named.table.headings().iter().map(|heading| heading.name.as_str())))
        };
        self.tables.iter().map(of).collect::<Vec<_>>().join("; ")
    }
}
