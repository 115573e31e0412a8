//! `valve compare` on campaigns whose truth is known.

use serde_json::Value;

use crate::campaign::Recording;
use crate::support::{Sandbox, shown};

const VALVE: &str = include_str!("../../models/testbed.toml");

fn compared(sandbox: &Sandbox, more: &[&str]) -> Value {
    let mut call = vec!["compare", "valve.toml", "campaign.toml", "--format", "json"];
    call.extend(more);
    let output = sandbox.valve(&call);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn with_effect(effect: &str) -> String {
    format!("{VALVE}\n[[effect]]\n{effect}\n")
}

#[test]
fn a_right_model_leaves_the_noise() {
    let sandbox = Sandbox::new();
    Recording::default().write(&sandbox, VALVE);
    let answer = compared(&sandbox, &[]);
    let overall = &answer["overall"];
    let size = overall["normalised_rms"].as_f64().unwrap();
    assert!((size - 1.0).abs() < 0.03, "{size}");
    // Rows are means of samples, whose noise is 30 um each.
    assert!((3e-6..3e-5).contains(&overall["rmse_m"].as_f64().unwrap()), "{overall}");
    assert!(overall["time_rmse_s"].as_f64().unwrap() < 1e-3, "{overall}");
    assert_eq!(overall["noise_source"], "stated");
    assert!(overall["close_time_error_s"].as_f64().unwrap().abs() < 3e-3);
    assert_eq!(answer["runs"].as_array().unwrap().len(), 3);
    assert_eq!(answer["runs"][0]["file"], "run-1.csv");
    assert!(answer["findings"].as_array().unwrap().is_empty(), "{}", answer["words"]);
    let shares: f64 = ["closing", "opening"]
        .iter()
        .flat_map(|direction| overall["phases"][direction].as_object().unwrap().values())
        .map(|phase| phase["share"].as_f64().unwrap())
        .sum();
    assert!((shares - 1.0).abs() < 1e-9, "{shares}");
}

#[test]
fn stated_noise_that_the_record_contradicts_is_told_and_the_records_own_counts() {
    let sandbox = Sandbox::new();
    Recording::default().write(&sandbox, VALVE);
    let sound = compared(&sandbox, &[]);
    assert!(!sound["doubts"].to_string().contains("noise"), "{}", sound["doubts"]);
    let campaign = sandbox.read("campaign.toml").replace("position_noise = \"0.03 mm\"", "position_noise = \"0.03 m\"");
    sandbox.write("campaign.toml", &campaign);
    let output = sandbox.valve(&["compare", "valve.toml", "campaign.toml"]);
    let told = String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        told.contains(": position_noise is stated as 30 mm, 1000 times more than what the recordings show:"),
        "{told}"
    );
    let answer = compared(&sandbox, &[]);
    assert_eq!(answer["overall"]["noise_source"], "estimated");
    let size = answer["overall"]["normalised_rms"].as_f64().unwrap();
    assert!((size - 1.0).abs() < 0.05, "{size}");
    assert!(answer["doubts"].to_string().contains("position_noise is stated as 30 mm"), "{}", answer["doubts"]);
}

#[test]
fn strokes_that_only_the_model_finishes_are_told_of_once() {
    let sandbox = Sandbox::new();
    let jammed = "kind = \"dry-friction\"\ncoulomb_force = \"900 N\"\nstatic_force = \"900 N\"";
    Recording::default().write(&sandbox, &with_effect(jammed));
    let answer = compared(&sandbox, &[]);
    let words = answer["words"].as_array().unwrap();
    let count = |part: &str| words.iter().filter(|word| word.as_str().unwrap().contains(part)).count();
    assert_eq!(count("closing: the model gets there, the valve does not, in 2 of 3 strokes (run-1.csv, run-2.csv)"), 1);
    assert_eq!(count("opening: the model gets there, the valve does not, in 2 of 3 strokes (run-2.csv, run-3.csv)"), 1);
    assert_eq!(count("gets there"), 2, "{words:?}");
}

#[test]
fn a_late_solenoid_is_found_in_the_dead_time() {
    let sandbox = Sandbox::new();
    let lag = "kind = \"solenoid-lag\"\nenergise_delay = \"5 ms\"\ndeenergise_delay = \"49 ms\"";
    Recording::default().write(&sandbox, &with_effect(lag));
    let answer = compared(&sandbox, &[]);
    let worst = &answer["findings"][0];
    assert_eq!(worst["direction"], "opening");
    assert_eq!(worst["phase"], "dead_time");
    assert!((worst["time_error_s"].as_f64().unwrap() - 0.049).abs() < 2e-3, "{worst}");
    let words = worst["words"].as_str().unwrap();
    assert!(words.contains("the model breaks away") && words.contains("ms early"), "{words}");
    assert!(words.contains("the rest of the stroke is then right"), "{words}");
}

