//! Files as recorders, spreadsheets and loggers write them.

use column_source::{Clock, ColumnSource, Comments, NoticeKind, TextSource};

struct Table {
    names: Vec<String>,
    units: Vec<Option<String>>,
    lines: Vec<usize>,
    numbers: Vec<Vec<f64>>,
    notices: Vec<String>,
}

fn open(bytes: &[u8]) -> TextSource {
    TextSource::new(bytes, "t.csv", Comments::WhereNoNames).unwrap()
}

fn read(bytes: &[u8]) -> Table {
    let mut source = open(bytes);
    let count = source.headings().len();
    let (mut lines, mut numbers) = (Vec::new(), Vec::new());
    while let Some(line) = source.next_row().unwrap() {
        lines.push(line);
        numbers.push((0..count).map(|column| source.number(column).unwrap()).collect());
    }
    let headings = source.headings();
    Table {
        names: headings.iter().map(|heading| heading.bare().to_owned()).collect(),
        units: headings.iter().map(|heading| heading.unit.as_ref().map(|unit| unit.text().to_owned())).collect(),
        lines,
        numbers,
        notices: source.notices().iter().map(|notice| format!("{}: {}", notice.line, notice.kind)).collect(),
    }
}

fn refusal(bytes: &[u8]) -> String {
    match TextSource::new(bytes, "t.csv", Comments::WhereNoNames) {
        Err(error) => error.to_string(),
        Ok(mut source) => loop {
            match source.next_row() {
                Err(error) => return error.to_string(),
                Ok(None) => panic!("not refused"),
                Ok(Some(_)) => {
                    let bad = (0..source.headings().len()).find_map(|column| source.number(column).err());
                    if let Some(error) = bad {
                        return error.to_string();
                    }
                }
            }
        },
    }
}

fn utf_16(text: &str, little: bool, mark: bool) -> Vec<u8> {
    let units = mark.then_some('\u{feff}').into_iter().chain(text.chars()).collect::<String>();
    units.encode_utf16().flat_map(|unit| if little { unit.to_le_bytes() } else { unit.to_be_bytes() }).collect()
}

#[test]
fn the_plain_case_needs_no_word() {
    let table = read(b"a,b\n1.5,2\n# pause\n\n-3e-1,NaN\n");
    assert_eq!((table.names, table.lines), (vec!["a".to_owned(), "b".to_owned()], vec![2, 5]));
    assert_eq!(table.numbers[0], [1.5, 2.0]);
    assert!(table.numbers[1][0] == -0.3 && table.numbers[1][1].is_nan());
    assert_eq!(table.notices, [""; 0]);
}

#[test]
fn what_historians_write_for_no_value_is_a_gap_and_other_words_are_refused() {
    let table = read(b"a;b\n1.5;Bad Input\nNO DATA;2\nI/O Timeout;3\n");
    assert!(table.numbers[0][1].is_nan() && table.numbers[1][0].is_nan() && table.numbers[2][0].is_nan());
    assert_eq!(table.numbers[2][1], 3.0);
    assert!(refusal(b"a;b\n1;2\n1;slow\n").contains("\"slow\" is not a number"));
}

#[test]
fn separators_decimals_and_units_of_a_german_recorder() {
    let text = "\u{feff}# Rekorder 7\r\nZeit;Weg;Druck\r\ns;mm;bar(g)\r\n0,000;25,40;\r\n1.000,001;25,38;5,1\r\n";
    let table = read(text.as_bytes());
    assert_eq!(table.units, [Some("s".into()), Some("mm".into()), Some("bar(g)".into())]);
    assert_eq!(table.numbers[1], [1000.001, 25.38, 5.1]);
    assert!(table.numbers[0][2].is_nan());
    assert_eq!(
        table.notices,
        [
            "3: the row under the header was taken as units: Zeit in s, Weg in mm, Druck in bar(g)",
            "4: numbers such as \"0,000\" were read with a decimal comma",
            "4: \".\" in numbers such as \"1.000,001\" was taken as a thousands separator",
        ]
    );
}

#[test]
fn units_in_brackets_and_quoted_thousands() {
    let table = read(b"Time [ms],\"Position, valve (mm)\",p / kPa\n\"1,000\",25.4,101.3\n\"1,001.5\",25.4,101.3\n");
    assert_eq!(table.names, ["Time", "Position, valve", "p"]);
    assert_eq!(table.units, [Some("ms".into()), Some("mm".into()), Some("kPa".into())]);
    assert_eq!((table.numbers[0][0], table.numbers[1][0]), (1000.0, 1001.5));
    assert!(table.notices[0].contains("thousands separator"));
}

