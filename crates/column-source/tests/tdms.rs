//! TDMS files: the same as the text of the same record, whatever way they are written; else refused in words.
#![cfg(feature = "tdms")]

use column_source::{ColumnSource, Comments, RecordError, find_table, open};

#[path = "made/tdms.rs"]
mod made;

use made::{Data, Form, Object, PLAIN, Value, framed, raw, segment};

/// Names, units and rows of a table.
type Table = (Vec<String>, Vec<Option<String>>, Vec<Vec<f64>>);

fn opened(bytes: &[u8]) -> Result<Box<dyn ColumnSource>, RecordError> {
    open(bytes, "run.tdms", Comments::WhereNoNames)
}

fn table(source: &mut dyn ColumnSource) -> Result<Table, RecordError> {
    let names = source.headings().iter().map(|heading| heading.name.clone()).collect();
    let units: Vec<_> =
        source.headings().iter().map(|heading| heading.unit.as_ref().map(|unit| unit.text().to_owned())).collect();
    let mut rows = Vec::new();
    while source.next_row()?.is_some() {
        rows.push((0..units.len()).map(|column| source.number(column)).collect::<Result<Vec<_>, _>>()?);
    }
    Ok((names, units, rows))
}

fn read(bytes: &[u8]) -> Table {
    table(opened(bytes).expect("a TDMS file").as_mut()).expect("numbers")
}

fn refusal(bytes: &[u8]) -> String {
    opened(bytes).and_then(|mut source| table(source.as_mut())).expect_err("a refusal").to_string()
}

/// A waveform of three channels in the types that recorders use.
fn bench() -> Vec<Object> {
    let group = Object { path: "/'Bench'".to_owned(), properties: Vec::new(), data: None };
    let sampled =
        |channel: Object| channel.with("wf_increment", Value::Number(0.25)).with("wf_start_offset", Value::Number(0.5));
    vec![
        group.with("operator", Value::Text("nobody")),
        sampled(Object::channel("Bench", "Weg", Data::Double(vec![25.4, 25.0, f64::NAN, 3.5])))
            .with("unit_string", Value::Text("mm")),
        sampled(Object::channel("Bench", "p [barg]", Data::Single(vec![5.5, 5.25, 4.0, -0.5])))
            .with("unit_string", Value::Text("Volts")),
        sampled(Object::channel("Bench", "Y1", Data::Boolean(vec![0, 1, 1, 0]))),
        sampled(Object::channel("Bench", "code", Data::Short(vec![-3, 2, 300, -32768]))),
    ]
}

const TEXT: &str = "time_s,Weg,p [barg],Y1,code\ns,mm,,,\n0.5,25.4,5.5,0,-3\n0.75,25.0,5.25,1,2\n1.0,,4.0,1,300\n\
                    1.25,3.5,-0.5,0,-32768\n";

#[test]
fn a_record_is_the_same_as_its_text_in_every_form() {
    let (names, units, rows) = table(opened(TEXT.as_bytes()).expect("text").as_mut()).expect("numbers");
    for (big, interleaved, chunks) in
        [(false, false, 1), (false, false, 2), (false, true, 1), (true, false, 1), (true, false, 4), (true, true, 1)]
    {
        let form = Form { big, interleaved, chunks };
        let found = read(&segment(&bench(), form));
        assert_eq!(found.0, names, "{form:?}");
        // The text says of a time in seconds what it says of itself.
        assert_eq!(found.1[1..], units[1..], "{form:?}");
        assert_eq!(format!("{:?}", found.2), format!("{rows:?}"), "{form:?}");
    }
}

#[test]
fn values_go_on_in_later_segments() {
    let once = segment(&bench(), PLAIN);
    // The same channels again: without a word, as before each, and with only one of them.
    let values = raw(&bench(), PLAIN);
    let silent = framed(&[], &values, 1 << 3, PLAIN);
    let (_, _, rows) = read(&[once.clone(), silent.clone(), silent].concat());
    assert_eq!(rows.len(), 12);
    assert_eq!(rows[11], [3.25, 3.5, -0.5, 0.0, -32768.0]);
    let mut metadata = 1_u32.to_le_bytes().to_vec();
    metadata.extend(12_u32.to_le_bytes());
    metadata.extend(b"/'Bench'/'Y'");
    metadata.extend(0_u32.to_le_bytes());
    metadata.extend(0_u32.to_le_bytes());
    let never = [once, framed(&metadata, &values, 0b1110, PLAIN)].concat();
    assert!(refusal(&never).contains("/'Bench'/'Y' is to be as before, and never was"), "{}", refusal(&never));
}

