//! From a campaign to a remaining life by copying what each verb prints as the next step, and nothing else.

use std::path::Path;

use crate::campaign::Recording;
use crate::support::{Sandbox, shown};

const README: &str = include_str!("../../README.md");
const VALVE: &str = include_str!("../../models/testbed.toml");

/// The commands that a text offers as next steps, each as its words; what is broken over lines is joined.
pub fn next_steps(text: &str) -> Vec<Vec<String>> {
    let joined = text.replace(" \\\n        ", " ");
    let mut steps = Vec::new();
    let mut is_next = false;
    for line in joined.lines() {
        if let Some(command) = line.strip_prefix("    valve ").filter(|_| is_next) {
            steps.push(command.split(' ').map(str::to_owned).collect());
            is_next = false;
        }
        is_next |= line.starts_with("next: ");
    }
    steps
}

/// Runs a call and then whatever is offered first, until a picture of a life is; gives the calls and the last answer.
fn follow(sandbox: &Sandbox, first: &str) -> (Vec<String>, String) {
    let mut call: Vec<String> = first.split(' ').map(str::to_owned).collect();
    let mut calls = Vec::new();
    loop {
        let words: Vec<&str> = call.iter().map(String::as_str).collect();
        let output = sandbox.valve(&words);
        assert_ne!(output.status.code(), Some(2), "valve {}\n{}", call.join(" "), shown(&output));
        let said = String::from_utf8(output.stdout).expect("text");
        calls.push(call.join(" "));
        let steps = next_steps(&said);
        let next = steps.into_iter().next().unwrap_or_else(|| panic!("no next step after {calls:?}:\n{said}"));
        if next.iter().any(|word| word == "--plot") || calls.len() > 8 {
            return (calls, said);
        }
        call = next;
    }
}

#[test]
fn the_sample_campaign_leads_to_a_remaining_life() {
    let sandbox = Sandbox::new();
    sandbox.copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("data/sticking-valve"), "");
    let (calls, last) = follow(&sandbox, "compare valve.toml campaign.toml");
    let shown = README.lines().skip_while(|line| *line != "    cd data/sticking-valve").skip(1);
    let shown: Vec<&str> = shown.map_while(|line| line.strip_prefix("    valve ")).collect();
    assert_eq!(calls, shown, "the README shows the chain as it is printed");
    assert!(!sandbox.path("calibrated.toml").exists(), "values that strayed are not written");
    assert!(sandbox.read("better.toml").contains("kind = \"dry-friction\""));
    assert!(last.contains("FV-7") && last.contains("atmosphere"), "{last}");
}

#[test]
fn a_campaign_that_its_tolerances_explain_leads_there_too() {
    let sandbox = Sandbox::new();
    Recording::default().write(&sandbox, &VALVE.replace("600 N s/m", "690 N s/m"));
    let (calls, last) = follow(&sandbox, "compare valve.toml campaign.toml");
    let verbs: Vec<&str> = calls.iter().filter_map(|call| call.split(' ').next()).collect();
    assert_eq!(verbs, ["compare", "calibrate", "build-tables", "prognose"]);
    assert!(sandbox.path("calibrated.toml").exists() && last.contains("FV-101"), "{last}");
}