#[test]
fn every_usual_encoding_is_read() {
    let text = "Zeit\tÖffnung\n0\t1,5\n1\t2,5\n";
    let latin: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
    let encoded = [
        (utf_16(text, true, true), Some("read as UTF-16LE")),
        (utf_16(text, false, true), Some("read as UTF-16BE")),
        (utf_16(text, true, false), Some("read as UTF-16LE")),
        (latin, Some("read as Windows-1252 (Latin-1)")),
        (text.as_bytes().to_vec(), None),
    ];
    for (bytes, notice) in encoded {
        let table = read(&bytes);
        assert_eq!(table.names, ["Zeit", "Öffnung"]);
        assert_eq!(table.numbers, [[0.0, 1.5], [1.0, 2.5]]);
        assert_eq!(
            table.notices.iter().any(|said| notice.is_some_and(|notice| said.contains(notice))),
            notice.is_some()
        );
    }
}

#[test]
fn lines_before_the_header_are_skipped_and_said() {
    let text = "Device: Logger 4\nDate;2026-03-01;;\n\nZeit;Weg;Ventil;\ns;mm;-;\n0;1;1;\n1;2;0;\n2;2;0;\n3;2;0;\n";
    let table = read(text.as_bytes());
    assert_eq!(table.names[..3], ["Zeit", "Weg", "Ventil"]);
    assert_eq!(table.lines[0], 6);
    assert_eq!(table.notices[0], "4: lines before the header were skipped: 2");
}

#[test]
fn a_hash_begins_a_name_where_it_can() {
    let text = "# a log\nvalve,cycle,close_time_s\n#12,1,1.5\n#13,1,1.6\nA,2,1.6\n";
    let mut log = TextSource::new(text.as_bytes(), "t.csv", Comments::BeforeHeader).unwrap();
    assert_eq!(log.next_row().unwrap(), Some(3));
    assert_eq!(log.field(0), "#12");
    // Also where nobody said so, if the other rows show it.
    let text = "name,close_time_s\nA,1.5\nB,1.5\n#3,1.6\n";
    let mut table = open(text.as_bytes());
    let lines: Vec<usize> = std::iter::from_fn(|| table.next_row().unwrap()).collect();
    assert_eq!(lines, [2, 3, 4]);
}

#[test]
fn a_last_row_that_was_cut_off_is_left_out_and_said() {
    let rows: Vec<String> = (0..20).map(|row| format!("0.{row:03},1,25.{row:03}\n")).collect();
    let whole = format!("t,c,x\n{}", rows.concat());
    for (cut, rows) in [(1, 20), (2, 19), (5, 19), (8, 19), (10, 19)] {
        let table = read(&whole.as_bytes()[..whole.len() - cut]);
        assert_eq!(table.numbers.len(), rows, "{cut} bytes");
        let said = table.notices == ["21: the last row is cut off; it was left out"];
        assert_eq!(said, rows == 19, "{cut} bytes: {:?}", table.notices);
    }
}

#[test]
fn what_is_no_table_is_refused_with_its_line() {
    for (bytes, expected) in [
        (&b""[..], "t.csv:1: the file is empty"),
        (b"# only a comment\n", "t.csv:1: the file is empty"),
        (b"a,b\n1,\x01\n", "t.csv:2: is not text"),
        (b"a,b\n1,2\n1,2,3\n1,2\n", "t.csv:3: has 3 fields; expected 2"),
        (b"a,b\n1,fast\n", "t.csv:2: column \"b\": \"fast\" is not a number"),
        (b"a;b\n1,5;2\n1,5;2.5\n", "t.csv:2: column \"a\": \"1,5\" mixes separators; expected a decimal point"),
        (b"\x1f\x8b\x08broken", "t.csv:1: cannot be unpacked"),
    ] {
        let found = refusal(bytes);
        assert!(found.starts_with(expected), "{found}");
    }
    let long = [b"a,b\n".as_slice(), &vec![b'1'; 10_000_000]].concat();
    assert!(refusal(&long).starts_with("t.csv:2: a line of 10000000 bytes"));
}

#[cfg(feature = "gzip")]
#[test]
fn compressed_text_is_unpacked() {
    use std::io::Write;
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packer.write_all(b"a,b\n1,2\n").unwrap();
    assert_eq!(read(&packer.finish().unwrap()).numbers, [[1.0, 2.0]]);
}

