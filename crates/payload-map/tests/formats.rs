//! `docs/formats.md` against the code: messages and their map.

use payload_map::PayloadMap;

const PAGE: &str = include_str!("../../../docs/formats.md");

/// Key, default and example of each row of the table under a heading.
fn rows() -> Vec<[&'static str; 3]> {
    let table = PAGE.split("### map.toml\n").nth(1).expect("a heading").split("\n## ").next().expect("a part");
    let rows = table.lines().filter(|line| line.starts_with("| `"));
    rows.map(|row| {
        let mut cells = row.trim_matches('|').split('|').map(|cell| cell.trim().trim_matches('`'));
        std::array::from_fn(|_| cells.next().expect("a cell"))
    })
    .collect()
}

#[test]
fn the_message_of_the_page_is_one() {
    let message = PAGE.split("```message.json\n").nth(1).expect("a message").split("```").next().expect("its end");
    let row = PayloadMap::plain().row(None, message.as_bytes(), false).expect("is a reading");
    assert_eq!((row.valve.as_str(), row.reading.cycle, row.reading.close_time_s), ("FV-101", 7, Some(2.25)));
    assert_eq!(row.reading.supply_pressure_pa, Some(620e3));
}

#[test]
fn keys_of_the_map_are_those_of_the_page() {
    let rows = rows();
    assert_eq!(rows.len(), 7, "{rows:?}");
    let whole: Vec<String> = rows.iter().map(|[key, _, example]| format!("{key} = {example}\n")).collect();
    PayloadMap::parse(&whole.concat(), "formats.md").expect("the examples are a map");
    for (place, [key, default, _]) in rows.iter().enumerate() {
        let others: String =
            whole.iter().enumerate().filter(|(at, _)| *at != place).map(|(_, line)| line.as_str()).collect();
        let read = PayloadMap::parse(&others, "formats.md");
        assert_eq!(read.is_ok(), !default.is_empty(), "{key}");
    }
    let known = PayloadMap::parse("unknown = 1\n", "m.toml").expect_err("is no key").to_string();
    assert!(rows.iter().all(|[key, ..]| known.contains(key)), "{known}");
}
