//! Repeats: the same conditions and commands, whenever the recorder was started.

mod recorded;

use model_lab::Dataset;
use model_lab::calibrate::Repeatability;
use model_lab::repeats::repeats;
use model_lab::scatter::{SOURCES, Scatter, Source};
use recorded::{Noise, campaign, recorded};
use valve_file::ValveFile;
use valve_model::Conditions;

fn testbed() -> ValveFile {
    ValveFile::parse(include_str!("../../../models/testbed.toml"), "testbed.toml").expect("a valid valve")
}

/// Four strokes at each of two supply pressures, their solenoid late by 0 to 6 ms, the recorder started these
/// times before the command.
fn strokes(file: &ValveFile, waits_s: [f64; 4], supply_error: f64) -> Dataset {
    let valve = file.valve();
    let nominal = Conditions::nominal(valve.parameters());
    let mut noise = Noise(11);
    let runs = [5.4e5, 6.2e5].into_iter().flat_map(|supply_pressure_pa| {
        [0.0, 6e-3, 3e-3, 1e-3].into_iter().enumerate().map(move |(repeat, late_s)| {
            let supply_pressure_pa = supply_pressure_pa * (1.0 + supply_error * repeat as f64);
            (Conditions { supply_pressure_pa, ..nominal }, waits_s[repeat], late_s)
        })
    });
    let record = |(conditions, wait_s, late_s)| recorded(valve, conditions, wait_s, late_s, &mut noise);
    campaign(runs.map(record).collect())
}

const TOGETHER: [f64; 4] = [0.0; 4];
const BY_HAND: [f64; 4] = [0.31, 0.0, 0.1437, 0.2204];

fn closing_delay_s(scatter: &Scatter) -> f64 {
    let source = SOURCES.iter().position(|(source, _)| *source == Source::CloseDelay).expect("is looked for");
    scatter.sizes()[source]
}

#[test]
fn a_recorder_started_by_hand_shows_the_same_scatter() {
    let file = testbed();
    let [together, by_hand] = [TOGETHER, BY_HAND].map(|waits_s| {
        let data = strokes(&file, waits_s, 0.0);
        let scatter = Scatter::estimate(&data, file.valve());
        assert!(scatter.is_known());
        let repeatability = Repeatability::of(&data, &scatter).expect("there are repeats");
        (closing_delay_s(&scatter), repeatability.position_m.expect("there are traces"))
    });
    // 0, 6, 3 and 1 ms scatter by 2.6 ms.
    assert!((1.8e-3..3.4e-3).contains(&together.0), "{together:?}");
    assert!((by_hand.0 / together.0 - 1.0).abs() < 0.1, "{by_hand:?} instead of {together:?}");
    assert!((by_hand.1 / together.1 - 1.0).abs() < 0.1, "{by_hand:?} instead of {together:?}");
}

#[test]
fn places_are_at_the_same_time_after_the_command() {
    let file = testbed();
    let data = strokes(&file, BY_HAND, 0.0);
    let groups = repeats(&data);
    assert_eq!(groups.iter().map(|group| group.units.len()).collect::<Vec<_>>(), [4, 4]);
    for group in groups {
        assert!(group.places[0].len() > 600, "{} of 680", group.places[0].len());
        for index in 0..group.places[0].len() {
            let after = |member: usize| {
                let run = &data.runs[group.units[member]];
                let time_s = group.places[member][index].between(|block| run.channels[0].blocks[block].time_s);
                time_s - run.run.commands[0].time_s
            };
            for member in 1..4 {
                assert!((after(member) - after(0)).abs() < 1e-9, "{} and {} s", after(member), after(0));
            }
        }
    }
}

#[test]
fn a_gauge_read_a_little_differently_is_the_same_condition() {
    let file = testbed();
    let groups = |supply_error| repeats(&strokes(&file, BY_HAND, supply_error)).len();
    assert_eq!(groups(1e-3), 2);
    assert_eq!(groups(0.02), 0, "2 % more each time is another condition");
    assert_eq!(strokes(&file, TOGETHER, 1e-3).units_by_condition().len(), 2);
    assert_eq!(strokes(&file, TOGETHER, 0.02).units_by_condition().len(), 8);
}

#[test]
fn a_stroke_that_is_held_for_longer_is_no_repeat() {
    let file = testbed();
    let mut data = strokes(&file, TOGETHER, 0.0);
    for (index, run) in data.runs.iter_mut().enumerate() {
        run.run.commands[1].time_s += 0.1 * index as f64;
    }
    assert!(repeats(&data).is_empty());
    assert!(!Scatter::estimate(&data, file.valve()).is_known());
}
