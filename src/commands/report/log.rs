//! The section about a timing log.

use std::path::Path;
use std::sync::Arc;

use leak_table::TableBundle;
use prognoser::{Method, Prognoser};
use report::html::{Block, Section, Table};

use crate::cli::LogColumnArgs;
use crate::commands::log_input::LogInput;
use crate::commands::prognose::Ends;
use answers::figures::life::History;

/// Valves that get a picture.
const PICTURES: usize = 8;
/// Remarks that are listed.
const REMARKS: usize = 50;

/// Reads the log and tells how its valves stand: all in a table, the worst first, and the worst of them in pictures.
pub fn section(path: &Path, columns: &LogColumnArgs, tables: &Arc<TableBundle>) -> anyhow::Result<Section> {
    let mut prognoser = Prognoser::new(Arc::clone(tables), Method::default());
    let mut remarks: Vec<Vec<String>> = Vec::new();
    let mut unlisted = 0_usize;
    let mut log = LogInput::open(path, columns, false)?;
    log.announce();
    while let Some(row) = log.next_row()? {
        let prognosis = prognoser.push(&row);
        for notice in &prognosis.notices {
            if remarks.len() < REMARKS {
                remarks.push(vec![prognosis.valve.clone(), prognosis.cycle.to_string(), notice.to_string()]);
            } else {
                unlisted += 1;
            }
        }
    }
    let ends = Ends::of(prognoser.lasts().cloned());
    let mut blocks = Vec::new();
    if ends.len() <= PICTURES {
        blocks.extend(ends.iter().map(|end| Block::Callout(end.sentence())));
    } else {
        let counts: Vec<String> = ends.counts().into_iter().map(|cell| cell.text).collect();
        blocks.push(Block::Callout(format!("{} valves: {}", ends.len(), counts.join(", "))));
        blocks.push(Block::Table(ends.table().into()));
        blocks.push(Block::Text(format!("How the {PICTURES} that stand worst came to this:")));
    }
    let worst: Vec<&str> = ends.iter().take(PICTURES).map(|end| end.row().valve.as_str()).collect();
    blocks.extend(pictures(path, columns, tables, &worst)?);
    if !remarks.is_empty() {
        blocks.push(Block::Text("What was odd in the log:".to_owned()));
        blocks.push(Block::Table(Table::of_texts(["valve", "cycle", "remark"], remarks)));
    }
    if unlisted > 0 {
        blocks.push(Block::Text(format!("{unlisted} more remarks are not listed; `valve prognose` prints all.")));
    }
    Ok(Section { title: "Timing log".to_owned(), blocks })
}

/// The paths of these valves. Which they are is only known at the end of the log, so it is read again.
fn pictures(
    path: &Path,
    columns: &LogColumnArgs,
    tables: &Arc<TableBundle>,
    valves: &[&str],
) -> anyhow::Result<Vec<Block>> {
    let method = Method::default();
    let mut prognoser = Prognoser::new(Arc::clone(tables), method);
    let mut histories: Vec<History> = valves.iter().map(|name| History::of(Some((*name).to_owned()))).collect();
    let mut log = LogInput::open(path, columns, false)?;
    while let Some(row) = log.next_row()? {
        let Some(place) = valves.iter().position(|name| *name == row.valve) else { continue };
        let reading = row.reading;
        histories[place].add(&reading, &prognoser.push(&row));
    }
    let figures = histories.into_iter().filter_map(|history| history.figure(tables, method.name(), None));
    Ok(figures.map(|figure| Block::Figure(Box::new(figure.figure()))).collect())
}
