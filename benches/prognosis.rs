//! Prognosis: a table inversion, an update of the remaining life, the same by an optimiser, a log.

#[path = "../tests/reference_valve/mod.rs"]
mod reference_valve;

use std::cell::Cell;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::neldermead::NelderMead;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use leak_table::{ConditionRange, Conditions, Fault, Stroke, TableBundle};
use lut_builder::{Options, Request, build_request};
use prognoser::bayes::{BayesConfig, BayesEstimator};
use prognoser::{Method, OlsEstimator, Prognoser, Reading, TimingLog};
use reference_valve::{CYCLE, base_valve, leaking, periodic, spread, table_model, testbed, testbed_file};
use valve_model::Valve;
use valve_model::simulate::DEFAULT_STEP_S;

/// Leak that both ways of estimating have to find, m2; between the points of the table.
const LEAK_M2: f64 = 0.3456e-6;
/// Rows and valves of the log.
const ROWS: usize = 100_000;
const VALVES: usize = 1000;

fn reference_tables() -> TableBundle {
    TableBundle::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tables")).expect("tables/ is sound")
}

/// The life of a valve with a growing leak, read off the table, with a little noise.
fn life(tables: &TableBundle) -> Vec<Reading> {
    let table = tables.table(Fault::Atmosphere);
    let noise: Vec<f64> = spread(60, 0.5).map(|u| 0.01 * (u - 0.5)).collect();
    let reading = |cycle: u32| {
        let area = f64::from(cycle) * 0.0235e-6;
        let time = |stroke, noise| Some(table.curve(stroke).extrapolated_time_and_slope(area).0 + noise);
        let index = cycle as usize;
        Reading {
            cycle: u64::from(cycle),
            close_time_s: time(Stroke::Close, noise[index]),
            open_time_s: time(Stroke::Open, noise[30 + index]),
            ..Reading::default()
        }
    };
    (0..25).map(reading).collect()
}

/// A stroke time from a leak, and a leak from a stroke time, side by side.
fn inversion(criterion: &mut Criterion) {
    let tables = reference_tables();
    let curve = tables.table(Fault::Atmosphere).curve(Stroke::Close);
    let (first, last) = curve.end_times_s();
    let times: Vec<f64> = spread(256, 0.3).map(|u| first + u * (last - first)).collect();
    let leaks: Vec<f64> = times.iter().map(|time| curve.extrapolated_severity(*time)).collect();
    let mut group = criterion.benchmark_group("table inversion");
    group.throughput(Throughput::Elements(times.len() as u64));
    group.bench_function("leak to time", |b| {
        b.iter(|| leaks.iter().map(|leak| curve.extrapolated_time_and_slope(black_box(*leak)).0).sum::<f64>());
    });
    group.bench_function("time to leak", |b| {
        b.iter(|| times.iter().map(|time| curve.extrapolated_severity(black_box(*time))).sum::<f64>());
    });
    group.finish();
}

/// Both stroke times with their slopes, a whole slice and a leak, each at a pressure of its own.
fn over_pressure(criterion: &mut Criterion) {
    let file = testbed_file();
    let text = file.canonical_model();
    let own_k = file.valve().parameters().temperature_k;
    let range = ConditionRange { supply_pressure_pa: (560e3, 680e3), temperature_k: (own_k, own_k) };
    let request = Request { conditions: Some(range), ..Request::default() };
    let built = build_request(&table_model(&file, &text), &request, &Options::default(), &|_| {}).expect("tables");
    let table = built.bundle.entry(0).over_conditions.expect("was built");
    let at: Vec<(f64, Conditions)> = spread(256, 0.3)
        .zip(spread(256, 0.7))
        .map(|(leak, pressure)| {
            let supply_pressure_pa = 560e3 + 120e3 * pressure;
            (0.55e-6 * leak, Conditions { supply_pressure_pa, temperature_k: own_k })
        })
        .collect();
    let mut group = criterion.benchmark_group("table over pressure");
    group.throughput(Throughput::Elements(at.len() as u64));
    group.bench_function("leak to both times and slopes", |b| {
        b.iter(|| {
            at.iter().map(|(leak, at)| table.times(black_box(*leak), at).expect("covered").close.time_s).sum::<f64>()
        });
    });
    group.bench_function("slice", |b| {
        b.iter(|| {
            at.iter()
                .map(|(_, at)| table.slice(black_box(at)).expect("covered").curve(Stroke::Close).range().1)
                .sum::<f64>()
        });
    });
    group.finish();
}

/// One update with the remaining life, averaged over a life of 25 cycles.
fn update(criterion: &mut Criterion) {
    let tables = reference_tables();
    let life = life(&tables);
    let mut group = criterion.benchmark_group("update with remaining life");
    group.throughput(Throughput::Elements(life.len() as u64));
    group.bench_function("ols", |b| {
        b.iter(|| {
            let mut estimator = OlsEstimator::new();
            for reading in &life {
                black_box(estimator.update(&tables, reading));
            }
        });
    });
    group.bench_function("bayes", |b| {
        b.iter(|| {
            let mut estimator = BayesEstimator::new(&BayesConfig::default());
            for reading in &life {
                black_box(estimator.update(&tables, reading));
            }
        });
    });
    group.finish();
}

