//! A bundle on disk: what is written is read back, and what is damaged is
//! refused with a message that says where and what to do.

use std::fs;
use std::path::Path;

use leak_table::{
    BundleInfo, BundlePart, ConditionInfo, CycleSchedule, Fault, FaultInfo, LeakPairTable, Limits, MANIFEST_FILE,
    SeverityPoint, SeverityTable, Stroke, TableBundle, TableError,
};

const LIMITS: Limits = Limits { close_within_s: 3.0, open_within_s: 6.0 };

/// Times that rise like 1/(1 - a) and fall like 1/(1 + a).
fn table(fault: Fault, stall_mm2: f64) -> SeverityTable {
    let points = (0..=40)
        .map(|i| {
            let share = f64::from(i) / 40.0;
            let slow = (share < 0.9).then(|| 1.0 / (1.0 - share));
            let fast = Some(1.0 / (1.0 + share));
            let (close_time_s, open_time_s) = match fault {
                Fault::Atmosphere => (slow, fast),
                Fault::Supply => (fast, slow),
            };
            SeverityPoint { severity: share * stall_mm2 * 1e-6, close_time_s, open_time_s }
        })
        .collect();
    SeverityTable::new(fault.degradation(), points).expect("rows are monotone")
}

fn info(limits: Limits) -> BundleInfo {
    BundleInfo {
        valve: "made up".into(),
        model_hash: "0123abcd".into(),
        schedule: CycleSchedule { close_at_s: 0.0, open_at_s: 4.0, end_s: 12.0 },
        limits,
        reference: None,
    }
}

fn parts(limits: &Limits) -> Vec<BundlePart> {
    let part = |fault, stall_mm2| {
        let table = table(fault, stall_mm2);
        BundlePart { info: FaultInfo::from_table(&table, limits), table, over_conditions: None }
    };
    vec![part(Fault::Atmosphere, 0.7), part(Fault::Supply, 0.3)]
}

fn bundle() -> TableBundle {
    TableBundle::new(info(LIMITS), &parts(&LIMITS)).expect("limits are inside the tables")
}

fn written() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("temporary directory");
    bundle().write(dir.path()).expect("bundle is written");
    dir
}

fn refusal(dir: &Path) -> (TableError, String) {
    let error = TableBundle::read(dir).expect_err("a damaged bundle is refused");
    let text = error.to_string();
    (error, text)
}

/// Replaces a file and records its new hash and length, as someone would who
/// edits both.
fn forge(dir: &Path, name: &str, content: &str) {
    fs::write(dir.join(name), content).expect("file is written");
    let path = dir.join(MANIFEST_FILE);
    let manifest = fs::read_to_string(&path).expect("manifest is there");
    let mut value: serde_json::Value = serde_json::from_str(&manifest).expect("manifest is JSON");
    let entry = &mut value[name.trim_end_matches(".csv")];
    entry["blake3"] = blake3::hash(content.as_bytes()).to_hex().as_str().into();
    entry["bytes"] = content.len().into();
    fs::write(&path, value.to_string()).expect("manifest is written");
}

#[test]
fn reads_back_what_was_written() {
    let dir = written();
    assert_eq!(TableBundle::read(dir.path()).expect("is whole"), bundle());
}

#[test]
fn writes_the_same_bytes_again_and_leaves_nothing_else_behind() {
    let dir = written();
    let content = |name: &str| fs::read(dir.path().join(name)).expect("file is there");
    let names = ["atmosphere.csv", MANIFEST_FILE, "supply.csv"];
    let before = names.map(content);
    let read = TableBundle::read(dir.path()).expect("is whole");
    read.write(dir.path()).expect("is written again");
    assert_eq!(names.map(content), before);
    let mut found: Vec<_> =
        fs::read_dir(dir.path()).expect("directory is there").map(|entry| entry.expect("entry").file_name()).collect();
    found.sort();
    assert_eq!(found, names);
}

#[test]
fn the_limit_area_is_where_the_slow_stroke_crosses_its_limit() {
    let bundle = bundle();
    for (fault, stroke) in [(Fault::Atmosphere, Stroke::Close), (Fault::Supply, Stroke::Open)] {
        let area = bundle.limit_area_m2(fault);
        let (time, _) = bundle.table(fault).curve(stroke).extrapolated_time_and_slope(area);
        assert!((time - LIMITS.within_s(stroke)).abs() < 1e-6, "{fault}: {time}");
        let fast = Stroke::ALL.into_iter().find(|s| *s != stroke).expect("two strokes");
        assert_eq!(bundle.manifest().fault(fault).stroke(fast).limit_severity, None);
    }
}

