//! MATLAB files of v7.3 and other HDF5 files.
#![cfg(feature = "mat73")]

use column_source::{ColumnSource, Comments, RecordError, open};

#[path = "made/hdf5.rs"]
mod made;

use made::{Member, file};

fn opened(bytes: &[u8]) -> Result<Box<dyn ColumnSource>, RecordError> {
    open(bytes, "run.mat", Comments::WhereNoNames)
}

/// Names and rows.
fn table(source: &mut dyn ColumnSource) -> Result<(Vec<String>, Vec<Vec<f64>>), RecordError> {
    let names: Vec<String> = source.headings().iter().map(|heading| heading.name.clone()).collect();
    let mut rows = Vec::new();
    while source.next_row()?.is_some() {
        rows.push((0..names.len()).map(|column| source.number(column)).collect::<Result<Vec<_>, _>>()?);
    }
    Ok((names, rows))
}

fn refusal(bytes: &[u8]) -> String {
    opened(bytes).and_then(|mut source| table(source.as_mut())).expect_err("a refusal").to_string()
}

fn record() -> Vec<(&'static str, Member)> {
    let doubles = |shape: [u64; 2], values: &[f64], class| Member::Doubles {
        shape: shape.to_vec(),
        values: values.to_vec(),
        class,
    };
    vec![
        ("time_s", Member::vector(&[0.0, 0.5, 1.0])),
        // Lying in MATLAB.
        ("position_mm", doubles([3, 1], &[25.4, f64::NAN, 3.0], Some("double"))),
        ("command", Member::Bytes { shape: vec![1, 3], values: vec![0, 1, 1], class: Some("logical") }),
        // MATLAB's 3 x 2.
        ("pressure", doubles([2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], Some("double"))),
        ("rate", Member::vector(&[10.0])),
        ("note", Member::Bytes { shape: vec![1, 3], values: b"abc".to_vec(), class: Some("char") }),
        ("rec", Member::Group(vec![("deep", Member::Group(vec![("y", Member::vector(&[7.0, 8.0, 9.0]))]))])),
        ("#refs#", Member::Group(vec![("a", Member::vector(&[0.0, 0.0, 0.0]))])),
    ]
}

#[test]
fn a_record_is_the_same_as_its_text() {
    let text =
        "command,position_mm,pressure_1,pressure_2,time_s,rec.deep.y\n0,25.4,1,4,0,7\n1,,2,5,0.5,8\n1,3,3,6,1,9\n";
    let of_text = table(opened(text.as_bytes()).expect("text").as_mut()).expect("numbers");
    let mut source = opened(&file(&record())).expect("a MATLAB file");
    assert_eq!(format!("{:?}", table(source.as_mut()).expect("numbers")), format!("{of_text:?}"));
    assert!(source.notices()[0].kind.to_string().ends_with("of 3 rows, and left out: rate"), "{:?}", source.notices());
}

#[test]
fn objects_are_refused_when_they_are_asked_for() {
    let object = Member::Bytes { shape: vec![1, 6], values: vec![0; 6], class: Some("timeseries") };
    let alone = refusal(&file(&[("ts", object.clone())]));
    let expected = "run.mat:1: holds \"ts\", an object of MATLAB's class timeseries, which this program does not read; \
                    save its numbers";
    assert!(alone.starts_with(expected), "{alone}");
    let mut source = opened(&file(&[&record()[..], &[("ts", object)]].concat())).expect("a MATLAB file");
    source.next_row().expect("a row");
    assert_eq!(source.number(0), Ok(0.0));
    let asked = source.number(6).expect_err("an object").to_string();
    assert!(asked.contains("an object of MATLAB's class timeseries in column \"ts\""), "{asked}");
}

#[test]
fn tables_of_other_programs_stand_upright() {
    let upright = Member::Doubles { shape: vec![3, 2], values: vec![1.0, 4.0, 2.0, 5.0, 3.0, 6.0], class: None };
    let (names, rows) = table(opened(&file(&[("p", upright)])).expect("HDF5").as_mut()).expect("numbers");
    assert_eq!((names, rows), (vec!["p_1".into(), "p_2".into()], vec![vec![1.0, 4.0], vec![2.0, 5.0], vec![3.0, 6.0]]));
}

#[test]
fn files_of_h5py_are_read() {
    // Written by made/hdf5.py: chunked, packed, shuffled, of several types, with a unit and a structure.
    for bytes in [&include_bytes!("made/early.h5")[..], include_bytes!("made/late.h5")] {
        let mut source = opened(bytes).expect("an HDF5 file");
        assert_eq!(source.headings()[0].unit.as_ref().map(quantity::Unit::text), Some("mm"));
        let (names, rows) = table(source.as_mut()).expect("numbers");
        assert_eq!(names, ["Weg", "counts", "on", "time_s", "rec.x"]);
        assert_eq!(rows.len(), 40);
        for (row, values) in rows.iter().enumerate() {
            let row = row as f64;
            assert_eq!(values[..], [row / 4.0, -row, f64::from(u8::from(row > 20.0)), row / 8.0, row * row]);
        }
    }
}

#[test]
fn sizes_that_cannot_be_are_refused_before_anything_is_read() {
    for shape in [[1 << 40, 1 << 40], [1, 1 << 40], [1, 1 << 27]] {
        let huge = Member::Doubles { shape: shape.to_vec(), values: vec![0.0; 3], class: Some("double") };
        let words = refusal(&file(&[("x", huge)]));
        assert!(
            words
                .starts_with("run.mat:1: cannot be read as a MATLAB v7.3 or other HDF5 file with a table of columns: "),
            "{words}"
        );
    }
}

#[test]
fn no_cut_and_no_slip_is_more_than_an_error() {
    let files = [&file(&record())[..], include_bytes!("made/early.h5"), include_bytes!("made/late.h5")];
    for bytes in files {
        for length in (0..bytes.len()).step_by(64) {
            let _ = opened(&bytes[..length]).and_then(|mut source| table(source.as_mut()));
        }
        for at in (0..bytes.len()).filter(|at| bytes[*at] != 0 || at % 7 == 0) {
            for flip in [1, 0x80, 0xff] {
                let mut slipped = bytes.to_vec();
                slipped[at] ^= flip;
                let _ = opened(&slipped).and_then(|mut source| table(source.as_mut()));
            }
        }
    }
}
