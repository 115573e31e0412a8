//! `docs/formats.md` and the schema against the code: valve files.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use valve_file::ValveFile;
use valve_model::ParameterId;

const PAGE: &str = include_str!("../../../docs/formats.md");
const SCHEMA: &str = include_str!("../../../docs/schema/valve.schema.json");

/// The part of the page about valve files.
fn part() -> &'static str {
    PAGE.split("\n## ").find(|part| part.starts_with("valve.toml")).unwrap()
}

/// Keys with their examples, by table.
fn documented() -> BTreeMap<String, Vec<(String, String)>> {
    let mut tables: BTreeMap<String, Vec<(String, String)>> = BTreeMap::new();
    let mut table = String::new();
    for line in part().lines() {
        if let Some(heading) = line.strip_prefix("### ") {
            heading.trim_matches(['[', ']']).clone_into(&mut table);
        }
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        if line.starts_with("| `") {
            let bare = |cell: &str| cell.trim_matches('`').to_owned();
            tables.entry(table.clone()).or_default().push((bare(cells[0]), bare(cells[2])));
        }
    }
    tables
}

fn whole_file() -> &'static str {
    part().split("```valve\n").nth(1).unwrap().split("```").next().unwrap()
}

/// The whole file with one key set otherwise.
fn with(table: &str, key: &str, value: &str) -> String {
    let mut inside = table.is_empty();
    let mut done = false;
    let mut text = String::new();
    for line in whole_file().lines() {
        if line.starts_with('[') {
            inside = line == format!("[{table}]");
        }
        if inside && line.split(" = ").next() == Some(key) {
            let _ = writeln!(text, "{key} = {value}");
            done = true;
        } else {
            text.push_str(line);
            text.push('\n');
        }
    }
    assert!(done, "the whole file lacks {table}.{key}");
    text
}

#[test]
fn the_whole_file_is_read_without_a_doubt() {
    let file = ValveFile::parse(whole_file(), "formats.md").unwrap();
    assert_eq!(file.doubts(), []);
}

#[test]
fn every_parameter_is_documented() {
    let documented = documented();
    for id in ParameterId::ALL {
        let keys = documented.get(id.section()).unwrap_or_else(|| panic!("[{}] is not documented", id.section()));
        assert!(keys.iter().any(|(key, _)| key == id.name()), "{} is not documented", id.key());
    }
}

#[test]
fn every_documented_example_is_read() {
    let mut count = 0;
    for (table, keys) in documented() {
        for (key, example) in keys {
            let text = with(&table, &key, &example);
            if let Err(error) = ValveFile::parse(&text, "formats.md") {
                panic!("{table}.{key} = {example}: {error}");
            }
            count += 1;
        }
    }
    assert!(count > 25, "{count}");
}

#[test]
fn the_schema_has_the_documented_keys() {
    let schema: serde_json::Value = serde_json::from_str(SCHEMA).unwrap();
    for (table, keys) in documented() {
        let place = match table.as_str() {
            "" | "tolerance" => continue,
            table => &schema["properties"][table]["properties"],
        };
        let known: BTreeSet<&str> = place.as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(known, keys.iter().map(|(key, _)| key.as_str()).collect(), "{table}");
    }
}
