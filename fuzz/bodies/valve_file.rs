//! Valve files.

use valve_file::ValveFile;

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    if let Ok(file) = ValveFile::parse(&String::from_utf8_lossy(bytes), "v.toml") {
        let _ = file.doubts();
        // What was read is read again.
        assert!(ValveFile::parse(file.text(), "v.toml").is_ok());
    }
}
