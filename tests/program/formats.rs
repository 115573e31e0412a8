//! Recordings in recorders' own files: the same answers as on text.

use serde_json::Value;

use crate::support::{Sandbox, shown};

#[path = "../../crates/column-source/tests/made/tdms.rs"]
#[expect(dead_code, reason = "other tests write more")]
mod tdms;

#[cfg(feature = "mat73")]
#[path = "../../crates/column-source/tests/made/hdf5.rs"]
#[expect(dead_code, reason = "other tests write more")]
mod hdf5;

const VALVE: &str = include_str!("../../data/sticking-valve/valve.toml");
const CAMPAIGN: &str = include_str!("../../data/sticking-valve/campaign.toml");
const TRACES: [&str; 4] = [
    include_str!("../../data/sticking-valve/traces/run-1.csv"),
    include_str!("../../data/sticking-valve/traces/run-2.csv"),
    include_str!("../../data/sticking-valve/traces/run-3.csv"),
    include_str!("../../data/sticking-valve/traces/run-4.csv"),
];

/// The columns of a trace: time, command and position.
fn columns(text: &str) -> [Vec<f64>; 3] {
    let mut columns = [Vec::new(), Vec::new(), Vec::new()];
    for line in text.lines().filter(|line| line.starts_with(|first: char| first.is_ascii_digit())) {
        for (column, field) in columns.iter_mut().zip(line.split(',')) {
            column.push(field.parse().expect("a number"));
        }
    }
    columns
}

/// A trace as a waveform, its command as zeros and ones, and a group of something else before it.
fn as_tdms(text: &str) -> Vec<u8> {
    use tdms::{Data, Object, PLAIN, Value};

    let [time_s, command, position_mm] = columns(text);
    let sampled = |channel: Object| {
        channel.with("wf_increment", Value::Number(0.004)).with("wf_start_offset", Value::Number(time_s[0]))
    };
    let command = command.iter().map(|one| u8::from(*one > 0.5)).collect();
    let objects = [
        Object::channel("Noise", "microphone", Data::Single(vec![0.5; 20_000])),
        sampled(Object::channel("Bench", "command", Data::Boolean(command))),
        sampled(Object::channel("Bench", "position", Data::Double(position_mm))).with("unit_string", Value::Text("mm")),
    ];
    tdms::segment(&objects, PLAIN)
}

/// A trace as MATLAB writes it with -v7.3.
#[cfg(feature = "mat73")]
fn as_mat73(text: &str) -> Vec<u8> {
    let [time_s, command, position_mm] = columns(text);
    let [time_s, command, position_mm] = [time_s, command, position_mm].map(|values| hdf5::Member::vector(&values));
    hdf5::file(&[("time_s", time_s), ("command", command), ("position_mm", position_mm)])
}

/// What `compare` says of the sample campaign.
fn compared(sandbox: &Sandbox, campaign: &str) -> Value {
    let output = sandbox.valve(&["compare", "valve.toml", campaign, "--format", "json"]);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Writes the sample campaign as text and in another format, and holds the answers against each other.
fn same_as_text(ending: &str, made: fn(&str) -> Vec<u8>) -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("valve.toml", VALVE);
    sandbox.write("text.toml", CAMPAIGN);
    sandbox.write("other.toml", &CAMPAIGN.replace(".csv", ending));
    for (number, text) in TRACES.iter().enumerate() {
        sandbox.write(&format!("traces/run-{}.csv", number + 1), text);
        std::fs::write(sandbox.path(&format!("traces/run-{}{ending}", number + 1)), made(text)).expect("written");
    }
    let text = compared(&sandbox, "text.toml");
    let other = compared(&sandbox, "other.toml");
    assert!(text["overall"]["rmse_m"].as_f64().is_some_and(|size| size > 0.0), "{text}");
    assert_near(&text["overall"], &other["overall"], "overall");
    assert_eq!(text["runs"].as_array().expect("runs").len(), 4);
    sandbox
}

/// The same numbers to within the rounding of a time that is a product.
fn assert_near(one: &Value, other: &Value, place: &str) {
    match (one, other) {
        (Value::Object(one), Value::Object(other)) => {
            assert_eq!(one.len(), other.len(), "{place}");
            for (key, value) in one {
                assert_near(value, &other[key], &format!("{place}.{key}"));
            }
        }
        (Value::Number(_), Value::Number(_)) => {
            let (one, other) = (one.as_f64().expect("a number"), other.as_f64().expect("a number"));
            assert!((one - other).abs() <= 1e-6 * one.abs() + 1e-12, "{place}: {one} {other}");
        }
        _ => assert_eq!(one, other, "{place}"),
    }
}

#[test]
fn tdms_files_are_read_as_their_text() {
    let sandbox = same_as_text(".tdms", as_tdms);
    // A look at them finds what a look at the text finds.
    let [of_text, of_tdms] = ["csv", "tdms"].map(|ending| {
        let files = [1, 2, 3, 4].map(|number| format!("traces/run-{number}.{ending}"));
        let files: Vec<&str> = files.iter().map(String::as_str).collect();
        let out = format!("of-{ending}.toml");
        let options = ["--valve", "valve.toml", "--one-means", "close", "--supply", "75 psig", "--out", &out];
        let output = sandbox.valve(&[&["init", "campaign"][..], &files, &options].concat());
        assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
        assert!(ending == "csv" || shown(&output).contains("group \"Bench\" was read, and not group \"Noise\""));
        compared(&sandbox, &out)["overall"].clone()
    });
    assert_near(&of_text, &of_tdms, "init");
    // A name that is in no group is told with all that are.
    let named = CAMPAIGN.replace(".csv", ".tdms") + "\n[columns]\nposition = \"Weg\"\n";
    sandbox.write("named.toml", &named);
    let refused = shown(&sandbox.valve(&["compare", "valve.toml", "named.toml"]));
    for part in ["traces/run-1.tdms", "\"Weg\"", "group \"Noise\": \"microphone\"; group \"Bench\": \"time_s\""] {
        assert!(refused.contains(part), "{part} in {refused}");
    }
}

#[cfg(feature = "mat73")]
#[test]
fn matlab_files_of_v7_3_are_read_as_their_text() {
    same_as_text(".mat", as_mat73);
}
