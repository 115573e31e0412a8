//! Timing logs that are written in other ways.

use std::fmt::Write as _;

use crate::support::{Sandbox, shown};

/// The log of the sandbox as a German spreadsheet has it: without a column of valves, and dates in place of cycles.
fn exported(log: &str, headings: [&str; 3]) -> String {
    let mut text = format!("{}\r\n", headings.join(";"));
    for (row, line) in log.lines().skip(1).enumerate() {
        let fields: Vec<&str> = line.split(',').collect();
        let ms = |field: &str| {
            field.parse().map_or_else(|_| field.to_owned(), |s: f64| format!("{:.1}", 1e3 * s).replace('.', ","))
        };
        let _ = write!(text, "{:02}.{:02}.2026;{};{}\r\n", 1 + row % 28, 1 + row / 28, ms(fields[2]), ms(fields[3]));
    }
    text
}

#[test]
fn a_spreadsheet_s_export_gives_the_lives_of_the_plain_log() {
    let sandbox = Sandbox::with_tables();
    // Without the gap in its cycles, which no count of rows can know.
    let mut lines: Vec<String> = sandbox.read("log.csv").lines().map(str::to_owned).collect();
    for (row, line) in lines.iter_mut().enumerate().skip(1) {
        let (valve, rest) = line.split_once(',').expect("has fields");
        *line = format!("{valve},{row},{}", rest.split_once(',').expect("has fields").1);
    }
    let plain = lines.join("\n");
    sandbox.write("plain.csv", &plain);
    sandbox.write("export.csv", &exported(&plain, ["Datum", "Zeit ZU", "Zeit AUF"]));
    let columns = ["--valve-name", "FV-101", "--column", "close_time_ms=Zeit ZU", "--column", "open_time_ms=Zeit AUF"];
    let lives = |log: &str, columns: &[&str]| {
        let call = [&["prognose", log, "--tables", "tables", "--format", "jsonl"], columns].concat();
        let output = sandbox.valve(&call);
        assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
        let rows = String::from_utf8(output.stdout).expect("is text");
        let life = |row: &str| {
            let row: serde_json::Value = serde_json::from_str(row).expect("is JSON");
            [&row["cycle"], &row["fault"], &row["status"]].map(ToString::to_string).join(" ")
                + &format!(" {:.4}", row["rul_cycles"].as_f64().unwrap_or_default())
        };
        rows.lines().map(life).collect::<Vec<_>>()
    };
    let (of_plain, of_export) = (lives("plain.csv", &[]), lives("export.csv", &columns));
    assert!(of_plain.len() > 20 && of_plain.last().is_some_and(|row| row.contains("act-now")), "{of_plain:?}");
    assert_eq!(of_plain, of_export);

    // What was said of the columns is in the next command too, which runs as it is.
    let text = String::from_utf8(
        sandbox.valve(&[&["prognose", "export.csv", "--tables", "tables"][..], &columns].concat()).stdout,
    );
    let text = text.expect("is text").replace(" \\\n", " ");
    let next: Vec<&str> =
        text.split_once("next:").expect("a next step").1.lines().filter(|line| line.contains("valve ")).collect();
    assert!(next.concat().contains("'close_time_ms=Zeit ZU'"), "{next:?}");

    for call in [
        &["learn", "export.csv", "--tables", "tables", "--out", "prior.toml"][..],
        &["report", "valve.toml", "--log", "export.csv", "--out", "report.html"],
    ] {
        let output = sandbox.valve(&[call, &columns].concat());
        assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    }
}

#[test]
fn what_a_log_does_not_say_is_asked_for_with_the_option_that_says_it() {
    let sandbox = Sandbox::with_tables();
    sandbox.write("export.csv", &exported(&sandbox.read("log.csv"), ["Datum", "Schliesszeit", "Laufzeit"]));
    let mut said = Vec::new();
    for options in [
        &[][..],
        &["--valve-name", "FV-101"],
        &["--valve-name", "FV-101", "--column", "close_time_ms=Schliesszeit"],
        &["--valve-name", "FV-101", "--column", "close_time_ms=Schliesszeit", "--column", "open_time_ms=Lauf"],
        &["--valve-name", "FV-101", "--column", "close_time_mm=Schliesszeit"],
        &["--valve-name", "FV-101", "--follow"],
        &["--follow"],
    ] {
        let output = sandbox.valve(&[&["prognose", "export.csv", "--tables", "tables"][..], options].concat());
        assert_eq!(output.status.code(), Some(2), "{options:?} {}", shown(&output));
        said.push(format!("$ {}\n{}", options.join(" "), String::from_utf8_lossy(&output.stderr)));
    }
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn a_life_that_is_given_twice_teaches_nobody() {
    let sandbox = Sandbox::with_tables();
    let log = sandbox.read("log.csv");
    // The same rows under another name are the same life; other rows under the same name are another one.
    sandbox.write("again.csv", &log.replace("FV-101", "FV-102"));
    let learn = |logs: &[&str]| {
        let call = [&["learn"], logs, &["--tables", "tables", "--out", "prior.toml", "--force"]].concat();
        shown(&sandbox.valve(&call))
    };
    let told = learn(&["log.csv", "again.csv"]);
    let expected = "error: again.csv: valve FV-102 has the readings of valve FV-101 in log.csv, one for one; expected each life once";
    assert!(told.contains(expected) && told.contains("hint: leave one of the two out"), "{told}");
    assert!(!sandbox.path("prior.toml").exists(), "{told}");
    assert!(learn(&["log.csv", "./log.csv"]).contains("error: ./log.csv: given twice; expected each life once"));
    let lines: Vec<&str> = log.lines().collect();
    // A few rows of two valves may be alike.
    sandbox.write("few.csv", &lines[..5].join("\n"));
    sandbox.write("fewer.csv", &lines[..5].join("\n"));
    assert!(learn(&["few.csv", "fewer.csv"]).contains("2 valves"));
    sandbox.write("other.csv", &lines[..lines.len() - 1].join("\n"));
    let told = learn(&["log.csv", "other.csv"]);
    assert!(told.contains("2 valves, 2 of them worn"), "{told}");
}
