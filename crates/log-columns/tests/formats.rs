//! `docs/formats.md` against the code: timing logs.

use log_columns::{Channel, ColumnLog, NamedColumn, Wanted};
use prognoser::Reading;

const PAGE: &str = include_str!("../../../docs/formats.md");

/// The block of this name.
fn block(name: &str) -> &'static str {
    let start = PAGE.split_once(&format!("```{name}\n")).expect("is on the page").1;
    start.split_once("```").expect("ends").0
}

fn readings(text: &str) -> Vec<Reading> {
    let mut log = ColumnLog::read(text.as_bytes(), "formats.md", &Wanted::default()).expect("is a log");
    let mut readings = Vec::new();
    while let Some(row) = log.next_row().expect("is a row") {
        assert_eq!(row.valve, "FV-101");
        assert!(row.time.is_some_and(|time| time.ends_with("T06:30:00Z")), "{row:?}");
        readings.push(row.reading);
    }
    readings
}

#[test]
fn both_logs_of_the_page_say_the_same() {
    let (plain, other) = (readings(block("log.csv")), readings(block("other-log.csv")));
    assert_eq!((plain.len(), other.len()), (2, 2));
    for (plain, other) in plain.iter().zip(&other) {
        assert_eq!((plain.cycle, plain.stalled), (other.cycle, other.stalled));
        assert_eq!((plain.close_time_s, plain.open_time_s), (other.close_time_s, other.open_time_s));
        let pascal = plain.supply_pressure_pa.zip(other.supply_pressure_pa).expect("are told");
        assert!((pascal.0 - pascal.1).abs() < 1e3, "{pascal:?}");
    }
}

#[test]
fn columns_of_the_page_are_known() {
    let section =
        PAGE.split_once("## Timing log").expect("is on the page").1.split_once("## Messages").expect("follows").0;
    let named: Vec<NamedColumn> = section
        .split('`')
        .filter_map(|code| code.strip_prefix("--column "))
        .map(|code| code.parse().expect("is a column"))
        .collect();
    for channel in Channel::ALL {
        assert!(named.iter().any(|column| column.channel == channel), "{channel:?}");
    }
}
