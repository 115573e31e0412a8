//! `docs/results.md` against what the program prints for programs.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use prognoser::{FaultCall, Status};
use serde_json::Value;

use crate::support::{Sandbox, shown};

const PAGE: &str = include_str!("../../docs/results.md");
const HEAD: &str = "| key | example | null or missing | what it is |";

/// A row of a table of keys.
#[derive(Debug, Clone)]
struct Documented {
    /// Key by key from the document down, without the brackets of lists; `<...>` stands for any.
    path: Vec<String>,
    is_list: bool,
    example: Option<Value>,
    /// What is said of when it is null or missing.
    absent: String,
    is_seldom: bool,
    /// The words that it may hold, where the page names them all.
    words: Option<BTreeSet<String>>,
}

impl Documented {
    fn matches(&self, path: &[String]) -> bool {
        let is_name = |key: &str| key.starts_with('<');
        self.path.len() == path.len() && self.path.iter().zip(path).all(|(own, key)| own == key || is_name(own))
    }

    fn is_below_a_name(&self) -> bool {
        self.path.last().is_some_and(|key| key.starts_with('<'))
    }
}

/// The part of the page under a heading, up to the next one.
fn part(anchor: &str) -> &'static str {
    let heading = |part: &&str| part.lines().next().unwrap_or_default().to_lowercase().replace(' ', "-") == anchor;
    PAGE.split("\n#").map(|part| part.trim_start_matches('#').trim_start()).find(heading).expect(anchor)
}

/// What stands between backticks.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// Where the links of a text lead to on this page.
fn anchors(text: &str) -> impl Iterator<Item = &str> {
    text.split("](#").skip(1).filter_map(|rest| rest.split(')').next())
}

/// The words in the first column of the tables of a part.
fn words_of(anchor: &str) -> Vec<String> {
    let rows = part(anchor).lines().filter_map(|line| line.strip_prefix("| `"));
    rows.filter_map(|row| row.split('`').next()).map(str::to_owned).collect()
}

/// All keys of a part, with those of the parts that it links to.
fn keys(anchor: &str) -> Vec<Documented> {
    let mut all = Vec::new();
    add_keys(&mut all, anchor, &[], false);
    all
}

/// Adds the keys of a part below a place.
fn add_keys(all: &mut Vec<Documented>, anchor: &str, above: &[String], seldom_above: bool) {
    let rows = part(anchor).lines().skip_while(|line| *line != HEAD).skip(2).take_while(|line| line.starts_with('|'));
    assert!(rows.clone().next().is_some(), "{anchor} has no table of keys");
    for row in rows {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let [key, example, absent, what] = cells[..] else { panic!("four cells in {row}") };
        for anchor in anchors(key) {
            add_keys(all, anchor, above, seldom_above);
        }
        for key in quoted(key) {
            let path: Vec<String> = key.split('.').map(|key| key.trim_end_matches("[]").to_owned()).collect();
            let path = [above, &path].concat();
            let mut parents = all.iter().filter(|one| path.starts_with(&one.path));
            let is_seldom = seldom_above
                || absent.split(';').any(|part| part.trim() == "seldom")
                || parents.any(|one| one.is_seldom);
            let words = what.split_once("one of ").map(|(_, listed)| {
                let own = quoted(listed).map(str::to_owned);
                own.chain(anchors(listed).flat_map(words_of)).collect()
            });
            let text = example.strip_prefix('`').and_then(|text| text.strip_suffix('`'));
            let example = text.map(|text| serde_json::from_str(text).unwrap_or_else(|_| panic!("{text} is no JSON")));
            let is_list = key.ends_with("[]");
            let documented =
                Documented { path: path.clone(), is_list, example, absent: absent.to_owned(), is_seldom, words };
            all.push(documented);
            for anchor in anchors(cells[1]) {
                add_keys(all, anchor, &path, is_seldom);
            }
        }
    }
}

/// What was found at a key.
#[derive(Debug, Default)]
struct Found {
    kinds: BTreeSet<&'static str>,
    texts: BTreeSet<String>,
    count: usize,
    /// Objects at this place, each of which could have all keys below.
    objects: usize,
    is_list: bool,
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "bool",
        Value::Number(number) if number.is_f64() => "number",
        Value::Number(_) => "whole number",
        Value::String(_) => "text",
        Value::Array(_) => "list",
        Value::Object(_) => "object",
    }
}