#[test]
fn an_error_that_grows_with_supply_pressure_is_said_to() {
    let sandbox = Sandbox::new();
    Recording { supplies_psig: vec![55.0, 65.0, 75.0, 85.0, 95.0], ..Recording::default() }
        .write(&sandbox, &with_effect("kind = \"gas-heating\"\nwall_conductance = \"0.15 W/K\""));
    let answer = compared(&sandbox, &[]);
    let opening = answer["findings"].as_array().unwrap().iter().find(|one| one["direction"] == "opening").unwrap();
    assert_eq!(opening["phase"], "dead_time");
    assert!(opening["words"].as_str().unwrap().contains("grows with supply pressure"), "{opening}");
}

#[test]
fn fail_above_decides_the_exit_code_and_against_stands_beside() {
    let sandbox = Sandbox::new();
    let other = VALVE.replace("600 N s/m", "900 N s/m");
    sandbox.write("other.toml", &other);
    Recording::default().write(&sandbox, &other);
    let call = ["compare", "valve.toml", "campaign.toml", "--fail-above", "1.5"];
    assert_eq!(sandbox.valve(&call).status.code(), Some(1));
    let answer = compared(&sandbox, &["--against", "other.toml"]);
    assert!(answer["overall"]["normalised_rms"].as_f64().unwrap() > 2.0);
    assert!(answer["against"]["overall"]["normalised_rms"].as_f64().unwrap() < 1.03);
    let fine = ["compare", "other.toml", "campaign.toml", "--fail-above", "1.5"];
    assert_eq!(sandbox.valve(&fine).status.code(), Some(0));
}

#[test]
fn missing_friction_and_push_are_read_from_the_motion() {
    let sandbox = Sandbox::new();
    let friction = "kind = \"dry-friction\"\ncoulomb_force = \"40 N\"";
    Recording { supplies_psig: vec![75.0], ..Recording::default() }.write(&sandbox, &with_effect(friction));
    let answer = compared(&sandbox, &["--residual-force", "--plot-force", "force.svg", "--plot-signature", "s.svg"]);
    let places = answer["residual_force"]["along_stroke"].as_array().unwrap();
    assert!(places.len() > 15);
    for place in places {
        assert!((place["friction_n"].as_f64().unwrap() - 40.0).abs() < 2.0, "{place}");
        assert!(place["push_n"].as_f64().unwrap().abs() < 2.0, "{place}");
    }
    let signature = &answer["signature"];
    let dry = signature["friction_n"].as_f64().unwrap() - signature["viscous_n"].as_f64().unwrap();
    assert!((dry - 40.0).abs() < 3.0, "{signature}");
    assert!(sandbox.read("force.svg").starts_with("<svg"));

    Recording::default().write(&sandbox, VALVE);
    let answer = compared(&sandbox, &["--residual-force"]);
    for place in answer["residual_force"]["along_stroke"].as_array().unwrap() {
        let band = 4.0 * place["standard_error_n"].as_f64().unwrap();
        assert!(place["friction_n"].as_f64().unwrap().abs() < band + 0.3, "{place}");
        assert!(place["push_n"].as_f64().unwrap().abs() < band + 0.3, "{place}");
    }
}

#[test]
fn rows_too_far_apart_tell_no_missing_force_and_that_is_said() {
    let sandbox = Sandbox::new();
    Recording { supplies_psig: vec![75.0], ..Recording::default() }.write(&sandbox, VALVE);
    let kept = |(index, _): &(usize, &str)| index % 100 == 0 || *index == 1;
    let trace = sandbox.read("run-1.csv");
    let rows: Vec<&str> = trace.lines().enumerate().filter(kept).map(|(_, line)| line).collect();
    sandbox.write("run-1.csv", &(rows.join("\n") + "\n"));
    let told = sandbox.valve(&["compare", "valve.toml", "campaign.toml", "--residual-force"]);
    let words = String::from_utf8_lossy(&told.stdout).split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(told.status.code(), Some(0));
    assert!(words.contains("too short to tell a missing force, or their rows too far apart: strokes that"), "{words}");
    assert!(!words.contains("describe what is missing"), "{words}");
}

