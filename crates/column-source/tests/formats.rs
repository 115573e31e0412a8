//! Formats that are no text: told by their first bytes, read where the reader is built in, refused in words elsewhere.

use column_source::{ColumnSource, Comments, open};

fn opened(bytes: &[u8]) -> Result<Box<dyn ColumnSource>, String> {
    open(bytes, "run.bin", Comments::WhereNoNames).map_err(|error| error.to_string())
}

fn refused(bytes: &[u8]) -> String {
    opened(bytes).err().expect("a refusal")
}

#[test]
fn text_is_still_text() {
    let source = opened(b"time_s,position_mm\n0,1\n1,2\n").expect("text");
    assert_eq!(source.headings()[1].name, "position_mm");
}

#[test]
fn formats_that_are_not_read_are_named_with_a_way_out() {
    assert!(refused(b"TDSh\x0e\0\0\0").contains("name the .tdms file beside it"));
    for workbook in [&b"PK\x03\x04\x14\0"[..], b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1\0"] {
        assert!(refused(workbook).contains("which this program does not read; save the sheet as CSV"));
    }
    // What is cut off or made up is refused, not read as text.
    for start in [&b"PAR1"[..], b"MATLAB 5.0 MAT-file", b"TDSm", b"\x89HDF\r\n\x1a\n"] {
        let words = refused(start);
        assert!(words.contains("built without a reader") || words.contains("cannot be read as a"), "{words}");
    }
}

/// Rows of a source as numbers.
#[cfg(feature = "mat")]
fn rows(source: &mut dyn ColumnSource) -> Vec<Vec<f64>> {
    let mut rows = Vec::new();
    while source.next_row().expect("a row").is_some() {
        let numbers = (0..source.headings().len()).map(|column| source.number(column).expect("a number"));
        rows.push(numbers.collect());
    }
    rows
}

#[cfg(feature = "mat")]
mod mat {
    use super::{opened, rows};

    /// An element of a MAT file: type, length, bytes, and zeros up to eight.
    fn element(kind: u32, bytes: &[u8]) -> Vec<u8> {
        let length = u32::try_from(bytes.len()).expect("short");
        let mut out = [kind.to_le_bytes(), length.to_le_bytes()].concat();
        out.extend(bytes);
        out.resize(out.len().next_multiple_of(8), 0);
        out
    }

    /// A matrix of doubles, by columns.
    fn matrix(name: &str, size: [i32; 2], values: &[f64]) -> Vec<u8> {
        let bytes = |values: &[f64]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
        let class_double = [6_u32.to_le_bytes(), 0_u32.to_le_bytes()].concat();
        let parts = [
            element(6, &class_double),
            element(5, &size.map(i32::to_le_bytes).concat()),
            element(1, name.as_bytes()),
            element(9, &bytes(values)),
        ];
        element(14, &parts.concat())
    }

    /// A file as MATLAB writes it with -v6 (The MathWorks, "MAT-File Format", chapter 1).
    fn file(matrices: &[Vec<u8>]) -> Vec<u8> {
        let mut out = b"MATLAB 5.0 MAT-file, made for a test".to_vec();
        out.resize(124, b' ');
        out.extend([0x00, 0x01, b'I', b'M']);
        out.extend(matrices.concat());
        out
    }

