//! What the documents show is what the program does.

use crate::support::{self, Sandbox, shown};

const README: &str = include_str!("../../README.md");

/// Calls of the program in the README's blocks of commands.
fn calls() -> Vec<Vec<&'static str>> {
    // What follows a change of the directory is run by `next`.
    let is_elsewhere = |line: &str| line.starts_with("cd ");
    let blocks = README.split("\n\n").map(|block| block.lines().filter_map(|line| line.strip_prefix("    ")));
    let commands = blocks.filter(|block| !block.clone().any(is_elsewhere)).flatten();
    commands.filter_map(|line| line.strip_prefix("valve ")).map(|call| call.split_whitespace().collect()).collect()
}

#[test]
fn commands_of_the_readme_run_one_after_the_other() {
    let sandbox = Sandbox::new();
    let calls = calls();
    assert!(calls.len() >= 3, "the README shows how to simulate, build tables and prognose");
    for call in calls {
        let output = sandbox.valve(&call);
        assert_eq!(output.status.code(), Some(0), "valve {}\n{}", call.join(" "), shown(&output));
    }
}

#[test]
fn every_verb_is_in_the_readme() {
    for verb in support::verbs() {
        assert!(README.contains(&format!("`valve {verb}`")), "{verb}");
    }
}

#[test]
fn picture_of_the_readme_is_what_the_demo_draws() {
    let sandbox = Sandbox::new();
    let output = sandbox.valve(&["demo", "--plot", "life.svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let again = "draw it again: cargo run --release -- demo --plot docs/life.svg";
    let (words, numbers) = taken_apart(&sandbox.read("life.svg"));
    let (shown_words, shown_numbers) = taken_apart(include_str!("../../docs/life.svg"));
    assert_eq!(words, shown_words, "{again}");
    for (number, shown) in numbers.iter().zip(&shown_numbers) {
        assert!((number - shown).abs() <= SHIFT_PX, "{number} instead of {shown}; {again}");
    }
}

/// Pixels by which the picture may be off: another prior need not change it.
const SHIFT_PX: f64 = 4.0;

/// A text without its numbers, and these.
fn taken_apart(text: &str) -> (String, Vec<f64>) {
    let mut words = String::new();
    let mut numbers = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find(|letter: char| letter.is_ascii_digit()) {
        words.push_str(&rest[..start]);
        words.push('#');
        rest = &rest[start..];
        let end = rest.find(|letter: char| !(letter.is_ascii_digit() || letter == '.')).unwrap_or(rest.len());
        numbers.push(rest[..end].trim_end_matches('.').parse().unwrap_or(f64::NAN));
        rest = &rest[end..];
    }
    words.push_str(rest);
    (words, numbers)
}

#[test]
fn accuracies_of_the_readme_are_what_evaluate_finds() {
    let sandbox = Sandbox::new();
    let output = sandbox.valve(&["evaluate", "valve.toml", "--format", "json"]);
    let study: serde_json::Value =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}\n{}", shown(&output)));
    let found = |variance: f64, fault: &str, method: &str| {
        let results = study["results"].as_array().expect("results").iter();
        let mut same = results.filter(|result| {
            result["noise_variance_s2"].as_f64() == Some(variance)
                && result["fault"] == fault
                && result["method"] == method
        });
        same.next().expect("a result")["relative_accuracy"]["p50"].as_f64().expect("a number")
    };
    let mut rows = 0;
    for row in README.lines().filter(|line| line.starts_with("| 0 |") || line.starts_with("| 1e-")) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let variance: f64 = cells[0].parse().expect("a variance");
        for (cell, method) in [(cells[2], "ols"), (cells[3], "bayes")] {
            let values: Vec<f64> = cell.split('/').map(|value| value.trim().parse().expect("a number")).collect();
            for (value, fault) in values.iter().zip(["supply", "atmosphere"]) {
                let now = found(variance, fault, method);
                assert!((value - now).abs() < 0.005, "{row}: {method} for {fault} is {now:.3}");
            }
        }
        rows += 1;
    }
    assert_eq!(rows, 4);
}
