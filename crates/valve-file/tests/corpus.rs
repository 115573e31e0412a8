//! The seeds of the fuzz target, read by the same functions.

use std::path::Path;

use valve_file::ValveFile;

#[test]
fn valve_files_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus/valve_file");
    let mut read = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(ValveFile::parse(&text, "v.toml").unwrap().doubts(), [], "{}", path.display());
        read += 1;
    }
    assert!(read >= 2, "{read}");
}