    #[test]
    fn vectors_and_matrices_are_columns() {
        let bytes = file(&[
            matrix("time_s", [1, 3], &[0.0, 0.1, 0.2]),
            matrix("position_mm", [3, 1], &[25.4, f64::NAN, 3.0]),
            matrix("rate_hz", [1, 1], &[10.0]),
            matrix("pressure", [3, 2], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
        ]);
        let mut source = opened(&bytes).expect("a MATLAB file");
        let names: Vec<&str> = source.headings().iter().map(|heading| heading.name.as_str()).collect();
        assert_eq!(names, ["time_s", "position_mm", "pressure_1", "pressure_2"]);
        let read = rows(source.as_mut());
        assert_eq!(read[0], [0.0, 25.4, 1.0, 4.0]);
        assert!(read[1][1].is_nan());
        assert_eq!(read[2], [0.2, 3.0, 3.0, 6.0]);
        assert!(source.notices()[0].kind.to_string().ends_with("left out: rate_hz"), "{:?}", source.notices());
        // Lying signals, the time first; the other way round it is a table of many columns.
        let lying = file(&[matrix("ans", [2, 3], &[0.0, 5.0, 0.1, 6.0, 0.2, 7.0])]);
        let mut source = opened(&lying).expect("a MATLAB file");
        assert_eq!(rows(source.as_mut()), [[0.0, 5.0], [0.1, 6.0], [0.2, 7.0]]);
        let wide = file(&[matrix("ans", [2, 3], &[0.2, 5.0, 0.1, 6.0, 0.0, 7.0])]);
        assert_eq!(opened(&wide).expect("a MATLAB file").headings().len(), 3);
        // Sizes and lengths that cannot be are refused in words, whatever they multiply or add up to.
        for sizes in [[0x5a00_0001, 0x0074_6965], [i32::MAX, i32::MAX], [-1, -3], [-3, 1]] {
            let words = opened(&file(&[matrix("time_s", sizes, &[0.0, 0.1, 0.2])])).map(|_| ()).expect_err("no sizes");
            assert!(words.contains("the sizes of an array are more than there can be"), "{words}");
        }
        let mut long = bytes.clone();
        long[132..136].fill(0xff);
        let words = opened(&long).map(|_| ()).expect_err("longer than the file");
        assert!(words.contains("a part is longer than the file"), "{words}");
        for length in 0..bytes.len() {
            // Any cut is an error or a shorter table.
            let _ = opened(&bytes[..length]);
        }
    }
}

#[cfg(feature = "parquet")]
mod parquet {
    use std::sync::Arc;

    use column_source::Clock;
    use parquet::basic::Compression;
    use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
    use parquet::file::properties::WriterProperties;
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::parser::parse_message_type;

    use super::opened;

    fn file(compression: Compression) -> Vec<u8> {
        let schema = "message run {
            required int64 time (TIMESTAMP_MICROS);
            optional double position;
            required int64 command;
            required binary note (UTF8);
        }";
        let schema = Arc::new(parse_message_type(schema).expect("a schema"));
        let properties = Arc::new(WriterProperties::builder().set_compression(compression).build());
        let mut bytes = Vec::new();
        let mut writer = SerializedFileWriter::new(&mut bytes, schema, properties).expect("a writer");
        let mut group = writer.next_row_group().expect("a group");
        for column in 0..4 {
            let mut next = group.next_column().expect("a column").expect("there are four");
            let written = match column {
                0 => next.typed::<Int64Type>().write_batch(&[1_700_000_000_000_000, 1_700_000_000_250_000], None, None),
                1 => next.typed::<DoubleType>().write_batch(&[12.5], Some(&[1, 0]), None),
                2 => next.typed::<Int64Type>().write_batch(&[0, 1], None, None),
                _ => next.typed::<ByteArrayType>().write_batch(
                    &[ByteArray::from("1.5"), ByteArray::from("")],
                    None,
                    None,
                ),
            };
            written.expect("written");
            next.close().expect("closed");
        }
        group.close().expect("closed");
        writer.close().expect("closed");
        bytes
    }

    #[test]
    fn columns_of_every_kind_are_read() {
        for compression in [Compression::UNCOMPRESSED, Compression::SNAPPY, Compression::LZ4_RAW] {
            let bytes = file(compression);
            let mut source = opened(&bytes).expect("a Parquet file");
            assert_eq!(source.headings()[1].name, "position");
            let (mut clock, mut times_s) = (Clock::default(), Vec::new());
            while let Some(line) = source.next_row().expect("a row") {
                times_s.push(clock.seconds(&source.field(0), line).expect("a time"));
                let [position, command, note] = [1, 2, 3].map(|column| source.number(column).expect("a number"));
                assert!(if line == 1 { position == 12.5 && note == 1.5 } else { position.is_nan() && note.is_nan() });
                assert_eq!(command, line as f64 - 1.0);
            }
            assert!((times_s[1] - times_s[0] - 0.25).abs() < 1e-6, "{times_s:?}");
            for length in (4..bytes.len()).step_by(7) {
                assert!(opened(&bytes[..length]).is_err(), "cut at {length}");
            }
        }
        let mut source = opened(&file(Compression::UNCOMPRESSED)).expect("a Parquet file");
        source.next_row().expect("a row");
        let error = source.number(0).expect_err("a timestamp is no number").to_string();
        assert!(error.starts_with("run.bin:1: column \"time\""), "{error}");
    }
}
