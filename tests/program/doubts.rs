//! What a user is told of a log that does not say what it seems to say.

use std::fmt::Write as _;

use crate::support::{Sandbox, shown};

const HEADER: &str = "valve,cycle,close_time_s,open_time_s\n";

/// Times of the healthy reference valve, s.
const HEALTHY_S: [f64; 2] = [1.0422, 2.1344];

/// Something like noise of a standard deviation of 5 ms, the same for the same number.
fn noise_s(number: usize) -> f64 {
    let unit = |salt: usize| ((number * 7919 + salt * 104_729) % 1013) as f64 / 1013.0 - 0.5;
    0.005 * (0..12).map(unit).sum::<f64>()
}

/// Rows of one valve: the healthy times by a factor and with noise, of each cycle.
fn rows(valve: &str, cycles: usize, factor: impl Fn(usize) -> [f64; 2]) -> Vec<String> {
    (1..=cycles)
        .map(|cycle| {
            let [close, open] = factor(cycle);
            let (close, open) =
                (close * HEALTHY_S[0] + noise_s(2 * cycle), open * HEALTHY_S[1] + noise_s(2 * cycle + 1));
            format!("{valve},{cycle},{close:.4},{open:.4}\n")
        })
        .collect()
}

/// The text of a call on a log, its words parted by single spaces.
fn words(sandbox: &Sandbox, log: &str, call: &[&str]) -> String {
    sandbox.write("log.csv", log);
    let told = shown(&sandbox.valve(call));
    told.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn prognosed(log: &str) -> String {
    words(&Sandbox::with_tables(), log, &["prognose", "log.csv", "--tables", "tables"])
}

fn assert_says(told: &str, wanted: &[&str]) {
    for words in wanted {
        assert!(told.contains(words), "{words:?} in {told}");
    }
}

#[test]
fn a_valve_that_is_far_off_from_its_first_row_on_is_not_called_healthy() {
    let told = prognosed(&(HEADER.to_owned() + &rows("A", 30, |_| [1.44, 1.44]).concat()));
    let wanted = [
        "1 valve: ? 1 unknown",
        "worn when the log began, or not the valve of the tables; closing time +4",
        "a valve counts as healthy at its first row, and with `--start unknown` it does not",
    ];
    assert_says(&told, &wanted);
    // As far off as sister valves are.
    let told = prognosed(&(HEADER.to_owned() + &rows("A", 30, |_| [1.1, 1.1]).concat()));
    assert_says(&told, &["1 healthy", "closing time +10.", "--start unknown"]);
    let told = prognosed(&(HEADER.to_owned() + &rows("A", 30, |_| [1.0, 1.0]).concat()));
    assert!(told.contains("1 healthy") && !told.contains("first row"), "{told}");
}

#[test]
fn what_a_named_fault_rests_on_is_told_once() {
    let log = Sandbox::new().read("log.csv");
    let other = log.replace("FV-101", "FV-102");
    let log = log + other.split_once('\n').expect("a header").1;
    let told = prognosed(&log);
    assert_eq!(told.matches("Each valve counts as healthy at its first row.").count(), 1, "{told}");
    let call = ["prognose", "log.csv", "--tables", "tables", "--start", "unknown"];
    let told = words(&Sandbox::with_tables(), &log, &call);
    assert!(told.contains("act-now") && !told.contains("healthy at its first row"), "{told}");
}

#[test]
fn times_that_a_recorder_repeats_are_no_readings() {
    let growing = |cycle: usize| [1.0 + 0.012 * cycle as f64, 1.0 - 0.012 * cycle as f64];
    let mut all = rows("A", 25, growing);
    let times = all[24].strip_prefix("A,25,").expect("a row").to_owned();
    all.extend((26..=45).map(|cycle| format!("A,{cycle},{times}")));
    let told = prognosed(&(HEADER.to_owned() + &all.concat()));
    let wanted = [
        "both times are exactly those of the row before, in ",
        " rows from cycle 26 on",
        "did the recorder lose its source and go on with the last value? They are not used",
        "times repeat exactly since cycle 26: 20 rows not used",
    ];
    assert_says(&told, &wanted);
    assert!(!told.contains("rests"), "{told}");

    // The same, recorded to a tenth: such times repeat by themselves.
    let coarse = |row: &str| {
        let fields: Vec<&str> = row.trim().split(',').collect();
        let rounded = |field: &str| field.parse::<f64>().map_or(field.to_owned(), |time| format!("{time:.1}"));
        format!("{},{},{},{}\n", fields[0], fields[1], rounded(fields[2]), rounded(fields[3]))
    };
    let log: String = all.iter().map(|row| coarse(row)).collect();
    let told = prognosed(&(HEADER.to_owned() + &log));
    assert!(!told.contains("repeat"), "{told}");
}

#[test]
fn a_supply_pressure_without_its_point_is_left_out() {
    let sandbox = Sandbox::with_tables();
    let built = sandbox.valve(&["build-tables", "valve.toml", "--supply-range", "70..80 psig", "--out", "wide"]);
    assert_eq!(built.status.code(), Some(0), "{}", shown(&built));
    let log = |stated: &dyn Fn(usize) -> &'static str| {
        let rows = rows("A", 30, |_| [1.0, 1.0]);
        let with = |(at, row): (usize, &String)| format!("{},{}\n", row.trim(), stated(at + 1));
        HEADER.replace('\n', ",supply_pressure_psig\n") + &rows.iter().enumerate().map(with).collect::<String>()
    };
    let call = ["prognose", "log.csv", "--tables", "wide"];
    let told = words(&sandbox, &log(&|cycle| if cycle == 20 || cycle == 24 { "750" } else { "75.0" }), &call);
    let wanted = [
        "log.csv:21: valve A, cycle 20: the supply pressure of 5272.4 kPa absolute is far outside the tables (584.0 to 652.9)",
        "the row is not used: is it mistyped, or in another unit?",
        "1 more row of 1 valve with the remark \"far-conditions\"",
        "1 healthy",
    ];
    assert_says(&told, &wanted);
    assert!(!told.contains("--supply-range"), "{told}");
    // A little outside is used, at the edge of the tables.
    let told = words(&sandbox, &log(&|cycle| if cycle == 20 { "81.5" } else { "75.0" }), &call);
    assert!(told.contains("do not cover") && !told.contains("far outside"), "{told}");
    let told = words(&sandbox, &log(&|_| "110"), &call);
    assert_says(&told, &["1 unknown", "far outside", "builds tables for that"]);
}

