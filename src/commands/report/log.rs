//! The section about a timing log.

use std::collections::HashMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use leak_table::TableBundle;
use prognoser::{Method, Prognoser, TimingLog};
use report::html::{Block, Section, Table};

use crate::commands::prognose::{End, Ends, History};

/// Valves that get a picture.
const PICTURES: usize = 8;
/// Remarks that are listed.
const REMARKS: usize = 50;

/// Reads the log and tells how its valves stand.
pub fn section(path: &Path, tables: &Arc<TableBundle>) -> anyhow::Result<Section> {
    let file = File::open(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    let mut log = TimingLog::new(path.display().to_string(), BufReader::new(file))?;
    let method = Method::default();
    let mut prognoser = Prognoser::new(Arc::clone(tables), method);
    let mut histories: Vec<History> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    let mut remarks: Vec<Vec<String>> = Vec::new();
    let mut unlisted = 0_usize;
    while let Some(row) = log.next_row()? {
        let (prognosis, reading) = (prognoser.push(&row), row.reading);
        if !places.contains_key(&prognosis.valve) && histories.len() < PICTURES {
            places.insert(prognosis.valve.clone(), histories.len());
            histories.push(History::of(Some(prognosis.valve.clone())));
        }
        if let Some(place) = places.get(&prognosis.valve) {
            histories[*place].add(&reading, &prognosis);
        }
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
        blocks.push(Block::Table(states(&ends)));
    }
    let figures = histories.into_iter().filter_map(|history| history.figure(tables, method.name(), None));
    blocks.extend(figures.map(|figure| Block::Figure(Box::new(figure.figure()))));
    if !remarks.is_empty() {
        blocks.push(Block::Text("What was odd in the log:".to_owned()));
        let columns = ["valve", "cycle", "remark"].map(str::to_owned).into();
        blocks.push(Block::Table(Table { columns, rows: remarks }));
    }
    if unlisted > 0 {
        blocks.push(Block::Text(format!("{unlisted} more remarks are not listed; `valve prognose` prints all.")));
    }
    Ok(Section { title: "Timing log".to_owned(), blocks })
}

/// How every valve stands, in a table.
fn states(ends: &Ends) -> Table {
    let row = |end: &End| {
        let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.1}"));
        let one = end.row();
        vec![
            one.valve.clone(),
            one.cycle.to_string(),
            one.fault.name().to_owned(),
            number(one.rul_cycles),
            number(one.rul_p05),
            one.status.name().to_owned(),
        ]
    };
    Table {
        columns: ["valve", "cycle", "fault", "cycles left", "at least (95 %)", "status"].map(str::to_owned).into(),
        rows: ends.iter().map(row).collect(),
    }
}
