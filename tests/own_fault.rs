//! A fault that no crate of the workspace has heard of goes from a model to a named fault, a remaining life and a
//! picture: nothing asks which fault it has.

mod reference_valve;

use std::borrow::Cow;

use leak_table::{Degradation, DegradationId, Monotone, Moves, Severity, Stroke, TableBundle, TimeAt};
use lut_builder::{Options, Request, Wear, build_request};
use prognoser::{LogRow, Method, Prognoser, Reading};
use reference_valve::{table_model, testbed_file};

/// The guides drag: viscous friction that grows.
fn drag() -> Wear {
    let degradation = Degradation {
        id: DegradationId::new("guide-drag"),
        name: Cow::Borrowed("drag of the guides"),
        short: Cow::Borrowed("drag"),
        severity: Severity {
            quantity: Cow::Borrowed("added viscous friction"),
            unit: Cow::Borrowed("kN s/m"),
            column: Cow::Borrowed("drag_kn_s_per_m"),
            per_si: 1e-3,
        },
        moves: Moves { close: Some(Monotone::Rising), open: Some(Monotone::Rising) },
        prior: 1.0,
    };
    Wear {
        degradation,
        reach: |_| vec![2e4, 8e4],
        apply: |worn, drag| {
            worn.parameters.viscous_friction_n_s_per_m += drag;
            Ok(())
        },
    }
}

/// The tables of the leaks and the drag, as they are read back from their files.
fn tables() -> TableBundle {
    let file = testbed_file();
    let text = file.canonical_model();
    let mut wears = Wear::leaks();
    wears.push(drag());
    let request = Request { wears, conditions: None, both_leaks: false };
    let built = build_request(&table_model(&file, &text), &request, &Options::default(), &|_| ()).expect("tables");
    let directory = tempfile::tempdir().expect("a temporary directory");
    built.bundle.write(directory.path()).expect("written");
    TableBundle::read(directory.path()).expect("readable")
}

/// The cycle in which the life ends.
const END_CYCLE: f64 = 40.0;

#[test]
fn a_fault_that_a_program_brings_along_is_built_read_and_named() {
    let bundle = tables();
    let entry = bundle.get("guide-drag").expect("was built and read");
    let time = |stroke: Stroke, severity: f64| match entry.table.curve(stroke).time_at(severity) {
        TimeAt::Within(time_s) => time_s,
        other => panic!("{stroke} at {severity}: {other:?}"),
    };
    let mut prognoser = Prognoser::new(bundle.clone().into(), Method::default());
    let mut last = None;
    for cycle in 0..30_u32 {
        let severity = entry.limit_severity * f64::from(cycle) / END_CYCLE;
        // A millisecond of noise that looks random.
        let noise = |shift: f64| 2e-3 * ((f64::from(cycle) * 0.618_034 + shift).fract() - 0.5);
        let reading = Reading {
            close_time_s: Some(time(Stroke::Close, severity) + noise(0.1)),
            open_time_s: Some(time(Stroke::Open, severity) + noise(0.6)),
            cycle: u64::from(cycle),
            ..Reading::default()
        };
        last = Some(prognoser.push(&LogRow { valve: "V1", reading, time: None, line: u64::from(cycle) + 2 }));
    }
    let last = last.expect("30 rows");
    assert_eq!(last.fault.name(), "guide-drag");
    let end = last.eol_cycle.expect("an end");
    assert!((end - END_CYCLE).abs() < 2.0, "end of life at {end}");
    let json = serde_json::to_value(&last).expect("is JSON");
    assert_eq!(json["fault"], "guide-drag");
    assert!(json["fault_probability"]["guide-drag"].as_f64().is_some_and(|share| share > 0.95), "{json}");
    assert_eq!(json["fault_probability"]["friction"], 0.0);
}
