//! Errors that can be explained in two ways, with no way uphill from the one to the other.

use std::sync::atomic::AtomicUsize;

use identify::{Fit, FitOptions, GroupNoise, GroupPrior, Noise, Smoothness, fit};

use crate::common::{Functions, record, shared};
use crate::drawn::noise;

const STATED: f64 = 0.1;
const AT_REST: usize = 220;
const MOVING: usize = 80;

/// Readings of something that rests, where they are all alike but for a tenth of the noise that is stated, and then moves, where they are off
/// by steps that last for a few rows.
fn problem(seed: u64) -> Functions {
    let at_rest = noise(AT_REST, 0.1 * STATED, seed);
    let steps = noise(MOVING / 4, 2.0 * STATED, seed + 1000);
    let moving = (0..MOVING).map(|row| steps[row / 4]);
    let observed: Vec<f64> = at_rest.into_iter().chain(moving).collect();
    let mut of_both = record(&observed, STATED, true, 0);
    for row in &mut of_both.series[0].rows[..AT_REST] {
        row.activity = 0.0;
    }
    Functions {
        coordinates: vec![shared("mean", 0.0, 1.0, 10.0)],
        records: vec![of_both],
        of_records: vec![Box::new(|u| vec![u[0]; AT_REST + MOVING])],
        asked: AtomicUsize::new(0),
    }
}

fn found(seed: u64, known: Option<Noise>) -> Fit {
    let prior =
        GroupPrior { multiplier_sigma: 1.0, multiplier: (0.05, 20.0), discrepancy: (1e-4, 10.0), time_s: (0.5, 50.0) };
    let options = FitOptions { known, ..FitOptions::new(vec![prior]) };
    fit(&problem(seed), &[0.0], &options).expect("a fit")
}

#[test]
fn a_fit_that_goes_on_from_noise_finds_the_model_error_that_explains_more() {
    let all_noise = GroupNoise { multiplier: 1.0, discrepancy: 0.0, time_s: 1.0 };
    for seed in 1..=20 {
        let known = Noise { groups: vec![all_noise], smoothness: Smoothness::Rough };
        let [afresh, gone_on] = [found(seed, None), found(seed, Some(known))];
        let group = gone_on.noise.groups[0];
        assert!((0.08..0.13).contains(&group.multiplier) && group.discrepancy > STATED, "{seed}: {group:?}");
        let behind = afresh.log_evidence - gone_on.log_evidence;
        assert!(behind.abs() < 0.5, "{seed}: {behind}");
    }
}
