//! What the documents show is what the program does.

use crate::support::{self, Sandbox, shown};

const README: &str = include_str!("../../README.md");

/// Calls of the program in the README's blocks of commands.
fn calls() -> Vec<Vec<&'static str>> {
    let commands = README.lines().filter_map(|line| line.strip_prefix("    "));
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
