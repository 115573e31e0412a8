//! Calls that are killed at any instant: what they write is what was there or the new one, whole.

use std::process::Stdio;
use std::thread;
use std::time::Instant;

use crate::campaign::Recording;
use crate::dice::Dice;
use crate::support::{Sandbox, shown};

const VALVE: &str = include_str!("../../models/testbed.toml");
/// Kills of a call among the usual tests, and in the test that takes minutes.
const FEW: u32 = 4;
const MANY: u32 = 200;

/// Kills a call so many times, half of them near its end, where it writes. `prepare` puts back what was there before it,
/// `whole` looks at what it left.
fn kill_at_instants(sandbox: &Sandbox, call: &[&str], kills: u32, prepare: impl Fn(), whole: impl Fn() -> bool) {
    // Once undisturbed, to know how long it takes.
    let start = Instant::now();
    let output = sandbox.valve(call);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let mut time = start.elapsed();
    let mut dice = Dice(u64::from(kills));
    let (mut kill, mut hit) = (0, 0);
    // Where the first call was slowed down by others, the first kills come late: then there are more of them.
    while kill < kills || hit * 3 < kills {
        assert!(kill < 4 * kills, "only {hit} of {kill} kills of {call:?} came before its end");
        prepare();
        let share = dice.below(1000) as f64 / 1000.0;
        let instant = if kill % 2 == 0 { share } else { 0.85 + 0.2 * share };
        let mut child = sandbox.command(call).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
        thread::sleep(time.mul_f64(instant));
        let runs = child.try_wait().expect("is a child").is_none();
        hit += u32::from(runs);
        // Other work on the machine changes how long a call takes.
        time = time.mul_f64(if runs { 1.02 } else { 0.9 });
        child.kill().expect("killed");
        child.wait().expect("ended");
        assert!(whole(), "torn by kill {kill} of {call:?}, at {instant:.3} of its time");
        kill += 1;
    }
    prepare();
    let output = sandbox.valve(call);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let left: Vec<String> = sandbox.names().into_iter().filter(|name| name.contains("partial")).collect();
    assert_eq!(left, [""; 0], "stale files stay");
    println!("{}: {hit} of {kill} kills before its end, of about {time:?}", call[0]);
}

/// A call with one output, which is the old text or that of an undisturbed run.
fn file_survives(sandbox: &Sandbox, call: &[&str], name: &str, kills: u32) {
    let call = [call, &["--out", name, "--force"]].concat();
    let output = sandbox.valve(&call);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let new = sandbox.read(name);
    assert!(new.len() > 1000, "{new}");
    let old = "# what was there before\n".repeat(300);
    let whole = || [&old, &new].contains(&&sandbox.read(name));
    kill_at_instants(sandbox, &call, kills, || sandbox.write(name, &old), whole);
    assert_eq!(sandbox.read(name), new, "the last call was not disturbed");
}

fn tables_survive(kills: u32) {
    let sandbox = Sandbox::new();
    sandbox.write("other.toml", &VALVE.replace("600 N s/m", "700 N s/m"));
    let build = |valve: &str, out: &str| {
        let output = sandbox.valve(&["build-tables", valve, "--out", out, "--wear", "leaks", "--force"]);
        assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    };
    // What the tables tell, whichever names their files have at the moment.
    let told = |tables: &str| {
        let output = sandbox.valve(&["prognose", "log.csv", "--tables", tables, "--format", "jsonl", "--quiet"]);
        (output.status.code() == Some(0)).then_some(output.stdout)
    };
    build("other.toml", "old");
    build("valve.toml", "new");
    let both = [told("old"), told("new")];
    assert!(both[0].is_some() && both[1].is_some() && both[0] != both[1], "two sets");
    let call = ["build-tables", "valve.toml", "--out", "made", "--wear", "leaks", "--force"];
    let old = || sandbox.copy(&sandbox.path("old"), "made/");
    kill_at_instants(&sandbox, &call, kills, old, || both.contains(&told("made")));
}

fn fits_survive(kills: u32) {
    let sandbox = Sandbox::new();
    let truth = VALVE.replace("600 N s/m", "690 N s/m");
    Recording { supplies_psig: vec![65.0, 85.0], ..Recording::default() }.write(&sandbox, &truth);
    file_survives(&sandbox, &["calibrate", "valve.toml", "campaign.toml"], "calibrated.toml", kills);
    file_survives(&sandbox, &["adopt", "valve.toml", "campaign.toml"], "adopted.toml", kills);
}

fn report_survives(kills: u32) {
    let sandbox = Sandbox::new();
    file_survives(&sandbox, &["report", "valve.toml", "--log", "log.csv"], "report.html", kills);
}

#[test]
fn a_trace_is_whole() {
    let sandbox = Sandbox::new();
    let call = ["simulate", "valve.toml", "--cycles", "20", "--trace", "long.csv", "--force"];
    let output = sandbox.valve(&call);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let expected = sandbox.read("long.csv");
    let whole = || sandbox.read("long.csv") == expected || sandbox.read("long.csv") == "old";
    kill_at_instants(&sandbox, &call, FEW, || sandbox.write("long.csv", "old"), whole);
}

#[test]
fn tables_a_fit_and_a_report_are_whole() {
    tables_survive(FEW);
    fits_survive(FEW);
    report_survives(FEW);
}

#[test]
#[ignore = "takes minutes: 200 kills of each call"]
fn two_hundred_kills_of_each_leave_it_whole() {
    tables_survive(MANY);
    fits_survive(MANY);
    report_survives(MANY);
}