/// The squared miss of the closing time over the leak area in mm2, by full simulation.
struct Miss<'a> {
    valve: &'a Valve,
    close_time_s: f64,
    simulations: &'a Cell<usize>,
}

fn close_time_s(valve: &Valve, area_m2: f64) -> f64 {
    let run = (valve, leaking(valve, Fault::Atmosphere, area_m2.max(0.0)));
    // A valve that does not close takes longer than the cycle.
    periodic(&[run], &CYCLE, DEFAULT_STEP_S)[0].close_time_s.unwrap_or(CYCLE.end_s)
}

impl CostFunction for Miss<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, area_mm2: &Vec<f64>) -> Result<f64, Error> {
        self.simulations.set(self.simulations.get() + 1);
        Ok((close_time_s(self.valve, area_mm2[0] * 1e-6) - self.close_time_s).powi(2))
    }
}

/// The leak from one closing time, with the optimiser stopped when the misses in its simplex agree to
/// `tolerance_s2`; also how many simulations it took.
fn optimised(valve: &Valve, close_time_s: f64, tolerance_s2: f64) -> (f64, usize) {
    let simulations = Cell::new(0);
    let problem = Miss { valve, close_time_s, simulations: &simulations };
    let start = vec![vec![0.0], vec![0.1]];
    let solver = NelderMead::new(start).with_sd_tolerance(tolerance_s2).expect("a tolerance above 0");
    let result = Executor::new(problem, solver).configure(|state| state.max_iters(200)).run().expect("finite costs");
    let area_mm2 = result.state().get_best_param().map_or(f64::NAN, |area| area[0]);
    (area_mm2 * 1e-6, simulations.get())
}

/// The leak from one closing time: by the table, and by an optimiser on the full simulation stopped as
/// soon as it is as accurate as the table.
fn table_and_optimiser(criterion: &mut Criterion) {
    let tables = reference_tables();
    let curve = tables.table(Fault::Atmosphere).curve(Stroke::Close);
    let valve = base_valve(testbed());
    let measured_s = close_time_s(&valve, LEAK_M2);
    let table_error = (curve.extrapolated_severity(measured_s) - LEAK_M2).abs();
    let ladder = (0..12).map(|k| 1e-4 * 0.1_f64.powi(k));
    let error_at = |tolerance: f64| (optimised(&valve, measured_s, tolerance).0 - LEAK_M2).abs();
    let tolerance = ladder.into_iter().find(|t| error_at(*t) <= table_error).unwrap_or(1e-16);
    let (area, simulations) = optimised(&valve, measured_s, tolerance);
    println!(
        "leak of {:.4} mm2: table misses by {:.1e} mm2, optimiser by {:.1e} mm2 with {simulations} simulations",
        LEAK_M2 * 1e6,
        table_error * 1e6,
        (area - LEAK_M2).abs() * 1e6,
    );
    let mut group = criterion.benchmark_group("leak from one closing time");
    group.sample_size(10);
    group.bench_function("table", |b| b.iter(|| curve.extrapolated_severity(black_box(measured_s))));
    group.bench_function("Nelder-Mead on the simulation", |b| b.iter(|| optimised(&valve, measured_s, tolerance)));
    group.finish();
}

/// A log of many valves, their cycles interleaved.
fn log(life: &[Reading]) -> String {
    let mut text = String::from("valve,cycle,close_time_s,open_time_s\n");
    for row in 0..ROWS {
        let (valve, cycle) = (row % VALVES, row / VALVES);
        // Lives longer than the table's start are slowed down.
        let reading = life[cycle * (life.len() - 1) / (ROWS / VALVES)];
        let time = |time_s: Option<f64>| time_s.map_or_else(String::new, |time_s| format!("{time_s:.4}"));
        let (close, open) = (time(reading.close_time_s), time(reading.open_time_s));
        text.extend([&format!("valve-{valve:04},{cycle},"), &close, ",", &open, "\n"]);
    }
    text
}

fn read(text: &str, mut each: impl FnMut(&prognoser::LogRow<'_>)) -> Duration {
    let start = Instant::now();
    let mut log = TimingLog::new("bench", text.as_bytes()).expect("a log");
    while let Some(row) = log.next_row().expect("a row") {
        each(&row);
    }
    start.elapsed()
}

/// A long log; printed, since once is enough.
fn long_log(_: &mut Criterion) {
    let tables = Arc::new(reference_tables());
    let text = log(&life(&tables));
    let reading = read(&text, |row| {
        black_box(row.reading);
    });
    println!("log of {ROWS} rows, {VALVES} valves: reading {:.0} ns a row", per_row_ns(reading));
    for method in [Method::Ols, Method::default()] {
        let mut prognoser = Prognoser::new(Arc::clone(&tables), method);
        let whole = read(&text, |row| drop(black_box(prognoser.push(row))));
        println!(
            "log of {ROWS} rows, {VALVES} valves: {} {:.0} ns a row, reading is {:.0} % of it",
            method.name(),
            per_row_ns(whole),
            100.0 * reading.as_secs_f64() / whole.as_secs_f64(),
        );
    }
}

fn per_row_ns(time: Duration) -> f64 {
    time.as_secs_f64() * 1e9 / ROWS as f64
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    targets = inversion, over_pressure, update, table_and_optimiser, long_log
}
criterion_main!(benches);