#[test]
fn a_missing_manifest_is_told() {
    let dir = written();
    fs::remove_file(dir.path().join(MANIFEST_FILE)).expect("is removed");
    let (error, text) = refusal(dir.path());
    assert!(matches!(error, TableError::ManifestMissing { .. }), "{text}");
    assert!(text.contains("build-tables"), "{text}");
}

#[test]
fn an_unknown_version_is_told_even_if_its_keys_are_unknown() {
    let dir = written();
    let path = dir.path().join(MANIFEST_FILE);
    fs::write(&path, r#"{"format_version": 7, "anything": 1}"#).expect("is written");
    let (error, text) = refusal(dir.path());
    assert!(matches!(error, TableError::Version { .. }), "{text}");
    assert!(text.contains("version 7, expected at most 3"), "{text}");
}

#[test]
fn a_broken_manifest_is_told_with_its_line() {
    let dir = written();
    let path = dir.path().join(MANIFEST_FILE);
    let text = fs::read_to_string(&path).expect("is there");
    fs::write(&path, text.replace("\"valve\"", "\"walve\"")).expect("is written");
    let (error, text) = refusal(dir.path());
    assert!(matches!(error, TableError::Manifest { line: 3, .. }), "{text}");
}

#[test]
fn a_changed_table_is_told() {
    let dir = written();
    let path = dir.path().join("supply.csv");
    let text = fs::read_to_string(&path).expect("is there");
    fs::write(&path, text.replacen("1.000", "1.001", 1)).expect("is written");
    let (error, text) = refusal(dir.path());
    assert!(matches!(error, TableError::Hash { .. }), "{text}");
    assert!(text.contains("supply.csv"), "{text}");
}

#[test]
fn a_truncated_table_is_told() {
    let dir = written();
    let path = dir.path().join("atmosphere.csv");
    let text = fs::read_to_string(&path).expect("is there");
    fs::write(&path, &text[..text.len() / 2]).expect("is written");
    let (error, text) = refusal(dir.path());
    assert!(matches!(error, TableError::Truncated { .. }), "{text}");
}

#[test]
fn wrong_columns_are_told() {
    let dir = written();
    forge(dir.path(), "supply.csv", "area,close,open\n0,1,2\n");
    let (error, text) = refusal(dir.path());
    assert!(matches!(error, TableError::Columns { .. }), "{text}");
    assert!(text.contains("supply.csv:1: found columns \"area,close,open\""), "{text}");
}

#[test]
fn text_for_a_number_is_told_with_its_line() {
    let dir = written();
    let rows = "leak_area_mm2,close_time_s,open_time_s\n0,1,2\n0.1,fast,3\n";
    forge(dir.path(), "supply.csv", rows);
    let (error, text) = refusal(dir.path());
    assert!(matches!(error, TableError::Field { line: 3, .. }), "{text}");
    assert!(text.contains("\"fast\" as close_time_s"), "{text}");
}

#[test]
fn rows_that_are_not_monotone_are_told_with_their_line() {
    let dir = written();
    let rows = "leak_area_mm2,close_time_s,open_time_s\n0,1,2\n0.1,0.9,3\n0.2,0.8,3\n";
    forge(dir.path(), "supply.csv", rows);
    let (error, text) = refusal(dir.path());
    assert!(matches!(error, TableError::Rows { line: 4, .. }), "{text}");
    assert!(text.contains("supply.csv:4: opening time: found 3 s after 3 s"), "{text}");
}

#[test]
fn a_file_name_that_leads_elsewhere_is_refused() {
    let dir = written();
    let path = dir.path().join(MANIFEST_FILE);
    let text = fs::read_to_string(&path).expect("is there");
    fs::write(&path, text.replace("\"supply.csv\"", "\"../supply.csv\"")).expect("is written");
    let (error, text) = refusal(dir.path());
    assert!(matches!(error, TableError::Manifest { .. }), "{text}");
    assert!(text.contains("../supply.csv"), "{text}");
}

#[test]
fn tables_of_another_model_are_refused() {
    let dir = written();
    assert!(TableBundle::read_for_model(dir.path(), "0123abcd").is_ok());
    let error = TableBundle::read_for_model(dir.path(), "ffff").expect_err("another model");
    assert!(matches!(error, TableError::Model { .. }));
    assert!(error.to_string().contains("0123abcd, expected model ffff"), "{error}");
}

#[test]
fn limits_outside_the_tables_are_refused() {
    let limits = Limits { close_within_s: 50.0, open_within_s: 50.0 };
    let error = TableBundle::new(info(limits), &parts(&limits)).expect_err("never crossed");
    assert!(matches!(&error, TableError::LimitOutside { id, .. } if id == "atmosphere"), "{error}");
}

#[test]
fn a_failed_write_leaves_nothing() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let file = dir.path().join("tables");
    fs::write(&file, "a file where the directory should be").expect("is written");
    assert!(matches!(bundle().write(&file), Err(TableError::Io { .. })));
    assert_eq!(fs::read_dir(dir.path()).expect("is there").count(), 1);
}

