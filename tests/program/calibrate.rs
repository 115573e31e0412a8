//! `valve calibrate` on campaigns whose truth is known.

use serde_json::Value;

use crate::campaign::Recording;
use crate::support::{Sandbox, shown};

const VALVE: &str = include_str!("../../models/testbed.toml");

const TOLERANCES: &str = "
[tolerance]  # what is not known exactly
\"actuator.viscous_friction\" = 0.20
\"actuator.dead_volume\" = 0.10
\"spring.preload_compression\" = 0.03
\"pneumatics.solenoid_orifice_area\" = 0.05
";

/// A stroke at each of these tells how strokes differ, though none is repeated.
const SUPPLIES_PSIG: [f64; 6] = [55.0, 65.0, 75.0, 85.0, 95.0, 105.0];

fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    let text = match VALVE.find("[tolerance]") {
        Some(_) => VALVE.to_owned(),
        None => format!("{VALVE}{TOLERANCES}"),
    };
    sandbox.write("valve.toml", &text);
    sandbox
}

fn calibrated(sandbox: &Sandbox) -> Value {
    let output = sandbox.valve(&["calibrate", "valve.toml", "campaign.toml", "--format", "json"]);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn changed_parameters_are_found_and_the_rest_is_noise() {
    let sandbox = sandbox();
    let changed = VALVE.replace("600 N s/m", "690 N s/m").replace("\"0.5 mm2\"", "\"0.48 mm2\"");
    Recording::default().write(&sandbox, &changed);
    let answer = calibrated(&sandbox);
    assert_eq!(answer["verdict"], "explained", "{}", answer["reasons"]);
    let steps = answer["steps"].as_array().unwrap();
    assert_eq!([&steps[0]["step"], &steps[1]["step"]], ["datasheet", "calibrated"]);
    assert!(steps[0]["normalised_rms"].as_f64().unwrap() > 3.0, "{steps:?}");
    assert!((steps[1]["normalised_rms"].as_f64().unwrap() - 1.0).abs() < 0.05, "{steps:?}");
    assert!((steps[1]["held_out_normalised_rms"].as_f64().unwrap() - 1.0).abs() < 0.1, "{steps:?}");
    for (key, truth) in [("actuator.viscous_friction", 690.0), ("pneumatics.solenoid_orifice_area", 0.48e-6)] {
        let found = answer["parameters"].as_array().unwrap().iter().find(|one| one["parameter"] == key).unwrap();
        let (after, error) = (found["after"].as_f64().unwrap(), found["standard_error"].as_f64().unwrap());
        assert!((after - truth).abs() < 3.0 * error, "{found}");
        assert!(error < 0.1 * truth, "{found}");
    }
}

#[test]
fn strokes_that_differ_are_no_missing_physics() {
    let sandbox = sandbox();
    Recording { supplies_psig: SUPPLIES_PSIG.to_vec(), scatter: 1.0, ..Recording::default() }.write(&sandbox, VALVE);
    let answer = calibrated(&sandbox);
    // What no nuisance has the form of is a small model error, and no missing physics.
    assert_ne!(answer["verdict"], "beyond-tolerance", "{}", answer["reasons"]);
    assert!(answer["steps"][1]["model_error_share_of_stroke"].as_f64().unwrap() < 3e-3, "{}", answer["steps"]);
    for found in answer["parameters"].as_array().unwrap() {
        let (before, after) = (found["before"].as_f64().unwrap(), found["after"].as_f64().unwrap());
        let error = found["standard_error"].as_f64().unwrap();
        assert!((after - before).abs() < 3.5 * error, "nothing was changed: {found}");
    }
}

#[test]
fn missing_physics_is_not_success() {
    let sandbox = sandbox();
    let friction = format!("{VALVE}\n[[effect]]\nkind = \"dry-friction\"\ncoulomb_force = \"40 N\"\n");
    Recording::default().write(&sandbox, &friction);
    let answer = calibrated(&sandbox);
    assert_eq!(answer["verdict"], "beyond-tolerance");
    assert!(answer["steps"][1]["model_error_share_of_stroke"].as_f64().unwrap() > 1e-3);
    let output = sandbox.valve(&["calibrate", "valve.toml", "campaign.toml"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("something beyond the tolerances is there"), "{text}");
}

#[test]
fn the_new_file_keeps_comments_and_can_be_reverted() {
    let sandbox = sandbox();
    let changed = VALVE.replace("600 N s/m", "690 N s/m");
    Recording { supplies_psig: vec![65.0, 85.0], ..Recording::default() }.write(&sandbox, &changed);
    let call = ["calibrate", "valve.toml", "campaign.toml", "--out", "new.toml"];
    assert_eq!(sandbox.valve(&call).status.code(), Some(0));
    let (old, new) = (sandbox.read("valve.toml"), sandbox.read("new.toml"));
    assert!(new.contains("[[history]]") && new.contains("campaign = \"recorded\""), "{new}");
    for comment in old.lines().filter_map(|line| line.split_once('#')).map(|(_, comment)| comment) {
        assert!(new.contains(comment), "lost: {comment}");
    }
    let again = sandbox.valve(&call);
    assert_eq!(again.status.code(), Some(2), "{}", shown(&again));
    assert_eq!(sandbox.read("new.toml"), new, "an existing file is not replaced unasked");
    let back = sandbox.valve(&["revert", "new.toml", "--out", "back.toml"]);
    assert_eq!(back.status.code(), Some(0), "{}", shown(&back));
    assert_eq!(sandbox.read("back.toml").trim_end(), old.trim_end());
}

#[test]
fn nothing_to_calibrate_is_said() {
    let sandbox = Sandbox::new();
    let bare = VALVE.split("[tolerance]").next().unwrap();
    sandbox.write("valve.toml", bare);
    Recording { supplies_psig: vec![75.0], ..Recording::default() }.write(&sandbox, VALVE);
    let output = sandbox.valve(&["calibrate", "valve.toml", "campaign.toml"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("[tolerance]"), "{}", shown(&output));
}
