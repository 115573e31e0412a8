//! The tables that come with the project: what the builder writes, and as accurate as they say.

mod reference_valve;

use std::fs;
use std::path::{Path, PathBuf};

use leak_table::{Fault, Stroke, TableBundle, TimeAt};
use lut_builder::{Options, Request, build_request, model_hash};
use reference_valve::{leaking, periodic, spread, table_model, testbed_file};
use valve_model::simulate::DEFAULT_STEP_S;

/// Largest interpolation error up to the limit, s.
const UP_TO_LIMIT_S: f64 = 0.2e-3;
/// The same beyond it, s.
const BEYOND_LIMIT_S: f64 = 2e-3;

fn checked_in() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tables")
}

fn built_with(threads: usize) -> TableBundle {
    let file = testbed_file();
    let text = file.canonical_model();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
    let model = table_model(&file, &text);
    let request = Request { both_leaks: true, ..Request::default() };
    let built = pool.install(|| build_request(&model, &request, &Options::default(), &|_| {}));
    built.expect("the reference valve has tables").bundle
}

#[test]
fn they_are_what_the_builder_writes_whatever_the_number_of_threads() {
    for threads in [1, 2] {
        let directory = tempfile::tempdir().expect("a temporary directory");
        built_with(threads).write(directory.path()).expect("written");
        let mut compared = 0;
        for entry in fs::read_dir(directory.path()).expect("readable") {
            let name = entry.expect("readable").file_name();
            let built = fs::read(directory.path().join(&name)).expect("readable");
            let kept = fs::read(checked_in().join(&name)).expect("checked in");
            assert!(
                built == kept,
                "{} differs; if the model was meant to change, write it again with \
                 `cargo run --release -p lut-builder --example build_tables models/testbed.toml tables`",
                name.display()
            );
            compared += 1;
        }
        assert_eq!(compared, 4);
    }
}

#[test]
fn both_leaks_at_once_agree_with_the_simulation() {
    let tables = TableBundle::read(&checked_in()).expect("tables/ is sound");
    let both = tables.both_leaks().expect("tables/ has both");
    let file = testbed_file();
    // Shares of the limits, away from where a stroke is about to stall.
    for [atmosphere, supply] in [[0.33, 0.71], [0.87, 0.52], [1.31, 1.13], [0.18, 1.06], [1.62, 1.74]] {
        let areas =
            [atmosphere * tables.limit_area_m2(Fault::Atmosphere), supply * tables.limit_area_m2(Fault::Supply)];
        let mut conditions = leaking(file.valve(), Fault::Atmosphere, areas[0]);
        conditions.leak_from_supply_m2 = areas[1];
        let times = periodic(&[(file.valve(), conditions)], &file.schedule(), DEFAULT_STEP_S)[0];
        for (stroke, equivalent) in Stroke::ALL.into_iter().zip(both.equivalents(areas)) {
            let curve = tables.table(equivalent.fault).curve(stroke);
            let told_s = curve.extrapolated_time_and_slope(equivalent.area_m2).0;
            let simulated_s = if stroke == Stroke::Close { times.close_time_s } else { times.open_time_s };
            let off_s = (told_s - simulated_s.expect("finished")).abs();
            assert!(off_s < 2e-3, "{stroke} at {atmosphere} and {supply}: {off_s} s");
        }
    }
}

#[test]
fn they_belong_to_the_valve_file() {
    let file = testbed_file();
    let hash = model_hash(&file.canonical_model(), &file.limits());
    TableBundle::read_for_model(&checked_in(), &hash).expect("built from models/testbed.toml");
    let mut limits = file.limits();
    limits.close_within_s += 1.0;
    let other = model_hash(&file.canonical_model(), &limits);
    TableBundle::read_for_model(&checked_in(), &other).expect_err("other limits, other tables");
}

#[test]
fn they_agree_with_the_simulation_between_their_points() {
    let file = testbed_file();
    let bundle = TableBundle::read(&checked_in()).expect("readable");
    for fault in Fault::ALL {
        let table = bundle.table(fault);
        let limit_m2 = bundle.limit_area_m2(fault);
        let stall_m2 = table.range().1;
        let areas: Vec<f64> = spread(96, 0.271).map(|u| u * stall_m2).collect();
        let runs: Vec<_> = areas.iter().map(|area| (file.valve(), leaking(file.valve(), fault, *area))).collect();
        for (area, times) in areas.iter().zip(periodic(&runs, &file.schedule(), DEFAULT_STEP_S)) {
            let tolerance = if *area <= limit_m2 { UP_TO_LIMIT_S } else { BEYOND_LIMIT_S };
            for (stroke, simulated) in [(Stroke::Close, times.close_time_s), (Stroke::Open, times.open_time_s)] {
                let TimeAt::Within(interpolated) = table.curve(stroke).time_at(*area) else {
                    panic!("{fault} {area} m2: no {stroke} time in the table, simulated {simulated:?}")
                };
                let simulated = simulated.expect("finished below the stall");
                assert!((interpolated - simulated).abs() < tolerance, "{fault} {area} m2 {stroke}");
            }
        }
    }
}

#[test]
fn limit_and_stall_are_where_the_simulation_has_them() {
    let file = testbed_file();
    let bundle = TableBundle::read(&checked_in()).expect("readable");
    for (fault, stroke) in [(Fault::Atmosphere, Stroke::Close), (Fault::Supply, Stroke::Open)] {
        let info = bundle.manifest().fault(fault).stroke(stroke);
        let limit_m2 = info.limit_severity.expect("this leak takes this stroke to its limit");
        let stall_m2 = info.stall_severity.expect("this leak stalls this stroke");
        let run = |area| (file.valve(), leaking(file.valve(), fault, area));
        let times = periodic(&[run(limit_m2), run(stall_m2 * 0.9999), run(stall_m2)], &file.schedule(), DEFAULT_STEP_S);
        let time = |index: usize| match stroke {
            Stroke::Close => times[index].close_time_s,
            Stroke::Open => times[index].open_time_s,
        };
        let limit_s = bundle.manifest().limits.within_s(stroke);
        assert!((time(0).expect("finished") - limit_s).abs() < 1e-6);
        assert!(time(1).is_some() && time(2).is_none());
    }
}
