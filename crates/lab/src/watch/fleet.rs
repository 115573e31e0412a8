//! How every valve stands, and how it came to that.

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use leak_table::{Stroke, TableBundle};
use prognoser::{LogRow, Method, Prognoser, Prognosis};
use serde_json::{Value, json};

use super::leak_limit_mm2;

/// Points of a valve's past that are kept: beyond that every second one goes.
const PAST: usize = 240;

/// Points of a small picture.
const SMALL: usize = 24;

/// Remarks of a valve that are kept.
const REMARKS: usize = 60;

/// Valves that may change at once for pages to be told of each; beyond that they look at the fleet as a whole.
pub const MANY: usize = 1500;

/// Troubles that are kept.
const TROUBLES: usize = 50;

/// What is kept of one row; nothing is NaN.
#[derive(Debug, Clone, Copy)]
struct Point {
    cycle: u64,
    severity: f32,
    rul: [f32; 3],
    times_s: [f32; 2],
}

/// One valve.
#[derive(Debug)]
struct Known {
    last: Prognosis,
    past: Vec<Point>,
    /// Rows between two points.
    every: usize,
    /// Rows since the last point.
    since: usize,
    rows: u64,
    remarks: VecDeque<(u64, String)>,
}

impl Known {
    fn add(&mut self, point: Point) {
        self.rows += 1;
        // The newest is always there.
        if self.since > 0 {
            self.past.pop();
        }
        self.past.push(point);
        self.since = (self.since + 1) % self.every;
        if self.past.len() > PAST {
            let mut place = 0;
            self.past.retain(|_| {
                place += 1;
                place % 2 == 1
            });
            self.every *= 2;
            self.since = 0;
        }
    }
}

/// All that changes while logs grow.
struct Inside {
    prognoser: Prognoser,
    valves: HashMap<String, Known>,
    changed: BTreeSet<String>,
    troubles: VecDeque<(u64, String)>,
    /// Troubles so far, and those that pages were told of.
    counts: (u64, u64),
}

/// Every valve of every log.
pub struct Fleet {
    tables: Arc<TableBundle>,
    inside: Mutex<Inside>,
}

impl Fleet {
    /// Before the first row.
    pub fn new(tables: Arc<TableBundle>, method: &Method) -> Self {
        let inside = Inside {
            prognoser: Prognoser::new(Arc::clone(&tables), *method),
            valves: HashMap::new(),
            changed: BTreeSet::new(),
            troubles: VecDeque::new(),
            counts: (0, 0),
        };
        Self { tables, inside: Mutex::new(inside) }
    }

    fn inside(&self) -> MutexGuard<'_, Inside> {
        self.inside.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes in a row.
    pub fn push(&self, row: &LogRow<'_>) {
        let mut inside = self.inside();
        let told = inside.prognoser.push(row);
        let small = |value: Option<f64>| {
            #[expect(clippy::cast_possible_truncation, reason = "for a picture")]
            let value = value.map_or(f32::NAN, |value| value as f32);
            value
        };
        let point = Point {
            cycle: told.cycle,
            severity: small(told.severity),
            rul: [told.rul_p05, told.rul_p50, told.rul_p95].map(small),
            times_s: Stroke::ALL.map(|stroke| small(row.reading.time_s(stroke))),
        };
        let remarks: Vec<(u64, String)> = told.notices.iter().map(|notice| (told.cycle, notice.to_string())).collect();
        if !inside.changed.contains(row.valve) {
            inside.changed.insert(row.valve.to_owned());
        }
        let known = match inside.valves.get_mut(row.valve) {
            Some(known) => {
                known.last = told;
                known
            }
            None => inside.valves.entry(row.valve.to_owned()).or_insert(Known {
                last: told,
                past: Vec::new(),
                every: 1,
                since: 0,
                rows: 0,
                remarks: VecDeque::new(),
            }),
        };
        // A counter that started again starts a picture anew.
        if known.past.last().is_some_and(|last| last.cycle > point.cycle)
            && remarks.iter().all(|(_, text)| !text.contains("not used"))
        {
            known.past.clear();
            (known.every, known.since) = (1, 0);
        }
        if known.past.last().is_none_or(|last| last.cycle < point.cycle) {
            known.add(point);
        }
        known.remarks.extend(remarks);
        while known.remarks.len() > REMARKS {
            known.remarks.pop_front();
        }
    }

