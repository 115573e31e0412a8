//! `valve prognose` beside a log that grows, with nobody there to look: what it skips, how it ends.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::support::{Sandbox, shown};

const FOLLOW: [&str; 5] = ["prognose", "log.csv", "--tables", "tables", "--follow"];

/// A running program whose output is read along.
struct Running {
    child: Child,
    out: BufReader<std::process::ChildStdout>,
}

impl Running {
    fn start(sandbox: &Sandbox, more: &[&str]) -> Self {
        let mut child = sandbox
            .command(&[&FOLLOW, more].concat())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let out = BufReader::new(child.stdout.take().expect("a pipe"));
        Self { child, out }
    }

    fn lines(&mut self, count: usize) -> String {
        let mut text = String::new();
        for _ in 0..count {
            self.out.read_line(&mut text).expect("a line");
        }
        text
    }

    /// Exit code, and what was still written to stdout and to stderr; it must end by itself.
    fn end(mut self) -> (Option<i32>, String, String) {
        let started = Instant::now();
        while self.child.try_wait().expect("is a child").is_none() {
            if started.elapsed() > Duration::from_mins(1) {
                let _ = self.child.kill();
                panic!("did not end within a minute");
            }
            thread::sleep(Duration::from_millis(10));
        }
        let (mut out, mut err) = (String::new(), String::new());
        self.out.read_to_string(&mut out).expect("text");
        self.child.stderr.take().expect("a pipe").read_to_string(&mut err).expect("text");
        (self.child.wait().expect("ended").code(), out, err)
    }
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([name, &child.id().to_string()]).status().expect("kill is there");
    assert!(status.success());
}

fn append(sandbox: &Sandbox, text: &str) {
    let mut file = fs::OpenOptions::new().append(true).open(sandbox.path("log.csv")).expect("is there");
    file.write_all(text.as_bytes()).expect("written");
}

#[test]
#[cfg(unix)]
fn asked_to_end_it_ends_with_whole_output() {
    for name in ["-TERM", "-INT"] {
        let sandbox = Sandbox::with_tables();
        let mut running = Running::start(&sandbox, &["--format", "json"]);
        // The end of the last row comes with what follows it.
        let begun = running.lines(25);
        append(&sandbox, "FV-101,26,2.9");
        signal(&running.child, name);
        let (code, rest, err) = running.end();
        assert_eq!(code, Some(0), "{name}: {err}");
        let rows: Vec<serde_json::Value> = serde_json::from_str(&(begun + &rest)).expect("valid JSON");
        assert_eq!(rows.len(), 25, "half a row is none");
    }
}

