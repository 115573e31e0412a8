//! How every valve stands, and how it came to that.

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::ops::Bound;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use leak_table::{Stroke, TableBundle};
use prognoser::{FaultCall, LogRow, Method, Prognoser, Prognosis};
use serde::Serialize;
use serde_json::{Value, json};

use super::leak_limit_mm2;
use crate::thin::corners;

/// Points of a valve's past that are kept: beyond that half of them go, and the corners stay.
const PAST: usize = 240;

/// Points of a small picture.
const SMALL: usize = 24;

/// Remarks of a valve that are kept.
const REMARKS: usize = 60;

/// Valves that pages are told of at once: where more have changed the others follow, so that a page never stands still.
const AT_ONCE: usize = 1500;

/// Faults that are less probable are not drawn.
const LEAST_SHARE: f64 = 0.005;

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
    rows: u64,
    remarks: VecDeque<(u64, String)>,
}

impl Known {
    fn add(&mut self, point: Point) {
        self.rows += 1;
        self.past.push(point);
        if self.past.len() > PAST {
            self.past = self.thinned(PAST / 2);
        }
    }

    /// So many points of its past that keep the corners of all that is drawn.
    fn thinned(&self, count: usize) -> Vec<Point> {
        if self.past.len() <= count {
            return self.past.clone();
        }
        let column =
            |of: &dyn Fn(&Point) -> f32| -> Vec<f64> { self.past.iter().map(|point| f64::from(of(point))).collect() };
        let drawn = COLUMNS.map(|of| column(&of));
        #[expect(clippy::cast_precision_loss, reason = "for a picture")]
        let cycles: Vec<f64> = self.past.iter().map(|point| point.cycle as f64).collect();
        let columns: Vec<&[f64]> = drawn.iter().map(|values| &values[..]).collect();
        corners(&cycles, &columns, count).into_iter().map(|place| self.past[place]).collect()
    }
}

/// What is drawn of a point, beside its cycle.
const COLUMNS: [fn(&Point) -> f32; 6] = [
    |point| point.severity,
    |point| point.rul[0],
    |point| point.rul[1],
    |point| point.rul[2],
    |point| point.times_s[0],
    |point| point.times_s[1],
];

/// How a valve stands, without its past: few words, since there may be thousands.
#[derive(Debug, Clone, Serialize)]
struct Standing {
    valve: String,
    status: &'static str,
    fault: &'static str,
    cycle: u64,
    rows: u64,
    time: Option<String>,
    severity: Option<f64>,
    leak_mm2: Option<f64>,
    leak_limit_mm2: Option<f64>,
    /// Cycles left, 5, 50 and 95 %.
    rul: [Option<f64>; 3],
    replace_by_cycle: Option<u64>,
    replace_by: Option<String>,
    caveat: Option<String>,
}

/// A row of the fleet's page.
#[derive(Debug, Clone, Serialize)]
pub struct FleetRow {
    #[serde(flatten)]
    standing: Standing,
    /// Cycles, and the wear at each.
    small: (Vec<u64>, Vec<Option<f64>>),
}

/// The columns of a past: the cycle, and what is drawn of it in the order of [`COLUMNS`].
#[derive(Debug, Clone, Serialize)]
struct Past(Vec<u64>, Column, Column, Column, Column, Column, Column);

type Column = Vec<Option<f64>>;

/// Remarks, each with its cycle, the newest first.
type Remarks = Vec<(u64, String)>;

/// All that is known of a valve.
#[derive(Debug, Clone, Serialize)]
pub struct ValvePast {
    now: Prognosis,
    row: FleetRow,
    past: Past,
    remarks: Remarks,
}

/// What a page without a server shows of a valve beside its row.
#[derive(Debug, Clone, Serialize)]
struct Now {
    /// Faults that are probable enough to be drawn.
    fault_probability: Option<BTreeMap<&'static str, f64>>,
    eol_cycle: Option<f64>,
    eol_time: Option<String>,
}

/// All valves of a page without a server, a column each, since there may be thousands.
#[derive(Debug, Clone, Serialize)]
pub struct WholeFleet {
    limits_s: [f64; 2],
    logs: [String; 1],
    /// What [`Standing`] tells, by its names, a value for each valve.
    rows: BTreeMap<String, Vec<Value>>,
    /// Now, past and remarks of each valve, numbers as short as they are seen.
    valves: Vec<(Value, Value, Remarks)>,
}