#[test]
fn times_of_the_clock_and_texts_are_read_as_in_text() {
    // 2026-03-01 12:00:00 UTC, and half a second more.
    let start = 2_082_844_800 + 1_772_366_400;
    let objects = [
        Object::channel("log", "when", Data::Time(vec![(start, 0), (start, 1 << 63)])),
        Object::channel("log", "valve", Data::Text(vec!["FV-101", "Öl"])),
        Object::channel("log", "close_time_s", Data::Double(vec![1.5, 2.5])).with("wf_increment", Value::Number(1.0)),
    ];
    for big in [false, true] {
        let mut source = opened(&segment(&objects, Form { big, ..PLAIN })).expect("a TDMS file");
        // A column of times is there, so none is made.
        assert_eq!(source.headings().len(), 3);
        let mut fields = Vec::new();
        while source.next_row().expect("a row").is_some() {
            fields.push((
                source.field(0).into_owned(),
                source.field(1).into_owned(),
                source.number(2).expect("a number"),
            ));
        }
        assert_eq!(fields[0], ("2026-03-01T12:00:00Z".to_owned(), "FV-101".to_owned(), 1.5));
        assert_eq!(fields[1], ("2026-03-01T12:00:00.5Z".to_owned(), "Öl".to_owned(), 2.5));
    }
}

#[test]
fn codes_of_a_converter_are_scaled() {
    let linear = |channel: Object| {
        channel
            .with("NI_Number_Of_Scales", Value::Count(2))
            .with("NI_Scale[0]_Scale_Type", Value::Text("Polynomial"))
            .with("NI_Scale[0]_Polynomial_Coefficients_Size", Value::Count(3))
            .with("NI_Scale[0]_Polynomial_Coefficients[0]", Value::Number(1.0))
            .with("NI_Scale[0]_Polynomial_Coefficients[1]", Value::Number(0.0))
            .with("NI_Scale[0]_Polynomial_Coefficients[2]", Value::Number(2.0))
            .with("NI_Scale[0]_Polynomial_Input_Source", Value::Count(u32::MAX))
            .with("NI_Scale[1]_Scale_Type", Value::Text("Linear"))
            .with("NI_Scale[1]_Linear_Slope", Value::Number(10.0))
            .with("NI_Scale[1]_Linear_Y_Intercept", Value::Number(-5.0))
            .with("NI_Scale[1]_Linear_Input_Source", Value::Count(0))
    };
    let codes = || Object::channel("g", "x", Data::Short(vec![0, -1, 2]));
    assert_eq!(read(&segment(&[linear(codes())], PLAIN)).2, [[5.0], [25.0], [85.0]]);
    let done = linear(codes()).with("NI_Scaling_Status", Value::Text("scaled"));
    assert_eq!(read(&segment(&[done], PLAIN)).2, [[0.0], [-1.0], [2.0]]);
    // What cannot be scaled is refused when it is asked for, and stands in nobody's way before.
    let other = codes()
        .with("NI_Number_Of_Scales", Value::Count(1))
        .with("NI_Scale[0]_Scale_Type", Value::Text("Thermocouple"));
    let words = refusal(&segment(&[other], PLAIN));
    let expected = "run.tdms:1: holds values to be scaled by the kind \"Thermocouple\" in column \"x\", which this program \
                    does not read; save it scaled, or export it as CSV";
    assert_eq!(words, expected);
    // A scale that feeds on itself ends.
    let circle = codes()
        .with("NI_Number_Of_Scales", Value::Count(1))
        .with("NI_Scale[0]_Scale_Type", Value::Text("AdvancedAPI"))
        .with("NI_Scale[0]_AdvancedAPI_Input_Source", Value::Count(0));
    assert!(refusal(&segment(&[circle], PLAIN)).contains("takes its input from scale 0"));
}

/// Goes to the table with what is looked for.
fn find<T>(
    source: &mut dyn ColumnSource,
    wanted: &dyn Fn(&dyn ColumnSource) -> Result<T, RecordError>,
) -> Result<T, RecordError> {
    find_table(source, wanted, |one| one.headings().len())
}

#[test]
fn of_several_groups_the_one_with_the_columns_is_read() {
    let column = |group: &str, name: &str, values: Vec<f64>| Object::channel(group, name, Data::Double(values));
    let bytes = segment(
        &[
            column("Bench", "time_s", vec![0.0, 1.0]),
            column("Bench", "Weg", vec![5.0, 6.0]),
            column("Noise", "a", vec![1.0; 8]),
            column("Bench", "rate", vec![100.0]),
            column("It's", "Weg", vec![7.0, 8.0, 9.0]),
        ],
        PLAIN,
    );
    let mut source = opened(&bytes).expect("a TDMS file");
    assert_eq!(source.table(), Some("group \"Noise\""));
    let named = |source: &dyn ColumnSource, names: [&str; 2]| {
        let place = |name: &str| {
            let found = source.headings().iter().position(|heading| heading.name == source.within_table(name));
            found.ok_or_else(|| source.error(1, column_source::RecordProblem::Empty))
        };
        Ok::<_, RecordError>((place(names[0])?, place(names[1])?))
    };
    assert_eq!(find(source.as_mut(), &|one| named(one, ["time_s", "Weg"])), Ok((0, 1)));
    assert_eq!(table(source.as_mut()).expect("numbers").2, [[0.0, 5.0], [1.0, 6.0]]);
    let said = source.notices()[0].kind.to_string();
    let expected =
        "group \"Bench\" (rows: 2) was read, and not group \"Noise\", group \"It's\", group \"Bench\" (rows: 1)";
    assert_eq!(said, expected);
    let two = find(source.as_mut(), &|one| named(one, ["Weg", "Weg"])).expect_err("two have it").to_string();
    assert!(two.contains("group \"Bench\" (rows: 2) and group \"It's\" all have the columns"), "{two}");
    assert_eq!(find(source.as_mut(), &|one| named(one, ["It's/Weg", "Weg"])), Ok((0, 0)));
    assert!(find(source.as_mut(), &|one| named(one, ["time_s", "a"])).is_err());
    // Where none has all, the one with the most stays at hand.
    assert_eq!(source.table(), Some("group \"Bench\" (rows: 2)"));
    let all = source.listed();
    assert!(all.starts_with("group \"Noise\": \"a\"; group \"Bench\" (rows: 2): \"time_s\", \"Weg\""), "{all}");
}

