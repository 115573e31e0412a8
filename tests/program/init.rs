//! The way in: a valve file from a datasheet, a campaign file from recordings, the page about files.

use std::fmt::Write;

use crate::support::{Sandbox, shown};

const DATASHEET: [&str; 13] = [
    "init",
    "--out",
    "new.toml",
    "--stroke",
    "25.4 mm",
    "--bore",
    "63 mm",
    "--supply",
    "5.2 barg",
    "--bench-set",
    "1.8..3.1 bar",
    "--solenoid",
    "0.8 mm",
];

#[test]
fn a_datasheet_becomes_a_valve_file_that_runs() {
    let sandbox = Sandbox::new();
    let output = sandbox.valve(&[&DATASHEET[..], &["--typical"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("Typical values with wide tolerances: ") && said.contains("The model closes in "), "{said}");
    let text = sandbox.read("new.toml");
    for line in [
        "stroke = \"25.4 mm\"",
        "piston_area = \"31.17 cm2\"                    # from a bore of 63 mm",
        "supply_pressure = \"5.2 barg\"",
        "solenoid_orifice_area = \"0.5027 mm2\"",
        "\"actuator.dead_volume\" = 0.50",
        "\"spring.stiffness\" = 0.03",
    ] {
        assert!(text.contains(line), "{line} in\n{text}");
    }
    let simulated = sandbox.valve(&["simulate", "new.toml"]);
    assert_eq!(simulated.status.code(), Some(0), "{}", shown(&simulated));
    assert_eq!(String::from_utf8(simulated.stderr).unwrap(), "", "no doubt about what init wrote");
}

#[test]
fn nothing_is_guessed_or_replaced_unasked() {
    let sandbox = Sandbox::new();
    let refused = shown(&sandbox.valve(&DATASHEET));
    for option in ["--moving-mass", "--port", "--pipe", "--typical"] {
        assert!(refused.contains(option), "{refused}");
    }
    let refused = shown(&sandbox.valve(&["init", "--typical", "--out", "new.toml"]));
    for option in ["--stroke", "--bore", "--supply"] {
        assert!(refused.contains(option), "{refused}");
    }
    let before = sandbox.read("valve.toml");
    let refused =
        shown(&sandbox.valve(&["init", "--typical", "--stroke", "1 mm", "--bore", "1 mm", "--supply", "5 barg"]));
    assert!(refused.contains("valve.toml: exists already") && refused.contains("--force"), "{refused}");
    let wrong = shown(&sandbox.valve(&[&DATASHEET[..12], &["5 bar", "--typical"]].concat()));
    assert!(wrong.contains("--solenoid: ") && wrong.contains("Kv 0.03"), "{wrong}");
    let wrong = shown(&sandbox.valve(&[
        "init",
        "--typical",
        "--stroke",
        "1 mm",
        "--bore",
        "1 mm",
        "--supply",
        "5 bar",
        "--out",
        "x.toml",
    ]));
    assert!(wrong.contains("--supply: \"bar\" does not say from where it counts; expected barg"), "{wrong}");
    assert_eq!(sandbox.read("valve.toml"), before);
    assert_eq!(sandbox.names(), ["log.csv", "valve.toml"]);
}

/// Recordings of the sandbox's valve at three pressures, in the handwriting of a German recorder.
fn recordings(sandbox: &Sandbox, command: &str) -> Vec<String> {
    let mut files = Vec::new();
    for (index, pressure) in ["60 psig", "5.2 barg", "85 psig"].into_iter().enumerate() {
        let output = sandbox.valve(&["simulate", "valve.toml", "--supply-pressure", pressure, "--trace", "trace.csv"]);
        assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
        let trace = sandbox.read("trace.csv");
        std::fs::remove_file(sandbox.path("trace.csv")).unwrap();
        let mut lines = trace.lines();
        let header: Vec<&str> = lines.next().unwrap().split(',').collect();
        let column = |name: &str| header.iter().position(|other| *other == name).unwrap();
        let mut text = format!("Anlage: Halle 3\nZeit;{command};Hub\nms;-;mm\n");
        for (row, line) in lines.enumerate() {
            let cells: Vec<&str> = line.split(',').collect();
            let number = |name: &str| cells[column(name)].parse::<f64>().unwrap();
            let noise = 0.03 * ((row as f64 * 12.9898).sin() * 43_758.545_3).fract();
            let row = format!(
                "{:.1};{};{:.3}",
                number("time_s") * 1e3,
                cells[column("command")],
                number("position_mm") + noise
            );
            writeln!(text, "{}", row.replace('.', ",")).unwrap();
        }
        let file = format!("Messung{}_{}.csv", index + 1, pressure.replace(' ', "").replace('.', ","));
        sandbox.write(&file, &text);
        files.push(file);
    }
    files
}

#[test]
fn raw_recordings_become_a_campaign_that_compares() {
    let sandbox = Sandbox::new();
    let files = recordings(&sandbox, "Magnetventil zu");
    let mut call = vec!["init", "campaign", "--valve", "valve.toml", "--temperature", "20 degC"];
    call.extend(files.iter().map(String::as_str));
    let output = sandbox.valve(&call);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    for expected in [
        "- time: column \"Zeit\" (by its name, unit and shape), in ms, as it says",
        "- command: 1 means close (by the column's name)",
        "- Messung2_5,2barg.csv: 5.2 barg (from the file's name), close at 0.000 s, open at 4.000 s",
        "    valve compare valve.toml campaign.toml\n",
    ] {
        assert!(said.contains(expected), "{expected} in\n{said}");
    }
    let compared = sandbox.valve(&["compare", "valve.toml", "campaign.toml", "--format", "json"]);
    assert_eq!(compared.status.code(), Some(0), "{}", shown(&compared));
    let answer: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    let error_m = answer["overall"]["rmse_m"].as_f64().unwrap();
    assert!(error_m < 0.06e-3, "{error_m} m: the model made these recordings");
    // A second time it would replace the file.
    let refused = shown(&sandbox.valve(&call));
    assert!(refused.contains("campaign.toml: exists already"), "{refused}");
}

#[test]
fn what_recordings_do_not_tell_is_asked_for_by_its_option() {
    let sandbox = Sandbox::new();
    let files = recordings(&sandbox, "Magnetventil");
    let call = |more: &[&str]| {
        let mut call = vec!["init", "campaign"];
        call.extend(files.iter().map(String::as_str));
        call.extend(more);
        shown(&sandbox.valve(&call))
    };
    let refused = call(&["--valve", "valve.toml"]);
    assert!(refused.contains("do not tell whether a command of 1 tells the valve to close or to open"), "{refused}");
    assert!(refused.contains("hint: say it with --one-means close (or open)"), "{refused}");
    let refused = call(&["--valve", "valve.toml", "--column", "positon=Hub"]);
    assert!(
        refused.contains("there is no channel \"positon\"") && refused.contains("did you mean \"position\"?"),
        "{refused}"
    );
    let mixed = call(&["--valve", "valve.toml", "--one-means", "close", "--supply", "75 psi"]);
    assert!(mixed.contains("--supply: \"psi\" does not say from where it counts"), "{mixed}");
    let names: Vec<String> = sandbox
        .names()
        .into_iter()
        .filter(|name| std::path::Path::new(name).extension().is_some_and(|end| end == "toml"))
        .collect();
    assert_eq!(names, ["valve.toml"], "a refused call leaves nothing behind");
    let done = call(&["--valve", "valve.toml", "--position-grows", "open"]);
    assert!(done.starts_with("exit code: 0"), "{done}");
}

#[test]
fn the_page_about_files_is_printed() {
    let sandbox = Sandbox::new();
    let page = sandbox.valve(&["help", "formats"]);
    assert_eq!(String::from_utf8(page.stdout).unwrap(), include_str!("../../docs/formats.md"));
    let simulate = String::from_utf8(sandbox.valve(&["help", "simulate"]).stdout).unwrap();
    assert!(simulate.contains("--leak-to-atmosphere"), "{simulate}");
    let refused = shown(&sandbox.valve(&["help", "format"]));
    assert!(refused.contains("there is no help about \"format\" (did you mean \"formats\"?)"), "{refused}");
}
