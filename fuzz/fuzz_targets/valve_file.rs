//! Valve files.
#![no_main]

use libfuzzer_sys::fuzz_target;
use valve_file::ValveFile;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(file) = ValveFile::parse(&String::from_utf8_lossy(bytes), "v.toml") {
        let _ = file.doubts();
        // What was read is read again.
        assert!(ValveFile::parse(file.text(), "v.toml").is_ok());
    }
});
