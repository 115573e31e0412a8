//! `valve prognose --state`: killed at any instant, the output is that of an undisturbed run.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::PathBuf;
use std::process::{Child, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::dice::Dice;
use crate::support::{Sandbox, shown};

const HEADER: &str = "valve,cycle,close_time_s,open_time_s\n";
const CALL: [&str; 11] = [
    "prognose",
    "grows.csv",
    "--tables",
    "tables",
    "--state",
    "state",
    "--out",
    "out.jsonl",
    "--format",
    "jsonl",
    "--quiet",
];

/// Rows of valves that leak, one after the other.
fn rows(count: usize, valves: u64) -> Vec<String> {
    let mut dice = Dice(7);
    let noise = |dice: &mut Dice| (dice.below(2000) as f64 - 1000.0) * 1e-5;
    (0..count as u64)
        .map(|row| {
            let (valve, cycle) = (row % valves, row / valves + 1);
            let growth = (cycle as f64 / 60.0).min(1.0) * (valve % 3) as f64 / 2.0;
            let (close, open) = (2.02 + 0.9 * growth + noise(&mut dice), 0.70 - 0.02 * growth + noise(&mut dice));
            format!("FV-{valve:03},{cycle},{close:.4},{open:.4}\n")
        })
        .collect()
}

/// Who writes the log and rotates it now and then.
struct Plant {
    path: PathBuf,
    rotations: u64,
}

impl Plant {
    fn write(&self, text: &str) {
        let mut file = OpenOptions::new().append(true).create(true).open(&self.path).expect("opens");
        file.write_all(text.as_bytes()).expect("written");
    }

    fn rotate(&mut self, how: u64) {
        // Times of last writing are as fine as the system's clock ticks.
        thread::sleep(Duration::from_millis(10));
        self.rotations += 1;
        let mut name = self.path.clone().into_os_string();
        name.push(format!("-2026{:06}", self.rotations));
        if how == 0 {
            fs::copy(&self.path, &name).expect("copied");
            File::options().write(true).open(&self.path).and_then(|file| file.set_len(0)).expect("cut");
        } else {
            fs::rename(&self.path, &name).expect("renamed");
            self.write(if how == 1 { HEADER } else { "" });
        }
        thread::sleep(Duration::from_millis(10));
    }
}

fn start(sandbox: &Sandbox) -> Child {
    let call = [&CALL[..], &["--follow"]].concat();
    sandbox.command(&call).stdin(Stdio::null()).stdout(Stdio::null()).spawn().expect("the program starts")
}

/// A log written in pieces and rotated, its reader killed so many times: the output must be that of one whole reading.
fn survives(kills: usize, count: usize) {
    let sandbox = Sandbox::with_tables();
    let rows = rows(count, 25);
    let whole = [HEADER, &rows.concat()].concat();
    sandbox.write("whole.csv", &whole);
    let undisturbed = sandbox.valve(&["prognose", "whole.csv", "--tables", "tables", "--format", "jsonl", "--quiet"]);
    assert!(undisturbed.status.success(), "{}", shown(&undisturbed));

    let mut plant = Plant { path: sandbox.path("grows.csv"), rotations: 0 };
    let mut dice = Dice(kills as u64);
    // The first row must be read before the first rotation.
    let mut written = HEADER.len() + rows[0].len();
    plant.write(&whole[..written]);
    let per_kill = whole.len() / (kills + 1);
    for kill in 0..=kills {
        let mut child = start(&sandbox);
        if kill == 0 {
            let started = Instant::now();
            while fs::metadata(sandbox.path("out.jsonl")).map_or(0, |out| out.len()) == 0 {
                assert!(started.elapsed() < Duration::from_mins(1), "nothing was written");
                thread::sleep(Duration::from_millis(5));
            }
        }
        let end = HEADER.len() + per_kill * (kill + 1);
        let end = if kill == kills { whole.len() } else { end.min(whole.len()) };
        while written < end {
            let piece = (written + 1 + dice.length(per_kill / 3)).min(end);
            plant.write(&whole[written..piece]);
            // A header stands between whole rows only.
            let at_line = whole.as_bytes()[piece - 1] == b'\n';
            written = piece;
            match dice.below(12) {
                0 => plant.rotate(0),
                1 if at_line => plant.rotate(1),
                2 => plant.rotate(2),
                _ => thread::sleep(Duration::from_millis(dice.below(25))),
            }
        }
        if kill < kills {
            thread::sleep(Duration::from_millis(dice.below(60)));
            child.kill().expect("killed");
            child.wait().expect("ended");
        } else {
            let started = Instant::now();
            while fs::metadata(sandbox.path("out.jsonl")).map_or(0, |out| out.len()) < undisturbed.stdout.len() as u64 {
                if started.elapsed() > Duration::from_secs(20) {
                    break;
                }
                thread::sleep(Duration::from_millis(50));
            }
            thread::sleep(Duration::from_millis(300));
            child.kill().expect("killed");
            child.wait().expect("ended");
        }
    }
    let found = sandbox.read("out.jsonl");
    let expected = String::from_utf8(undisturbed.stdout).expect("text");
    let same = found.lines().zip(expected.lines()).take_while(|(a, b)| a == b).count();
    assert!(
        found == expected,
        "{} lines of {} after {kills} kills and {} rotations; the first {same} are the same; then {:?} instead of {:?}",
        found.lines().count(),
        expected.lines().count(),
        plant.rotations,
        found.lines().nth(same),
        expected.lines().nth(same)
    );
}

#[test]
fn a_killed_reader_of_a_rotated_log_loses_nothing_and_doubles_nothing() {
    survives(20, 2000);
}

#[test]
#[ignore = "takes minutes: 500 kills on 100,000 rows"]
fn five_hundred_kills_lose_nothing() {
    survives(500, 100_000);
}

#[test]
fn every_call_goes_on_where_the_last_one_ended() {
    for (format, name) in [("json", "out.json"), ("csv", "out.csv"), ("text", "out.txt")] {
        let sandbox = Sandbox::with_tables();
        let log = sandbox.read("log.csv");
        let rows: Vec<&str> = log.split_inclusive('\n').collect();
        let call = ["prognose", "log.csv", "--tables", "tables", "--state", "state", "--out", name, "--format", format];
        for count in [1, 9, 9, 18, rows.len()] {
            sandbox.write("log.csv", &rows[..count].concat());
            let output = sandbox.valve(&call);
            assert!(output.status.success() && output.stdout.is_empty(), "{}", shown(&output));
            if format == "json" {
                let whole: Vec<serde_json::Value> = serde_json::from_str(&sandbox.read(name)).expect("valid JSON");
                assert_eq!(whole.len(), count - 1);
            }
        }
        let mut at_once = vec!["prognose", "log.csv", "--tables", "tables", "--format", format];
        at_once.extend((format == "text").then_some("--all-rows"));
        let found = sandbox.read(name);
        let expected = String::from_utf8(sandbox.valve(&at_once).stdout).expect("text");
        assert!(expected.starts_with(&found) && expected.len() < found.len() + 320, "{found}\n---\n{expected}");
    }
}

#[test]
fn what_a_state_cannot_go_on_from_is_told() {
    let sandbox = Sandbox::with_tables();
    sandbox.write("grows.csv", &sandbox.read("log.csv"));
    let mut texts = String::new();
    let mut tell = |sandbox: &Sandbox, what: &str, output: std::process::Output| {
        let root = sandbox.path("");
        let text = shown(&output).replace(&root.display().to_string(), "/here/");
        texts.extend(["# ", what, "\n", &text, "\n"]);
    };
    sandbox.write("out.jsonl", "somebody's\n");
    tell(&sandbox, "an output that is there", sandbox.valve(&CALL));
    fs::remove_file(sandbox.path("out.jsonl")).expect("removed");
    fs::remove_dir_all(sandbox.path("state")).expect("removed");
    assert!(sandbox.valve(&CALL).status.success());
    tell(&sandbox, "other options", sandbox.valve(&[&CALL[..], &["--empty-is-stalled"]].concat()).cut("options"));
    let other_log = CALL.map(|word| if word == "grows.csv" { "log.csv" } else { word });
    tell(&sandbox, "another log", sandbox.valve(&other_log));
    let stdin = CALL.map(|word| if word == "grows.csv" { "-" } else { word });
    tell(&sandbox, "stdin", sandbox.valve(&stdin));
    tell(&sandbox, "least squares", sandbox.valve(&[&CALL[..], &["--method", "ols"]].concat()));
    let mut running = start(&sandbox);
    thread::sleep(Duration::from_millis(500));
    tell(&sandbox, "in use", sandbox.valve(&CALL));
    running.kill().expect("killed");
    running.wait().expect("ended");
    let whole = format!("{} written", sandbox.bytes("out.jsonl").len());
    File::options().write(true).open(sandbox.path("out.jsonl")).and_then(|out| out.set_len(100)).expect("cut");
    let mut tell = |sandbox: &Sandbox, what: &str, mut output: std::process::Output| {
        let text = String::from_utf8_lossy(&output.stderr).replace(&whole, "N written");
        output.stderr = text.into_bytes();
        tell(sandbox, what, output);
    };
    tell(&sandbox, "an output that was cut", sandbox.valve(&CALL));
    fs::write(sandbox.path("state/state.redb"), "no database").expect("written");
    tell(&sandbox, "no states", sandbox.valve(&CALL));
    tell(&sandbox, "no output", sandbox.valve(&["prognose", "grows.csv", "--tables", "tables", "--state", "state"]));
    insta::assert_snapshot!("states_refused", texts);
}

/// Texts that hold all numbers of the settings are cut before them.
trait Cut {
    fn cut(self, at: &str) -> Self;
}

impl Cut for std::process::Output {
    fn cut(mut self, at: &str) -> Self {
        let text = String::from_utf8_lossy(&self.stderr).into_owned();
        let end = text.find(at).map_or(text.len(), |start| start + at.len());
        self.stderr = [&text.as_bytes()[..end], b" ...\n"].concat();
        self
    }
}
