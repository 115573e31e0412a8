//! Many valves in one log: the worst stand first, in text and report, and the counts are right.

use std::collections::HashMap;
use std::fmt::Write;

use serde_json::Value;

use crate::support::{Sandbox, shown};

const VALVES: usize = 200;

/// A log of valves at all ages, their rows interleaved: most are healthy, the others leak and are looked at after
/// another number of cycles each, and one strokes too slowly for any life.
fn write_log(sandbox: &Sandbox) {
    let life = sandbox.read("log.csv");
    let life: Vec<&str> = life.lines().skip(1).filter_map(|line| line.strip_prefix("FV-101,")).collect();
    let mut log = "valve,cycle,close_time_s,open_time_s\n".to_owned();
    for (index, row) in life.iter().enumerate() {
        for valve in 0..VALVES {
            let text = match valve % 8 {
                3 if index <= 5 + (valve * 7) % (life.len() - 5) => (*row).to_owned(),
                3 => continue,
                _ if valve == 150 && index > 20 => format!("{index},9.0,9.0"),
                _ => {
                    format!("{index},{:.4},{:.4}", 1.043 + 1e-4 * (index % 3) as f64, 2.138 + 1e-4 * (valve % 3) as f64)
                }
            };
            let _ = writeln!(log, "FV-{valve:03},{text}");
        }
    }
    sandbox.write("fleet.csv", &log);
}

/// Valves from worst to best by what programs are told, and how many stand where.
fn by_jsonl(sandbox: &Sandbox) -> (Vec<String>, HashMap<String, usize>) {
    let output = sandbox.valve(&["prognose", "fleet.csv", "--tables", "tables", "--format", "jsonl"]);
    let mut last: HashMap<String, Value> = HashMap::new();
    for line in String::from_utf8(output.stdout).expect("text").lines() {
        let row: Value = serde_json::from_str(line).expect("JSON");
        let wears = ["atmosphere", "supply", "both-leaks", "other"];
        let likely = wears.iter().filter_map(|name| row["fault_probability"][name].as_f64()).fold(0.0, f64::max);
        assert!(row["status"] != "healthy" || row["fault"] == "none" && likely < 0.5, "healthy with a fault: {row}");
        last.insert(row["valve"].as_str().expect("a name").to_owned(), row);
    }
    let ladder = ["eol-reached", "act-now", "plan", "watch", "unknown", "healthy"];
    let mut counts = HashMap::new();
    let mut valves: Vec<(usize, f64, String)> = Vec::new();
    for (name, row) in last {
        let status = row["status"].as_str().expect("a state").to_owned();
        let place = ladder.iter().position(|state| *state == status).expect("a known state");
        valves.push((place, row["rul_p05"].as_f64().unwrap_or(f64::INFINITY), name));
        *counts.entry(status).or_default() += 1;
    }
    valves.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
    (valves.into_iter().map(|(.., name)| name).collect(), counts)
}

/// Checks a line such as "200 valves: ▲ 2 act-now, ✓ 198 healthy".
fn check_counts(line: &str, counts: &HashMap<String, usize>) {
    let (_, told) = line.split_once("200 valves: ").unwrap_or_else(|| panic!("{line}"));
    let told: Vec<&str> = told.trim().split(", ").collect();
    assert_eq!(told.len(), counts.len(), "{line}");
    for one in told {
        let words: Vec<&str> = one.split(' ').collect();
        assert_eq!(words.len(), 3, "sign, count and state in {line}");
        assert_eq!(words[1].parse::<usize>().ok(), counts.get(words[2]).copied(), "{line}");
    }
}