fn look(value: &Value, path: &[String], found: &mut BTreeMap<Vec<String>, Found>) {
    let here = found.entry(path.to_vec()).or_default();
    here.kinds.insert(kind(value));
    here.count += 1;
    match value {
        Value::String(text) => {
            here.texts.insert(text.clone());
        }
        Value::Array(list) if list.iter().any(Value::is_object) => {
            here.is_list = true;
            for entry in list {
                look_into(entry, path, found);
            }
        }
        _ => look_into(value, path, found),
    }
}

fn look_into(value: &Value, path: &[String], found: &mut BTreeMap<Vec<String>, Found>) {
    let Value::Object(keys) = value else { return };
    found.entry(path.to_vec()).or_default().objects += 1;
    for (key, value) in keys {
        look(value, &[path, std::slice::from_ref(key)].concat(), found);
    }
}

/// What is wrong between a part of the page and documents that it is about; `are_all` if together these hold all that
/// the page tells of.
fn differences(anchor: &str, documents: &[Value], are_all: bool) -> Vec<String> {
    let rows = keys(anchor);
    let mut found = BTreeMap::new();
    for document in documents {
        look_into(document, &[], &mut found);
    }
    let mut wrong = Vec::new();
    for (path, one) in found.iter().filter(|(path, _)| !path.is_empty()) {
        let key = path.join(".");
        let names = |row: &&Documented| row.path.iter().filter(|key| key.starts_with('<')).count();
        let matching: Vec<&Documented> = rows.iter().filter(|row| row.matches(path)).collect();
        let Some(fewest) = matching.iter().map(names).min() else {
            wrong.push(format!("{key} is printed and not on the page"));
            continue;
        };
        let matching: Vec<&Documented> = matching.into_iter().filter(|row| names(row) == fewest).collect();
        let says = |word: &str| matching.iter().any(|row| row.absent.contains(word));
        if one.kinds.contains("null") && !says("null") {
            wrong.push(format!("{key} is null, of which the page says nothing"));
        }
        let places = found.get(&path[..path.len() - 1]).map_or(0, |above| above.objects);
        if one.count < places && !says("missing") && !matching.iter().any(|row| row.is_below_a_name()) {
            wrong.push(format!("{key} is missing in some places, of which the page says nothing"));
        }
        if one.is_list != matching.iter().any(|row| row.is_list) && one.objects > 0 {
            wrong.push(format!("{key}: whether it is a list is wrong on the page"));
        }
        for row in &matching {
            let kinds = || one.kinds.iter().filter(|kind| **kind != "null");
            if let Some(example) = &row.example
                && kinds().next().is_some()
                && !one.kinds.contains(kind(example))
            {
                wrong.push(format!("{key}: the example is a {}, printed is {:?}", kind(example), one.kinds));
            }
            if let Some(words) = &row.words {
                let others =
                    one.texts.difference(words).map(|text| format!("{key} can be {text:?}, which the page lacks"));
                wrong.extend(others);
            }
        }
    }
    if are_all {
        let unseen = rows.iter().filter(|row| !row.is_seldom && !found.keys().any(|path| row.matches(path)));
        wrong.extend(unseen.map(|row| format!("{} is on the page and in no document", row.path.join("."))));
    }
    wrong.sort();
    wrong.dedup();
    wrong
}

/// Holds a document against the page, which must tell of all that is in it.
pub fn assert_documented(anchor: &str, document: &Value) {
    let wrong = differences(anchor, std::slice::from_ref(document), false);
    assert!(wrong.is_empty(), "docs/results.md, {anchor}:\n{}", wrong.join("\n"));
}

/// The same of documents that together hold all that the page tells of.
fn assert_same(anchor: &str, documents: &[Value]) {
    let wrong = differences(anchor, documents, true);
    assert!(wrong.is_empty(), "docs/results.md, {anchor}:\n{}", wrong.join("\n"));
}

/// What a call prints with `--format json`; words are parted by blanks, `_` is a blank within one.
fn json(sandbox: &Sandbox, call: &str) -> Value {
    let words: Vec<String> = call.split(' ').map(|word| word.replace('_', " ")).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).chain(["--format", "json"]).collect();
    let output = sandbox.valve(&words);
    assert_eq!(output.status.code(), Some(0), "{call}\n{}", shown(&output));
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}\n{}", shown(&output)))
}

