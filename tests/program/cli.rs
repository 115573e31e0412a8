//! What the program prints: exit code, stdout and stderr of whole calls.

use crate::support::{self, Sandbox, shown};

#[test]
fn nominal_cycle_as_text() {
    let sandbox = Sandbox::new();
    insta::assert_snapshot!(shown(&sandbox.valve(&["simulate", "valve.toml"])));
}

#[test]
fn leaking_cycles_as_json() {
    let sandbox = Sandbox::new();
    let call = ["simulate", "valve.toml", "--cycles", "2", "--leak-from-supply", "0.05 mm2", "--format", "json"];
    let output = sandbox.valve(&call);
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let cycles = answer["cycles"].as_array().unwrap();
    assert_eq!(cycles.len(), 2);
    for cycle in cycles {
        assert!(cycle["close_time_s"].as_f64().unwrap() < 1.04, "such a leak closes faster: {cycle}");
        assert!(cycle["open_time_s"].as_f64().unwrap() > 2.14, "and opens slower: {cycle}");
    }
}

#[test]
fn a_stalled_valve_is_an_answer() {
    let sandbox = Sandbox::new();
    let call = ["simulate", "valve.toml", "--leak-to-atmosphere", "2 mm2", "--format", "json"];
    let output = sandbox.valve(&call);
    assert_eq!(output.status.code(), Some(0));
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(answer["cycles"][0]["close_time_s"].is_null());
}

#[test]
fn trace_and_plot_are_written() {
    let sandbox = Sandbox::new();
    let output = sandbox.valve(&["simulate", "valve.toml", "--trace", "cycle.csv", "--plot", "cycle.png"]);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let trace = sandbox.read("cycle.csv");
    let mut rows = trace.lines();
    assert_eq!(rows.next(), Some("time_s,command,position_mm,chamber_pressure_kpa,pipe_pressure_kpa"));
    assert_eq!(trace.lines().count(), 12_002, "a row a millisecond from 0 to 12 s, and the header");
    assert!(sandbox.bytes("cycle.png").starts_with(b"\x89PNG"));
    assert_eq!(sandbox.names(), ["cycle.csv", "cycle.png", "log.csv", "valve.toml"], "no staged file may stay");
}

#[test]
fn effects_are_listed_and_explained() {
    let sandbox = Sandbox::new();
    insta::assert_snapshot!("effects", shown(&sandbox.valve(&["effects"])));
    insta::assert_snapshot!("effect", shown(&sandbox.valve(&["effects", "dry-friction"])));
}

#[test]
fn every_effect_can_be_explained() {
    let sandbox = Sandbox::new();
    let listed = sandbox.valve(&["effects", "--format", "json"]);
    let listed: serde_json::Value = serde_json::from_slice(&listed.stdout).unwrap();
    for effect in listed["effects"].as_array().unwrap() {
        let id = effect["id"].as_str().unwrap();
        let output = sandbox.valve(&["effects", id, "--format", "json"]);
        assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    }
}

#[test]
fn wrong_calls_say_what_would_be_right() {
    let sandbox = Sandbox::new();
    sandbox.write("wrong-unit.toml", &sandbox.read("valve.toml").replace("25.4 mm", "25.4 psig"));
    let calls: [&[&str]; 8] = [
        &["simulate", "missing.toml"],
        &["simulate", "wrong-unit.toml"],
        &["simulate", "valve.toml", "--leak-to-atmosphere", "0.1 mm"],
        &["simulate", "valve.toml", "--leak-to-atmosphere", "-0.1 mm2"],
        &["simulate", "valve.toml", "--supply-pressure", "75 psi"],
        &["simulate", "valve.toml", "--plot", "cycle.pdf"],
        &["simulate", "valve.toml", "--trace", "nowhere/cycle.csv"],
        &["effects", "dry-frction"],
    ];
    let answers: Vec<String> =
        calls.iter().map(|call| format!("$ valve {}\n{}", call.join(" "), shown(&sandbox.valve(call)))).collect();
    insta::assert_snapshot!(answers.join("\n"));
    assert_eq!(sandbox.names(), ["log.csv", "valve.toml", "wrong-unit.toml"], "a refused call leaves nothing behind");
}

#[test]
fn help_names_every_verb_and_an_example_for_each() {
    let sandbox = Sandbox::new();
    insta::assert_snapshot!(shown(&sandbox.valve(&["--help"])));
    for verb in support::verbs() {
        let help = sandbox.valve(&[verb, "--help"]);
        let text = String::from_utf8(help.stdout).unwrap();
        assert!(text.contains("Example"), "`valve {verb} --help` shows no example:\n{text}");
    }
}

#[test]
fn completions_and_manual_come_from_the_same_definition() {
    let sandbox = Sandbox::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = String::from_utf8(sandbox.valve(&["completions", shell]).stdout).unwrap();
        assert!(script.contains("leak-to-atmosphere"), "{shell}");
    }
    let page = String::from_utf8(sandbox.valve(&["man"]).stdout).unwrap();
    assert!(page.starts_with(".ie"), "{page:.40}");
    assert_eq!(sandbox.valve(&["man", "pages"]).status.code(), Some(0));
    assert!(sandbox.read("pages/valve-simulate.1").contains("leak"));
}

#[test]
fn a_formula_that_is_no_number_gives_no_times() {
    let sandbox = Sandbox::new();
    let effect = |formula: &str| {
        format!("\n[[effect]]\nkind = \"custom\"\nname = \"odd\"\nacts_on = \"force\"\nformula = \"{formula}\"\n")
    };
    let valve = sandbox.read("valve.toml");
    sandbox.write("always.toml", &format!("{valve}{}", effect("sqrt(x - 10)")));
    let refused = sandbox.valve(&["simulate", "always.toml"]);
    assert_eq!((refused.status.code(), refused.stdout.len()), (Some(2), 0), "{}", shown(&refused));
    assert!(shown(&refused).contains("formula of \"odd\" is no number"), "{}", shown(&refused));
    // A number at the valve's own supply, and none at another: neither a stroke time nor "not reached" is known there.
    sandbox.write("seldom.toml", &format!("{valve}{}", effect("0 * sqrt(p_s - 5e5)")));
    let fine = sandbox.valve(&["simulate", "seldom.toml"]);
    assert_eq!(fine.status.code(), Some(0), "{}", shown(&fine));
    let refused = sandbox.valve(&["simulate", "seldom.toml", "--supply-pressure", "50 psig", "--trace", "t.csv"]);
    assert_eq!((refused.status.code(), refused.stdout.len()), (Some(2), 0), "{}", shown(&refused));
    assert!(shown(&refused).contains("no stroke time is known under these conditions"), "{}", shown(&refused));
    assert!(!sandbox.path("t.csv").exists());
}

#[test]
fn temperatures_below_zero_are_values_and_no_options() {
    let sandbox = Sandbox::new();
    let simulated = sandbox.valve(&["simulate", "valve.toml", "--temperature", "-20 degC"]);
    assert_eq!(simulated.status.code(), Some(0), "{}", shown(&simulated));
    let built = ["build-tables", "valve.toml", "--out", "cold", "--wear", "leaks", "--temperature-range", "-5..5 K"];
    let refused = sandbox.valve(&built);
    assert_eq!(refused.status.code(), Some(2));
    assert!(shown(&refused).contains("-5"), "{}", shown(&refused));
    assert!(!shown(&refused).contains("unexpected argument"), "{}", shown(&refused));
}
