//! A log of many valves, from its text to rows written: what reading, the estimate and the output take of it.

use std::fmt::Write as _;
use std::hint::black_box;
use std::io::Write as _;
use std::sync::Arc;

use leak_table::{Fault, Stroke, TableBundle};
use prognoser::study::NoiseSource;
use prognoser::{LogRow, Method, Prognoser, Prognosis, TimingLog};

use crate::markdown::{Table, figures, percent, time};
use crate::pace::by_turns;
use crate::reference_valve::tables;

/// Valves, their cycles interleaved, and cycles of each.
const VALVES: u32 = 500;
const CYCLES: u32 = 40;
/// Shortest and longest life of those that leak, cycles.
const ENDS: (f64, f64) = (50.0, 150.0);
/// Noise of the timings, s.
const NOISE_S: f64 = 0.003;

/// A log as a line of cycles after the other, each with all valves; one in `one_in` leaks.
fn log(tables: &TableBundle, one_in: u32) -> String {
    let table = tables.table(Fault::Atmosphere);
    let limit_m2 = tables.limit_area_m2(Fault::Atmosphere);
    let mut noise = NoiseSource::new(u64::from(one_in), 0);
    let growths: Vec<f64> = (0..VALVES)
        .map(|valve| {
            let end = ENDS.0 + noise.uniform() * (ENDS.1 - ENDS.0);
            if valve % one_in == 0 { limit_m2 / end } else { 0.0 }
        })
        .collect();
    let mut text = String::from("valve,cycle,close_time_s,open_time_s\n");
    for cycle in 0..CYCLES {
        for (valve, growth) in growths.iter().enumerate() {
            let [close, open] = Stroke::ALL.map(|stroke| {
                table.curve(stroke).extrapolated_time_and_slope(growth * f64::from(cycle)).0 + NOISE_S * noise.normal()
            });
            writeln!(text, "valve-{valve:04},{cycle},{close:.4},{open:.4}").expect("memory takes everything");
        }
    }
    text
}

/// All rows of a log, one after the other.
fn each_row(text: &str, mut take: impl FnMut(&LogRow<'_>)) {
    let mut log = TimingLog::new("log", text.as_bytes()).expect("the log has a header");
    while let Some(row) = log.next_row().expect("the log has rows") {
        take(&row);
    }
}

/// Reads and estimates, and hands each prognosis on.
fn prognose(tables: &Arc<TableBundle>, text: &str, method: &Method, mut take: impl FnMut(Prognosis)) {
    let mut prognoser = Prognoser::new(Arc::clone(tables), *method);
    each_row(text, |row| take(prognoser.push(row)));
}

/// Writes rows as JSON lines to a sink.
#[derive(Default)]
struct Lines {
    line: Vec<u8>,
    bytes: usize,
}

impl Lines {
    fn write(&mut self, prognosis: &Prognosis) {
        self.line.clear();
        serde_json::to_writer(&mut self.line, prognosis).expect("memory takes everything");
        self.line.push(b'\n');
        std::io::sink().write_all(black_box(&self.line)).expect("a sink takes everything");
        self.bytes += self.line.len();
    }
}

/// What one log takes with one method.
fn row(what: &str, tables: &Arc<TableBundle>, text: &str, method: &Method) -> Vec<String> {
    let mut told = Vec::new();
    prognose(tables, text, method, |prognosis| told.push(prognosis));
    let mut lines = Lines::default();
    for prognosis in &told {
        lines.write(prognosis);
    }
    let bytes = lines.bytes as f64 / told.len() as f64;
    let paces = by_turns(&mut [
        Box::new(|| each_row(text, |row| _ = black_box(row.reading))),
        Box::new(|| prognose(tables, text, method, |prognosis| drop(black_box(prognosis)))),
        Box::new(|| told.iter().for_each(|prognosis| lines.write(prognosis))),
        Box::new(|| {
            let mut lines = Lines::default();
            prognose(tables, text, method, |prognosis| lines.write(&prognosis));
        }),
    ]);
    let [reading_s, estimated_s, writing_s, all_s] = [0, 1, 2, 3].map(|call| paces[call].call_s / told.len() as f64);
    vec![
        format!("{what}, {}", method.name()),
        time(reading_s),
        time(estimated_s - reading_s),
        time(writing_s),
        time(all_s),
        percent(writing_s / all_s),
        figures(bytes),
    ]
}

/// A log of valves that all leak and one of a fleet, with each method.
pub fn compare() {
    let tables = Arc::new(tables());
    let mut rows = Vec::new();
    for (what, one_in) in [("all leak", 1), ("one in ten leaks", 10)] {
        let text = log(&tables, one_in);
        let methods = [Method::Ols, Method::default()];
        rows.extend(methods.iter().map(|method| row(what, &tables, &text, method)));
    }
    Table {
        title: "A log with its output".to_owned(),
        about: format!(
            "{VALVES} valves of {CYCLES} cycles, their rows interleaved; read from CSV in memory, written as JSON lines, as \
             the program formats them, to a sink."
        ),
        head: vec!["log", "reading", "estimate", "writing", "a row in all", "writing is", "bytes written"],
        rows,
    }
    .print();
}