/// All that changes while logs grow.
struct Inside {
    prognoser: Prognoser,
    valves: HashMap<String, Known>,
    changed: BTreeSet<String>,
    /// The valve that pages were told of last.
    turn: String,
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
            turn: String::new(),
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
        let told = self.inside().prognoser.push(row);
        self.take(row, told);
    }

    /// Takes in what was told of a row.
    pub fn take(&self, row: &LogRow<'_>, told: Prognosis) {
        let mut inside = self.inside();
        let small = |value: Option<f64>| {
            #[expect(clippy::cast_possible_truncation, reason = "for a picture")]
            let value = value.map_or(f32::NAN, |value| value as f32);
            value
        };
        let point = Point {
            cycle: told.cycle,
            severity: small(told.severity),
            rul: [told.rul_p05, told.rul_cycles, told.rul_p95].map(small),
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
                rows: 0,
                remarks: VecDeque::new(),
            }),
        };
        // A counter that started again starts a picture anew.
        if known.past.last().is_some_and(|last| last.cycle > point.cycle)
            && remarks.iter().all(|(_, text)| !text.contains("not used"))
        {
            known.past.clear();
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

    /// How the valves stand that have changed since they were told of last, and what went wrong since. Where very many have
    /// changed it is some of them, the others when this is asked again, each in its turn.
    pub fn changed(&self) -> (Vec<FleetRow>, Vec<String>) {
        let mut inside = self.inside();
        let all = inside.counts.0;
        let told = std::mem::replace(&mut inside.counts.1, all);
        let troubles = inside.troubles.iter().filter(|(number, _)| *number > told);
        let troubles = troubles.map(|(_, words)| words.clone()).collect();
        let behind = (Bound::Excluded(inside.turn.as_str()), Bound::Unbounded);
        let turn = inside.changed.range::<str, _>(behind).chain(&inside.changed).take(inside.changed.len());
        let names: Vec<String> = turn.take(AT_ONCE).cloned().collect();
        for name in &names {
            inside.changed.remove(name);
        }
        if let Some(last) = names.last() {
            inside.turn.clone_from(last);
        }
        let rows = names.iter().filter_map(|name| Some(self.row(inside.valves.get(name)?))).collect();
        (rows, troubles)
    }

    /// How every valve stands.
    pub fn rows(&self) -> Vec<FleetRow> {
        self.inside().valves.values().map(|known| self.row(known)).collect()
    }

    /// What went wrong.
    pub fn troubles(&self) -> Vec<String> {
        self.inside().troubles.iter().map(|(_, words)| words.clone()).collect()
    }

    /// A row of the fleet's page.
    fn row(&self, known: &Known) -> FleetRow {
        let small = known.thinned(SMALL);
        let small = small.iter().map(|point| (point.cycle, rounded(point.severity))).unzip();
        FleetRow { standing: self.standing(known), small }
    }

    /// How a valve stands, without its past.
    fn standing(&self, known: &Known) -> Standing {
        let last = &known.last;
        Standing {
            valve: last.valve.clone(),
            status: last.status.name(),
            fault: last.fault.name(),
            cycle: last.cycle,
            rows: known.rows,
            time: last.time.clone(),
            severity: last.severity,
            leak_mm2: last.leak_area_mm2,
            leak_limit_mm2: leak_limit_mm2(&self.tables, last.fault),
            rul: [last.rul_p05, last.rul_cycles, last.rul_p95],
            replace_by_cycle: last.replace_by_cycle,
            replace_by: last.replace_by.clone(),
            caveat: last.caveat.clone(),
        }
    }

    /// All that is known of a valve.
    pub fn valve(&self, name: &str) -> Option<ValvePast> {
        let inside = self.inside();
        let known = inside.valves.get(name)?;
        Some(ValvePast {
            now: known.last.clone(),
            row: self.row(known),
            past: past(&known.past),
            remarks: known.remarks.iter().rev().cloned().collect(),
        })
    }

    /// Number of valves.
    pub fn len(&self) -> usize {
        self.inside().valves.len()
    }

    /// Everything that is known, `points` of each valve's past at most: what [`Fleet::rows`] and [`Fleet::valve`] tell, a
    /// column each, since there may be thousands of valves.
    pub fn whole(&self, log: &str, points: usize) -> WholeFleet {
        let inside = self.inside();
        let mut known: Vec<&Known> = inside.valves.values().collect();
        known.sort_by(|a, b| a.last.valve.cmp(&b.last.valve));
        let mut rows: BTreeMap<String, Vec<Value>> = BTreeMap::new();
        for one in &known {
            if let Value::Object(row) = json!(self.standing(one)) {
                row.into_iter().for_each(|(key, value)| rows.entry(key).or_default().push(short(value)));
            }
        }
        let now = |one: &Known| {
            let last = &one.last;
            let probable = last.fault_probability.map(|all| {
                let wears = all.wears().iter().map(|(id, _)| FaultCall::Wears(*id));
                let faults = [FaultCall::None, FaultCall::BothLeaks, FaultCall::Other].into_iter().chain(wears);
                let shares = faults.map(|fault| (fault.name(), all.of(fault)));
                shares.filter(|(_, share)| *share >= LEAST_SHARE).collect()
            });
            Now { fault_probability: probable, eol_cycle: last.eol_cycle, eol_time: last.eol_time.clone() }
        };
        let of_valve = |one: &Known| {
            let remarks = one.remarks.iter().rev().take(points.min(REMARKS)).cloned().collect();
            (short(json!(now(one))), short(json!(past(&one.thinned(points)))), remarks)
        };
        WholeFleet {
            limits_s: limits_s(&self.tables),
            logs: [log.to_owned()],
            rows,
            valves: known.iter().map(|one| of_valve(one)).collect(),
        }
    }
}

