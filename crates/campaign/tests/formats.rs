//! `docs/formats.md` and the schema against the code: campaigns, recordings and stroke times.

use std::collections::{BTreeMap, BTreeSet};

use campaign::{Campaign, ValveFacts};

const PAGE: &str = include_str!("../../../docs/formats.md");
const SCHEMA: &str = include_str!("../../../docs/schema/campaign.schema.json");
const VALVE: ValveFacts =
    ValveFacts { ambient_pressure_pa: 101_325.0, supply_pressure_pa: 620e3, temperature_k: 293.15, stroke_m: 0.02 };

fn part() -> &'static str {
    PAGE.split("\n## ").find(|part| part.starts_with("campaign.toml")).unwrap()
}

/// What stands in the fences of this kind.
fn fenced(kind: &str) -> Vec<&'static str> {
    let fence = format!("```{kind}\n");
    part().match_indices(&fence).map(|(at, _)| part()[at + fence.len()..].split("```").next().unwrap()).collect()
}

fn read(text: &str, csv: &str) -> Result<Campaign, String> {
    Campaign::parse(text, "formats.md", &VALVE, &|name| {
        Ok(if name == "timings.csv" { fenced("timings.csv")[0] } else { csv }.as_bytes().to_vec())
    })
    .map_err(|error| error.to_string())
}

/// Keys with their examples, by table.
fn documented() -> BTreeMap<String, Vec<(String, String)>> {
    let mut tables: BTreeMap<String, Vec<(String, String)>> = BTreeMap::new();
    let mut table = String::new();
    for line in part().lines() {
        if let Some(heading) = line.strip_prefix("### ") {
            heading.trim_matches(['[', ']']).clone_into(&mut table);
        }
        if line.starts_with("| `") {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            let bare = |cell: &str| cell.trim_matches('`').to_owned();
            tables.entry(table.clone()).or_default().push((bare(cells[0]), bare(cells[2])));
        }
    }
    tables
}

#[test]
fn the_whole_files_are_read() {
    let recording = fenced("run.csv")[0];
    let campaigns: Vec<Campaign> = fenced("campaign").iter().map(|text| read(text, recording).unwrap()).collect();
    let run = &campaigns[0].runs[0];
    assert_eq!((run.trace.time_s.len(), run.commands.len(), campaigns[0].planned.len()), (9, 2, 1));
    assert!((run.trace.position_m[0] - 0.02).abs() < 1e-12 && run.trace.position_m[4].abs() < 1e-12);
    assert_eq!(campaigns[1].timings.len(), 2);
}

/// A campaign with one key of one table, and a recording that fits it.
fn with(table: &str, key: &str, example: &str) -> (String, String) {
    let csv = "time_s,command,position_mm,pipe_pressure_kpa,chamber_pressure_kpa,Zeit,Y1,LVDT,PT-1,p Leitung [bara],PT-3 (kPa)\n";
    let row = |time: f64, command: u8, position: f64| {
        format!(
            "{time},{command},{position},{p},{p},{time},{command},{position},1,1.2,600\n",
            p = 400 * u32::from(command) + 100
        )
    };
    let rows = [(0.0, 1, 20.0), (0.1, 1, 10.0), (0.2, 1, 0.0), (0.3, 0, 0.0), (0.4, 0, 10.0), (0.5, 0, 20.0)];
    let mut turned = rows;
    if example.contains("-1.0") {
        for row in &mut turned {
            if key == "command" { row.1 = 1 - row.1 } else { row.2 = 25.4 - row.2 }
        }
    }
    let csv = format!("{csv}{}", turned.map(|(time, command, position)| row(time, command, position)).concat());
    let run = "[[run]]\nfile = \"run.csv\"\nsupply_pressure = \"5.2 barg\"\ntemperature = \"20 degC\"\n";
    let text = match (table, key) {
        ("", "name") => format!("name = {example}\n{run}"),
        ("run", "name" | "commands" | "end") => {
            let commands = "commands = [ { at = \"0 s\", close = true } ]\n";
            let commands = if key == "commands" { "" } else { commands };
            format!("name = \"c\"\n[[run]]\n{commands}{key} = {example}\n")
        }
        ("run", key) => {
            let kept: Vec<&str> = run.lines().filter(|line| line.split(" = ").next() != Some(key)).collect();
            format!("name = \"c\"\n{}\n{key} = {example}\n", kept.join("\n"))
        }
        ("timings", "columns") => format!("name = \"c\"\n[timings]\nfile = \"own.csv\"\ncolumns = {example}\n"),
        ("timings", key) => format!("name = \"c\"\n[timings]\n{key} = {example}\n"),
        ("command_from", key) => {
            let all = [("channel", "\"pipe_pressure\""), ("threshold", "\"2 barg\"")];
            let rest: Vec<String> = all
                .iter()
                .filter(|(other, _)| *other != key)
                .map(|(key, value)| format!("{key} = {value}\n"))
                .collect();
            format!("name = \"c\"\n[command_from]\n{key} = {example}\n{}{run}", rest.concat())
        }
        (table, key) => format!("name = \"c\"\n[{table}]\n{key} = {example}\n{run}"),
    };
    let own = "Schliesszeit [ms],open_time_s\n1042,2.1\n".to_owned();
    (text, if table == "timings" { own } else { csv })
}

#[test]
fn every_documented_example_is_read() {
    let mut count = 0;
    for (table, keys) in documented() {
        for (key, example) in keys {
            let (text, csv) = with(&table, &key, &example);
            if let Err(error) = read(&text, &csv) {
                panic!("{table}.{key} = {example}: {error}\n{text}");
            }
            count += 1;
        }
    }
    assert!(count > 30, "{count}");
}

#[test]
fn every_key_that_the_reader_knows_is_documented() {
    // Each table refuses an unknown key and lists those that it knows.
    for table in ["sensors", "uncertainty", "columns", "command_from", "inputs", "run", "timings"] {
        let header = if table == "run" { "[[run]]".to_owned() } else { format!("[{table}]") };
        let refusal = read(&format!("name = \"c\"\n{header}\nno_such_key = 1\n"), "").unwrap_err();
        let known: BTreeSet<&str> = refusal.split("expected one of ").nth(1).unwrap().split(", ").collect();
        let documented = documented();
        let keys: BTreeSet<&str> = documented[table].iter().map(|(key, _)| key.as_str()).collect();
        assert_eq!(keys, known, "{table}");
    }
}

#[test]
fn the_schema_has_the_documented_keys() {
    let schema: serde_json::Value = serde_json::from_str(SCHEMA).unwrap();
    for (table, keys) in documented() {
        let place = match table.as_str() {
            "" => continue,
            "run" => &schema["properties"]["run"]["items"]["properties"],
            table => &schema["properties"][table]["properties"],
        };
        let known: BTreeSet<&str> = place.as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(known, keys.iter().map(|(key, _)| key.as_str()).collect(), "{table}");
    }
}
