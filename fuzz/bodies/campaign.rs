//! A campaign file and its recording, parted by a line of three dashes.

use campaign::{Campaign, ValveFacts};

const VALVE: ValveFacts =
    ValveFacts { ambient_pressure_pa: 101_325.0, supply_pressure_pa: 620e3, temperature_k: 293.15, stroke_m: 0.02 };

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let (campaign, recording) = text.split_once("\n---\n").unwrap_or((&text, ""));
    if let Ok(read) = Campaign::parse(campaign, "c.toml", &VALVE, &|_| Ok(recording.as_bytes().to_vec())) {
        for run in &read.runs {
            assert!(run.trace.time_s.windows(2).all(|pair| pair[1] > pair[0]));
            assert_eq!(run.trace.time_s.len(), run.trace.position_m.len());
        }
    }
}
