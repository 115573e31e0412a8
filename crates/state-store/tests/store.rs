//! States as they are written and read back.

use std::path::Path;
use std::sync::Arc;

use leak_table::TableBundle;
use prognoser::bayes::STATE_VERSION;
use prognoser::{LogRow, Method, Prognoser, Reading};
use state_store::{Progress, Store, StoreError, Term};

fn tables() -> Arc<TableBundle> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tables");
    Arc::new(TableBundle::read(&folder).expect("the reference valve's tables"))
}

fn terms(tables: &str) -> [Term; 1] {
    [Term { name: "tables", value: tables.to_owned() }]
}

fn push(prognoser: &mut Prognoser, valve: &str, cycle: u64) -> prognoser::Prognosis {
    let reading =
        Reading { cycle, close_time_s: Some(2.02 + 0.01 * cycle as f64), open_time_s: Some(0.7), ..Reading::default() };
    prognoser.push(&LogRow { valve, reading, time: Some("2026-01-31T06:00:00Z"), line: cycle })
}

#[test]
fn a_valve_goes_on_as_if_nothing_had_happened() {
    let folder = tempfile::tempdir().expect("a directory");
    let mut whole = Prognoser::new(tables(), Method::default());
    for cycle in 1..20 {
        push(&mut whole, "A", cycle);
        push(&mut whole, "B", cycle);
    }
    // Late rows, and rows that are not used, are remembered as well.
    push(&mut whole, "A", 3);
    let progress = Progress { output_bytes: 7, output_rows: 2, ..Progress::default() };
    {
        let store = Store::open(folder.path(), &terms("these")).expect("begins");
        assert_eq!(store.progress().expect("reads"), None);
        let states = ["A", "B"].map(|name| (name, whole.state(name).expect("was seen")));
        store.commit(&progress, &[], states.into_iter()).expect("keeps");
    }
    let store = Store::open(folder.path(), &terms("these")).expect("opens");
    assert_eq!(store.progress().expect("reads"), Some(progress));
    let mut second = Prognoser::new(tables(), Method::default());
    let kept = store.reader().expect("reads");
    for name in ["A", "B"] {
        assert!(second.resume(name, kept.valve(name).expect("reads").expect("was kept")));
        assert_eq!(second.last(name), whole.last(name));
    }
    assert!(kept.valve("C").expect("reads").is_none());
    for cycle in [2, 20, 20, 22] {
        assert_eq!(push(&mut second, "A", cycle), push(&mut whole, "A", cycle));
    }
    let mut seen = Vec::new();
    kept.each(|name, _| seen.push(name.to_owned())).expect("reads");
    assert_eq!(seen, ["A", "B"]);
}

#[test]
fn other_terms_and_a_second_process_are_refused() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = Store::open(folder.path(), &terms("these")).expect("begins");
    let busy = Store::open(folder.path(), &terms("these")).expect_err("is open");
    assert!(matches!(busy, StoreError::InUse { .. }), "{busy}");
    drop(store);
    let other = Store::open(folder.path(), &terms("those")).expect_err("differs").to_string();
    assert!(other.contains("found a state kept with tables these, expected those"), "{other}");
}

/// What a state is made of. Another make of it needs another `STATE_VERSION`, or programs take states of others for their
/// own: raise it where this test fails.
#[test]
fn what_a_state_is_made_of_is_known_by_its_version() {
    fn make(value: &serde_json::Value) -> String {
        use serde_json::Value;
        match value {
            Value::Object(all) => {
                let fields: Vec<String> = all.iter().map(|(name, value)| format!("{name}: {}", make(value))).collect();
                format!("{{{}}}", fields.join(", "))
            }
            Value::Array(all) => {
                let mut kinds: Vec<String> = all.iter().map(make).collect();
                let count = kinds.len();
                kinds.sort();
                kinds.dedup();
                // Lists of a fixed length are tuples and matrices; longer ones, and those of things, vary.
                let shown = if all.iter().any(|one| one.is_object() || one.is_string()) {
                    String::new()
                } else {
                    count.to_string()
                };
                format!("[{}]{shown}", kinds.join("|"))
            }
            Value::Number(_) => "number".to_owned(),
            Value::String(_) => "text".to_owned(),
            Value::Bool(_) => "flag".to_owned(),
            Value::Null => "nothing".to_owned(),
        }
    }
    let mut prognoser = Prognoser::new(tables(), Method::default());
    (1..40).for_each(|cycle| drop(push(&mut prognoser, "A", cycle)));
    push(&mut prognoser, "A", 3);
    let state = serde_json::to_value(prognoser.state("A").expect("was seen")).expect("is JSON");
    insta::assert_snapshot!("state", format!("version {STATE_VERSION}\n{}", make(&state).replace(", ", ",\n")));
}

#[test]
fn messages_and_names_are_kept_with_the_states() {
    let folder = tempfile::tempdir().expect("a directory");
    let progress = Progress::default();
    {
        let store = Store::open(folder.path(), &terms("these")).expect("begins");
        assert!(store.taken().expect("reads").add([1; 16]), "nothing was taken yet");
        store.commit(&progress, &[[1; 16], [2; 16]], std::iter::empty()).expect("keeps");
        assert_eq!(store.name("client", || "made".to_owned()).expect("keeps"), "made");
    }
    let store = Store::open(folder.path(), &terms("these")).expect("opens");
    let mut taken = store.taken().expect("reads");
    assert!(!taken.add([1; 16]) && !taken.add([2; 16]) && taken.add([3; 16]));
    assert_eq!(store.name("client", || "another".to_owned()).expect("reads"), "made");
    // Far more than are remembered: the oldest are let go, in the file too.
    let many: Vec<[u8; 16]> = (0..70_000_u128).map(|number| (number << 64).to_le_bytes()).collect();
    store.commit(&progress, &many, std::iter::empty()).expect("keeps");
    let mut taken = store.taken().expect("reads");
    assert!(taken.add([1; 16]) && taken.add(many[0]) && !taken.add(many[69_999]));
}