#[test]
fn an_adequate_model_is_adopted_without_effects() {
    let sandbox = Sandbox::new();
    Recording { supplies_psig: vec![65.0, 85.0], ..Recording::default() }
        .write(&sandbox, &VALVE.replace("600 N s/m", "690 N s/m"));
    let explained = sandbox.valve(&["explain", "valve.toml", "campaign.toml"]);
    let said = String::from_utf8(explained.stdout).unwrap();
    let call = next_steps(&said).remove(0);
    assert_eq!(call.join(" "), "adopt valve.toml campaign.toml --out calibrated.toml", "{said}");
    let words: Vec<&str> = call.iter().map(String::as_str).collect();
    let adopted = sandbox.valve(&words);
    assert_eq!(adopted.status.code(), Some(0), "{}", shown(&adopted));
    let text = sandbox.read("calibrated.toml");
    assert!(text.contains("action = \"calibrated\""), "{text}");
    // What is fitted to these strokes leads on, not to another fit.
    for verb in ["compare", "explain"] {
        let said = String::from_utf8(sandbox.valve(&[verb, "calibrated.toml", "campaign.toml"]).stdout).unwrap();
        assert_eq!(next_steps(&said)[0][0], "build-tables", "{said}");
    }
    assert!(!String::from_utf8_lossy(&adopted.stdout).contains("The strokes were made at"));
    sandbox.write("warm.toml", &sandbox.read("valve.toml").replace("293.15 K", "303.15 K"));
    let adopted = sandbox.valve(&["adopt", "warm.toml", "campaign.toml", "--out", "warm-2.toml"]);
    let said = String::from_utf8(adopted.stdout).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains("The strokes were made at 293.1 K, the valve file states 303.1 K"), "{said}");
    // There is nothing that a formula would be needed for.
    let refused =
        sandbox.valve(&["adopt", "valve.toml", "campaign.toml", "--effect", "unexplained", "--out", "x.toml"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(shown(&refused).contains("no formula is needed or found: nothing is missing"), "{}", shown(&refused));
    assert!(!sandbox.path("x.toml").exists());
}

#[test]
fn names_that_are_taken_are_not_offered_and_results_alone_are_silent() {
    let sandbox = Sandbox::new();
    Recording::default().write(&sandbox, &VALVE.replace("600 N s/m", "690 N s/m"));
    sandbox.write("calibrated.toml", "mine");
    let compared = sandbox.valve(&["compare", "valve.toml", "campaign.toml"]);
    let said = String::from_utf8(compared.stdout).unwrap();
    assert!(said.ends_with("valve calibrate valve.toml campaign.toml --out calibrated-2.toml\n"), "{said}");
    let quiet = String::from_utf8(sandbox.valve(&["-q", "compare", "valve.toml", "campaign.toml"]).stdout).unwrap();
    assert!(!quiet.contains("next:") && said.starts_with(&quiet), "{quiet}");
}

#[test]
fn values_that_strayed_are_written_only_if_forced() {
    let sandbox = Sandbox::new();
    let friction = format!("{VALVE}\n[[effect]]\nkind = \"dry-friction\"\ncoulomb_force = \"40 N\"\n");
    Recording { supplies_psig: vec![65.0, 85.0], ..Recording::default() }.write(&sandbox, &friction);
    let call = ["calibrate", "valve.toml", "campaign.toml", "--out", "new.toml"];
    let withheld = sandbox.valve(&call);
    assert_eq!(withheld.status.code(), Some(1), "{}", shown(&withheld));
    assert!(shown(&withheld).contains("not written: new.toml") && !sandbox.path("new.toml").exists());
    let forced = sandbox.valve(&[&call[..], &["--force"]].concat());
    assert_eq!(forced.status.code(), Some(0), "{}", shown(&forced));
    assert!(sandbox.read("new.toml").contains("[[history]]"));
}

#[test]
fn values_are_withheld_wherever_physics_is_missing() {
    let sandbox = Sandbox::new();
    // Friction that the only tolerated parameter cannot stand in for: no value strays, and a lot is left.
    Recording::default().write(&sandbox, &VALVE.replace("600 N s/m", "2400 N s/m"));
    let valve = sandbox.read("valve.toml");
    let (before, _) = valve.split_once("[tolerance]").expect("tolerances");
    sandbox.write("valve.toml", &format!("{before}[tolerance]\n\"actuator.dead_volume\" = 0.5\n"));
    let told = sandbox.valve(&["calibrate", "valve.toml", "campaign.toml", "--format", "json"]);
    assert!(shown(&told).contains("\"prior_data_conflict\": false"), "{}", shown(&told));
    let withheld = sandbox.valve(&["calibrate", "valve.toml", "campaign.toml", "--out", "new.toml"]);
    assert_eq!(withheld.status.code(), Some(1), "{}", shown(&withheld));
    assert!(shown(&withheld).contains("physics is missing") && !sandbox.path("new.toml").exists());
}

#[test]
fn a_log_is_looked_at_as_it_was_read() {
    let sandbox = Sandbox::with_tables();
    let call = ["prognose", "log.csv", "--tables", "tables", "--noise", "20 ms", "--growth", "linear", "--risk", "0.1"];
    let said = String::from_utf8(sandbox.valve(&call).stdout).unwrap();
    let next = next_steps(&said).remove(0).join(" ");
    assert!(next.contains("--noise '0.02 s' --risk 0.1 --growth linear"), "{next}");
    let plain = String::from_utf8(sandbox.valve(&call[..4]).stdout).unwrap();
    let next = next_steps(&plain).remove(0).join(" ");
    assert!(next.ends_with("prognose log.csv --tables tables --plot life.svg"), "{next}");
}
