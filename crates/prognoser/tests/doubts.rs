//! What happens to a valve may be nothing that was thought of: the estimate doubts itself instead of going on.

mod common;

use common::{log, noisy, notices, reading, run, tables};
use leak_table::Fault;
use prognoser::study::NoiseSource;
use prognoser::{FaultCall, Method, Reading, Status};

/// A sound valve whose times are changed by hand.
fn healthy(
    cycles: u64,
    seed: u64,
    sd_s: impl Fn(u64) -> f64,
    change: impl Fn(u64, [f64; 2]) -> [f64; 2],
) -> Vec<Reading> {
    let (tables, mut noise) = (tables(), NoiseSource::new(seed, 0));
    let one = |cycle| {
        let sound = reading(&tables, Fault::Atmosphere, cycle, 0.0);
        let [close, open] = change(cycle, [sound.close_time_s, sound.open_time_s].map(|time| time.expect("it moves")));
        noisy(Reading { close_time_s: Some(close), open_time_s: Some(open), ..sound }, sd_s(cycle), &mut noise)
    };
    (0..cycles).map(one).collect()
}

#[test]
fn a_counter_of_strokes_that_is_read_once_a_day_is_as_good_as_one_of_days() {
    for fault in Fault::ALL {
        for (seed, strokes) in [(1, 7), (2, 100), (3, 100), (4, 5000)] {
            let mut readings = log(&tables(), fault, 90, 0.01, seed, |row| row / 100.0);
            for one in &mut readings {
                // Not every day is like the other.
                one.cycle = one.cycle * strokes + one.cycle % 3;
            }
            let prognoses = run(Method::default(), &readings);
            let last = &prognoses[89];
            assert_eq!(last.fault, FaultCall::from(fault), "{strokes} a row: {last:?}");
            let (left, truth) = (last.rul_cycles.expect("it leaks"), 11.0 * strokes as f64);
            assert!((left / truth - 1.0).abs() < 0.3, "{fault}, {strokes} a row: {left} for {truth}");
            assert!(last.rul_p05.expect("bounds") < truth && truth < last.rul_p95.expect("bounds"), "{last:?}");
            let rate = last.leak_rate_mm2_per_cycle.expect("it grows") * strokes as f64 * 100.0;
            let limit = tables().limit_area_m2(fault) * 1e6;
            assert!((rate / limit - 1.0).abs() < 0.2, "{fault}, {strokes} a row: {rate} of {limit}");
        }
    }
}

#[test]
fn noise_that_jumps_is_no_end_of_life() {
    let mut anew = 0;
    for seed in 0..12 {
        let readings = healthy(300, seed, |cycle| if cycle < 100 { 0.005 } else { 0.05 }, |_, times| times);
        let prognoses = run(Method::default(), &readings);
        assert!(prognoses.iter().all(|one| one.status != Status::EolReached), "{seed}");
        let last = &prognoses[299];
        assert!(matches!(last.fault, FaultCall::None | FaultCall::Undecided), "{seed}: {last:?}");
        assert!(last.noise_s.expect("it is estimated") > 0.02, "{seed}: {last:?}");
        anew += notices(&prognoses).iter().filter(|(_, kind)| *kind == "begun-anew").count();
    }
    assert!(anew > 0, "noise ten times as large leaves no estimate in place");
}

#[test]
fn noise_that_stays_as_it_is_leaves_the_estimate_in_place() {
    for seed in 0..30 {
        let leak = |cycle: f64| (cycle - 100.0).max(0.0) / 250.0;
        let prognoses = run(Method::default(), &log(&tables(), Fault::Supply, 300, 0.02, seed, leak));
        assert!(notices(&prognoses).iter().all(|(_, kind)| *kind != "begun-anew"), "{seed}");
    }
}

#[test]
fn a_time_that_is_off_since_a_day_and_stays_there_is_no_reason_to_hurry() {
    for seed in 0..8 {
        let moved = |cycle: u64, [close, open]: [f64; 2]| [if cycle < 60 { close } else { close - 0.08 }, open];
        let prognoses = run(Method::default(), &healthy(200, seed, |_| 0.008, moved));
        let last = &prognoses[199];
        assert!(!matches!(last.status, Status::ActNow | Status::EolReached), "{seed}: {last:?}");
    }
}

