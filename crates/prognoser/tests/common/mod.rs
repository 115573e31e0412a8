//! The tables of a test valve and logs made from them.
#![allow(dead_code, reason = "each test file uses a part of this")]
#![allow(clippy::large_types_passed_by_value, reason = "settings, once a test")]

use std::fs;
use std::path::Path;

use leak_table::{
    BundleInfo, BundlePart, CycleSchedule, Fault, FaultInfo, Limits, SeverityPoint, SeverityTable, Stroke, TableBundle,
    TimeAt, m2_from_mm2,
};
use prognoser::study::NoiseSource;
use prognoser::{LogRow, Method, Prognoser, Prognosis, Reading};

/// Tables of a normally open valve at 75 psig in cycles of 12 s.
pub fn tables() -> TableBundle {
    let table = |fault: Fault| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/{fault}.csv"));
        let text = fs::read_to_string(path).expect("test data are there");
        let points = text
            .lines()
            .skip(1)
            .map(|line| {
                let fields: Vec<&str> = line.split(',').collect();
                SeverityPoint {
                    severity: m2_from_mm2(fields[0].parse().expect("an area")),
                    close_time_s: fields[1].parse().ok(),
                    open_time_s: fields[2].parse().ok(),
                }
            })
            .collect();
        SeverityTable::new(fault.degradation(), points).expect("test data are monotone")
    };
    let limits = Limits { close_within_s: 3.0, open_within_s: 6.0 };
    let part = |fault| {
        let table = table(fault);
        BundlePart { info: FaultInfo::from_table(&table, &limits), table, over_conditions: None }
    };
    let info = BundleInfo {
        valve: "test valve".into(),
        model_hash: String::new(),
        schedule: CycleSchedule { close_at_s: 0.0, open_at_s: 4.0, end_s: 12.0 },
        limits,
        reference: None,
    };
    TableBundle::new(info, &[part(Fault::Atmosphere), part(Fault::Supply)]).expect("limits are inside the tables")
}

/// The reading of a cycle at a leak given as a fraction of the limit.
pub fn reading(tables: &TableBundle, fault: Fault, cycle: u64, leak: f64) -> Reading {
    let area = leak * tables.limit_area_m2(fault);
    let time = |stroke| match tables.table(fault).curve(stroke).time_at(area) {
        TimeAt::Within(time) => Some(time),
        _ => None,
    };
    let times = [time(Stroke::Close), time(Stroke::Open)];
    let stalled = times.map(|time| time.is_none());
    Reading { cycle, close_time_s: times[0], open_time_s: times[1], stalled, ..Reading::default() }
}

/// Adds noise to a reading and rounds it to 0.1 ms.
pub fn noisy(reading: Reading, sd_s: f64, noise: &mut NoiseSource) -> Reading {
    let mut blur = |time: Option<f64>| {
        let error = sd_s * noise.normal();
        time.map(|time| ((time + error).max(0.0) * 1e4).round() / 1e4)
    };
    Reading { close_time_s: blur(reading.close_time_s), open_time_s: blur(reading.open_time_s), ..reading }
}

/// A log of one valve whose leak goes as `leak` (fractions of the limit).
pub fn log(
    tables: &TableBundle,
    fault: Fault,
    cycles: u64,
    sd_s: f64,
    seed: u64,
    leak: impl Fn(f64) -> f64,
) -> Vec<Reading> {
    let mut noise = NoiseSource::new(seed, 0);
    (0..cycles).map(|cycle| noisy(reading(tables, fault, cycle, leak(cycle as f64)), sd_s, &mut noise)).collect()
}

/// Pushes the log of one valve through a new prognoser.
pub fn run(method: Method, readings: &[Reading]) -> Vec<Prognosis> {
    let mut prognoser = Prognoser::new(tables().into(), method);
    readings.iter().map(|reading| prognoser.push(&row("V", reading))).collect()
}

/// A row of a log.
pub fn row<'a>(valve: &'a str, reading: &Reading) -> LogRow<'a> {
    LogRow { valve, reading: *reading, time: None, line: reading.cycle + 2 }
}

/// Names of all notices with the cycles at which they came.
pub fn notices(prognoses: &[Prognosis]) -> Vec<(u64, &'static str)> {
    prognoses.iter().flat_map(|p| p.notices.iter().map(|n| (p.cycle, n.kind()))).collect()
}
