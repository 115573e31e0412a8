//! Logs as historians and spreadsheets write them.

use log_columns::{ColumnLog, Wanted};
use prognoser::Reading;
use proptest::prelude::*;

/// Valve, reading and date of a row.
type Row = (String, Reading, Option<String>);

fn wanted(columns: &[&str], valve: Option<&str>) -> Wanted {
    let columns = columns.iter().map(|text| text.parse().expect("is a column")).collect();
    Wanted { columns, valve: valve.map(str::to_owned), empty_is_stalled: false }
}

fn read(bytes: &[u8], wanted: &Wanted) -> Result<(Vec<Row>, Vec<String>), String> {
    let mut log = ColumnLog::read(bytes, "log.csv", wanted).map_err(|error| error.to_string())?;
    let notices = log.notices().iter().map(|(line, notice)| format!("{line}: {notice}")).collect();
    let mut rows = Vec::new();
    while let Some(row) = log.next_row().map_err(|error| error.to_string())? {
        rows.push((row.valve.to_owned(), row.reading, row.time.map(str::to_owned)));
    }
    Ok((rows, notices))
}

fn reading(cycle: u64, close_time_s: Option<f64>, open_time_s: Option<f64>) -> Reading {
    Reading { cycle, close_time_s, open_time_s, ..Reading::default() }
}

const GERMAN: &str = "Anlage Nord, Auswertung\r\n\r\n\
    Ventil;Datum;Schaltspiel;Schließzeit;Öffnungszeit;Zuluft;Bemerkung\r\n\
    ;;;ms;ms;barg;\r\n\
    FV-1;01.03.2026 06:30;7;2.016,3;4.103,9;5,17;\r\n\
    FV-1;02.03.2026 06:30;8;2.017,0;;5,2;Sensor?\r\n\
    FV-1;03.03.2026 06:30;9;stalled;4.104,0;;\r\n";

#[test]
fn a_german_export_is_read_in_whatever_encoding() {
    let (utf_16, ..) = (GERMAN.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>(), ());
    let latin: Vec<u8> = GERMAN.chars().map(|letter| u8::try_from(u32::from(letter)).expect("is Latin-1")).collect();
    for bytes in [GERMAN.as_bytes(), &[&[0xff, 0xfe][..], &utf_16].concat(), &latin] {
        let (rows, notices) = read(bytes, &Wanted::default()).expect("is a log");
        let name = || "FV-1".to_owned();
        let stalled = Reading { stalled: [true, false], ..reading(9, None, Some(4.104)) };
        let supply =
            |barg: f64, reading: Reading| Reading { supply_pressure_pa: Some(1e5 * barg + 101_325.0), ..reading };
        assert_eq!(rows.len(), 3, "{rows:?}");
        let close = |found: Reading, expected: Reading| {
            let near =
                |a: Option<f64>, b: Option<f64>| a.zip(b).map_or(a == b, |(a, b)| (a - b).abs() < 1e-9 * b.abs());
            near(found.close_time_s, expected.close_time_s)
                && near(found.open_time_s, expected.open_time_s)
                && near(found.supply_pressure_pa, expected.supply_pressure_pa)
                && (found.cycle, found.stalled) == (expected.cycle, expected.stalled)
        };
        let expected =
            [supply(5.17, reading(7, Some(2.0163), Some(4.1039))), supply(5.2, reading(8, Some(2.017), None)), stalled];
        for (index, (found, expected)) in rows.iter().zip(expected).enumerate() {
            assert!(close(found.1, expected), "{:?}", found.1);
            assert_eq!((&found.0, found.2.as_deref()), (&name(), Some(&*format!("2026-03-0{}T06:30:00Z", index + 1))));
        }
        let said = notices.join("\n");
        for words in [
            "Schließzeit as close_time, Öffnungszeit as open_time, Zuluft as supply_pressure",
            "lines before the header were skipped: 1",
            "Schließzeit in ms",
            "decimal comma",
            "dates such as \"01.03.2026 06:30\" were read as day.month.year, without a zone, taken as UTC",
        ] {
            assert!(said.contains(words), "{words}: {said}");
        }
        assert!(!said.contains("Bemerkung"));
    }
}

