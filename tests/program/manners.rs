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