#[test]
fn channels_that_were_sampled_at_other_times_are_a_table_of_their_own() {
    let sampled = |name: &str, step_s: f64, second: i64| {
        Object::channel("g", name, Data::Double(vec![1.0, 2.0]))
            .with("wf_increment", Value::Number(step_s))
            .with("wf_start_time", Value::Time(second, 0))
            .with("wf_xunit_string", Value::Text("ms"))
    };
    let bytes = segment(
        &[sampled("a", 500.0, 7), sampled("b", 500.0, 7), sampled("c", 250.0, 7), sampled("d", 500.0, 8)],
        PLAIN,
    );
    let mut source = opened(&bytes).expect("a TDMS file");
    assert_eq!(source.tables(), 3);
    assert_eq!(table(source.as_mut()).expect("numbers").2, [[0.0, 1.0, 1.0], [0.5, 2.0, 2.0]]);
    // A spectrum has no times.
    let spectrum = Object::channel("g", "a", Data::Double(vec![1.0]))
        .with("wf_increment", Value::Number(10.0))
        .with("wf_xunit_string", Value::Text("Hz"));
    assert_eq!(read(&segment(&[spectrum], PLAIN)).0, ["a"]);
}

#[test]
fn what_is_not_read_is_named() {
    let daqmx = |code: u32| {
        let mut metadata = 1_u32.to_le_bytes().to_vec();
        metadata.extend(10_u32.to_le_bytes());
        metadata.extend(b"/'Bench'/'");
        metadata.extend(code.to_le_bytes());
        framed(&metadata, &[0; 8], 0b1110, PLAIN)
    };
    let words = refusal(&daqmx(0x1269));
    assert!(words.starts_with("run.tdms:1: holds raw data of NI-DAQmx in channel /'Bench'/'"), "{words}");
    assert!(words.contains("export it as CSV"), "{words}");
    let extended = Object::channel("g", "x", Data::Other(11, 16, vec![0; 32]));
    assert!(refusal(&segment(&[extended], PLAIN)).contains("holds values of the type 0xb in channel /'g'/'x'"));
    let complex = Object::channel("g", "x", Data::Other(0x10_000d, 16, vec![0; 32]));
    assert!(refusal(&segment(&[complex], PLAIN)).contains("holds complex numbers in column \"x\""));
    let nothing = Object { path: "/".to_owned(), properties: Vec::new(), data: None };
    assert!(refusal(&segment(&[nothing], PLAIN)).contains("the file is empty"));
    let infinite = Object::channel("g", "x", Data::Double(vec![f64::INFINITY]));
    assert!(refusal(&segment(&[infinite], PLAIN)).contains("\"inf\" is not a number"));
}

#[test]
fn what_a_recorder_could_not_finish_is_read_up_to_its_last_whole_rows() {
    let mut bytes = segment(&bench(), Form { interleaved: true, ..PLAIN });
    bytes[12..20].fill(0xff);
    bytes.extend([0; 7]);
    let mut source = opened(&bytes).expect("a TDMS file");
    assert_eq!(table(source.as_mut()).expect("numbers").2.len(), 4);
    assert_eq!(source.notices()[0].kind.to_string(), "the last row is cut off; it was left out");
}

#[test]
fn no_cut_and_no_slip_is_more_than_an_error() {
    let big = Form { big: true, interleaved: true, chunks: 1 };
    let texts = [Object::channel("g", "t", Data::Text(vec!["a", "bc", "", "d"]))];
    let files =
        [[segment(&bench(), Form { chunks: 2, ..PLAIN }), segment(&texts, PLAIN)].concat(), segment(&bench(), big)];
    for bytes in files {
        let whole = read(&bytes[..]).2.len();
        for length in (0..bytes.len()).step_by(64).chain([bytes.len() - 1]) {
            let found = opened(&bytes[..length]).and_then(|mut source| table(source.as_mut()));
            assert!(found.is_err() || found.is_ok_and(|(.., rows)| rows.len() <= whole), "{length}");
        }
        assert!(refusal(&bytes[..bytes.len() - 1]).contains("it is cut off in the middle"));
        for at in 0..bytes.len() {
            for flip in [1, 0x80, 0xff] {
                let mut slipped = bytes.clone();
                slipped[at] ^= flip;
                let _ = opened(&slipped).and_then(|mut source| table(source.as_mut()));
            }
        }
    }
}
