//! `valve watch`: its numbers are those of `valve prognose`, and it follows logs that grow.

use std::fs::OpenOptions;
use std::io::Write;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::page::Served;
use crate::support::{Sandbox, shown};

fn append(sandbox: &Sandbox, name: &str, text: &str) {
    let mut file = OpenOptions::new().append(true).open(sandbox.path(name)).expect("the log");
    file.write_all(text.as_bytes()).expect("appended");
}

fn rows(served: &Served) -> Vec<Value> {
    served.get("api/fleet").json()["rows"].as_array().expect("rows").clone()
}

/// Waits for a valve to stand at a cycle.
fn at_cycle(served: &Served, valve: &str, cycle: u64) -> Value {
    let since = Instant::now();
    loop {
        let rows = rows(served);
        if let Some(row) = rows.iter().find(|row| row["valve"] == valve && row["cycle"] == cycle) {
            return row.clone();
        }
        assert!(since.elapsed() < Duration::from_mins(1), "{valve} never got to cycle {cycle}: {rows:?}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn valves_stand_as_prognose_has_them_and_follow_their_log() {
    let sandbox = Sandbox::with_tables();
    let log = sandbox.read("log.csv");
    let lines: Vec<&str> = log.lines().collect();
    let half = lines.len() / 2;
    sandbox.write("logs/one.csv", &format!("{}\n", lines[..half].join("\n")));
    let served = Served::start(&sandbox, &["watch", "logs", "--tables", "tables"]);
    let cycle_of = |line: &str| line.split(',').nth(1).and_then(|cycle| cycle.parse().ok()).expect("a cycle");
    let valve = lines[1].split(',').next().expect("a name");
    at_cycle(&served, valve, cycle_of(lines[half - 1]));

    // The log grows, with a row that cannot be read; another log comes into the folder.
    append(&sandbox, "logs/one.csv", "FV-101,not a number,1.0,2.0\n");
    append(&sandbox, "logs/one.csv", &format!("{}\n", lines[half..].join("\n")));
    sandbox.write("logs/two.csv", "valve,cycle,close_time_s,open_time_s\nFV-202,0,1.05,2.13\n");
    let row = at_cycle(&served, valve, cycle_of(lines[lines.len() - 1]));
    at_cycle(&served, "FV-202", 0);
    let output = sandbox.valve(&["prognose", "log.csv", "--tables", "tables", "--format", "jsonl"]);
    let last = String::from_utf8(output.stdout.clone()).expect("text");
    let last: Value =
        serde_json::from_str(last.lines().last().unwrap_or_else(|| panic!("{}", shown(&output)))).expect("JSON");
    assert_eq!(row["rul"], json!([last["rul_p05"], last["rul_cycles"], last["rul_p95"]]));
    for key in ["status", "fault", "severity", "replace_by_cycle", "caveat"] {
        assert_eq!(row[key], last[key], "{key}");
    }
    assert_eq!(row["leak_mm2"], last["leak_area_mm2"]);

    let known = served.post("api/valve", &json!({ "valve": valve })).json();
    assert_eq!(known["now"]["fault_probability"], last["fault_probability"]);
    let cycles = known["past"][0].as_array().expect("cycles");
    let columns = known["past"].as_array().expect("columns");
    assert_eq!(columns.len(), 7);
    assert!(columns.iter().all(|column| column.as_array().map(Vec::len) == Some(cycles.len())));
    assert_eq!(cycles.last(), Some(&last["cycle"]));
    let troubles = served.get("api/fleet").json()["troubles"].to_string();
    assert!(troubles.contains("not a number") && troubles.contains("skipped"), "{troubles}");
    assert_eq!(served.post("api/valve", &json!({ "valve": "FV-999" })).status, 422);
}

#[test]
fn what_is_not_there_is_refused_before_a_page_is_served() {
    let sandbox = Sandbox::with_tables();
    let no_log = sandbox.valve(&["watch", "nothing.csv", "--tables", "tables", "--no-open"]);
    assert_eq!(no_log.status.code(), Some(2));
    assert!(shown(&no_log).contains("nothing.csv: "), "{}", shown(&no_log));
    let no_tables = sandbox.valve(&["watch", "log.csv", "--tables", "nowhere", "--no-open"]);
    assert_eq!(no_tables.status.code(), Some(2), "{}", shown(&no_tables));
}

/// Drives the page in headless Chromium while a log grows: `crates/lab/web/test/watch.mjs`.
#[test]
#[ignore = "needs node, Chromium and `npm ci` in crates/lab/web; .ci/run does that and runs it"]
fn a_browser_sees_a_valve_come_to_its_end() {
    let sandbox = Sandbox::with_tables();
    let log = sandbox.read("log.csv");
    let (head, rest) = log.split_once('\n').expect("a header");
    sandbox.write("grows.csv", &format!("{head}\n"));
    for cycle in 0..30 {
        for valve in 0..200 {
            append(&sandbox, "grows.csv", &format!("V-{valve:03},{cycle},1.0422,2.1343\n"));
        }
    }
    sandbox.write("rest.csv", rest);
    let served = Served::start(&sandbox, &["watch", "grows.csv", "--tables", "tables"]);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/crates/lab/web/test/watch.mjs");
    let driven = Command::new("node").arg(script).arg(&served.url).arg(sandbox.path("")).output().expect("node runs");
    assert!(driven.status.success(), "{}", shown(&driven));
}
