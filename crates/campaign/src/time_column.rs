//! The time column of a file whose campaign names none, or one that other files have.

use column_source::{Clock, ColumnSource, Comments, any_unit_at_end};
use quantity::{Dimension, Unit};

use crate::columns::{self, CHANNELS, Mapping};
use crate::error::{DataError, DataProblem};
use crate::words::is_time;

/// Rows that are looked at for a timestamp.
const ROWS: usize = 20;

/// The column that is the time by itself, of columns by name, unit and whether they hold timestamps: the only one that is
/// called a time and tells its unit or holds timestamps, else the only one that holds timestamps.
pub(crate) fn by_itself<'a>(columns: impl Iterator<Item = (&'a str, Option<Unit>, bool)>) -> Option<usize> {
    let all: Vec<(bool, bool, bool)> = columns
        .map(|(name, unit, is_stamp)| {
            let unit = unit.or_else(|| any_unit_at_end(name));
            let in_time = unit.is_some_and(|unit| unit.measures(Dimension::Time));
            (is_time(name), in_time, is_stamp)
        })
        .collect();
    let only = |fits: &dyn Fn(&(bool, bool, bool)) -> bool| {
        let found: Vec<usize> = (0..all.len()).filter(|index| fits(&all[*index])).collect();
        <[usize; 1]>::try_from(found).ok().map(|[index]| index)
    };
    only(&|(is_time, in_time, is_stamp)| *is_time && (*in_time || *is_stamp)).or_else(|| only(&|column| column.2))
}

/// What is to be read in place of a time column that a file lacks: the name of its own, and the refusal that would be made
/// without it. `None` where it has the column, or none by itself.
pub(crate) fn in_place(
    bytes: &[u8],
    file: &str,
    mappings: &[Mapping],
) -> Result<Option<(String, DataError)>, DataError> {
    let mut source = column_source::open(bytes, file, Comments::WhereNoNames)?;
    let mapping = mappings.iter().find(|mapping| mapping.channel == "time");
    let time = |source: &dyn ColumnSource| match columns::find(source, CHANNELS[0], mapping, 0.0) {
        Ok(None) => Some(columns::missing(source, "time_s", "time_s, time_ms, or its name in [columns]")),
        Err(error) if matches!(*error.problem, DataProblem::MissingColumn { .. }) => Some(error),
        Ok(Some(_)) | Err(_) => None,
    };
    // Of a file of several tables the one that is read is not known yet.
    if source.tables() != 1 {
        return Ok(None);
    }
    let Some(refusal) = time(source.as_ref()) else { return Ok(None) };
    let mut stamps = vec![false; source.headings().len()];
    for _ in 0..ROWS {
        // What is wrong with a row is told where it is read.
        let Ok(Some(line)) = source.next_row() else { break };
        for (index, is_stamp) in stamps.iter_mut().enumerate() {
            *is_stamp |=
                source.number(index).is_err() && Clock::default().seconds(&source.field(index), line).is_some();
        }
    }
    let headings = source.headings().iter().zip(&stamps);
    let found = by_itself(headings.map(|(heading, is_stamp)| (heading.bare(), heading.unit.clone(), *is_stamp)));
    Ok(found.map(|index| (source.headings()[index].name.clone(), refusal)))
}