/// The columns of a past, the cycle first.
fn past(points: &[Point]) -> Past {
    let [wear, least, middle, most, close, open] =
        COLUMNS.map(|of| points.iter().map(|point| rounded(of(point))).collect());
    Past(points.iter().map(|point| point.cycle).collect(), wear, least, middle, most, close, open)
}

/// The same with numbers of five digits at most, as many as are seen.
fn short(value: Value) -> Value {
    match value {
        Value::Number(number) if number.is_f64() => {
            let value = number.as_f64().unwrap_or(0.0);
            format!("{value:.4e}").parse::<f64>().map_or(Value::Null, |value| json!(value))
        }
        Value::Array(all) => all.into_iter().map(short).collect(),
        Value::Object(all) => all.into_iter().map(|(key, value)| (key, short(value))).collect(),
        other => other,
    }
}

/// The longest that a closing and an opening may take, s.
pub fn limits_s(tables: &TableBundle) -> [f64; 2] {
    let limits = tables.manifest().limits;
    Stroke::ALL.map(|stroke| limits.within_s(stroke))
}

/// Five decimals, and nothing for NaN.
fn rounded(value: f32) -> Option<f64> {
    value.is_finite().then(|| (f64::from(value) * 1e5).round() / 1e5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn however_many_change_each_is_told_of_in_its_turn() {
        let tables =
            TableBundle::read(std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tables"))).unwrap();
        let fleet = Fleet::new(Arc::new(tables), &Method::default());
        let push = |cycle: u64| {
            for valve in 0..2 * AT_ONCE + 10 {
                let valve = format!("V{valve:05}");
                let reading = prognoser::Reading { cycle, close_time_s: Some(1.04), ..Default::default() };
                fleet.push(&LogRow { valve: &valve, reading, time: None, line: 1 });
            }
        };
        let told = || -> Vec<String> { fleet.changed().0.iter().map(|row| row.standing.valve.clone()).collect() };
        push(0);
        let first = told();
        assert_eq!(first.len(), AT_ONCE);
        // Those that were told of change again before the others had their turn.
        push(1);
        let mut seen: BTreeSet<String> = first.into_iter().collect();
        seen.extend(told());
        seen.extend(told());
        assert_eq!(seen.len(), 2 * AT_ONCE + 10, "nobody waits for long");
        // Ten changed after they had been told of, and then there is no more to tell.
        assert_eq!((told().len(), told().len()), (10, 0));
    }

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
        let mut known = Known { last, past: Vec::new(), rows: 0, remarks: VecDeque::new() };
        for cycle in 0..5000 {
            // One row stands out, early on.
            let severity = if cycle == 77 { 1.0 } else { 0.1 };
            #[expect(clippy::cast_precision_loss, reason = "for a picture")]
            let noise = (cycle as f32 * 12.9898).sin() * 0.01;
            let point = Point { cycle, severity, rul: [0.0; 3], times_s: [1.0 + noise; 2] };
            known.add(point);
            assert!(known.past.len() <= PAST);
            assert_eq!(known.past.last().map(|point| point.cycle), Some(cycle));
            assert!(known.past.windows(2).all(|pair| pair[0].cycle < pair[1].cycle));
        }
        assert!(known.past.len() > PAST / 3, "{}", known.past.len());
        assert_eq!(known.past[0].cycle, 0);
        assert!(known.past.iter().any(|point| point.severity > 0.9), "corners stay");
    }
}
