//! What is said of the rows of a log: the first of a kind one by one, how many more there are in the end.

use std::collections::{BTreeMap, BTreeSet};

use leak_table::TableBundle;
use prognoser::{Notice, Reading};
use quantity::Dimension;

use crate::output::{self, told_in};

/// Remarks of a kind that are told of one valve, and of all valves.
const OF_A_VALVE: usize = 1;
const OF_ALL: usize = 12;

/// The share of rows from which on what is odd about them is a mistake of the whole log.
const THROUGHOUT: f64 = 0.5;

/// Kind of the remark on a row whose conditions are too far from the tables.
const FAR: &str = "far-conditions";

/// A remark on a row: the notice's kind, and the line that tells it.
#[derive(Debug, Clone)]
pub struct Remark {
    /// [`Notice::kind`].
    pub kind: &'static str,
    /// [`Notice::is_event`]: told whatever the number of its kind.
    pub is_event: bool,
    /// Where it is, and what.
    pub text: String,
}

/// Remarks of one kind that were not told one by one.
#[derive(Debug, Default)]
struct Kind {
    by_valve: BTreeMap<String, usize>,
    told: usize,
    untold: usize,
    untold_of: BTreeSet<String>,
}

/// The least and the most of a condition that rows state, how many do, and how many do not.
#[derive(Debug, Clone, Copy)]
struct Stated {
    least: f64,
    most: f64,
    with: usize,
    without: usize,
}

impl Stated {
    const NONE: Self = Self { least: f64::INFINITY, most: f64::NEG_INFINITY, with: 0, without: 0 };

    fn add(&mut self, value: Option<f64>) {
        match value {
            Some(value) => {
                (self.least, self.most) = (self.least.min(value), self.most.max(value));
                self.with += 1;
            }
            None => self.without += 1,
        }
    }
}

/// The remarks on a log.
#[derive(Debug)]
pub struct Remarks {
    /// Whether they are gathered: rows of a whole log, unless all are asked for.
    gathers: bool,
    rows: usize,
    kinds: Vec<(&'static str, Kind)>,
    supply_pa: Stated,
    temperature_k: Stated,
    /// The same of rows that are left out for what they state.
    far: [Stated; 2],
}

impl Remarks {
    /// Of a log that is read as a whole, or row by row as it comes.
    pub fn new(is_live: bool) -> Self {
        let gathers = !is_live && !output::is_verbose();
        Self {
            gathers,
            rows: 0,
            kinds: Vec::new(),
            supply_pa: Stated::NONE,
            temperature_k: Stated::NONE,
            far: [Stated::NONE; 2],
        }
    }

    /// Takes a row with its remarks, and tells those that are told one by one.
    pub fn take(&mut self, valve: &str, reading: &Reading, remarks: &[Remark]) {
        self.rows += 1;
        let is_far = remarks.iter().any(|remark| remark.kind == FAR);
        let [far_pa, far_k] = &mut self.far;
        let [supply_pa, temperature_k] =
            if is_far { [far_pa, far_k] } else { [&mut self.supply_pa, &mut self.temperature_k] };
        supply_pa.add(reading.supply_pressure_pa);
        temperature_k.add(reading.temperature_k);
        for Remark { kind, is_event, text } in remarks {
            if !self.gathers || *is_event {
                output::note(text);
                continue;
            }
            let place = self.kinds.iter().position(|(known, _)| known == kind).unwrap_or_else(|| {
                self.kinds.push((kind, Kind::default()));
                self.kinds.len() - 1
            });
            let of_kind = &mut self.kinds[place].1;
            let of_valve = of_kind.by_valve.entry(valve.to_owned()).or_default();
            *of_valve += 1;
            if *of_valve <= OF_A_VALVE && of_kind.told < OF_ALL {
                of_kind.told += 1;
                output::note(text);
            } else {
                of_kind.untold += 1;
                of_kind.untold_of.insert(valve.to_owned());
            }
        }
    }

    /// Tells how many there were that were not told, and what they say of the log as a whole; whether it was read the wrong way
    /// round, so that nothing that was found holds.
    pub fn finish(&self, log: &str, tables: &TableBundle) -> bool {
        for (kind, of_kind) in self.kinds.iter().filter(|(_, of_kind)| of_kind.untold > 0) {
            let plural = |count: usize| if count == 1 { "" } else { "s" };
            let (rows, valves) = (of_kind.untold, of_kind.untold_of.len());
            let (rows, valves) =
                (format!("{rows} more row{}", plural(rows)), format!("{valves} valve{}", plural(valves)));
            output::note(&format!("{log}: {rows} of {valves} with the remark {kind:?}; -v tells each"));
        }
        let count = |kind: &str| {
            let found = self.kinds.iter().find(|(known, _)| *known == kind);
            found.map_or(0, |(_, of_kind)| of_kind.by_valve.values().sum::<usize>())
        };
        let exchanged = count("exchanged");
        if exchanged > 1 && exchanged as f64 > THROUGHOUT * self.rows as f64 {
            output::note(&format!(
                "{log}: closing and opening times look exchanged in {exchanged} of {} rows; exchange the two columns",
                self.rows
            ));
        }
        let backwards = [("out-of-order", "cycle"), ("strange-date", "date")].into_iter().find_map(|(kind, what)| {
            let rows = count(kind);
            (rows > 1 && rows as f64 > THROUGHOUT * self.rows as f64).then_some((rows, what))
        });
        if let Some((rows, what)) = backwards {
            output::note(&format!(
                "{log}: in {rows} of {} rows the {what} lies before those above: it is sorted newest first, and what was found \
                 of it does not hold; sort it by {what}, oldest first",
                self.rows
            ));
        }
        let range = tables.condition_range();
        // What most rows state is no slip of somebody who wrote it down.
        let far = count(FAR) as f64 > THROUGHOUT * self.rows as f64;
        let [supply_pa, temperature_k] = if far { self.far } else { [self.supply_pa, self.temperature_k] };
        let conditions = [
            (supply_pa, Dimension::Pressure, 0.01 * supply_pa.most, "supply pressure", "--supply-range"),
            (temperature_k, Dimension::Temperature, 1.0, "temperature", "--temperature-range"),
        ];
        for (stated, dimension, room, what, option) in conditions {
            if stated.with > 0 && stated.without > 0 && range.is_some() {
                output::note(&format!(
                    "{log}: {} of {} rows do not say the {what}; they count as made at that of the tables' reference",
                    stated.without, self.rows
                ));
            }
            if (far || count("conditions-not-covered") > 0) && stated.with > 0 {
                let unit = told_in(dimension);
                let number = |value: f64| unit.number(value, 1);
                output::note(&format!(
                    "{log}: the {what} lies between {} and {} {}; `valve build-tables` with {option} \"{}..{} {}\" builds \
                     tables for that",
                    number(stated.least),
                    number(stated.most),
                    unit.name(),
                    number(stated.least - room),
                    number(stated.most + room),
                    unit.name()
                ));
            }
        }
        backwards.is_some()
    }
}

/// What is said of a row, for the log's name and its line.
pub fn remark(log: &str, line: u64, valve: &str, cycle: u64, notice: &Notice) -> Remark {
    let text = format!("{log}:{line}: valve {valve}, cycle {cycle}: {notice}");
    Remark { kind: notice.kind(), is_event: notice.is_event(), text }
}
