//! Tables: a manifest and its two files, parted by lines of three dashes. Their lengths and hashes are put where the manifest
//! says LENGTH and HASH, so that what is behind those checks is reached too.

use std::fs;
use std::sync::Arc;

use leak_table::TableBundle;
use prognoser::{LogRow, Method, Prognoser, Reading};

/// The files of the manifest, in its order.
const FILES: [&str; 2] = ["atmosphere.csv", "supply.csv"];

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let mut parts = text.split("\n---\n");
    let mut manifest = parts.next().unwrap_or_default().to_owned();
    let dir = tempfile::tempdir().expect("a directory");
    for name in FILES {
        let part = parts.next().unwrap_or_default();
        fs::write(dir.path().join(name), part).expect("written");
        manifest = manifest.replacen("\"LENGTH\"", &part.len().to_string(), 1).replacen(
            "HASH",
            &blake3::hash(part.as_bytes()).to_hex(),
            1,
        );
    }
    fs::write(dir.path().join("manifest.json"), manifest).expect("written");
    let tables = match TableBundle::read(dir.path()) {
        Ok(tables) => tables,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return;
        }
    };
    // Tables that are read can be used.
    let mut prognoser = Prognoser::new(Arc::new(tables), Method::default());
    for cycle in 1..6 {
        let time = 1.0 + 0.2 * cycle as f64;
        let reading = Reading { cycle, close_time_s: Some(time), open_time_s: Some(time), ..Reading::default() };
        let told = prognoser.push(&LogRow { valve: "V", reading, time: None, line: cycle });
        assert!(told.rul_cycles.is_none_or(f64::is_finite), "{told:?}");
    }
}
