//! Recordings of any format: text, gzip, TDMS, Parquet, MATLAB, HDF5.

use column_source::{Comments, open};

/// Rows that are looked at: more are of one kind.
const ROWS: usize = 10_000;

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    let mut source = match open(bytes, "t.dat", Comments::WhereNoNames) {
        Ok(source) => source,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return;
        }
    };
    for table in 0..source.tables() {
        source.go_to(table);
        for _ in 0..ROWS {
            let Ok(Some(_)) = source.next_row() else { break };
            for column in 0..source.headings().len() {
                // A number is finite or a gap.
                if let Ok(number) = source.number(column) {
                    assert!(number.is_finite() || number.is_nan());
                }
            }
        }
    }
}
