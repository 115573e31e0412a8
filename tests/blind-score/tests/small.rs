//! A small draw of the blind benchmark; the whole one is a command of its own.

use blind_benchmark::draw::{DrawSpec, draw};
use blind_score::{Drawn, Scored, Summary, score};
use identify::Stop;
use model_lab::diagnosis::{DiagnoseOptions, Progress, Verdict, explain};

/// Every second stroke of one campaign with 0.1 mm of noise and no repeats.
fn one(seed: u64, weights: [f64; 4], pressures: bool) -> Scored {
    let spec = DrawSpec {
        weights,
        pressures: Some(pressures),
        repeats: Some(false),
        position_noise_m: Some(0.1e-3),
        ..DrawSpec::default()
    };
    let mut drawn = draw(seed, 0, &spec);
    drawn.runs = drawn.runs.into_iter().step_by(2).collect();
    let folder = tempfile::tempdir().unwrap();
    score(&drawn, folder.path()).unwrap()
}

#[test]
fn nothing_hidden_is_nothing_found() {
    let scored = one(11, [1.0, 0.0, 0.0, 0.0], false);
    assert_eq!(scored.answer.verdict, "adequate", "{scored:?}");
    assert!(scored.answer.held_out.unwrap() < 1.05, "{scored:?}");
}

#[test]
#[ignore = "takes half a minute: three whole searches"]
fn single_effects_are_named_with_their_size() {
    // Most of a few: what the whole benchmark counts.
    let scored: Vec<Scored> = [(12, false), (13, true), (14, false)]
        .map(|(seed, pressures)| one(seed, [0.0, 1.0, 0.0, 0.0], pressures))
        .into();
    let named = scored.iter().filter(|one| one.first_is_right() && one.sizes()[0].error < 0.15).count();
    assert!(named >= 2, "{scored:?}");
    // And the summary counts them.
    let text = Summary { all: &scored }.to_string();
    let row = text.lines().find(|line| line.starts_with("one effect: the right one first")).unwrap();
    let hits = [0, 1, 2].map(|index| usize::from(scored[index].first_is_right()));
    let counted = [format!("{} of 2 (", hits[0] + hits[2]), format!("{} of 1 (", hits[1])];
    assert!(counted.iter().all(|count| row.contains(count)), "{text}");
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
#[ignore = "takes half a minute: a search over pairs"]
fn two_effects_are_both_named() {
    let scored = one(15, [0.0, 0.0, 1.0, 0.0], true);
    assert!(scored.names_all(), "{scored:?}");
}

#[test]
fn a_search_that_is_cut_short_claims_nothing_that_it_has_not_tried() {
    let spec = DrawSpec { weights: [0.0, 1.0, 0.0, 0.0], ..DrawSpec::default() };
    let folder = tempfile::tempdir().unwrap();
    let Drawn { file, campaign, .. } = Drawn::through_files(&draw(12, 0, &spec), folder.path()).unwrap();
    // Stopped at the start, before anything is calibrated; and by the first effect that it has fitted.
    for at_once in [true, false] {
        let stop = Stop::new();
        if at_once {
            stop.ask();
        }
        let report = |progress: Progress| {
            if matches!(progress, Progress::Tried { .. }) {
                stop.ask();
            }
        };
        let answer = explain(&file, &campaign, &DiagnoseOptions::default(), &report, &stop);
        assert_eq!(answer.is_none(), at_once);
        let Some(answer) = answer else { continue };
        assert!(answer.interrupted);
        assert_eq!((answer.verdict, answer.recommended.len()), (Verdict::NotEnoughData, 0));
        assert!(answer.notes.iter().any(|note| note.contains("cut short")), "{:?}", answer.notes);
    }
}
