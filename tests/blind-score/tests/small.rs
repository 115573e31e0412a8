//! A small draw of the blind benchmark; the whole one is a command of its own.

use blind_benchmark::draw::{DrawSpec, draw};
use blind_score::{Drawn, Kind, Scored, Summary, score};
use identify::Stop;
use model_lab::diagnosis::{DiagnoseOptions, Progress, Verdict, explain};

/// One campaign with 0.1 mm of noise and no repeats.
fn one(seed: u64, weights: [f64; 4], pressures: bool) -> Scored {
    let spec = DrawSpec {
        weights,
        pressures: Some(pressures),
        repeats: Some(false),
        position_noise_m: Some(0.1e-3),
        ..DrawSpec::default()
    };
    let folder = tempfile::tempdir().unwrap();
    score(&draw(seed, 0, &spec), folder.path()).unwrap()
}

#[test]
fn nothing_hidden_is_nothing_found() {
    let scored = one(11, [1.0, 0.0, 0.0, 0.0], false);
    assert_eq!(scored.answer.verdict, "adequate", "{scored:?}");
    assert!(scored.answer.held_out.unwrap() < 1.05, "{scored:?}");
}

#[test]
fn a_single_effect_is_named_with_its_size() {
    for (seed, pressures) in [(12, false), (13, true), (14, false)] {
        let scored = one(seed, [0.0, 1.0, 0.0, 0.0], pressures);
        assert!(scored.first_is_right() && scored.is_in_groups(), "{scored:?}");
        assert!(scored.sizes()[0].error < 0.1, "{scored:?}");
        assert!(scored.answer.held_out.unwrap() < 1.1, "{scored:?}");
    }
}

#[test]
fn a_fit_that_is_stuck_is_freed_by_a_larger_one() {
    // Strong stiction seen with little noise: a long, curved valley with other valleys beside it.
    let spec = DrawSpec {
        weights: [0.0, 1.0, 0.0, 0.0],
        pressures: Some(false),
        repeats: Some(false),
        position_noise_m: Some(0.03e-3),
        testbed_share: 1.0,
        ..DrawSpec::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let scored = score(&draw(1, 0, &spec), folder.path()).unwrap();
    assert!(scored.is_exact() && scored.sizes()[0].error < 0.01, "{scored:?}");
    assert!(scored.answer.held_out.unwrap() < 1.02, "{scored:?}");
}

#[test]
fn what_little_an_effect_leaves_is_no_physics_outside_the_catalogue() {
    // A seat that holds strongly, seen with little noise: strokes scatter by more than a few directions show.
    let spec = DrawSpec { weights: [0.0, 1.0, 0.0, 0.0], ..DrawSpec::default() };
    let folder = tempfile::tempdir().unwrap();
    let scored = score(&draw(6001, 5, &spec), folder.path()).unwrap();
    assert!(scored.is_exact() && scored.sizes()[0].error < 0.05, "{scored:?}");
    assert!(scored.answer.lack.unwrap() > 15.0 && scored.answer.held_out.unwrap() < 1.1, "{scored:?}");
}

#[test]
fn strokes_that_differ_though_none_was_repeated_are_no_physics() {
    let drawn = |index: usize, weights: [f64; 4]| {
        let spec = DrawSpec { weights, repeats: Some(false), always_scatters: true, ..DrawSpec::default() };
        let folder = tempfile::tempdir().unwrap();
        score(&draw(17, index, &spec), folder.path()).unwrap()
    };
    let nothing = drawn(0, [1.0, 0.0, 0.0, 0.0]);
    assert!(nothing.tidy.as_ref().is_some_and(|truth| truth.scatter.is_some() && !truth.repeats));
    assert_eq!(nothing.answer.verdict, "adequate", "{nothing:?}");
    let one = drawn(0, [0.0, 1.0, 0.0, 0.0]);
    assert!(one.first_is_right() && one.is_in_groups(), "{one:?}");
    assert!(one.answer.held_out.unwrap() < 1.1, "{one:?}");
}

#[test]
fn an_effect_that_only_led_the_way_is_dropped() {
    // Three strokes, on which a droop of the supply alone gets stuck, and does not beside a leak of nothing.
    let spec = DrawSpec { weights: [0.0, 1.0, 0.0, 0.0], repeats: Some(false), ..DrawSpec::default() };
    let mut drawn = draw(9501, 8, &spec);
    drawn.runs = [0, 2, 4].map(|run| drawn.runs[run].clone()).to_vec();
    let folder = tempfile::tempdir().unwrap();
    let scored = score(&drawn, folder.path()).unwrap();
    assert!(scored.is_exact() && scored.sizes()[0].error < 0.05, "{scored:?}");
}

#[test]
fn two_effects_are_both_named() {
    let scored = one(15, [0.0, 0.0, 1.0, 0.0], true);
    assert!(scored.names_all(), "{scored:?}");
}

#[test]
fn what_no_catalogue_holds_is_told() {
    let scored = one(16, [0.0, 0.0, 0.0, 1.0], true);
    assert_eq!(scored.wanted.kind, Kind::Outside);
    assert_eq!(scored.answer.verdict, "outside-catalogue", "{scored:?}");
}

#[test]
fn a_search_that_is_cut_short_claims_nothing_that_it_has_not_tried() {
    let spec = DrawSpec { weights: [0.0, 1.0, 0.0, 0.0], ..DrawSpec::default() };
    let folder = tempfile::tempdir().unwrap();
    let Drawn { file, campaign, .. } = Drawn::through_files(&draw(12, 0, &spec), folder.path()).unwrap();
    // Stopped at the start, and by what it tells first.
    for at_once in [true, false] {
        let stop = Stop::new();
        if at_once {
            stop.ask();
        }
        let report = |_: Progress| stop.ask();
        let answer = explain(&file, &campaign, &DiagnoseOptions::default(), &report, &stop).unwrap();
        assert!(answer.interrupted);
        assert_eq!((answer.verdict, answer.recommended.len()), (Verdict::NotEnoughData, 0));
        assert!(answer.notes.iter().any(|note| note.contains("cut short")), "{:?}", answer.notes);
    }
}

#[test]
fn the_summary_counts_what_was_scored() {
    let scored = [one(12, [0.0, 1.0, 0.0, 0.0], false)];
    let text = Summary { all: &scored }.to_string();
    let row = text.lines().find(|line| line.starts_with("one effect: the right one first")).unwrap();
    assert!(row.contains("1 of 1 (100 %)"), "{text}");
    assert!(!text.contains("with pressures"), "{text}");
}