proptest::proptest! {
    #[test]
    fn numbers_come_back_however_they_are_written(
        numbers in proptest::collection::vec((-9_999_999i64..9_999_999, -9_999_999i64..9_999_999), 2..30),
        decimals in 1usize..4,
        way in 0usize..6,
    ) {
        let (delimiter, decimal, thousands) =
            [(',', '.', None), (';', ',', None), ('\t', ',', None), (';', ',', Some('.')), (';', '.', Some(',')), ('\t', '.', Some('\''))][way];
        let write = |number: i64| {
            let scale = 10i64.pow(u32::try_from(decimals).unwrap());
            let (whole, part) = (number.abs() / scale, number.abs() % scale);
            let mut groups = whole.to_string();
            if let Some(separator) = thousands {
                for place in (1..groups.len()).rev().filter(|place| (groups.len() - place) % 3 == 0).collect::<Vec<_>>() {
                    groups.insert(place, separator);
                }
            }
            format!("{}{groups}{decimal}{part:0decimals$}", if number < 0 { "-" } else { "" })
        };
        let value = |number: i64| number as f64 / 10f64.powi(i32::try_from(decimals).unwrap());
        let rows: Vec<String> = numbers.iter().map(|(a, b)| format!("{}{delimiter}{}\n", write(*a), write(*b))).collect();
        let table = read(format!("a{delimiter}b\n{}", rows.concat()).as_bytes());
        for (row, (a, b)) in table.numbers.iter().zip(&numbers) {
            proptest::prop_assert!((row[0] - value(*a)).abs() < 1e-9 && (row[1] - value(*b)).abs() < 1e-9, "{:?}", table.notices);
        }
        proptest::prop_assert_eq!(table.numbers.len(), numbers.len());
    }

    #[test]
    fn no_bytes_make_the_reader_panic(bytes in proptest::collection::vec(proptest::num::u8::ANY, 0..400)) {
        if let Ok(mut source) = TextSource::new(&bytes, "t.csv", Comments::WhereNoNames) {
            while let Ok(Some(_)) = source.next_row() {
                for column in 0..source.headings().len() {
                    let _ = source.number(column);
                }
            }
        }
    }
}

#[test]
fn notices_are_of_their_kind() {
    let source = open(b"t;x\n0,1;1,5\n0,2;1,5\n");
    assert!(matches!(source.notices()[0].kind, NoticeKind::DecimalComma { .. }));
}

#[test]
fn columns_without_names_are_numbered_and_no_row_is_lost() {
    let table = read(b"0.000\t3.427\t-0.009\n11.000\t3.426\t0.004\n22.000\t3.426\t0.000\n");
    assert_eq!(table.names, ["column 1", "column 2", "column 3"]);
    assert_eq!((table.lines, &table.numbers[0]), (vec![1, 2, 3], &vec![0.0, 3.427, -0.009]));
    let said = "1: no line names the columns; from left to right they are called \"column 1\" to \"column 3\"";
    assert_eq!(table.notices, [said]);
    // Notes above the rows name nothing; neither does a single column's lack of a word.
    let table = read(b"bench 7, second try\n# by hand\n0;1,5\n1;1,6\n2;1,7\n");
    assert_eq!((table.names.len(), table.numbers.len(), table.lines[0]), (2, 3, 3));
    assert_eq!(table.numbers[1], [1.0, 1.6]);
    assert_eq!(read(b"1.5\n2.5\n3.5\n").numbers, [[1.5], [2.5], [3.5]]);
    // A gap in the first row is a gap; names that are numbers but for one are names.
    assert!(read(b"0.0,,1\n0.1,2,1\n0.2,2,1\n").numbers[0][1].is_nan());
    assert_eq!(read(b"time,1,2\n0.0,5,6\n0.1,5,6\n").names, ["time", "1", "2"]);
    assert_eq!(read(b"x\n1\n2\n").names, ["x"]);
}

#[test]
fn a_date_beside_a_time_of_the_day_is_a_moment() {
    let text = "id,date,time,Hub\n3,2026-02-28,23:59:59.5,1\n4,2026-03-01,00:00:01.0,2\n";
    let mut source = open(text.as_bytes());
    let (mut clock, mut times_s) = (Clock::default(), Vec::new());
    while let Some(line) = source.next_row().unwrap() {
        times_s.push(clock.seconds(&source.field(2), line).unwrap());
    }
    assert_eq!(times_s, [0.0, 1.5]);
    let said: Vec<String> = source.notices().iter().map(|notice| notice.kind.to_string()).collect();
    assert_eq!(said, ["the date in \"date\" and the time of the day in \"time\" were taken together"]);
    // Two such columns cannot be told apart, and are left as they stand.
    let mut two = open(b"date,on,off\n2026-03-01,10:00:00,10:00:02\n2026-03-01,10:01:00,10:01:02\n");
    two.next_row().unwrap();
    assert_eq!((two.field(1).as_ref(), two.notices().len()), ("10:00:00", 0));
}