#[test]
fn two_hundred_valves_stand_worst_first_in_text_and_report() {
    let sandbox = Sandbox::with_tables();
    write_log(&sandbox);
    let (order, counts) = by_jsonl(&sandbox);
    assert_eq!(order.len(), VALVES);
    assert!(counts.len() >= 4 && counts["healthy"] > 100, "a fleet with little in it: {counts:?}");

    let output = sandbox.valve(&["prognose", "fleet.csv", "--tables", "tables"]);
    let text = String::from_utf8(output.stdout.clone()).expect("text");
    check_counts(text.lines().next().expect("a line"), &counts);
    let listed: Vec<&str> = text.lines().filter(|line| line.starts_with("FV-")).map(|line| &line[..6]).collect();
    assert_eq!(listed, order, "{}", shown(&output));
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    assert!(text.contains("■ eol-reached") && text.contains("✓ healthy"), "{text}");
    assert!(text.ends_with(&format!("--plot-valve {}\n", order[0])), "{text}");
    let coloured = sandbox.valve(&["--color", "always", "prognose", "fleet.csv", "--tables", "tables"]);
    let coloured = String::from_utf8(coloured.stdout).expect("text");
    assert!(coloured.contains("\u{1b}[1;31m■ eol-reached\u{1b}[0m"), "{coloured}");

    let every = sandbox.valve(&["prognose", "fleet.csv", "--tables", "tables", "--all-rows"]);
    let every = String::from_utf8(every.stdout).expect("text");
    let rows = sandbox.read("fleet.csv").lines().count() - 1;
    assert_eq!(every.lines().filter(|line| line.starts_with("FV-")).count(), rows + VALVES);

    let output = sandbox.valve(&["report", "valve.toml", "--log", "fleet.csv", "--out", "report.html"]);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let page = sandbox.read("report.html");
    let callout = page.lines().find(|line| line.contains("callout\">200 valves: ")).expect("the counts");
    check_counts(callout.trim_end_matches("</p>"), &counts);
    let cells = page.lines().filter_map(|line| line.strip_prefix("<tr><td>FV-"));
    let in_report: Vec<String> = cells.map(|rest| format!("FV-{}", &rest[..3])).take(VALVES).collect();
    assert_eq!(in_report, order);
    assert!(page.contains("<td class=\"bad\">■ eol-reached</td>"));
    let drawn: Vec<usize> = order
        .iter()
        .enumerate()
        .filter(|(_, name)| page.contains(&format!(">{name}: ")))
        .map(|(place, _)| place)
        .collect();
    assert_eq!(drawn, [0, 1, 2, 3, 4, 5, 6, 7], "the worst have a picture");
}

#[test]
fn rows_come_out_in_the_order_of_the_log_whatever_the_number_of_threads() {
    let sandbox = Sandbox::with_tables();
    write_log(&sandbox);
    let log = sandbox.read("fleet.csv");
    // A row that stands twice is said so behind its own line.
    let (head, tail) = log.split_at(log.match_indices('\n').nth(700).expect("long enough").0 + 1);
    let again = head.lines().last().expect("a row");
    sandbox.write("fleet.csv", &format!("{head}{again}\n{tail}"));
    let run = |threads: &str| {
        let arguments = ["prognose", "fleet.csv", "--tables", "tables", "--format", "csv"];
        sandbox.command(&arguments).env("RAYON_NUM_THREADS", threads).output().expect("runs")
    };
    let (one, three) = (run("1"), run("3"));
    assert!(one.status.success(), "{}", shown(&one));
    assert!(one.stdout == three.stdout && one.stderr == three.stderr, "{}", shown(&three));
    let log = sandbox.read("fleet.csv");
    let key = |line: &str| line.split(',').take(2).map(str::to_owned).collect::<Vec<_>>();
    let told = String::from_utf8(three.stdout).expect("text");
    assert!(log.lines().map(key).eq(told.lines().map(key)), "other rows or in another order");
    let notes = String::from_utf8(three.stderr).expect("text");
    assert_eq!(notes.matches("in the log before").count(), 1, "{notes}");
}

#[test]
#[ignore = "takes half a minute: tables of every wear with stiff friction"]
fn friction_of_a_valve_that_rubs_already_is_told_as_that_of_any_other() {
    let sandbox = Sandbox::new();
    let effect = "\n[[effect]]\nkind = \"dry-friction\"\ncoulomb_force = \"25 N\"\nopening_factor = 0.5\n";
    sandbox.write("valve.toml", &format!("{}{effect}", sandbox.read("valve.toml")));
    let call = ["evaluate", "valve.toml", "--scenarios", "--only", "friction", "--seeds", "10", "--format", "json"];
    let output = sandbox.valve(&call);
    let document: Value = serde_json::from_slice(&output.stdout).expect("a document");
    let quiet = &document["scenarios"][0];
    assert!(quiet["named_rightly"].as_f64() >= Some(0.9), "{quiet}");
    assert!(quiet["relative_accuracy"].as_f64() >= Some(0.85), "{quiet}");
}
