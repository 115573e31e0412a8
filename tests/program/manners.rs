//! What every verb has in common: a help that fits a screen, words for slips, names without the way to them.

use crate::campaign::Recording;
use crate::support::{Sandbox, shown};

/// A screen.
const COLUMNS: usize = 80;
const LINES: usize = 50;

const VALVE: &str = include_str!("../../models/testbed.toml");

fn on_a_screen(sandbox: &Sandbox, call: &[&str]) -> String {
    let output = sandbox.command(call).env("COLUMNS", "80").output().expect("the program runs");
    String::from_utf8(output.stdout).expect("text")
}

fn widest(text: &str) -> usize {
    text.lines().map(|line| line.chars().count()).max().unwrap_or(0)
}

#[test]
fn every_short_help_fits_a_screen() {
    let sandbox = Sandbox::new();
    let fits = |call: &[&str]| {
        let text = on_a_screen(&sandbox, call);
        let (lines, columns) = (text.lines().count(), widest(&text));
        assert!(lines > 5 && lines <= LINES && columns <= COLUMNS, "{call:?}: {lines} lines of {columns}\n{text}");
        text
    };
    let help = fits(&["--help"]);
    assert_eq!(help, fits(&["-h"]));
    let verbs = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let verbs: Vec<&str> = verbs.filter_map(|line| line.split_whitespace().next()).collect();
    assert!(verbs.len() > 15 && verbs.contains(&"prognose") && verbs.contains(&"man"), "{verbs:?}");
    for verb in &verbs {
        let short = fits(&[verb, "-h"]);
        let long = on_a_screen(&sandbox, &[verb, "--help"]);
        assert!(long.lines().count() >= short.lines().count() && widest(&long) <= COLUMNS, "{verb}\n{long}");
    }
    fits(&["init", "campaign", "-h"]);
}

#[test]
fn a_verb_with_a_slip_is_answered_with_the_right_one() {
    let sandbox = Sandbox::new();
    for (slip, verb) in [("prognos", "prognose"), ("calibrat", "calibrate"), ("buildtables", "build-tables")] {
        let output = sandbox.valve(&[slip, "valve.toml"]);
        assert_eq!(output.status.code(), Some(2));
        assert!(shown(&output).contains(&format!("a similar subcommand exists: '{verb}'")), "{}", shown(&output));
    }
}

#[test]
fn pictures_and_pages_do_not_tell_where_files_are() {
    let sandbox = Sandbox::with_tables();
    Recording::default().write(&sandbox, &VALVE.replace("600 N s/m", "690 N s/m"));
    let at = |name: &str| sandbox.path(name).display().to_string();
    let (valve, campaign, log) = (at("valve.toml"), at("campaign.toml"), at("log.csv"));
    let tables = at("tables");
    let calls: [&[&str]; 5] = [
        &["compare", &valve, &campaign, "--against", &valve, "--plot", "1.svg", "--plot-strips", "2.svg"],
        &["calibrate", &valve, &campaign, "--plot", "3.svg"],
        &["simulate", &valve, "--plot", "4.svg"],
        &["prognose", &log, "--tables", &tables, "--plot", "5.svg"],
        &["report", &valve, "--log", &log, "--out", "6.html"],
    ];
    for call in calls {
        let output = sandbox.valve(call);
        assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    }
    let folder = sandbox.path("");
    let folder = folder.to_str().expect("a path in text");
    for name in ["1.svg", "2.svg", "3.svg", "4.svg", "5.svg", "6.html"] {
        assert!(!sandbox.read(name).contains(folder), "{name} has {folder} in it");
    }
}

#[test]
fn text_fits_the_columns_there_are() {
    let sandbox = Sandbox::with_tables();
    Recording::default().write(&sandbox, &VALVE.replace("600 N s/m", "690 N s/m"));
    let calls: [&[&str]; 9] = [
        &["simulate", "valve.toml", "--cycles", "3"],
        &["effects"],
        &["effects", "dry-friction"],
        &["prognose", "log.csv", "--tables", "tables"],
        &["compare", "valve.toml", "campaign.toml", "--residual-force"],
        &["calibrate", "valve.toml", "campaign.toml"],
        &["evaluate", "valve.toml", "--seeds", "2"],
        &["demo"],
        &["build-tables", "valve.toml", "--out", "made"],
    ];
    for call in calls {
        let text = on_a_screen(&sandbox, call);
        // What is to be pasted into a file or a shell stays as it is.
        let prose = text.lines().filter(|line| !line.starts_with("    "));
        let widest = prose.max_by_key(|line| line.chars().count()).unwrap_or_default();
        assert!(widest.chars().count() <= COLUMNS, "{call:?}: {widest}");
    }
}