    /// Notes that a log or a row cannot be read.
    pub fn trouble(&self, words: String) {
        let mut inside = self.inside();
        if inside.troubles.back().is_some_and(|(_, last)| *last == words) {
            return;
        }
        inside.counts.0 += 1;
        let number = inside.counts.0;
        inside.troubles.push_back((number, words));
        if inside.troubles.len() > TROUBLES {
            inside.troubles.pop_front();
        }
    }

    /// How the valves stand that have changed since this was asked last (only how many there are, where they are very
    /// many), and what went wrong since.
    pub fn changed(&self) -> (Result<Vec<Value>, usize>, Vec<String>) {
        let mut inside = self.inside();
        let names = std::mem::take(&mut inside.changed);
        let all = inside.counts.0;
        let told = std::mem::replace(&mut inside.counts.1, all);
        let troubles = inside.troubles.iter().filter(|(number, _)| *number > told);
        let troubles = troubles.map(|(_, words)| words.clone()).collect();
        if names.len() > MANY {
            return (Err(names.len()), troubles);
        }
        let rows = names.iter().filter_map(|name| Some(self.row(inside.valves.get(name)?))).collect();
        (Ok(rows), troubles)
    }

    /// How every valve stands.
    pub fn rows(&self) -> Vec<Value> {
        self.inside().valves.values().map(|known| self.row(known)).collect()
    }

    /// What went wrong.
    pub fn troubles(&self) -> Vec<String> {
        self.inside().troubles.iter().map(|(_, words)| words.clone()).collect()
    }

    /// A row of the fleet's page: few words, since there may be thousands.
    fn row(&self, known: &Known) -> Value {
        let last = &known.last;
        let step = known.past.len().div_ceil(SMALL).max(1);
        // Counted from the newest, which is always there.
        let mut small: Vec<Value> =
            known.past.iter().rev().step_by(step).map(|point| rounded(point.severity)).collect();
        small.reverse();
        json!({
            "valve": last.valve,
            "status": last.status.name(),
            "fault": last.fault.name(),
            "cycle": last.cycle,
            "rows": known.rows,
            "time": last.time,
            "severity": last.severity,
            "leak_mm2": last.leak_area_mm2,
            "leak_limit_mm2": leak_limit_mm2(&self.tables, last.fault),
            "rul": [last.rul_p05, last.rul_p50, last.rul_p95],
            "replace_by_cycle": last.replace_by_cycle,
            "replace_by": last.replace_by,
            "caveat": last.caveat,
            "small": small,
        })
    }

    /// All that is known of a valve.
    pub fn valve(&self, name: &str) -> Option<Value> {
        let inside = self.inside();
        let known = inside.valves.get(name)?;
        let column = |of: &dyn Fn(&Point) -> f32| known.past.iter().map(|point| rounded(of(point))).collect::<Vec<_>>();
        Some(json!({
            "now": known.last,
            "row": self.row(known),
            "past": {
                "cycle": known.past.iter().map(|point| point.cycle).collect::<Vec<_>>(),
                "severity": column(&|point| point.severity),
                "rul_p05": column(&|point| point.rul[0]),
                "rul_p50": column(&|point| point.rul[1]),
                "rul_p95": column(&|point| point.rul[2]),
                "close_time_s": column(&|point| point.times_s[0]),
                "open_time_s": column(&|point| point.times_s[1]),
            },
            "remarks": known.remarks.iter().rev().map(|(cycle, text)| json!([cycle, text])).collect::<Vec<_>>(),
        }))
    }
}

/// Five decimals, and nothing for NaN.
fn rounded(value: f32) -> Value {
    if value.is_finite() { json!((f64::from(value) * 1e5).round() * 1e-5) } else { Value::Null }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_past_stays_small_and_ends_with_the_newest() {
        let last = Prognoser::new(
            Arc::new(
                TableBundle::read(std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tables"))).unwrap(),
            ),
            Method::default(),
        )
        .push(&LogRow {
            valve: "V",
            reading: prognoser::Reading { close_time_s: Some(1.0), open_time_s: Some(2.0), ..Default::default() },
            time: None,
            line: 1,
        });
        let mut known = Known { last, past: Vec::new(), every: 1, since: 0, rows: 0, remarks: VecDeque::new() };
        for cycle in 0..5000 {
            let point = Point { cycle, severity: 0.0, rul: [0.0; 3], times_s: [1.0; 2] };
            known.add(point);
            assert!(known.past.len() <= PAST);
            assert_eq!(known.past.last().map(|point| point.cycle), Some(cycle));
            assert!(known.past.windows(2).all(|pair| pair[0].cycle < pair[1].cycle));
        }
        assert!(known.past.len() > PAST / 3, "{}", known.past.len());
        assert_eq!(known.past[0].cycle, 0);
    }
}
