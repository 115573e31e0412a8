//! Records that begin or end where a recorder happened to be switched, and slow ones: nothing is missing in them.

use blind_benchmark::world::{Class, Realisms, World, WorldSpec, draw_world};
use blind_score::{Scored, score_recording};

/// A laboratory's campaign in which nothing is hidden, with one imperfection.
fn nothing_hidden((realism, size): (&'static str, f64), class: Class, seed: u64) -> Scored {
    let spec = WorldSpec {
        weights: [1.0, 0.0, 0.0, 0.0],
        class: Some(class),
        realisms: Some(Realisms::only(realism, size)),
        ..WorldSpec::of(World::Laboratory)
    };
    let folder = tempfile::tempdir().unwrap();
    score_recording(&draw_world(seed, 0, &spec), folder.path()).unwrap()
}

/// That the model explains records that begin so, to the noise.
fn explained_wherever_they_begin(cases: &[(&'static str, Class, u64)]) {
    for &(realism, class, seed) in cases {
        let scored = nothing_hidden((realism, 1.0), class, seed);
        assert_eq!(scored.answer.verdict, "adequate", "{realism}: {scored:?}");
        let share = scored.answer.held_out.unwrap();
        assert!(share < 2.0, "{realism}: {share} of the noise on strokes that were held out");
    }
}

#[test]
#[ignore = "takes half a minute: two whole searches"]
fn wherever_a_record_begins_the_model_explains_it_to_the_noise() {
    explained_wherever_they_begin(&[("begins-filling", Class::Needle, 31), ("begins-moving", Class::Common, 33)]);
}

#[test]
#[ignore = "takes half a minute: three whole searches"]
fn so_it_does_on_other_valves_and_before_they_rest() {
    let cases = [
        ("begins-filling", Class::Common, 32),
        ("begins-moving", Class::Needle, 34),
        ("begins-before-rest", Class::Common, 35),
    ];
    explained_wherever_they_begin(&cases);
}

#[test]
fn a_command_between_two_rows_of_a_slow_recorder_is_no_missing_physics() {
    // Rows over a closing stroke.
    for (rows, class, seed) in [(25.0, Class::Common, 41), (40.0, Class::Gate, 42)] {
        let scored = nothing_hidden(("slow-logger", rows), class, seed);
        assert_eq!(scored.answer.verdict, "adequate", "{rows} rows: {scored:?}");
    }
}
