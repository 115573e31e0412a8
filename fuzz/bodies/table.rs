//! Text with columns.

use column_source::{ColumnSource, Comments, TextSource};

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    for comments in [Comments::WhereNoNames, Comments::BeforeHeader] {
        let Ok(mut source) = TextSource::new(bytes, "t.csv", comments) else { continue };
        while let Ok(Some(line)) = source.next_row() {
            assert!(line > 0);
            for column in 0..source.headings().len() {
                // A number is finite or a gap.
                assert!(
                    source.number(column).is_ok_and(|number| number.is_finite() || number.is_nan())
                        || source.number(column).is_err()
                );
            }
        }
    }
}
