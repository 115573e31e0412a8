//! The seeds of the fuzz target, read by the same functions.

use std::path::Path;

use column_source::{ColumnSource, Comments, TextSource};

#[test]
fn tables_are_read_or_refused() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus/table");
    let mut read = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let bytes = std::fs::read(&path).unwrap();
        let Ok(mut source) = TextSource::new(&bytes, "t.csv", Comments::WhereNoNames) else { continue };
        let mut rows = 0;
        while source.next_row().unwrap_or_else(|error| panic!("{}: {error}", path.display())).is_some() {
            rows += 1;
        }
        assert!(rows > 0, "{}", path.display());
        read += 1;
    }
    assert!(read >= 7, "{read}");
}