#[test]
fn results_are_told_in_the_units_asked_for() {
    let sandbox = Sandbox::with_tables();
    Recording::default().write(&sandbox, &VALVE.replace("600 N s/m", "690 N s/m"));
    let told = |units: &[&str]| {
        let call = [&["compare", "valve.toml", "campaign.toml", "--residual-force"], units].concat();
        let output = sandbox.valve(&call);
        assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
        String::from_utf8(output.stdout).expect("text")
    };
    let (usual, psig) = (told(&[]), told(&["--units", "psig,in,lbf"]));
    let first = |text: &str| -> Vec<f64> {
        let row = text.lines().skip_while(|line| !line.starts_with("run ")).skip(1).find(|line| line.contains(".csv"));
        row.expect("a run").split_whitespace().filter_map(|word| word.parse().ok()).collect()
    };
    let (before, after) = (first(&usual), first(&psig));
    assert!(usual.contains("supply (kPa)") && psig.contains("supply (psig)"), "{psig}");
    assert!((before[0] - (14.696 + after[0]) * 6.894_757).abs() < 1.0, "{before:?} kPa, {after:?} psig");
    assert!((before[1] - 25.4 * after[1]).abs() < 1e-3, "{before:?} mm, {after:?} in");
    assert_eq!(before[2..], after[2..], "what has no unit stays");
    for unit in [" mm", "kPa", " N "] {
        let left: Vec<&str> = psig.lines().filter(|line| line.contains(unit) && !line.starts_with("    ")).collect();
        assert!(left.is_empty(), "{unit} in {left:?}");
    }
    assert!(told(&["--units", "file"]).contains("supply (psig)"), "as the valve file says it");

    for (units, words) in [("psi", "from where it counts"), ("mm,in", "two units"), ("parsec", "parsec")] {
        let output = sandbox.valve(&["compare", "valve.toml", "campaign.toml", "--units", units]);
        assert_eq!(output.status.code(), Some(2));
        assert!(shown(&output).contains(words), "{}", shown(&output));
    }
    let output = sandbox.valve(&["prognose", "log.csv", "--tables", "tables", "--units", "file"]);
    assert!(output.status.code() == Some(2) && shown(&output).contains("reads no valve file"), "{}", shown(&output));
    let all = ["prognose", "log.csv", "--tables", "tables", "--all-rows", "--units"];
    let [mm2, cm2] = ["mm2", "cm2"].map(|unit| {
        let output = sandbox.valve(&[&all[..], &[unit]].concat());
        let text = String::from_utf8(output.stdout).expect("text");
        let row = text.lines().find(|line| line.starts_with("FV-101")).expect("a row").to_owned();
        let last = text.lines().filter(|line| line.contains(" atmosphere ")).nth(20).unwrap_or(&row).to_owned();
        let leak: f64 = last.split_whitespace().nth(4).and_then(|word| word.parse().ok()).expect("a leak");
        leak
    });
    assert!((mm2 - 100.0 * cm2).abs() < 1e-3 && mm2 > 0.1, "{mm2} mm2, {cm2} cm2");
}

#[test]
fn the_numbers_of_the_paper_stand_beside_its_valve_alone() {
    let sandbox = Sandbox::new();
    sandbox.write("other.toml", &VALVE.replace("600 N s/m", "690 N s/m"));
    for (file, is_papers) in [("valve.toml", true), ("other.toml", false)] {
        let call = ["evaluate", file, "--seeds", "2", "--plot", &format!("{file}.svg")];
        let output = sandbox.valve(&call);
        let (text, picture) = (String::from_utf8(output.stdout).expect("text"), sandbox.read(&format!("{file}.svg")));
        assert_eq!(text.contains("paper"), is_papers, "{text}");
        assert_eq!(picture.contains("paper"), is_papers, "the picture of {file}");
    }
}
