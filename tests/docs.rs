//! What the documents show is what the program does.

mod support;

use support::{Sandbox, shown};

const README: &str = include_str!("../README.md");

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
    let drawn = sandbox.read("life.svg");
    let shown = include_str!("../docs/life.svg");
    assert!(drawn == shown, "draw it again: cargo run --release -- demo --plot docs/life.svg");
}