#[test]
fn names_that_look_the_same_are_asked_about_or_refused() {
    let mut log = HEADER.to_owned();
    for (cycle, valve) in
        ["FV-1", "fv-1", "\u{a0}FV-1\u{a0}", "FV -1", "FV-1\u{200b}", "\u{202e}FV-1", "fv-1"].iter().enumerate()
    {
        let _ = writeln!(log, "{valve},{cycle},1.0412,2.1344");
    }
    let told = prognosed(&log);
    let wanted = [
        "log.csv:3: \"FV-1\" and \"fv-1\": the same valve? Their names differ in nothing but capital letters or spaces",
        "log.csv:5: \"FV-1\" and \"FV -1\": the same valve?",
        "log.csv:6: valve: found \"FV-1\\u{200b}\", expected a name without characters that nobody sees",
        "log.csv:7: valve: found \"\\u{202e}FV-1\", expected a name without characters that nobody sees",
        "3 valves: ",
        "2 lines were no rows and were skipped",
    ];
    assert_says(&told, &wanted);
    assert_eq!(told.matches("the same valve?").count(), 2, "{told}");
}

#[test]
fn one_bad_cell_costs_one_row_wherever_a_log_is_read() {
    let sandbox = Sandbox::with_tables();
    let log = sandbox.read("log.csv");
    let bad = log.replacen("\nFV-101,3,", "\nFV-101,3,fast,", 1);
    let lines: Vec<String> = bad
        .lines()
        .map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            if fields.contains(&"fast") { "FV-101,3,fast,2.0".to_owned() } else { line.to_owned() }
        })
        .collect();
    let bad = lines.join("\n") + "\nFV-101,26,3.1,0.7\nFV-101,27,3.2,0.7\n";
    for call in [
        &["prognose", "log.csv", "--tables", "tables"][..],
        &["learn", "log.csv", "--tables", "tables", "--out", "prior.toml"],
        &["evaluate", "valve.toml", "--log", "log.csv"],
        &["report", "valve.toml", "--log", "log.csv", "--out", "report.html"],
    ] {
        let told = words(&sandbox, &bad, call);
        let wanted =
            ["exit code: 0", "close_time_s: found \"fast\", expected", "log.csv: 1 line was no row and was skipped"];
        assert_says(&told, &wanted);
        assert_eq!(told.matches("found \"fast\"").count(), 1, "{call:?} {told}");
    }
    let told = words(&sandbox, &bad, &["prognose", "log.csv", "--tables", "tables", "--strict"]);
    assert_says(&told, &["exit code: 2", "error: log.csv:"]);
    let told = words(&sandbox, &format!("{HEADER}A,1,x,2\nA,2,y,2\n"), &["prognose", "log.csv", "--tables", "tables"]);
    assert_says(
        &told,
        &["exit code: 2", "error: log.csv:2: close_time_s: found \"x\"", "no other line is a row either"],
    );
}

