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
    let one_line = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(one_line.contains("Assumed: air, closes within 3"), "{said}");
    assert!(
        one_line.contains(
            " s, upright, a discharge coefficient of 0.86, 20 degC, an atmosphere of 101.325 kPa, name my valve."
        ),
        "{said}"
    );
    let text = sandbox.read("new.toml");
    for line in [
        "stroke = \"25.4 mm\"",
        "piston_area = \"31.17 cm2\"                    # from a bore of 63 mm",
        "supply_pressure = \"5.2 barg\"",
        "solenoid_orifice_area = \"0.5027 mm2\"",
        "\"actuator.dead_volume\" = 0.5",
        "\"stops.contact_stiffness\" = 1",
        "\"spring.stiffness\" = 0.03",
    ] {
        assert!(text.contains(line), "{line} in\n{text}");
    }
    let simulated = sandbox.valve(&["simulate", "new.toml"]);
    assert_eq!(simulated.status.code(), Some(0), "{}", shown(&simulated));
    assert_eq!(String::from_utf8(simulated.stderr).unwrap(), "", "no doubt about what init wrote");
}

#[test]
fn what_else_a_datasheet_tells_goes_in_as_it_is_told() {
    let sandbox = Sandbox::new();
    let more = [
        "--typical",
        "--contact-stiffness",
        "0.4 MN/m",
        "--flow-coefficient",
        "0.7",
        "--orientation",
        "horizontal",
        "--open-at",
        "7 s",
        "--cycle-end",
        "21 s",
        "--tolerance",
        "spring.stiffness=0.02",
        "--tolerance",
        "port_orifice_area 15 %",
    ];
    let output = sandbox.valve(&[&DATASHEET[..], &more].concat());
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(!said.contains("upright") && !said.contains("coefficient of"), "{said}");
    let text = sandbox.read("new.toml");
    for line in [
        "contact_stiffness = \"0.4 MN/m\"",
        "flow_coefficient = 0.7 ",
        "orientation = \"horizontal\"",
        "open_at = \"7 s\"",
        "end = \"21 s\"",
        "\"stops.contact_stiffness\" = 0.1",
        "\"spring.stiffness\" = 0.02",
        "\"pneumatics.port_orifice_area\" = 0.15",
    ] {
        assert!(text.contains(line), "{line} in\n{text}");
    }
    let wrong =
        ["--flow-coefficient", "2", "--orientation", "up", "--tolerance", "gas=0.1", "--tolerance", "stroke=0.1"];
    let refused = sandbox
        .valve(&[&["init", "--out", "b.toml", "--typical", "--stroke", "1 mm", "--bore", "9 mm"], &wrong[..]].concat());
    let said = String::from_utf8(refused.stderr).unwrap();
    for words in
        ["--flow-coefficient: \"2\" is no", "expected upright,", "no \"gas\"", "actuator.stroke cannot be calibrated"]
    {
        assert!(said.contains(words), "{words} in\n{said}");
    }
}

#[test]
fn a_bore_beside_a_piston_area_has_to_agree_with_it() {
    let sandbox = Sandbox::new();
    let with_area = |area: &str, out: &str| {
        sandbox.valve(&[&["init", "--out", out], &DATASHEET[3..], &["--typical", "--piston-area", area]].concat())
    };
    let output = with_area("31.2 cm2", "both.toml");
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    assert!(sandbox.read("both.toml").contains("piston_area = \"31.2 cm2\""));
    let output = with_area("25 cm2", "other.toml");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("--bore: its area of 31.17 cm2 is not the --piston-area of 25 cm2"), "{said}");
    assert!(!sandbox.path("other.toml").exists());
}

