//! The emulator against an independent accurate solution, and its draws against themselves.

use blind_benchmark::Conditions;
use blind_benchmark::draw::{DrawSpec, draw};
use blind_benchmark::hidden::Hidden;
use blind_benchmark::record::stroke_times;
use blind_benchmark::truth::Category;
use blind_benchmark::valve::Valve;

/// Closing and opening times of the testbed valve over supply pressure, from another integrator
/// converged to a ten-millionth of a second; command to close at 0 s, to open at 6 s.
const SUPPLY_SWEEP: [(f64, f64, f64); 4] = [
    (50.0, 1.737_772_3, 1.548_869_4),
    (65.0, 1.201_123_5, 1.921_077_6),
    (75.0, 1.042_194_6, 2.134_358_7),
    (100.0, 0.811_040_4, 2.584_368_4),
];

fn plain(supply_psig: f64) -> Conditions {
    Conditions { supply_psig, leak_to_atmosphere_m2: 0.0, leak_from_supply_m2: 0.0 }
}

#[test]
fn with_nothing_hidden_the_stroke_times_are_those_of_an_accurate_solution() {
    let valve = Valve { open_at_s: 6.0, ..Valve::testbed() };
    for (psig, close_s, open_s) in SUPPLY_SWEEP {
        let (close, open) = stroke_times(&valve, &Hidden::default(), &plain(psig), 1);
        assert!((close.unwrap() - close_s).abs() < 5e-5, "{psig} psig closes in {close:?}");
        assert!((open.unwrap() - open_s).abs() < 5e-5, "{psig} psig opens in {open:?}");
    }
}

#[test]
fn a_draw_depends_on_its_seed_and_index_alone() {
    let spec = DrawSpec { repeats: Some(false), testbed_share: 1.0, ..DrawSpec::default() };
    let once = draw(5, 3, &spec);
    assert_eq!(once, draw(5, 3, &spec));
    assert_ne!(once.truth.factors, draw(6, 3, &spec).truth.factors);
    assert_ne!(once.truth.factors, draw(5, 4, &spec).truth.factors);
}

#[test]
fn categories_follow_their_weights() {
    let spec =
        DrawSpec { weights: [1.0, 2.0, 1.0, 0.0], repeats: Some(false), testbed_share: 1.0, ..DrawSpec::default() };
    let drawn: Vec<_> = (0..8).map(|index| draw(9, index, &spec).truth.category).collect();
    let count = |category| drawn.iter().filter(|&&other| other == category).count();
    assert_eq!(count(Category::Nothing), 2);
    assert_eq!(count(Category::One), 4);
    assert_eq!(count(Category::Two), 2);
}

#[test]
fn a_campaign_becomes_a_folder() {
    let spec = DrawSpec { repeats: Some(false), pressures: Some(true), ..DrawSpec::default() };
    let campaign = draw(2, 0, &spec);
    let parent = tempfile::tempdir().unwrap();
    let folder = campaign.write_to(parent.path()).unwrap();
    for file in ["valve.toml", "campaign.toml", "truth.json", "traces/run-01.csv", "traces/run-07.csv"] {
        assert!(folder.join(file).is_file(), "{file} is missing");
    }
    let trace = std::fs::read_to_string(folder.join("traces/run-01.csv")).unwrap();
    let mut lines = trace.lines();
    assert_eq!(lines.next(), Some("time_s,command,position_mm,chamber_pressure_kpa,pipe_pressure_kpa"));
    assert!(lines.next().unwrap().starts_with("0.000,1,"));
    assert_eq!(trace.lines().count(), campaign.runs[0].time_s.len() + 1);
    let truth: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("truth.json")).unwrap()).unwrap();
    assert_eq!(truth["category"], campaign.truth.category.word());
}

#[test]
fn drawn_valves_make_full_strokes_and_no_two_are_alike() {
    let spec = DrawSpec { testbed_share: 0.0, timings_only: true, ..DrawSpec::default() };
    let (one, other) = (draw(3, 0, &spec), draw(3, 1, &spec));
    assert_ne!(one.valve, other.valve);
    for campaign in [one, other] {
        assert_eq!(campaign.timings.len(), 46);
        assert!(campaign.timings.iter().all(|row| row.close_s.is_some() && row.open_s.is_some()));
    }
}