#[test]
fn leaks_are_not_negative_to_explain_what_no_leaks_do() {
    for seed in 0..6 {
        let slower = |cycle: u64, times: [f64; 2]| times.map(|time| time * (1.0 + 0.004 * cycle as f64));
        let prognoses = run(Method::default(), &healthy(90, seed, |_| 0.01, slower));
        for one in &prognoses[30..] {
            assert_ne!(one.fault, FaultCall::BothLeaks, "{seed}: {one:?}");
        }
    }
}

#[test]
fn a_leak_that_comes_and_goes_is_told_between_its_times() {
    for fault in Fault::ALL {
        for seed in 0..5 {
            // Seven cycles of fourteen, each time somewhat larger.
            let leak = |k: f64| if k % 14.0 < 7.0 { 0.0 } else { 0.3 + k / 300.0 };
            let prognoses = run(Method::default(), &log(&tables(), fault, 104, 0.01, seed, leak));
            let between = &prognoses[101];
            let caveat = between.caveat.as_deref().unwrap_or_default();
            assert!(caveat.contains("comes and goes: "), "{fault}, {seed}: {between:?}");
            assert!(between.status >= Status::Watch, "{fault}, {seed}: {between:?}");
        }
    }
    // Noise, a mistyped row in fifty, and growth by leaps are no such thing.
    let mistyped = |cycle: u64, times: [f64; 2]| if cycle % 50 == 20 { times.map(|time| 1.4 * time) } else { times };
    for seed in 0..5 {
        let sound = healthy(400, seed, |_| 0.02, mistyped);
        let leaps = log(&tables(), Fault::Atmosphere, 60, 0.01, seed, |k| 0.08 * (k / 6.0).floor());
        for one in run(Method::default(), &sound).iter().chain(&run(Method::default(), &leaps)) {
            assert!(!one.caveat.as_deref().unwrap_or_default().contains("comes and goes"), "{seed}: {one:?}");
        }
    }
}

#[test]
fn columns_that_are_exchanged_from_a_row_on_stay_doubted() {
    let swapped = |cycle: u64, [close, open]: [f64; 2]| if cycle < 30 { [close, open] } else { [open, close] };
    let prognoses = run(Method::default(), &healthy(60, 3, |_| 0.01, swapped));
    assert_eq!(notices(&prognoses).first(), Some(&(30, "exchanged")));
    for one in &prognoses[34..] {
        let caveat = one.caveat.as_deref().unwrap_or_default();
        assert!(caveat.contains("or the two times are exchanged since cycle 30"), "{one:?}");
    }
    // Put right again they are doubted no more.
    let mended =
        |cycle: u64, [close, open]: [f64; 2]| if (30..45).contains(&cycle) { [open, close] } else { [close, open] };
    let prognoses = run(Method::default(), &healthy(60, 3, |_| 0.01, mended));
    assert!(!prognoses[59].caveat.as_deref().unwrap_or_default().contains("exchanged"), "{:?}", prognoses[59]);
}

#[test]
fn a_switch_that_was_moved_and_put_right_leaves_no_wear_behind() {
    let mut told = 0;
    for seed in 0..12 {
        let (to, back) = (60 + seed, 75 + 2 * seed);
        let moved = |cycle: u64, [close, open]: [f64; 2]| {
            [if (to..back).contains(&cycle) { close - 0.12 } else { close }, open]
        };
        let prognoses = run(Method::default(), &healthy(150, seed, |_| 0.01, moved));
        let last = &prognoses[149];
        assert!(matches!(last.status, Status::Healthy | Status::Unknown), "{seed}: {last:?}");
        told += usize::from(notices(&prognoses).iter().any(|(_, kind)| *kind == "as-before"));
    }
    assert!(told >= 9, "told in {told} of 12");
}