#[test]
fn what_is_not_in_the_file_is_said_by_options_or_counted() {
    let text = b"when,ZU,AUF\n2026-03-01,2.5,4.5\n2026-03-02,2.6,\n";
    let wanted = wanted(&["close_time_s=ZU", "open_time_s=AUF", "time=when"], Some("FV-2"));
    let (rows, notices) = read(text, &wanted).expect("is a log");
    let row = |cycle, open, date: &str| {
        ("FV-2".to_owned(), reading(cycle, Some(2.4 + 0.1 * cycle as f64), open), Some(format!("{date}T00:00:00Z")))
    };
    assert_eq!(rows, [row(1, Some(4.5), "2026-03-01"), row(2, None, "2026-03-02")]);
    assert!(notices.iter().any(|said| said.ends_with("the rows of each valve were counted from 1")), "{notices:?}");
    assert!(!notices.iter().any(|said| said.contains("taken by their names")), "{notices:?}");

    // Each valve has a count of its own.
    let text = b"tag;close_time_ms;open_time_ms\nA;1000;1100\nB;1000;1100\nA;1001;1101\n";
    let (rows, _) = read(text, &Wanted::default()).expect("is a log");
    let counts: Vec<(&str, u64)> = rows.iter().map(|(valve, reading, _)| (valve.as_str(), reading.cycle)).collect();
    assert_eq!(counts, [("A", 1), ("B", 1), ("A", 2)]);
}

