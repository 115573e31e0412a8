//! A look at a recording, and the campaign file that comes of it.

use campaign::guess::{DraftRun, Hints, Recording, draft, understand};
use campaign::{Campaign, ValveFacts};

const VALVE: ValveFacts =
    ValveFacts { ambient_pressure_pa: 101_325.0, supply_pressure_pa: 620e3, temperature_k: 293.15, stroke_m: 0.02 };

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    let Ok(recording) = Recording::read(bytes, "run-75psig.csv") else { return };
    let hints =
        Hints { stroke_m: Some(0.02), ambient_pressure_pa: 101_325.0, one_closes: Some(true), ..Hints::default() };
    let found = understand(std::slice::from_ref(&recording), &hints);
    if found.unknown.is_empty() {
        let run = DraftRun { file: "a.csv".into(), supply_pressure: "75 psig".into(), ..DraftRun::default() };
        let text = draft("fuzz", &found, &recording, &[run]);
        // What is written is a campaign, or refused for what the recording holds: never for its own syntax.
        if let Err(error) = Campaign::parse(&text, "c.toml", &VALVE, &|_| Ok(bytes.to_vec())) {
            assert!(!error.to_string().contains("not valid TOML"), "{error}\n{text}");
        }
    }
}
