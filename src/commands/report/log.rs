//! What a timing log says.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use lab::frozen::FrozenFleet;
use leak_table::TableBundle;
use prognoser::{Method, Prognoser, Prognosis, Status};
use report::html::{Block, Point, Section, Table, View};
use serde_json::json;

use super::Part;
use crate::cli::LogColumnArgs;
use crate::commands::log_input::LogInput;
use crate::commands::prognose::{Ends, limits_words};
use crate::output;
use answers::figures::life::History;

/// Valves that get a picture.
const PICTURES: usize = 8;
/// Remarks that are listed.
const REMARKS: usize = 50;

/// Valves that are named at the top of the page.
const NAMED: usize = 12;

/// Reads the log and tells how its valves stand: all in a table, the worst first, and the worst of them in pictures.
pub fn part(path: &Path, columns: &LogColumnArgs, tables: &Arc<TableBundle>) -> anyhow::Result<Part> {
    let fleet = FrozenFleet::new(tables);
    let mut prognoser = Prognoser::new(Arc::clone(tables), Method::default());
    let mut remarks = Remarks::default();
    let mut log = LogInput::open(path, columns, false)?;
    log.announce();
    log.each(|row| {
        let prognosis = prognoser.push(row);
        fleet.take(row, &prognosis);
        remarks.take(&prognosis);
    })?;
    let ends = Ends::of(prognoser.lasts().cloned());
    let mut still = Vec::new();
    if ends.len() <= PICTURES {
        still.extend(ends.iter().map(|end| Block::Callout(end.sentence())));
    } else {
        still.push(Block::Callout(counted(&ends)));
        still.push(Block::Table(ends.table().into()));
        still.push(Block::Text(format!("How the {PICTURES} that stand worst came to this:")));
    }
    let worst: Vec<&str> = ends.iter().take(PICTURES).map(|end| end.row().valve.as_str()).collect();
    still.extend(pictures(path, columns, tables, &worst)?);
    let mut blocks = vec![Block::View(View { kind: "fleet", of: "log", still })];
    if ends.iter().any(|end| end.row().fault.wears()) {
        blocks.push(Block::Text(limits_words(&tables.manifest().limits)));
        blocks.push(Block::Text(
            "Each valve counts as healthy at its first row; `valve prognose --start unknown` is for a log that begins later in life."
                .to_owned(),
        ));
    }
    blocks.extend(remarks.blocks());
    Ok(Part {
        short: short(&ends),
        sections: vec![Section { title: "Timing log".to_owned(), blocks }],
        // A page goes to others: the log's name, not where it is kept.
        data: vec![("log", json!(fleet.whole(output::short_name(&path.display().to_string()))).to_string())],
    })
}

/// What was odd in the log, what is odd in many rows of a valve as one remark.
#[derive(Default)]
struct Remarks {
    /// Valve, cycle, remark, and how many more rows have it.
    listed: Vec<([String; 3], usize)>,
    /// Where that of a valve and kind is listed.
    places: HashMap<(String, &'static str), usize>,
    unlisted: usize,
}

impl Remarks {
    fn take(&mut self, prognosis: &Prognosis) {
        for notice in &prognosis.notices {
            let key = (prognosis.valve.clone(), notice.kind());
            if let Some(place) = self.places.get(&key).filter(|_| !notice.is_event()) {
                self.listed[*place].1 += 1;
            } else if self.listed.len() < REMARKS {
                self.places.insert(key, self.listed.len());
                let texts = [prognosis.valve.clone(), prognosis.cycle.to_string(), notice.to_string()];
                self.listed.push((texts, 0));
            } else {
                self.unlisted += 1;
            }
        }
    }

    fn blocks(self) -> Vec<Block> {
        let mut blocks = Vec::new();
        let row = |([valve, cycle, remark], more): ([String; 3], usize)| {
            let more = match more {
                0 => String::new(),
                1 => "; one more row".to_owned(),
                more => format!("; {more} more rows"),
            };
            vec![valve, cycle, remark + &more]
        };
        if !self.listed.is_empty() {
            blocks.push(Block::Text("What was odd in the log:".to_owned()));
            let rows = self.listed.into_iter().map(row).collect();
            blocks.push(Block::Table(Table::of_texts(["valve", "cycle", "remark"], rows)));
        }
        if self.unlisted > 0 {
            let unlisted = self.unlisted;
            blocks
                .push(Block::Text(format!("{unlisted} more remarks are not listed; `valve prognose -v` prints all.")));
        }
        blocks
    }
}

/// How many valves stand where.
fn counted(ends: &Ends) -> String {
    let counts: Vec<String> = ends.counts().into_iter().map(|cell| cell.text).collect();
    format!("{} valve{}: {}", ends.len(), if ends.len() == 1 { "" } else { "s" }, counts.join(", "))
}

/// State, worst and what to do.
fn short(ends: &Ends) -> Vec<Point> {
    let Some(worst) = ends.iter().next() else { return Vec::new() };
    let mut points = Vec::new();
    if ends.len() > 1 {
        points.push(Point::new("State", counted(ends)));
    }
    points.push(Point::new(if ends.len() > 1 { "Worst" } else { "State" }, worst.sentence()));
    let now = |end: &&crate::commands::prognose::End| matches!(end.row().status, Status::EolReached | Status::ActNow);
    let mut urgent: Vec<&str> = ends.iter().filter(now).map(|end| end.row().valve.as_str()).collect();
    let to_do = if urgent.is_empty() {
        worst.replacement().unwrap_or_else(|| "go on recording: nothing is to be replaced".to_owned())
    } else {
        let more = urgent.len().saturating_sub(NAMED);
        urgent.truncate(NAMED);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("replace now: {}{more}", urgent.join(", "))
    };
    points.push(Point::new("What to do", to_do));
    points
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
    LogInput::open(path, columns, false)?.each(|row| {
        if let Some(place) = valves.iter().position(|name| *name == row.valve) {
            histories[place].add(&row.reading, &prognoser.push(row));
        }
    })?;
    let figures = histories.into_iter().filter_map(|history| history.figure(tables, method.name(), None));
    Ok(figures.map(|figure| Block::Figure(Box::new(figure.figure()))).collect())
}