#[test]
#[cfg(unix)]
fn a_pipe_that_stays_open_does_not_keep_it() {
    let sandbox = Sandbox::with_tables();
    let mut child = sandbox
        .command(&["prognose", "-", "--tables", "tables", "--format", "json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    stdin.write_all(sandbox.read("log.csv").as_bytes()).expect("written");
    let mut out = BufReader::new(child.stdout.take().expect("a pipe"));
    let mut text = String::new();
    for _ in 0..25 {
        out.read_line(&mut text).expect("a line");
    }
    signal(&child, "-TERM");
    out.read_to_string(&mut text).expect("text");
    assert!(child.wait().expect("ends").success());
    assert_eq!(serde_json::from_str::<Vec<serde_json::Value>>(&text).expect("valid JSON").len(), 25);
    drop(stdin);
}

#[test]
fn the_first_end_of_life_ends_it() {
    let sandbox = Sandbox::with_tables();
    let mut running = Running::start(&sandbox, &["--format", "jsonl", "--fail-on-eol"]);
    running.lines(25);
    append(&sandbox, "FV-101,26,3.05,0.71\nFV-101,27,3.31,0.69\nFV-102,1,0.68,2.04\n");
    let (code, rest, err) = running.end();
    assert_eq!(code, Some(1), "{err}");
    let last = rest.lines().last().expect("a row");
    assert!(last.contains("\"eol-reached\"") && !rest.contains("FV-102"), "{rest}");
}

#[test]
fn what_is_no_row_is_skipped_with_a_word_and_a_count() {
    let sandbox = Sandbox::with_tables();
    append(
        &sandbox,
        "FV-101,26,fast,0.7\nFV-101\nFV-101,99999999999999999,2.9,0.7\nFV-101,26,2.,0.7\n# shift B, cold\n",
    );
    append(&sandbox, "FV-101,26,1e155,0.7\nFV-\"1,26,2.9,0.7\nFV-101,26,2.9,0.7\n");
    let mut running = Running::start(&sandbox, &["--format", "jsonl"]);
    let rows = running.lines(26);
    assert!(rows.lines().last().expect("a row").contains("\"cycle\":26"));
    signal(&running.child, "-TERM");
    let (code, rest, err) = running.end();
    assert_eq!((code, rest.as_str()), (Some(0), ""));
    insta::assert_snapshot!("skipped_lines", err);
}

#[test]
fn if_nothing_is_to_be_skipped_it_ends_there() {
    let sandbox = Sandbox::with_tables();
    append(&sandbox, "FV-101,26,fast,0.7\nFV-101,27,2.9,0.7\n");
    let (code, out, err) = Running::start(&sandbox, &["--format", "jsonl", "--strict"]).end();
    assert_eq!((code, out.lines().count()), (Some(2), 25), "{err}");
    let last = err.lines().last().expect("a refusal");
    assert!(last.starts_with("error: log.csv:27: close_time_s: found \"fast\""), "{err}");
}

#[test]
fn a_rotation_is_followed() {
    let sandbox = Sandbox::with_tables();
    let log = sandbox.read("log.csv");
    let rows: Vec<&str> = log.split_inclusive('\n').collect();
    sandbox.write("log.csv", &rows[..11].concat());
    let mut running = Running::start(&sandbox, &["--format", "jsonl"]);
    running.lines(10);
    append(&sandbox, &rows[11..14].concat());
    fs::rename(sandbox.path("log.csv"), sandbox.path("log.csv.1")).expect("renamed");
    sandbox.write("log.csv", &[rows[0], &rows[14..].concat()].concat());
    let last = running.lines(15);
    assert!(last.lines().last().expect("a row").contains("\"cycle\":25"), "{last}");
    signal(&running.child, "-TERM");
    let (code, rest, err) = running.end();
    assert_eq!((code, rest.as_str()), (Some(0), ""));
    assert!(err.contains("\nlog.csv: another file has taken its name; reading goes on there\n"), "{err}");
}

#[test]
fn the_ranges_that_tables_lack_are_those_of_the_log() {
    let sandbox = Sandbox::with_tables();
    let rows: Vec<String> = (1..9).map(|cycle| format!("FV-101,{cycle},0.68,2.04,{}\n", 70 + cycle)).collect();
    let log = format!("valve,cycle,close_time_s,open_time_s,supply_pressure_psig\n{}", rows.concat());
    sandbox.write("log.csv", &log);
    let told = shown(&sandbox.valve(&["--units", "psig", "prognose", "log.csv", "--tables", "tables"]));
    let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(told.contains("the supply pressure lies between 71.0"), "{told}");
    assert!(told.contains("--supply-range \"70."), "{told}");
}

#[test]
fn logs_that_tell_nothing_are_told_as_that() {
    let header = "valve,cycle,close_time_s,open_time_s\n";
    let rows = |times: &str| {
        let rows: Vec<String> = (1..7).map(|cycle| format!("FV-101,{cycle},{times}\n")).collect();
        rows.concat()
    };
    let cases = [
        ("no rows", String::new()),
        ("a dead switch", rows("0,0")),
        ("exchanged columns", rows("2.13,1.05")),
        ("a switch that died", format!("{}FV-101,7,0,0\n", rows("0.68,2.04"))),
        ("a dead end switch", "FV-101,1,0.000,2.04\n".to_owned()),
        ("a name with commands for terminals", "FV\u{1b}[31m\u{7},1,0.68,2.04\n".to_owned()),
        ("a rounded cycle", "FV-101,1e17,0.68,2.04\n".to_owned()),
        ("a number sign", "#12,1,0.68,2.04\n# 12, shift B\n#12,2,0.68,2.04\n".to_owned()),
    ];
    let mut texts = String::new();
    for (what, rows) in cases {
        let sandbox = Sandbox::with_tables();
        sandbox.write("log.csv", &format!("{header}{rows}"));
        let told = shown(&sandbox.valve(&["prognose", "log.csv", "--tables", "tables"]));
        assert!(!told.contains(['\u{1b}', '\u{7}']), "{told}");
        texts.extend(["# ", what, "\n", &told, "\n"]);
    }
    insta::assert_snapshot!("logs_that_tell_nothing", texts);
}
