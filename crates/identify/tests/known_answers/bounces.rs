//! What is thrown back again and again is fitted up to its first turn, then beyond.

use std::sync::atomic::AtomicUsize;

use identify::{FitOptions, GroupPrior, Record, fit};

use crate::common::{Functions, record, shared};
use crate::drawn::noise;

/// A ball dropped from one metre, its height every hundredth of a second, m, with the noise of a row.
const ROWS: usize = 300;
const EACH_S: f64 = 0.01;
const NOISE_M: f64 = 3e-3;

/// What pulls it, m/s², and the share of its speed that it keeps, with what is known of them beforehand.
const PULL: (f64, f64) = (9.81, 0.5);
const KEEPS: (f64, f64) = (0.92, 0.05);

/// Its height, and how often it was thrown back before, at each row.
fn heights(pull: f64, keeps: f64) -> Vec<(f64, usize)> {
    let (mut began_s, mut lasts_s, mut turns) = (-(2.0 / pull).sqrt(), 2.0 * (2.0 / pull).sqrt(), 0);
    let at = |row: usize| {
        let time_s = EACH_S * row as f64;
        while time_s > began_s + lasts_s && lasts_s > 1e-3 {
            began_s += lasts_s;
            lasts_s *= keeps;
            turns += 1;
        }
        let since_s = (time_s - began_s).min(lasts_s);
        (0.5 * pull * since_s * (lasts_s - since_s), turns)
    };
    (0..ROWS).map(at).collect()
}

/// The true ball with noise, and where a fit of it starts: both known a standard deviation or less.
fn drawn(seed: u64) -> (Functions, Vec<f64>) {
    let truth = heights(PULL.0, KEEPS.0);
    let observed: Vec<f64> =
        truth.iter().zip(noise(ROWS, NOISE_M, seed)).map(|((height, _), noise)| height + noise).collect();
    let mut record: Record = record(&observed, NOISE_M, true, 0);
    for (row, (_, turns)) in record.series[0].rows.iter_mut().zip(&truth) {
        row.turns = *turns;
    }
    let off = noise(2, 1.2, 1_000 + seed);
    let problem = Functions {
        coordinates: vec![shared("pull", 0.0, 1.0, 3.0), shared("keeps", 0.0, 1.0, 1.4)],
        records: vec![record],
        of_records: vec![Box::new(|u| {
            let ball = heights(PULL.0 * (PULL.1 * u[0]).exp(), KEEPS.0 + KEEPS.1 * u[1]);
            ball.into_iter().map(|(height, _)| height).collect()
        })],
        asked: AtomicUsize::default(),
    };
    (problem, off)
}

/// Draws whose fit ends at the true values.
fn right(options: &FitOptions) -> usize {
    let is_right = |seed: &u64| {
        let (problem, start) = drawn(*seed);
        let found = fit(&problem, &start, options).expect("has an optimum");
        found.u.iter().all(|u| u.abs() < 0.05)
    };
    (0..DRAWS).filter(is_right).count()
}

const DRAWS: u64 = 40;

#[test]
fn a_bouncing_ball_is_found_from_afar_turn_by_turn() {
    let prior =
        GroupPrior { multiplier_sigma: 1.0, multiplier: (0.3, 20.0), discrepancy: (1e-5, 0.5), time_s: (1.0, 10.0) };
    let usual = FitOptions::new(vec![prior]);
    let (at_once, by_turns) = (right(&usual), right(&usual.clone().from_nowhere()));
    assert!(by_turns >= 38 && at_once <= 28, "{by_turns} of {DRAWS} by turns, {at_once} at once");
}