#[test]
fn a_log_that_is_sorted_newest_first_is_told_and_its_answer_is_none() {
    let sandbox = Sandbox::with_tables();
    let call = ["prognose", "log.csv", "--tables", "tables"];
    let rows = (1..=20).rev().map(|cycle| format!("A,{cycle}.0,1.{:02},2.13\n", cycle + 4));
    let told = words(&sandbox, &(HEADER.to_owned() + &rows.collect::<String>()), &call);
    assert_says(
        &told,
        &["exit code: 1", "in 19 of 20 rows the cycle lies before those above: it is sorted newest first"],
    );
    let rows = (1..=20).rev().map(|day| format!("A,2026-05-{day:02}T06:00:00Z,1.{:02},2.13\n", day + 4));
    let dated = "valve,time,close_time_s,open_time_s\n".to_owned() + &rows.collect::<String>();
    assert_says(&words(&sandbox, &dated, &call), &["exit code: 1", "sort it by date, oldest first"]);
}

#[test]
fn a_number_at_which_the_file_ends_is_doubted() {
    let log = HEADER.to_owned() + &rows("A", 10, |_| [1.0, 1.0]).concat();
    let said =
        "found \"1.9\" where the file ends without an end of line, expected 4 decimals or more as in all rows before";
    assert_says(&prognosed(&format!("{log}A,11,1.0411,1.9")), &[said, "1 line was no row and was skipped"]);
    let other = format!("{log}A,11,1.0411,1.9").replace("close_time_s", "closing time [s]");
    assert_says(&prognosed(&other), &["log.csv:12: the last row is cut off; it was left out"]);
    for whole in ["A,11,1.0411,2.1301", "A,11,1.0411,2.1301\n", "A,11,1.0411,1.9\n"] {
        let told = prognosed(&format!("{log}{whole}"));
        assert!(!told.contains("cut off"), "{told}");
    }
}

#[test]
fn years_of_two_digits_are_of_this_century_or_asked_for() {
    let german = |ms: f64| {
        let mut number = format!("{ms:.1}").replace('.', ",");
        number.insert(1, '.');
        number
    };
    let exported = |date: &dyn Fn(usize) -> String| {
        let mut log = "Ventil;Zyklus;Schliesszeit [ms];Oeffnungszeit [ms];Datum\n".to_owned();
        for cycle in 1..=12 {
            let [close, open] = [0, 1].map(|stroke| german(1e3 * (HEALTHY_S[stroke] + noise_s(2 * cycle + stroke))));
            let _ = writeln!(log, "A;{cycle};{close};{open};{}", date(cycle));
        }
        log
    };
    let sandbox = Sandbox::with_tables();
    let call = ["prognose", "log.csv", "--tables", "tables", "--format", "jsonl"];
    let told = words(&sandbox, &exported(&|cycle| format!("{cycle:02}.01.26 06:00")), &call);
    assert_says(&told, &["\"time\":\"2026-01-03T06:00:00Z\"", "was taken as a thousands separator"]);
    assert!(!told.contains("other-unit"), "{told}");
    let told = words(&sandbox, &exported(&|cycle| format!("26-01-{cycle:02}")), &call);
    assert_says(&told, &["whose year has two digits and may be the day as well", "write the year with four digits"]);
}

#[test]
fn what_is_learnt_stands_beside_what_it_started_from() {
    let sandbox = Sandbox::with_tables();
    let log = sandbox.read("log.csv");
    let told = words(&sandbox, &log, &["learn", "log.csv", "--tables", "tables", "--out", "prior.toml"]);
    let wanted = [
        "1 valve, 1 of them worn.",
        "Started from the default, which counts as 4 valves: a life of 50 cycles (6 to 391)",
    ];
    assert_says(&told, &wanted);
}