#[test]
fn a_measurement_file_of_labview_is_read() {
    let text = "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n\
                X_Columns\tOne\nTime_Pref\tRelative\nDate\t2026/03/01\nTime\t10:00:00.25\n***End_of_Header***\t\n\t\n\
                Channels\t2\t\t\nSamples\t4\t4\t\nDate\t2026/03/01\t2026/03/01\t\nTime\t10:00:00.25\t10:00:00.25\t\n\
                Y_Unit_Label\tmm\tbar\t\nX_Dimension\tTime\tTime\t\nX0\t0.0000000000000000E+0\t0.0000000000000000E+0\t\n\
                Delta_X\t0.001000\t0.001000\t\n***End_of_Header***\t\t\t\nX_Value\tWeg\tDruck\tComment\n";
    let rows = (0..60).map(|row| format!("{:.6}\t25.4\t0.{row:02}\t\n", f64::from(row) * 1e-3));
    let table = read((text.to_owned() + &rows.collect::<String>()).as_bytes());
    assert_eq!(table.names, ["X_Value", "Weg", "Druck", "Comment"], "{:?}", table.notices);
    assert_eq!((table.numbers.len(), &table.numbers[3][..3]), (60, &[0.003, 25.4, 0.03][..]));
}

#[test]
fn exports_of_scopes_and_loggers_are_read() {
    // A scope's CSV: settings, names, units, an empty line.
    let pico = "Time,Channel A,Channel B\n(ms),(V),(V)\n\n0.00000,1.5,0.1\n0.00100,1.6,0.1\n0.00200,1.7,0.1\n";
    let table = read(pico.as_bytes());
    assert_eq!((table.names[0].as_str(), table.units[0].as_deref()), ("Time", Some("ms")));
    assert_eq!(table.numbers[2][1], 1.7);
    let tektronix = "Model,DPO2024\nFirmware Version,1.52\n\nPoint Format,Y,\nHorizontal Units,S,\nSample Interval,1e-3,\n\
                     Record Length,60,\n,,\nTIME,CH1,CH2\n-1.0e-3,0.12,2.0\n";
    let rows = (0..60).map(|row| format!("{row}e-3,0.14,2.1\n"));
    let table = read((tektronix.to_owned() + &rows.collect::<String>()).as_bytes());
    assert_eq!(table.names, ["TIME", "CH1", "CH2"]);
    assert_eq!(table.numbers[0], [-1e-3, 0.12, 2.0]);
    // A controller's log: quoted fields, a name for each value's state.
    let wincc = "\"VarName\";\"TimeString\";\"VarValue\";\"Validity\";\"Time_ms\"\r\n\"Weg\";\"01.03.2026 10:00:00\";12,5;1;46082416666,6667\r\n\
                 \"Weg\";\"01.03.2026 10:00:01\";12,6;1;46082416678,2407\r\n";
    let table = read_text(wincc.as_bytes(), &[2]);
    assert_eq!(table, [[12.5], [12.6]]);
}

fn read_text(bytes: &[u8], columns: &[usize]) -> Vec<Vec<f64>> {
    let mut source = open(bytes);
    let mut rows = Vec::new();
    while source.next_row().unwrap().is_some() {
        rows.push(columns.iter().map(|column| source.number(*column).unwrap()).collect());
    }
    rows
}

#[test]
fn a_header_within_the_rows_is_left_out_and_counted() {
    let table = read(b"Time;Hub\ns;mm\n0,1;1,5\nTime;Hub\ns;mm\n0,2;1,6\n Time ;Hub\n0,3;1,7\n");
    assert_eq!((table.lines, table.numbers), (vec![3, 6, 8], vec![vec![0.1, 1.5], vec![0.2, 1.6], vec![0.3, 1.7]]));
    assert_eq!(table.notices.last().unwrap(), "4: 2 rows are the header again; left out");
    let table = read(b"a,b\n1,2\n3,4\na,b\n5,6\n7,8\n");
    assert_eq!(
        (table.numbers.len(), &table.notices[..]),
        (4, &["4: one row is the header again; left out".to_owned()][..])
    );
    // A row of other words is none.
    assert!(refusal(b"a,b\n1,2\n3,4\na,c\n5,6\n").contains("\"a\" is not a number"));
}

#[test]
fn a_unit_in_the_heading_and_another_one_under_it_are_refused() {
    let refused = refusal(b"Zeit (s);Weg\nms;mm\n0;1\n1;2\n");
    let expected =
        "t.csv:2: column \"Zeit (s)\" is in s by its heading and in ms by the row of units under it; expected one";
    assert!(refused.starts_with(expected), "{refused}");
    assert!(refusal(b"t [s];p [barg]\ns;bara\n0;1\n1;2\n").contains("in barg by its heading and in bara by"));
    // The same in other words, and a unit that says less, contradict nothing.
    let units = |text: &str| read(text.as_bytes()).units;
    assert_eq!(units("t (sec);p [barg]\ns;bar\n0;1\n1;2\n"), [Some("s".to_owned()), Some("barg".to_owned())]);
    assert_eq!(units("t (s);p [bar]\nsec;bar(g)\n0;1\n1;2\n"), [Some("s".to_owned()), Some("bar(g)".to_owned())]);
}
