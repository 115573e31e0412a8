//! What is predicted of records that were held out, where the optimum without them is known.

use std::sync::atomic::Ordering;

use identify::held_out::{HeldOut, OwnFits, folds, held_out};
use identify::{Coordinate, Fit, FitOptions, fit};

use crate::common::{Function, Functions, options, record, shared};

/// Two records of one coordinate. The first is precise and observes it to be 1. The second says that it is 3, and rows that do not
/// move there, `bent` times its squared distance from 1, say that it is 2.
fn contradicting(bent: f64) -> (Functions, Fit) {
    let problem = Functions {
        coordinates: vec![shared("place", 1.0, 100.0, 50.0)],
        records: vec![record(&[1.0; 50], 1e-3, false, 0), record(&[3.0, bent], 0.1, false, 1)],
        of_records: vec![
            Box::new(|u| vec![u[0]; 50]),
            Box::new(move |u| vec![u[0], bent * (u[0] - 1.0) * (u[0] - 1.0)]),
        ],
        asked: 0.into(),
    };
    let whole = fit(&problem, &[1.0], &FitOptions { tolerance: 0.5, ..options() }).expect("a start that is possible");
    assert!((whole.u[0] - 1.0).abs() < 1e-3, "the first record decides: {:?}", whole.u);
    (problem, whole)
}

/// Where the coordinate is without the first record, by what is predicted of it.
fn place_without(held: &HeldOut) -> f64 {
    1.0 - held.own[0][0]
}

/// The root of `(x - 3) + 2 bent^2 ((x - 1)^2 - 1) (x - 1)`: the least squares of the second record.
fn known_place(bent: f64) -> f64 {
    let slope = |x: f64| (x - 3.0) + 2.0 * bent * bent * ((x - 1.0) * (x - 1.0) - 1.0) * (x - 1.0);
    let (mut below, mut above) = (2.0, 3.0);
    while above - below > 1e-9 {
        let middle = 0.5 * (below + above);
        if slope(middle) < 0.0 { below = middle } else { above = middle }
    }
    below
}

#[test]
fn derivatives_of_the_whole_fit_may_lead_beside_the_optimum_without_a_fold() {
    let (problem, whole) = contradicting(0.1);
    let quick = held_out(&problem, &whole, &folds(&problem), &options(), OwnFits::WhereShort).expect("two conditions");
    assert!((place_without(&quick) - 3.0).abs() < 0.03, "they see the first row alone: {}", place_without(&quick));
    let own = held_out(&problem, &whole, &folds(&problem), &options(), OwnFits::All).expect("two conditions");
    assert!((place_without(&own) - known_place(0.1)).abs() < 1e-3, "{} for {}", place_without(&own), known_place(0.1));
    assert!(own.own_fits > quick.own_fits);
}

#[test]
fn a_fold_whose_quick_steps_end_short_of_what_they_promise_has_a_fit_of_its_own() {
    // So steep that no step with the derivatives at hand makes anything better.
    let (problem, whole) = contradicting(20.0);
    let quick = held_out(&problem, &whole, &folds(&problem), &options(), OwnFits::None).expect("two conditions");
    assert!((place_without(&quick) - known_place(20.0)).abs() > 0.3, "{}", place_without(&quick));
    let quick = held_out(&problem, &whole, &folds(&problem), &options(), OwnFits::WhereShort).expect("two conditions");
    assert!(
        (place_without(&quick) - known_place(20.0)).abs() < 1e-2,
        "{} for {}",
        place_without(&quick),
        known_place(20.0)
    );
}

#[test]
fn a_step_that_keeps_its_promise_is_the_last_one() {
    // Linear, so that the first step ends in the optimum: the mean of the other two records.
    let problem = Functions {
        coordinates: vec![shared("place", 1.0, 100.0, 50.0)],
        records: [1.0, 2.0, 4.5].iter().enumerate().map(|(index, at)| record(&[*at; 4], 0.1, false, index)).collect(),
        of_records: (0..3).map(|_| -> Function { Box::new(|u| vec![u[0]; 4]) }).collect(),
        asked: 0.into(),
    };
    let whole = fit(&problem, &[1.0], &options()).expect("a start that is possible");
    let before = problem.asked.load(Ordering::Relaxed);
    let held = held_out(&problem, &whole, &folds(&problem), &options(), OwnFits::None).expect("three conditions");
    for (index, (at, place)) in [(1.0, 3.25), (2.0, 2.75), (4.5, 1.5)].into_iter().enumerate() {
        assert!((held.own[index][0] - (at - place)).abs() < 1e-3, "{index}: {:?}", held.own[index]);
    }
    // For each fold two records at the end of the step, and the third one there: once as it is, once with its own coordinates.
    assert_eq!(problem.asked.load(Ordering::Relaxed) - before, 3 * (2 + 2));
}

#[test]
fn what_was_set_for_a_record_alone_is_told_by_it_where_it_is_held_out() {
    // Two records of a place; the last one was moved by a step that was set to 1 and is 1.5.
    let missed = |of_measuring: bool| {
        let moved = |moves: f64| -> Function { Box::new(move |u| vec![u[0] + moves * u[1]; 4]) };
        let problem = Functions {
            coordinates: vec![
                shared("place", 1.0, 100.0, 50.0),
                Coordinate { of_measuring, ..shared("step", 1.0, 1.0, 5.0) },
            ],
            records: vec![
                record(&[2.0; 4], 0.1, false, 0),
                record(&[2.0; 4], 0.1, false, 1),
                record(&[3.5; 4], 0.1, false, 2),
            ],
            of_records: vec![moved(0.0), moved(0.0), moved(1.0)],
            asked: 0.into(),
        };
        let whole = fit(&problem, &[1.0, 1.0], &options()).expect("a start that is possible");
        let held = held_out(&problem, &whole, &folds(&problem), &options(), OwnFits::WhereShort).expect("conditions");
        held.own[2][0]
    };
    assert!(missed(true).abs() < 0.02, "{}", missed(true));
    assert!((missed(false) - 0.5).abs() < 0.02, "a law of the model is told by the others alone: {}", missed(false));
}

#[test]
fn a_record_alone_can_not_be_held_out() {
    let (problem, whole) = contradicting(0.1);
    assert!(held_out(&problem, &whole, &[vec![0, 1]], &options(), OwnFits::All).is_none());
}

#[test]
fn many_strokes_of_one_condition_are_few_folds_with_each_stroke_once() {
    let records = |count: usize, conditions: usize| Functions {
        coordinates: vec![shared("place", 1.0, 100.0, 50.0)],
        records: (0..count).map(|index| record(&[1.0], 0.1, false, index % conditions)).collect(),
        of_records: Vec::new(),
        asked: 0.into(),
    };
    let of_one = folds(&records(13, 1));
    assert_eq!(of_one.len(), 5);
    let mut all: Vec<usize> = of_one.into_iter().flatten().collect();
    all.sort_unstable();
    assert_eq!(all, (0..13).collect::<Vec<_>>());
    assert_eq!(folds(&records(3, 1)), [[0], [1], [2]]);
    assert_eq!(folds(&records(4, 2)), [[0, 2], [1, 3]]);
    assert!(folds(&records(1, 1)).is_empty());
}
