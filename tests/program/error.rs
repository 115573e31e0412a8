//! One error: the same step of the same campaign has the same numbers in every verb, document, report and history.

use serde_json::Value;

use crate::support::{Sandbox, shown};

/// The words for an error, in every document.
const KEYS: [&str; 4] = ["normalised_rms", "rmse_m", "share_of_stroke", "time_rmse_s"];

fn answer(sandbox: &Sandbox, call: &[&str]) -> Value {
    let mut call = call.to_vec();
    call.extend(["--format", "json"]);
    let output = sandbox.valve(&call);
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", shown(&output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} in {value:#}"))
}

/// Whether two errors are the same, to a share.
#[track_caller]
fn assert_same(one: &Value, other: &Value, share: f64) {
    for key in KEYS {
        let (a, b) = (number(one, key), number(other, key));
        assert!((a / b - 1.0).abs() <= share, "{key}: {a} and {b}");
    }
}

/// The errors of the last step of a valve file's history.
fn history(sandbox: &Sandbox, file: &str) -> [f64; 2] {
    let text = sandbox.read(file);
    let last = &text[text.rfind("[[history]]").expect("a history")..];
    ["error_before = ", "error_after = "].map(|key| {
        let rest = &last[last.find(key).expect("an error") + key.len()..];
        rest.lines().next().and_then(|line| line.parse().ok()).expect("a number")
    })
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn a_step_has_one_error_in_all_verbs_reports_and_histories() {
    let sandbox = Sandbox::new();
    sandbox.copy_sticking_valve("");
    let (valve, campaign) = ("valve.toml", "campaign.toml");

    let compared = answer(&sandbox, &["compare", valve, campaign]);
    let calibrated = answer(&sandbox, &["calibrate", valve, campaign, "--force", "--out", "calibrated.toml"]);
    let explained = answer(&sandbox, &["explain", valve, campaign]);
    let effect = explained["recommended"][0].as_str().expect("an effect");
    let adopted = answer(&sandbox, &["adopt", valve, campaign, "--effect", effect, "--out", "better.toml"]);

    // The file as it is, and calibrated: to the last digit.
    let datasheet = &compared["overall"];
    for (step, name) in ["datasheet", "calibrated"].into_iter().enumerate() {
        let first = &calibrated["steps"][step];
        assert_eq!(first["step"], name);
        assert_eq!(first, &explained["steps"][step]);
        assert_eq!(first, &adopted["steps"][step]);
    }
    assert_same(&calibrated["steps"][0], datasheet, 0.0);

    // With the effect: `explain` and `adopt` come to it by ways of their own.
    let [found, taken] = [&explained, &adopted].map(|one| &one["steps"][2]);
    assert_eq!([&found["step"], &taken["step"]], [effect, effect]);
    // Stroke times with dry friction answer to the smallest change of a fit with some hundredths of a millisecond.
    assert_same(found, taken, 0.1);

    // What was written leaves what was promised, once instruments are allowed for again.
    for (file, step) in [("calibrated.toml", &calibrated["steps"][1]), ("better.toml", taken)] {
        let again = answer(&sandbox, &["compare", file, campaign]);
        for key in ["normalised_rms", "rmse_m"] {
            let (a, b) = (number(&again["allowing_for_instruments"], key), number(step, key));
            // A calibrated file stands in for a friction that it lacks: another fit of the instruments beside it may take
            // a tenth more or less.
            assert!((a / b - 1.0).abs() < 0.15, "{file}, {key}: {a} for {b}");
        }
    }

    // Histories.
    let rms = |step: &Value| number(step, "normalised_rms");
    for (file, last) in [("calibrated.toml", &calibrated["steps"][1]), ("better.toml", taken)] {
        let [before, after] = history(&sandbox, file);
        assert!((before / rms(datasheet) - 1.0).abs() < 1e-6, "{file}: {before}");
        assert!((after / rms(last) - 1.0).abs() < 1e-6, "{file}: {after}");
    }

    // Text and report tell the same line.
    let told = |call: &[&str], key: &str| -> String {
        let output = sandbox.valve(call);
        let text = String::from_utf8_lossy(&output.stdout).replace('\n', " ");
        let from = text.find(key).unwrap_or_else(|| panic!("{key} in {text}")) + key.len();
        text[from..].split(" times the noise").next().expect("a line").split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let line = told(&["compare", valve, campaign], "error: ");
    let allowing = told(&["compare", valve, campaign], "may be off by: ");
    let left = told(&["calibrate", valve, campaign], "left: ");
    let output = sandbox.valve(&["report", valve, "--campaign", campaign, "--out", "report.html"]);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let report = sandbox.read("report.html");
    assert!(report.contains(&format!("error: {line} times the noise")), "{line}");
    assert!(report.contains(&format!("may be off by: {allowing} times the noise")), "{allowing}");
    assert!(report.contains(&format!("left: {left} times the noise")), "{left}");
    for step in explained["steps"].as_array().expect("steps") {
        assert!(report.contains(&format!("{:.3}", rms(step))), "{step:#}");
    }
}