#[test]
fn stroke_times_alone_are_compared() {
    let sandbox = Sandbox::new();
    let times = "supply_pressure_psig,close_time_s,open_time_s\n75,1.0422,2.1344\n75,1.0452,2.1314\n60,1.3,\n";
    sandbox.write("times.csv", times);
    let campaign = "name = \"times\"\n[sensors]\ntiming_noise = \"3 ms\"\n[timings]\nfile = \"times.csv\"\n";
    sandbox.write("campaign.toml", campaign);
    let answer = compared(&sandbox, &[]);
    assert_eq!(answer["runs"][0]["file"], "stroke times, lines 2 to 3");
    assert!(answer["runs"][0]["normalised_rms"].as_f64().unwrap() < 1.5, "{}", answer["runs"][0]);
    assert!(answer["overall"]["rmse_m"].is_null());
    let words = answer["words"].to_string();
    assert!(words.contains("the model gets there, the valve does not"), "{words}");
    let refused = sandbox.valve(&["compare", "valve.toml", "campaign.toml", "--plot", "o.svg"]);
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn bad_campaigns_are_refused_or_warned_of() {
    let sandbox = Sandbox::new();
    Recording { supplies_psig: vec![75.0], ..Recording::default() }.write(&sandbox, VALVE);
    let good = sandbox.read("campaign.toml");
    let trace = sandbox.read("run-1.csv");
    let rows = |change: &dyn Fn(&str, f64, &str, f64) -> String| -> String {
        let mut text = String::from("time_s,command,position_mm\n");
        for line in trace.lines().skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            text.push_str(&change(cells[0], cells[0].parse().unwrap(), cells[1], cells[2].parse().unwrap()));
            text.push('\n');
        }
        text
    };
    let told = |name: &str, campaign: &str, trace: &str| {
        sandbox.write("campaign.toml", campaign);
        sandbox.write("run-1.csv", trace);
        let output = sandbox.valve(&["compare", "valve.toml", "campaign.toml"]);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!stderr.is_empty(), "{name}: nothing was said");
        (output.status.code(), stderr)
    };
    let errors: [(&str, String, String, &str); 7] = [
        ("missing file", good.replace("run-1.csv", "gone.csv"), trace.clone(), "gone.csv"),
        ("wrong unit", good.replace("0.03 mm", "0.03 psig"), trace.clone(), "psig"),
        ("one file twice", format!("{good}\n[[run]]\nfile = \"run-1.csv\"\n"), trace.clone(), "run in line"),
        ("time backwards", good.clone(), rows(&|_, time, c, x| format!("{:.3},{c},{x}", (time - 3.0).abs())), "time"),
        ("command constant", good.clone(), rows(&|t, _, _, x| format!("{t},0,{x}")), "command"),
        ("all NaN", good.clone(), rows(&|t, _, c, _| format!("{t},{c},NaN")), "position"),
        ("inches", good.clone(), rows(&|t, _, c, x| format!("{t},{c},{:.5}", x / 25.4)), "inches"),
    ];
    for (name, campaign, trace, expected) in &errors {
        let (code, stderr) = told(name, campaign, trace);
        assert_eq!(code, Some(2), "{name}");
        assert!(stderr.contains(expected), "{name}: {stderr}");
    }
    let warnings: [(&str, String, &str); 2] = [
        ("no motion", rows(&|t, _, c, x| format!("{t},{c},{:.4}", 25.9 + 1e-4 * x)), "no motion"),
        ("clipped", rows(&|t, _, c, x| format!("{t},{c},{:.4}", x.clamp(1.5, 24.0))), "clipped"),
    ];
    for (name, trace, expected) in &warnings {
        let (code, stderr) = told(name, &good, trace);
        assert_eq!(code, Some(0), "{name}: {stderr}");
        assert!(stderr.contains(expected), "{name}: {stderr}");
    }
}

#[test]
fn a_run_whose_conditions_were_not_all_stated_is_named() {
    let sandbox = Sandbox::new();
    let supplies_psig = vec![60.0, 65.0, 70.0, 75.0, 85.0, 90.0, 50.0, 97.0];
    Recording { supplies_psig, ..Recording::default() }.write(&sandbox, VALVE);
    let campaign = sandbox.read("campaign.toml");
    // Of the last two nobody says that the regulator had been turned, once down and once up.
    sandbox
        .write("campaign.toml", &campaign.replace("\"50 psig\"", "\"72 psig\"").replace("\"97 psig\"", "\"72 psig\""));
    let answer = compared(&sandbox, &[]);
    let words = answer["words"].to_string();
    assert!(words.contains("run-7.csv is off most, its closing time by +"), "{words}");
    assert!(words.contains("are its conditions all stated"), "{words}");
}