/// Both leaks as one: the equivalent share of either is a plane, and what stalls has no times.
fn pair(bundle: &TableBundle) -> LeakPairTable {
    let areas =
        [0.7, 0.3].map(|stall_mm2| (0..=10).map(|i| f64::from(i) * 0.2 * stall_mm2 * 1e-6).collect::<Vec<f64>>());
    let time = |share: f64| (share < 0.9).then(|| 1.0 / (1.0 - share));
    let times = (0..11).flat_map(|i| (0..11).map(move |j| [f64::from(i) * 0.2, f64::from(j) * 0.2])).map(|[a, s]| {
        let (close, open) = (time(a - 0.6 * s)?, time(s - 1.5 * a)?);
        Some([close, open])
    });
    LeakPairTable::new(areas, times.collect(), bundle.leak_tables(), ConditionInfo::default()).expect("a grid")
}

#[test]
fn both_leaks_at_once_do_what_one_does() {
    let bundle = bundle();
    let table = pair(&bundle);
    for (a, s) in [(0.3, 0.1), (0.9, 0.45), (0.15, 0.7), (1.5, 1.9), (1.85, 1.95)] {
        let [close, open] = table.equivalents([a * 0.7e-6, s * 0.3e-6]);
        for (stroke, found, share) in [(Stroke::Close, close, a - 0.6 * s), (Stroke::Open, open, s - 1.5 * a)] {
            let slower = if stroke == Stroke::Close { Fault::Atmosphere } else { Fault::Supply };
            assert_eq!(found.fault, if share >= 0.0 { slower } else { slower.other() }, "{a}, {s}: {stroke}");
            let time_s = bundle.table(found.fault).curve(stroke).extrapolated_time_and_slope(found.area_m2).0;
            let expected_s = 1.0 / (1.0 - share);
            // Where one stroke stalls the other one is only known by going on straight.
            let tolerance = if share < 0.85 { 0.03 * expected_s } else { continue };
            assert!((time_s - expected_s).abs() < tolerance, "{a}, {s}, {stroke}: {time_s} instead of {expected_s}");
        }
        let step = 1e-10;
        for (leak, by) in [(0, [step, 0.0]), (1, [0.0, step])] {
            let at = |sign: f64| table.equivalents([a * 0.7e-6 + sign * by[0], s * 0.3e-6 + sign * by[1]]);
            for stroke in 0..2 {
                let slope = (at(1.0)[stroke].area_m2 - at(-1.0)[stroke].area_m2) / (2.0 * step);
                assert!((slope - at(0.0)[stroke].by[leak]).abs() < 1e-3, "{a}, {s}: {slope}");
            }
        }
    }
}

#[test]
fn both_leaks_are_written_and_read_back() {
    let bundle = bundle();
    let bundle = bundle.clone().with_both_leaks(&pair(&bundle)).expect("a grid");
    let dir = tempfile::tempdir().expect("temporary directory");
    bundle.write(dir.path()).expect("bundle is written");
    assert_eq!(TableBundle::read(dir.path()).expect("bundle is read"), bundle);
    let path = dir.path().join("both-leaks.csv");
    let text = fs::read_to_string(&path).expect("is there");
    fs::write(&path, text.replacen("0.140000000", "0.150000000", 1)).expect("is written");
    assert!(refusal(dir.path()).1.contains("both-leaks.csv"));
}