#[test]
fn a_cylinder_without_a_spring_is_opened_by_its_weight() {
    let sandbox = Sandbox::new();
    let arguments = "init --out new.toml --typical --supply 5_barg --bore 25_mm --stroke 80_mm --moving-mass 1.5_kg \
                     --spring-stiffness 0_N/m --solenoid 2_mm --port 2_mm --viscous-friction 20_N_s/m";
    let arguments: Vec<String> = arguments.split_whitespace().map(|word| word.replace('_', " ")).collect();
    let output = sandbox.valve(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    let one_line = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(one_line.contains("that its weight opens it, there being no spring"), "{said}");
    assert!(!one_line.contains("does not get there"), "{said}");
    let text = sandbox.read("new.toml");
    assert!(text.contains("orientation = \"inverted\"") && !text.contains("\"nan"), "{text}");
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

#[test]
fn a_springs_force_is_a_compression_by_its_stiffness() {
    let sandbox = Sandbox::new();
    let with = |out: &str, preload: &str, stiffness: &str| {
        let options = ["--stroke", "1 in", "--bore", "63 mm", "--supply", "75 psig", "--spring-preload", preload];
        sandbox.valve(&[&["init", "--typical", "--out", out, "--spring-stiffness", stiffness][..], &options].concat())
    };
    let written = with("new.toml", "130 lbf", "16 N/mm");
    assert_eq!(written.status.code(), Some(0), "{}", shown(&written));
    // 130 lbf are 578.27 N.
    let line = "preload_compression = \"36.14 mm\"";
    let text = sandbox.read("new.toml");
    assert!(text.contains(line) && text.contains("from 130 lbf"), "{text}");
    let refused = with("none.toml", "130 lbf", "0 N/m");
    assert_eq!(refused.status.code(), Some(2));
    assert!(shown(&refused).contains("\"130 lbf\" is a force, which is a compression only with a stiffness above 0"));
    assert!(!sandbox.path("none.toml").exists());
}

#[test]
fn units_of_american_datasheets_are_read_and_all_wrong_options_told_at_once() {
    let sandbox = Sandbox::new();
    let written = sandbox.valve(&[
        "init",
        "--typical",
        "--out",
        "new.toml",
        "--stroke",
        "1 inch",
        "--piston-area",
        "4.83 sq.in",
        "--supply",
        "75 PSIG",
        "--bench-set",
        "26.8 - 45.7 psig",
        "--solenoid",
        "0.083\"",
        "--dead-volume",
        "30 ccm",
        "--moving-mass",
        "3.3 lbs",
        "--pipe",
        "2.44 cu.in",
        "--gas",
        "N2",
    ]);
    assert_eq!(written.status.code(), Some(0), "{}", shown(&written));
    let text = sandbox.read("new.toml");
    for line in ["piston_area = \"4.83 sq.in\"", "supply_pressure = \"75 PSIG\"", "# nitrogen", "from 0.083\""] {
        assert!(text.contains(line), "{line} in\n{text}");
    }
    let simulated = sandbox.valve(&["simulate", "new.toml"]);
    assert_eq!(simulated.status.code(), Some(0), "{}", shown(&simulated));
    let refused = shown(&sandbox.valve(&[
        "init",
        "--typical",
        "--out",
        "x.toml",
        "--stroke",
        "25,4 mm",
        "--bore",
        "63 m2",
        "--supply",
        "5 bar",
        "--gas",
        "argon",
        "--spring-stiffness",
        "91.4 lb/in",
        "--close-within",
        "3",
    ]));
    for said in [
        "--stroke: \"25,4 mm\" has a decimal comma; write a decimal point",
        "--bore: \"m2\" is a unit of an area",
        "--supply: \"bar\" does not say from where it counts",
        "--gas: \"argon\" is not known; expected air or nitrogen",
        "--spring-stiffness: \"lb/in\" is a unit of another kind of quantity (did you mean \"lbf/in\"?)",
        "--close-within: \"3\" has no unit",
    ] {
        assert!(refused.contains(said), "{said} in\n{refused}");
    }
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
    call.extend(["--position-noise", "0.02 mm"]);
    call.extend(files.iter().map(String::as_str));
    let output = sandbox.valve(&call);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(sandbox.read("campaign.toml").contains("[sensors]\nposition_noise = \"0.02 mm\"\n"));
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
fn the_model_tells_the_direction_where_recordings_do_not() {
    let sandbox = Sandbox::new();
    let files = recordings(&sandbox, "sol");
    let mut call = vec!["init", "campaign", "--valve", "valve.toml", "--temperature", "20 degC"];
    call.extend(files.iter().map(String::as_str));
    let output = sandbox.valve(&call);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let said = String::from_utf8(output.stdout).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains("1 means close (valve.toml is 0.0") && said.contains("the other way round"), "{said}");
    // What is said against it is taken, with a doubt.
    let output = sandbox.valve(&[&call[..], &["--one-means", "open", "--force"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let doubt = String::from_utf8(output.stderr).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(doubt.contains("is it right that 1 means open? With close valve.toml is 0.0"), "{doubt}");
    // Without a model it is asked for.
    let mut alone = vec!["init", "campaign", "--stroke", "25.4 mm", "--temperature", "20 degC", "--force"];
    alone.extend(files.iter().map(String::as_str));
    let refused = shown(&sandbox.valve(&alone));
    assert!(refused.contains("--one-means close (or open)"), "{refused}");
}

/// A recording of a valve of 25.4 mm with its supply at 517 kPa above the atmosphere, in a gauge unit of so many Pa.
fn with_supply(heading: &str, unit_pa: f64, late_s: f64) -> String {
    let mut text = format!("Zeit [s],Magnetventil zu,Hub [mm],{heading}\n");
    for step in 0..2000 {
        let time_s = f64::from(step) * 2e-3;
        let since_s = time_s - late_s;
        let closed = ((since_s - 0.5) / 0.4).clamp(0.0, 1.0) - ((since_s - 2.3) / 0.6).clamp(0.0, 1.0);
        let noise = 0.03 * ((f64::from(step) * 12.9898).sin() * 43_758.545_3).fract();
        let supply = (517e3 + 100.0 * f64::from(step % 3)) / unit_pa;
        let command = u8::from((0.3..2.0).contains(&since_s));
        writeln!(text, "{time_s:.3},{command},{:.4},{supply:.5}", 25.4 * (1.0 - closed) + noise).unwrap();
    }
    text
}

#[test]
fn recordings_with_pressures_in_two_units_become_a_campaign() {
    let sandbox = Sandbox::new();
    sandbox.write("a.csv", &with_supply("Versorgungsdruck [bar(g)]", 1e5, 0.0));
    sandbox.write("b.csv", &with_supply("Versorgungsdruck [psig]", 6894.757, 0.1));
    sandbox.write("c.csv", &with_supply("Versorgungsdruck_PSIG", 6894.757, 0.2));
    let call = |more: &[&str]| {
        let mut call = vec!["init", "campaign", "a.csv", "b.csv", "c.csv", "--valve", "valve.toml", "--force"];
        call.extend(more);
        sandbox.valve(&call)
    };
    for options in [&[][..], &["--column", "supply_pressure=Versorgungsdruck"]] {
        let options = [options, &["--temperature", "20 degC", "--leak", "b.csv=atmosphere:0.15mm2"]].concat();
        let done = call(&options);
        assert_eq!(done.status.code(), Some(0), "{}", shown(&done));
        assert_eq!(String::from_utf8(done.stderr.clone()).unwrap(), "", "what is understood is no warning");
        let said = String::from_utf8(done.stdout).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
        for expected in [
            "as it says; 101.325 kPa of ambient pressure are added",
            "each recording's own unit counts: bar(g) in a.csv; psig in b.csv, c.csv",
            "c.csv: 618.4 kPa (from the median of the recorded supply pressure)",
        ] {
            assert!(said.contains(expected), "{expected} in\n{said}");
        }
        let text = sandbox.read("campaign.toml");
        assert!(text.contains("supply_pressure = \"Versorgungsdruck\"\n"), "{text}");
        assert_eq!(text.matches("leak_to_atmosphere = \"0.15mm2\"\n").count(), 1, "{text}");
        assert_eq!(text.matches("# leak_to_atmosphere = ").count(), 2, "{text}");
    }
    let compared = sandbox.valve(&["compare", "valve.toml", "campaign.toml"]);
    assert_eq!(compared.status.code(), Some(0), "{}", shown(&compared));
    assert!(!shown(&compared).contains("ambient pressure were added"), "{}", shown(&compared));
    let done = call(&["--column", "supply_pressure=none", "--supply", "75 psig", "--temperature", "20 degC"]);
    assert_eq!(done.status.code(), Some(0), "{}", shown(&done));
    assert!(sandbox.read("campaign.toml").contains("\nsupply_pressure = \"none\"\n"));
    let before = sandbox.read("campaign.toml");
    for (options, expected) in [
        (
            &["--column", "supply_pressure=Versorgungdruck"][..],
            "a.csv has no column \"Versorgungdruck\" (did you mean \"Versorgungsdruck\"?)",
        ),
        (&["--column", "supply_pressure="], "--column supply_pressure=: no name behind the channel"),
        (&["--column", "position=none"], "nothing can be read without the position"),
        (&["--temperature", "d.csv=20 degC"], "--temperature d.csv=20 degC: there is no recording \"d.csv\""),
        (&["--leak", "0.15mm2", "--supply", "5 bar"], "--supply: \"bar\" does not say from where it counts"),
        (
            &["--leak", "0.15mm2", "--supply", "5 bar"],
            "--leak: \"0.15mm2\" has no place; a leak is such as atmosphere:0.15mm2",
        ),
    ] {
        let refused = call(options);
        assert_eq!(refused.status.code(), Some(2), "{}", shown(&refused));
        assert!(shown(&refused).contains(expected), "{expected} in\n{}", shown(&refused));
    }
    assert_eq!(sandbox.read("campaign.toml"), before);
    let refused = shown(&sandbox.valve(&["compare", "valve.toml", "a.csv"]));
    assert!(refused.contains("a.csv: is a recording (a table of numbers), no campaign file; expected"), "{refused}");
}

#[test]
fn a_pressure_that_tells_the_command_drives_the_model() {
    let sandbox = Sandbox::new();
    // The second one's pipe never comes to where the first one's is still full.
    for (file, supply) in [("high.csv", "95 psig"), ("low.csv", "60 psig")] {
        let output =
            sandbox.valve(&["simulate", "valve.toml", "--supply-pressure", supply, "--trace", "trace.csv", "--force"]);
        assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
        let trace = sandbox.read("trace.csv");
        let header: Vec<&str> = trace.lines().next().unwrap().split(',').collect();
        let columns = ["time_s", "position_mm", "pipe_pressure_kpa"];
        let places = columns.map(|name| header.iter().position(|other| *other == name).unwrap());
        let mut text = columns.join(",") + "\n";
        for (row, line) in trace.lines().skip(1).enumerate() {
            let cells: Vec<&str> = line.split(',').collect();
            let [time, position, pressure] = places.map(|place| cells[place]);
            let noise = 0.03 * ((row as f64 * 12.9898).sin() * 43_758.545_3).fract();
            writeln!(text, "{time},{:.4},{pressure}", position.parse::<f64>().unwrap() + noise).unwrap();
        }
        sandbox.write(file, &text);
    }
    let call = ["init", "campaign", "high.csv", "low.csv", "--valve", "valve.toml", "--temperature", "20 degC"];
    let output = sandbox.valve(&[&call[..], &["--supply", "high.csv=95 psig", "--supply", "low.csv=60 psig"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("- pipe pressure: drives the model as it was measured"), "{said}");
    // The commands were given at 0 and 4 s.
    let opens_s = |file: &str| -> f64 {
        let line = said.split(&format!("- {file}: ")).nth(1).expect("each recording's commands");
        line.split("open at ").nth(1).and_then(|rest| rest.split_whitespace().next()).expect("a time").parse().unwrap()
    };
    for file in ["high.csv", "low.csv"] {
        assert!((4.0..4.8).contains(&opens_s(file)), "{file}: {said}");
    }
    let campaign = sandbox.read("campaign.toml");
    assert!(campaign.contains("[inputs]\npipe_pressure = \"measured\"\n"), "{campaign}");
    // The model made this recording; when its command was given is known to some hundredths of a second only.
    let error_mm = || {
        let compared = sandbox.valve(&["compare", "valve.toml", "campaign.toml", "--format", "json"]);
        assert_eq!(compared.status.code(), Some(0), "{}", shown(&compared));
        let answer: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
        1e3 * answer["overall"]["rmse_m"].as_f64().unwrap()
    };
    let driven_mm = error_mm();
    assert!(driven_mm < 0.1, "{driven_mm} mm");
    sandbox.write("campaign.toml", &campaign.replace("\"measured\"", "\"simulated\""));
    let from_command_mm = error_mm();
    assert!(from_command_mm > 2.0 * driven_mm, "{from_command_mm} mm from the command, {driven_mm} mm driven");
}

/// Runs the program at a terminal of its own and gives these answers; `None` where there is no `script` to make one.
#[cfg(target_os = "linux")]
fn at_a_terminal(sandbox: &Sandbox, arguments: &str, answers: &str) -> Option<String> {
    use std::io::Write as _;
    use std::process::{Command, Stdio};

    let mut child = Command::new("script")
        .args(["-qec", &format!("{} {arguments}", env!("CARGO_BIN_EXE_valve")), "/dev/null"])
        .current_dir(sandbox.path("."))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .ok()?;
    child.stdin.take().expect("a pipe").write_all(answers.as_bytes()).expect("the answers are taken");
    let output = child.wait_with_output().expect("the program ends");
    Some(String::from_utf8_lossy(&output.stdout).split_whitespace().collect::<Vec<_>>().join(" "))
}

#[cfg(target_os = "linux")]
#[test]
fn at_a_terminal_each_question_is_asked_once() {
    let sandbox = Sandbox::new();
    for (name, late_s) in [("a.csv", 0.0), ("b.csv", 0.1), ("c.csv", 0.2)] {
        sandbox.write(name, &with_supply("Versorgungsdruck [psig]", 6894.757, late_s));
    }
    let arguments = "init campaign a.csv b.csv c.csv --valve valve.toml";
    let Some(said) = at_a_terminal(&sandbox, arguments, "30 degC\nb.csv=supply:0.05mm2\n") else { return };
    assert_eq!(said.matches("Temperature of the recordings, such as 20 degC").count(), 1, "{said}");
    assert_eq!(sandbox.read("campaign.toml").matches("\ntemperature = \"30 degC\"").count(), 3);
    assert_eq!(said.matches("Leaks that were opened on purpose").count(), 1, "{said}");
    assert_eq!(sandbox.read("campaign.toml").matches("leak_from_supply = \"0.05mm2\"").count(), 1);
    let arguments = "init --out new.toml --stroke '25.4 mm' --bore '63 mm' --supply '5.2 barg'";
    // Bench set, mass, volume, friction, solenoid, port and pipe; gas; limits.
    let Some(said) = at_a_terminal(&sandbox, arguments, "1.8..3.1 barg\n\n\n\n\n\n\nN2\n\n9 s\n") else { return };
    assert!(said.contains("Gas: air or nitrogen (N2). Empty for air") && said.contains("Longest acceptable"), "{said}");
    assert!(said.contains("Assumed: closes within ") && !said.contains("opens within "), "{said}");
    let text = sandbox.read("new.toml");
    assert!(text.contains("# nitrogen") && text.contains("open_within = \"9 s\""), "{text}");
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
    let refused = call(&["--stroke", "25.4 mm"]);
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
fn the_pages_about_files_and_results_are_printed() {
    let sandbox = Sandbox::new();
    let page = sandbox.valve(&["help", "formats"]);
    assert_eq!(String::from_utf8(page.stdout).unwrap(), include_str!("../../docs/formats.md"));
    let page = sandbox.valve(&["help", "results"]);
    assert_eq!(String::from_utf8(page.stdout).unwrap(), include_str!("../../docs/results.md"));
    let simulate = String::from_utf8(sandbox.valve(&["help", "simulate"]).stdout).unwrap();
    assert!(simulate.contains("--leak-to-atmosphere"), "{simulate}");
    let refused = shown(&sandbox.valve(&["help", "format"]));
    assert!(refused.contains("there is no help about \"format\" (did you mean \"formats\"?)"), "{refused}");
    let refused = shown(&sandbox.valve(&["help", "result"]));
    assert!(refused.contains("(did you mean \"results\"?)") && refused.contains(", formats, results"), "{refused}");
}
