//! `valve lab`: its numbers are those of the other verbs, and nobody without the token gets any.

use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::campaign::Recording;
use crate::page::Served;
use crate::support::{Sandbox, shown};

const VALVE: &str = include_str!("../../models/testbed.toml");

const FRICTION: &str = "\n[[effect]]\nkind = \"dry-friction\"\ncoulomb_force = \"40 N\"\nstatic_force = \"55 N\"\n";

/// A valve that has dry friction, and a valve file that does not know of it.
fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    Recording::default().write(&sandbox, &format!("{VALVE}{FRICTION}"));
    sandbox
}

fn start(sandbox: &Sandbox) -> Served {
    Served::start(sandbox, &["lab", "valve.toml", "campaign.toml"])
}

fn show() -> Value {
    json!({ "runs": [0, 2], "window_s": null, "points": 500, "channel": "position" })
}

fn of_verb(sandbox: &Sandbox, arguments: &[&str]) -> Value {
    let output = sandbox.valve(arguments);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Waits for the answer of a job.
fn answer(served: &Served, kind: &str) -> Value {
    let since = Instant::now();
    loop {
        let answers = served.get("api/job").json();
        if !answers[kind].is_null() {
            return answers[kind].clone();
        }
        assert!(since.elapsed() < Duration::from_mins(5), "no answer of {kind}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn the_page_is_in_the_program_and_only_for_those_who_have_its_address() {
    let sandbox = sandbox();
    let served = start(&sandbox);
    let page = served.get("");
    assert_eq!(page.status, 200);
    assert!(page.body.contains("page.js"), "{}", page.body);
    assert!(page.head.to_lowercase().contains("content-security-policy: default-src 'none'"), "{}", page.head);
    for file in ["page.js", "style.css", "uPlot.iife.min.js", "uPlot.min.css"] {
        let answer = served.get(file);
        assert_eq!(answer.status, 200, "{file}");
        assert!(!answer.body.contains("://") || file.starts_with("uPlot"), "{file} names another place");
    }
    for path in ["/", "/api/lab", "/0123456789abcdef0123456789abcdef/api/lab"] {
        assert_eq!(served.ask_at("GET", path, "").status, 404, "{path}");
    }
    let open = sandbox.valve(&["lab", "valve.toml", "campaign.toml", "--host", "0.0.0.0"]);
    assert_eq!(open.status.code(), Some(2));
    assert!(shown(&open).contains("expected --token"), "{}", shown(&open));
}

#[test]
fn the_errors_are_those_of_compare_whatever_the_sliders_say() {
    let sandbox = sandbox();
    let served = start(&sandbox);
    let lab = served.get("api/lab").json();
    assert_eq!(lab["runs"].as_array().map(Vec::len), Some(3));
    let as_it_is = served.post("api/simulate", &json!({ "model": lab["model"], "show": show() })).json();
    let compared = of_verb(&sandbox, &["compare", "valve.toml", "campaign.toml", "--format", "json"]);
    for key in ["overall", "runs", "words"] {
        assert_eq!(as_it_is["comparison"][key], compared[key], "{key}");
    }
    let model = json!({
        "parameters": { "spring.stiffness": 15_500.0 },
        "effects": [{ "name": "dry-friction", "values": [40.0, 55.0, 0.01, 2e5, 1.0, 0.0] }],
    });
    let moved = served.post("api/simulate", &json!({ "model": model, "show": show() })).json();
    let text = VALVE.replace("stiffness = \"16 kN/m\"", "stiffness = \"15.5 kN/m\"");
    assert_ne!(text, VALVE);
    sandbox.write("moved.toml", &format!("{text}{FRICTION}"));
    let compared = of_verb(&sandbox, &["compare", "moved.toml", "campaign.toml", "--format", "json"]);
    // How closely to simulate is chosen once for the page, at the valve file's values: what it cuts short differs by a hair.
    for key in ["normalised_rms", "rmse_m", "share_of_stroke", "time_rmse_s", "close_time_error_s", "open_time_error_s"]
    {
        let [page, verb] = [&moved["comparison"], &compared].map(|one| one["overall"][key].as_f64().expect("a number"));
        assert!((page / verb - 1.0).abs() < 1e-3, "{key}: {page} for {verb}");
    }
    let measured = served.post("api/measured", &show()).json();
    for run in 0..2 {
        let times = measured["runs"][run]["time_s"].as_array().map(Vec::len);
        assert_eq!(times, moved["runs"][run]["simulated"].as_array().map(Vec::len));
        assert!(times.is_some_and(|count| (400..=502).contains(&count)), "{times:?}");
    }
}

#[test]
fn what_is_no_model_is_refused_in_words() {
    let sandbox = sandbox();
    let served = start(&sandbox);
    for (model, words) in [
        (json!({ "effects": [{ "name": "dry-frction", "values": [1.0] }] }), "dry-frction"),
        (json!({ "parameters": { "spring.stiffness": -1.0 } }), "spring.stiffness is -1"),
        (json!({ "parameters": { "spring.colour": 1.0 } }), "spring.colour"),
        (json!({ "effects": [{ "name": "dry-friction", "values": [50.0, 10.0] }] }), "at least the Coulomb force"),
    ] {
        let answer = served.post("api/simulate", &json!({ "model": model, "show": show() }));
        assert_eq!(answer.status, 422, "{}", answer.body);
        assert!(answer.json()["error"].as_str().is_some_and(|text| text.contains(words)), "{}", answer.body);
    }
    assert_eq!(served.post("api/simulate", &json!({ "model": {} })).status, 422);
    let plan = json!({ "models": [{}], "commands": [{ "at_s": 5.0, "close": true }], "end_s": 2.0,
        "supply_pressure_pa": 6e5, "temperature_k": 293.0, "leak_to_atmosphere_m2": 0.0, "leak_from_supply_m2": 0.0 });
    assert_eq!(served.post("api/predict", &plan).status, 422);
}

#[test]
fn the_band_of_a_prediction_is_what_is_open_about_it() {
    let sandbox = sandbox();
    let served = start(&sandbox);
    let stiffer = json!({ "parameters": { "spring.stiffness": 16_500.0 } });
    let slower = json!({ "parameters": { "actuator.viscous_friction": 700.0 } });
    let plan = json!({ "models": [{}, stiffer, slower], "spread": [[stiffer, slower], [], []],
        "commands": [{ "at_s": 0.0, "close": true }, { "at_s": 4.0, "close": false }], "end_s": 9.0,
        "supply_pressure_pa": 6e5, "temperature_k": 293.0, "leak_to_atmosphere_m2": 0.0, "leak_from_supply_m2": 0.0 });
    let told = served.post("api/predict", &plan).json();
    let numbers = |value: &Value| -> Vec<f64> {
        value.as_array().expect("numbers").iter().map(|one| one.as_f64().expect("a number")).collect()
    };
    let [middle, stiffer, slower] = [0, 1, 2].map(|model| numbers(&told["position_mm"][model]));
    let band = numbers(&told["band_mm"][0]);
    assert_eq!((&told["band_mm"][1], band.len()), (&Value::Null, middle.len()));
    assert!(band.iter().any(|width| *width > 0.1), "the models part");
    for at in 0..band.len() {
        let wanted = 1.645 * (stiffer[at] - middle[at]).hypot(slower[at] - middle[at]);
        assert!((band[at] - wanted).abs() < 1e-3, "{at}: {} for {wanted}", band[at]);
    }
}

#[test]
fn fits_are_those_of_calibrate_and_adopt_and_the_file_is_written_once() {
    let sandbox = sandbox();
    let served = start(&sandbox);
    assert_eq!(served.post("api/job", &json!({ "job": "fit", "model": {} })).status, 200);
    let busy = served.post("api/job", &json!({ "job": "explain" }));
    assert!(busy.status == 409 || busy.status == 200, "{}", busy.body);
    let fit = answer(&served, "fit");
    let calibrated = of_verb(&sandbox, &["calibrate", "valve.toml", "campaign.toml", "--format", "json"]);
    assert_eq!(fit["calibration"]["steps"], calibrated["steps"]);
    assert_eq!(fit["steps"], calibrated["steps"]);
    for parameter in calibrated["parameters"].as_array().expect("parameters") {
        let key = parameter["parameter"].as_str().expect("a key");
        assert_eq!(fit["model"]["parameters"][key], parameter["after"], "{key}");
    }

    let model = json!({ "effects": [{ "name": "dry-friction", "values": [40.0, 55.0, 0.01, 2e5, 1.0, 0.0] }] });
    let preview = served.post("api/preview", &model).json();
    assert_eq!(preview["changes"], true);
    let added = |line: &Value| line[0] == "+" && line[1] == "kind = \"dry-friction\"";
    assert!(preview["diff"].as_array().expect("lines").iter().any(added), "{preview}");
    let better = sandbox.path("better.toml").display().to_string();
    let written = served.post("api/write", &json!({ "model": model, "path": better, "replace": false }));
    assert_eq!(written.status, 200, "{}", written.body);
    let text = sandbox.read("better.toml");
    assert!(text.starts_with(VALVE.trim_end()), "comments and order stay");
    assert!(text.contains("action = \"added dry-friction\""), "{text}");
    // Never over anything that is there, the input first of all, without asking.
    for name in ["better.toml", "valve.toml"] {
        let path = sandbox.path(name).display().to_string();
        let again = served.post("api/write", &json!({ "model": {}, "path": path.clone(), "replace": false }));
        assert_eq!(again.json()["exists"], path, "{}", again.body);
    }
    assert_eq!(sandbox.read("valve.toml"), VALVE);
    let elsewhere = sandbox.path("log.csv").display().to_string();
    let refused = served.post("api/write", &json!({ "model": model, "path": elsewhere, "replace": true }));
    assert_eq!(refused.status, 422, "{}", refused.body);
}

#[test]
fn the_life_before_and_after_is_that_of_the_models_tables() {
    let sandbox = sandbox();
    let without = start(&sandbox);
    assert_eq!(without.get("api/lab").json()["has_log"], false);
    let refused = without.post("api/lives", &json!({}));
    assert!(refused.status == 422 && refused.body.contains("--log"), "{}", refused.body);

    let served = Served::start(&sandbox, &["lab", "valve.toml", "campaign.toml", "--log", "log.csv"]);
    assert_eq!(served.get("api/lab").json()["has_log"], true);
    let model = json!({ "parameters": { "spring.stiffness": 15_000.0 } });
    let lives = served.post("api/lives", &model).json();
    let names: Vec<&Value> = lives["models"].as_array().expect("models").iter().map(|one| &one["model"]).collect();
    assert_eq!(names, ["valve file", "sliders"]);
    let last = |model: usize| lives["models"][model]["told"][3].clone();
    sandbox.write("moved.toml", &VALVE.replace("stiffness = \"16 kN/m\"", "stiffness = \"15 kN/m\""));
    for (model, file) in [(0, "valve.toml"), (1, "moved.toml")] {
        let tables = format!("tables-{model}");
        let built = sandbox.valve(&["build-tables", file, "--out", &tables]);
        assert_eq!(built.status.code(), Some(0), "{}", shown(&built));
        let output = sandbox.valve(&["prognose", "log.csv", "--tables", &tables, "--format", "jsonl"]);
        let text = String::from_utf8(output.stdout).expect("text");
        let told: Value = serde_json::from_str(text.lines().last().expect("a row")).expect("JSON");
        // The page is told four digits.
        let [page, program] = [&last(model), &told].map(|told| told["eol_cycle"].as_f64().expect("an end of life"));
        assert!((page - program).abs() < 0.01, "{file}: {page} for {program}");
    }
    assert_ne!(last(0)["eol_cycle"], last(1)["eol_cycle"]);
}

#[test]
fn files_that_change_are_read_again_and_broken_ones_are_not() {
    let sandbox = sandbox();
    let served = start(&sandbox);
    let version = |served: &Served| served.get("api/lab").json()["version"].as_u64().expect("a number");
    assert_eq!(version(&served), 1);
    // The first look at the files is behind by then.
    std::thread::sleep(Duration::from_millis(1200));
    let wait_for = |wanted: &dyn Fn() -> bool| {
        let since = Instant::now();
        while !wanted() {
            assert!(since.elapsed() < Duration::from_secs(30), "nothing happened");
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    sandbox.write("valve.toml", &VALVE.replace("stiffness = \"16 kN/m\"", "stiffness = \"17 kN/m\""));
    wait_for(&|| version(&served) == 2);
    sandbox.write("valve.toml", "name = 3");
    std::thread::sleep(Duration::from_millis(2500));
    assert_eq!(version(&served), 2, "what was read before stays");
    sandbox.write("valve.toml", VALVE);
    wait_for(&|| version(&served) == 3);
}

/// Drives the page in headless Chromium: `crates/lab/web/test/lab.mjs`.
#[test]
#[ignore = "needs node, Chromium and `npm ci` in crates/lab/web; .ci/run does that and runs it"]
fn a_browser_finds_the_missing_friction() {
    let sandbox = sandbox();
    let served = Served::start(&sandbox, &["lab", "valve.toml", "campaign.toml", "--log", "log.csv"]);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/crates/lab/web/test/lab.mjs");
    let driven = Command::new("node").arg(script).arg(&served.url).arg(sandbox.path("")).output().expect("node runs");
    assert!(driven.status.success(), "{}", shown(&driven));
    assert!(sandbox.read("found.toml").contains("dry-friction"));
}

/// Drives the page in headless Chromium while its files change and its program is killed: `crates/lab/web/test/changes.mjs`.
#[test]
#[ignore = "needs node, Chromium and `npm ci` in crates/lab/web; .ci/run does that and runs it"]
fn a_browser_outlives_its_files_and_its_program() {
    let sandbox = Sandbox::new();
    let supplies_psig = (0..50).map(|run| 55.0 + 0.8 * f64::from(run)).collect();
    Recording { supplies_psig, ..Recording::default() }.write(&sandbox, &format!("{VALVE}{FRICTION}"));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/crates/lab/web/test/changes.mjs");
    let mut node = Command::new("node");
    let driven = node.arg(script).arg(env!("CARGO_BIN_EXE_valve")).arg(sandbox.path("")).output().expect("node runs");
    assert!(driven.status.success(), "{}", shown(&driven));
}