/// The sample campaign, and one of stroke times alone.
fn with_campaigns() -> Sandbox {
    let sandbox = Sandbox::with_tables();
    sandbox.copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("data/sticking-valve"), "sample/");
    sandbox.write("limit.toml", "name = \"limit switches\"\n\n[timings]\nfile = \"limit.csv\"\n");
    let rows = ["50,0,1.442,2.034", "75,0,1.052,2.134", "75,0,1.049,2.138", "75,0.1,1.211,1.833", "90,0,0.902,2.234"];
    let head = "supply_pressure_psig,leak_to_atmosphere_mm2,close_time_s,open_time_s";
    sandbox.write("limit.csv", &format!("{head}\n{}\n", rows.join("\n")));
    sandbox
}

#[test]
fn a_page_that_is_wrong_is_told_so() {
    let document = |text: &str| -> Vec<Value> { vec![serde_json::from_str(text).expect("JSON")] };
    let good = r#"{"schema": 5, "undone": "added dry-friction", "out": "back.toml"}"#;
    assert_same("revert", &document(good));
    for (change, wrong) in [
        (
            good.replace("undone", "redone"),
            &["redone is printed and not on the page", "undone is on the page and in no document"][..],
        ),
        (good.replace("\"back.toml\"", "null"), &["out is null, of which the page says nothing"]),
        (good.replace("\"back.toml\"", "3"), &["out: the example is a text, printed is {\"whole number\"}"]),
        (good.replace('5', "5.0"), &["schema: the example is a whole number, printed is {\"number\"}"]),
    ] {
        assert_eq!(differences("revert", &document(&change), true), wrong, "{change}");
    }
    let told = differences("health", &document(r#"{"rows": 1, "status": "fine"}"#), false);
    assert_eq!(told, ["status can be \"fine\", which the page lacks"]);
    let rows = document(r#"{"lives": [{"fault": "rust", "coverage_90": 0.5}, {"coverage_90": null}]}"#);
    assert_eq!(
        differences("evaluate---log", &rows, false),
        ["lives.fault is missing in some places, of which the page says nothing"]
    );
}

#[test]
fn words_of_the_program_are_all_on_the_page() {
    assert_eq!(words_of("status"), Status::ALL.map(Status::name));
    let faults = FaultCall::catalogue().chain([FaultCall::None, FaultCall::Undecided]).map(FaultCall::name);
    assert_eq!(words_of("faults"), faults.collect::<Vec<_>>());
    // Arms such as `Self::Glitch { .. } => "glitch",`.
    let named = |source: &'static str| {
        let arms = source.lines().filter_map(|line| line.trim().strip_prefix("Self::")?.split_once("=> \""));
        arms.filter_map(|(_, name)| name.strip_suffix("\",")).map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(words_of("notices"), named(include_str!("../../crates/prognoser/src/notice.rs")));
    assert_eq!(words_of("phases"), named(include_str!("../../crates/model-lab/src/compare/phases.rs")));
    for (anchor, source) in [
        ("explain", include_str!("../../crates/model-lab/src/diagnosis/answer.rs")),
        ("calibrate", include_str!("../../crates/model-lab/src/calibrate/verdict.rs")),
    ] {
        let row = keys(anchor).into_iter().find(|row| row.path == ["verdict"]).expect("a verdict");
        let words = row.words.expect("its words");
        let verdicts = named(source);
        assert!(verdicts.len() > 2 && verdicts.iter().all(|verdict| words.contains(verdict)), "{anchor}: {verdicts:?}");
    }
}

#[test]
fn the_version_on_the_page_is_the_programs() {
    let version = answers::SCHEMA;
    assert!(PAGE.contains(&format!("is the version of all these documents, {version}.")));
    assert!(part("results-for-programs").contains(&format!("\n| {version} | ")));
    let examples = PAGE.lines().filter_map(|line| line.strip_prefix("| `schema` | `"));
    assert!(examples.clone().all(|row| row.starts_with(&format!("{version}`"))));
    assert!(examples.count() > 10);
}

#[test]
fn simulated_cycles_are_as_documented() {
    let sandbox = Sandbox::new();
    let calls = ["simulate valve.toml", "simulate valve.toml --leak-to-atmosphere 3_mm2 --leak-from-supply 3_mm2"];
    assert_same("simulate", &calls.map(|call| json(&sandbox, call)));
}

#[test]
fn tables_are_as_documented() {
    let sandbox = Sandbox::new();
    let calls = [
        "build-tables valve.toml --out tables",
        "build-tables valve.toml --out wide --wear leaks --supply-range 74..76_psig",
    ];
    assert_same("build-tables", &calls.map(|call| json(&sandbox, call)));
}

#[test]
fn rows_of_a_prognosis_are_as_documented() {
    let sandbox = Sandbox::with_tables();
    let log = sandbox.read("log.csv");
    let dated = log.lines().enumerate().map(|(row, line)| match row {
        0 => format!("{line},time\n"),
        _ => format!("{line},2026-03-{row:02}T06:30:00Z\n"),
    });
    sandbox.write("dated.csv", &dated.collect::<String>());
    let mut rows = Vec::new();
    for call in ["log.csv", "dated.csv", "log.csv --method ols"] {
        let call = format!("prognose {call} --tables tables");
        rows.extend(json(&sandbox, &call).as_array().expect("a list of rows").iter().cloned());
    }
    assert_same("prognose", &rows);
    let of = |format| {
        let output = sandbox.valve(&["prognose", "log.csv", "--tables", "tables", "--format", format]);
        String::from_utf8(output.stdout).expect("text")
    };
    assert!(of("jsonl").lines().all(|line| line.starts_with(&format!("{{\"schema\":{},\"valve\":", answers::SCHEMA))));
    let csv = of("csv");
    assert_eq!(words_of("columns-of-csv").join(","), csv.lines().next().expect("a header"));
    let all = keys("prognose");
    for row in part("columns-of-csv").lines().filter(|line| line.starts_with("| `")) {
        let key: Vec<String> = quoted(row).nth(1).expect("a key").split('.').map(str::to_owned).collect();
        assert!(all.iter().any(|one| one.matches(&key)), "{row}");
        assert!(key.len() == 1 || words_of("faults").contains(&key[1]), "{row}");
    }
}

#[test]
fn what_is_learnt_and_evaluated_is_as_documented() {
    let sandbox = Sandbox::with_tables();
    assert_same("learn", &[json(&sandbox, "learn log.csv --tables tables --out prior.toml")]);
    assert_same("evaluate", &[json(&sandbox, "evaluate valve.toml --seeds 2 --noise-variance 0,1e-3")]);
    let ended = format!("{}FV-101,26,3.05,0.71\nFV-101,27,3.31,0.69\n", sandbox.read("log.csv"));
    sandbox.write("ended.csv", &ended);
    assert_same("evaluate---log", &[json(&sandbox, "evaluate valve.toml --log ended.csv")]);
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn lives_in_other_worlds_are_as_documented() {
    let told = json(&Sandbox::new(), "evaluate valve.toml --scenarios --seeds 1 --only linear");
    assert_same("evaluate---scenarios", &[told]);
}

#[test]
fn small_documents_are_as_documented() {
    let sandbox = Sandbox::new();
    assert_same("effects", &[json(&sandbox, "effects")]);
    assert_same("effects-id", &[json(&sandbox, "effects dry-friction")]);
    let undated =
        ["eol_time", "replace_by", "time"].map(|key| format!("prognoses.{key} is on the page and in no document"));
    assert_eq!(differences("demo", &[json(&sandbox, "demo")], true), undated, "its log has no dates");
    assert_same("report", &[json(&sandbox, "report valve.toml --log log.csv --out report.html")]);
}

#[test]
fn comparisons_and_calibrations_are_as_documented() {
    let sandbox = with_campaigns();
    let against = "compare sample/valve.toml sample/campaign.toml --against valve.toml --residual-force";
    assert_same("compare", &[json(&sandbox, against), json(&sandbox, "compare valve.toml limit.toml")]);
    let calls = [
        "calibrate sample/valve.toml sample/campaign.toml",
        "calibrate valve.toml limit.toml --out calibrated.toml --force",
    ];
    assert_same("calibrate", &calls.map(|call| json(&sandbox, call)));
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn searches_and_adoptions_are_as_documented() {
    let sandbox = with_campaigns();
    sandbox.copy_sticking_valve("sample/");
    let calls = ["explain sample/valve.toml sample/campaign.toml", "explain valve.toml limit.toml"];
    assert_same("explain", &calls.map(|call| json(&sandbox, call)));
    let adopt = "adopt sample/valve.toml sample/campaign.toml --effect dry-friction --out better.toml";
    let calls = [format!("{adopt} --log sample/log.csv"), format!("{adopt} --force")];
    assert_same("adopt", &calls.map(|call| json(&sandbox, &call)));
    assert_same("revert", &[json(&sandbox, "revert better.toml --out back.toml")]);
}
