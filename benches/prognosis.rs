//! Prognosis: a table inversion, a table over pressure, an update of the remaining life.

#[path = "../tests/reference_valve/mod.rs"]
mod reference_valve;

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use leak_table::{ConditionRange, Conditions, Fault, Stroke, TableBundle};
use lut_builder::{Options, Request, build_request};
use prognoser::bayes::{BayesConfig, BayesEstimator};
use prognoser::{OlsEstimator, Reading};
use reference_valve::{spread, table_model, testbed_file};

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

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    targets = inversion, over_pressure, update
}
criterion_main!(benches);