#[test]
fn what_cannot_be_known_is_refused_by_name() {
    let none = Wanted::default();
    for (text, wanted, expected) in [
        (
            "valve;cycle;Laufzeit;open_time_s\nA;1;2;3\n",
            &none,
            "log.csv:1: no column tells the closing time; there are \"valve\", \"cycle\", \"Laufzeit\", \"open_time_s\". Say \
             which one and in which unit, such as --column close_time_ms=NAME",
        ),
        ("close_time_s;open_time_s\n2;3\n", &none, "--valve-name NAME if all rows are of one valve"),
        (
            "valve;cycle;close;open_time_s\nA;1;2;3\n",
            &none,
            "column \"close\" has no unit; say it: --column close_time_ms=\"close\"",
        ),
        ("valve;cycle;close [mm];open_time_s\nA;1;2;3\n", &none, "column \"close [mm]\" is in mm; expected"),
        (
            "valve;close_time_s;open_time_s;supply [bar]\nA;2;3;5\n",
            &none,
            "--column supply_pressure_barg=\"supply [bar]\" above the atmosphere, or bara for absolute",
        ),
        (
            "valve;tag;close_time_s;open_time_s;closing [s]\nA;B;2;3;5\n",
            &self::wanted(&["close_time=closng"], None),
            "there is no column \"closng\" (did you mean \"closing\"?)",
        ),
        ("ventil;tag;close_time_s;open_time_s\nA;B;2;3\n", &none, "both \"ventil\" and \"tag\" could be valve"),
        ("valve;cycle;close_time_s;open_time_s\nA;1;2;3\nA;1,5;2;3\n", &none, "log.csv:3: cycle: found \"1,5\""),
        ("valve;cycle;close_time_s;open_time_s\nA;1;-2;3\n", &none, "log.csv:2: close_time_s: found \"-2\""),
        ("valve;cycle;close_time_s;open_time_s\nA;1;fast;3\n", &none, "\"fast\" is not a number"),
        ("valve;cycle;close_time_s;open_time_s\n;1;2;3\n", &none, "log.csv:2: valve: found \"\""),
        (
            "valve;date;close_time_s;open_time_s\nA;3/1/2026;2;3\nA;13/1/2026;2;3\n",
            &none,
            "log.csv:3: column \"date\": found \"13/1/2026\", expected month/day/year as in the rows before",
        ),
        ("", &none, "the file is empty"),
    ] {
        let error = read(text.as_bytes(), wanted).expect_err(text);
        assert!(error.contains(expected), "{error}");
    }
    for (text, expected) in [
        ("close_time_ms", "a column and its name are needed"),
        ("close_time_ms=", "no name behind the equals sign"),
        ("close_time_mm=ZU", "\"mm\" is no unit of close_time"),
        ("closing=ZU", "expected one of valve, cycle, close_time_ms"),
    ] {
        let error = text.parse::<log_columns::NamedColumn>().expect_err(text);
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_plain_log_means_what_it_means_to_the_prognoser() {
    let text = "valve,cycle,close_time_s,open_time_s,time,supply_pressure_psig,temperature_degc,note\n\
        \"DV,1\",7,2.0163,4.1039,2026-03-01T06:30:00Z,75,20,x\n\
        \"DV,1\",8,,stalled,2026-03-02T06:30:00Z,,,\n";
    let (rows, notices) = read(text.as_bytes(), &Wanted::default()).expect("is a log");
    let mut plain = prognoser::TimingLog::new("log.csv", text.as_bytes()).expect("is a log");
    for (valve, reading, time) in rows {
        let row = plain.next_row().expect("is a log").expect("is a row");
        assert_eq!((row.valve, row.time), (&*valve, time.as_deref()));
        let near = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or(a == b, |(a, b)| (a - b).abs() <= 1e-6 * b);
        assert!(near(row.reading.supply_pressure_pa, reading.supply_pressure_pa), "{reading:?}");
        assert!(near(row.reading.temperature_k, reading.temperature_k), "{reading:?}");
        let bare = |reading: Reading| Reading { supply_pressure_pa: None, temperature_k: None, ..reading };
        assert_eq!(bare(row.reading), bare(reading));
    }
    assert_eq!(notices, Vec::<String>::new());
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = read(&bytes, &Wanted::default());
    }

    #[test]
    fn any_cells_are_read_or_refused(cells in proptest::collection::vec("[0-9.,;:/TZ \"a-z-]{0,12}", 4..40)) {
        let rows = cells.chunks(4).map(|row| row.join(";")).collect::<Vec<_>>().join("\n");
        let text = format!("valve;date;close_time_ms;open_time_s\n{rows}\n");
        for (valve, reading, _) in read(text.as_bytes(), &Wanted::default()).map_or_else(|_| Vec::new(), |read| read.0) {
            prop_assert!(!valve.is_empty() && !valve.contains(char::is_control));
            let times = [reading.close_time_s, reading.open_time_s];
            prop_assert!(times.into_iter().flatten().all(|time_s| (0.0..=86_400.0).contains(&time_s)));
        }
    }
}

#[test]
fn a_log_of_one_valve_needs_no_column_of_valves() {
    let rows = |names: [&str; 2]| {
        let header = if names == [""; 2] { "" } else { ",Kennung" };
        let line = |(no, name): (u64, &str)| format!("2026-05-{no:02}T06:00:00Z,{no},1.6{no},3.1{no}{name}\n");
        let lines: String = (1..9).zip(names.into_iter().cycle()).map(line).collect();
        format!("Datum,no,close_time_s,open_time_s{header}\n{lines}")
    };
    let (read_rows, notices) = read(rows([""; 2]).as_bytes(), &Wanted::default()).expect("is a log");
    assert!(read_rows.iter().all(|row| row.0 == "log") && read_rows[7].1.cycle == 8, "{read_rows:?}");
    assert!(notices.iter().any(|notice| notice.contains("called log after the file")), "{notices:?}");
    // A column that comes again may name valves, in letters or in numbers; so may cycles that fall.
    for text in [rows([",A", ",B"]), rows([",1", ",2"]), rows([""; 2]).replace(",5,", ",2,")] {
        let error = read(text.as_bytes(), &Wanted::default()).expect_err("may be of several");
        assert!(error.contains("no column tells the valve"), "{error}");
    }
}
