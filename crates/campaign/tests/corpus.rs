//! The seeds of the fuzz targets, read by the same functions.

use std::path::{Path, PathBuf};

use campaign::guess::{Hints, Recording, understand};
use campaign::{Campaign, ValveFacts};

const VALVE: ValveFacts =
    ValveFacts { ambient_pressure_pa: 101_325.0, supply_pressure_pa: 620e3, temperature_k: 293.15, stroke_m: 0.02 };

fn seeds(target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus").join(target);
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files.map(|path| (path.clone(), std::fs::read(path).unwrap())).collect()
}

#[test]
fn campaigns_are_read() {
    let seeds = seeds("campaign");
    assert!(seeds.len() >= 4);
    for (path, bytes) in seeds {
        let text = String::from_utf8_lossy(&bytes);
        let (campaign, recording) = text.split_once("\n---\n").unwrap_or((&text, ""));
        let read = Campaign::parse(campaign, "c.toml", &VALVE, &|_| Ok(recording.as_bytes().to_vec()));
        assert!(read.is_ok(), "{}: {}", path.display(), read.unwrap_err());
    }
}

#[test]
fn recordings_are_looked_at() {
    let hints = Hints { stroke_m: Some(0.02), ambient_pressure_pa: 101_325.0, ..Hints::default() };
    for (path, bytes) in seeds("guess") {
        let recording = Recording::read(&bytes, "run-75psig.csv").unwrap();
        let found = understand(&[recording], &hints);
        assert!(
            found.columns.iter().any(|column| column.channel == "position"),
            "{}: {:?}",
            path.display(),
            found.said
        );
    }
}
