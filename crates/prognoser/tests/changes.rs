//! When the assumption of steady growth fails, the log says so and the
//! estimate goes on from there.

mod common;

use common::{log, noisy, notices, reading, run, tables};
use leak_table::Fault;
use prognoser::bayes::{BayesConfig, BayesEstimator, GrowthLaw, Noise};
use prognoser::study::NoiseSource;
use prognoser::{FaultCall, Method, Prognosis, Reading, Status};

const SD: f64 = 0.02;

/// Cycle at which a notice came first.
fn first(prognoses: &[Prognosis], kind: &str) -> Option<u64> {
    notices(prognoses).iter().find(|(_, found)| *found == kind).map(|(cycle, _)| *cycle)
}

fn end(prognosis: &Prognosis) -> f64 {
    prognosis.eol_cycle.expect("there is an end")
}

#[test]
fn a_repair_restarts_the_estimate() {
    for fault in Fault::ALL {
        for seed in 0..20 {
            let leak = |k: f64| {
                if k < 25.0 { k / 50.0 } else { (k - 25.0) / 50.0 }
            };
            let prognoses = run(Method::default(), &log(&tables(), fault, 60, SD, seed, leak));
            let cycle = first(&prognoses, "repaired").expect("the repair is seen");
            assert!((25..=30).contains(&cycle), "{fault}, {seed}: {cycle}");
            assert!((end(&prognoses[50]) - 75.0).abs() < 5.0, "{fault}: {:?}", prognoses[50]);
        }
    }
}

#[test]
fn a_step_is_seen_and_followed() {
    for fault in Fault::ALL {
        for seed in 0..20 {
            let leak = |k: f64| k / 50.0 + if k < 20.0 { 0.0 } else { 0.25 };
            let prognoses = run(Method::default(), &log(&tables(), fault, 36, SD, seed, leak));
            let cycle = first(&prognoses, "growth-changed").expect("the step is seen");
            assert!((20..=26).contains(&cycle), "{fault}, {seed}: {cycle}");
            assert!((end(&prognoses[35]) - 37.5).abs() < 1.5, "{fault}: {:?}", prognoses[35]);
        }
    }
}

#[test]
fn a_step_that_stays_is_no_sign_of_the_next() {
    for fault in Fault::ALL {
        for (seed, size) in (0..20).map(|seed| (seed, 0.1 + 0.02 * seed as f64)) {
            let leak = |k: f64| if k < 20.0 { 0.0 } else { size };
            let prognoses = run(Method::default(), &log(&tables(), fault, 120, 0.01, seed, leak));
            let [after, long_after] = [&prognoses[30], &prognoses[119]];
            assert_eq!(after.fault.fault(), Some(fault), "{seed}: {after:?}");
            // How soon the next one comes is not known, and ever less likely to be soon.
            let [soon, last] = [long_after.rul_p05, long_after.rul_p95].map(|rul| rul.expect("it leaks"));
            assert!(soon > 10.0 && last > 200.0, "{fault}, {size}: {soon} to {last}");
            assert!(soon > after.rul_p05.expect("it leaks"), "{fault}, {size}: {after:?}");
            assert_eq!(long_after.status, Status::Watch, "{fault}, {size}");
        }
    }
}

#[test]
fn a_steady_life_of_thousands_of_cycles_is_told_closely() {
    for fault in Fault::ALL {
        for seed in 0..3 {
            let prognoses = run(Method::default(), &log(&tables(), fault, 1600, 0.03, seed, |k| k / 3000.0));
            let one = &prognoses[1599];
            let [first, last] = [one.rul_p05, one.rul_p95].map(|rul| rul.expect("it leaks"));
            assert!(first < 1401.0 && 1401.0 < last, "{fault}, {seed}: {first} to {last}");
            assert!(last - first < 140.0, "{fault}, {seed}: {first} to {last}");
        }
    }
}

#[test]
fn a_pace_that_changes_little_by_little_has_an_end() {
    for fault in Fault::ALL {
        for seed in 0..10 {
            let leak = |k: f64| (k + 5.0 * (k / 8.0).sin()) / 60.0;
            let prognoses = run(Method::default(), &log(&tables(), fault, 50, 0.01, seed, leak));
            for one in &prognoses[25..] {
                let [middle, last] = [one.rul_p50, one.rul_p95].map(|rul| rul.expect("it leaks"));
                assert!(last < 10.0 * middle, "{fault}, {seed}, cycle {}: {middle}, up to {last}", one.cycle);
            }
        }
    }
}

#[test]
fn a_leak_that_sets_in_late_is_found() {
    for fault in Fault::ALL {
        for seed in 0..10 {
            let leak = |k: f64| (k - 100.0).max(0.0) / 40.0;
            let prognoses = run(Method::default(), &log(&tables(), fault, 130, SD, seed, leak));
            assert_eq!(prognoses[99].fault, FaultCall::None, "{seed}");
            assert_eq!(prognoses[115].fault.fault(), Some(fault), "{seed}");
            assert!((end(&prognoses[125]) - 140.0).abs() < 5.0, "{fault}: {:?}", prognoses[125]);
        }
    }
}

#[test]
fn a_leak_that_grows_slowly_on_a_healthy_valve_is_found() {
    for fault in Fault::ALL {
        for seed in 0..6 {
            let leak = |k: f64| (k - 150.0).max(0.0) / 1200.0;
            let prognoses = run(Method::default(), &log(&tables(), fault, 800, 0.01, seed, leak));
            for one in &prognoses {
                let named = one.fault.fault().is_none_or(|named| named == fault);
                assert!(named, "{fault}, {seed}: {one:?}");
            }
            for one in &prognoses[400..] {
                let share = one.severity.expect("it leaks") / leak(one.cycle as f64);
                assert!((0.8..1.2).contains(&share), "{fault}, {seed}: {one:?}");
            }
            assert!((end(&prognoses[799]) - 1350.0).abs() < 100.0, "{fault}, {seed}: {:?}", prognoses[799]);
        }
    }
}

#[test]
fn exponential_growth_is_told_from_linear_growth() {
    let leak = |k: f64| (0.12 * (k - 50.0)).exp();
    for fault in Fault::ALL {
        let readings = log(&tables(), fault, 48, SD, 2, leak);
        let config = BayesConfig { growth: GrowthLaw::Exponential, ..BayesConfig::default() };
        let asked = run(Method::Bayes(config), &readings);
        assert!((end(&asked[44]) - 50.0).abs() < 2.5, "{fault}: {:?}", asked[44]);
        let chosen = run(Method::default(), &readings);
        let seen = first(&chosen, "growth-curved").or(first(&chosen, "growth-changed"));
        assert!(seen.is_some(), "{fault}: nothing was said");
        assert!((end(&chosen[47]) - 50.0).abs() < 2.5, "{fault}: {:?}", chosen[47]);
        let config = BayesConfig { growth: GrowthLaw::Linear, ..BayesConfig::default() };
        let straight = run(Method::Bayes(config), &readings);
        assert_eq!(first(&straight, "growth-curved"), None);
    }
}

#[test]
fn steady_growth_raises_no_suspicion() {
    for fault in Fault::ALL {
        for seed in 0..50 {
            let readings = log(&tables(), fault, 50, SD, seed, |k| k / 51.0);
            let said = notices(&run(Method::default(), &readings));
            let changes = ["repaired", "growth-changed", "growth-curved", "unexplained"];
            assert!(!said.iter().any(|(_, kind)| changes.contains(kind)), "{seed}: {said:?}");
        }
    }
}

#[test]
fn noise_above_what_was_stated_is_said() {
    let readings = log(&tables(), Fault::Supply, 40, 0.05, 1, |k| k / 45.0);
    let stated = |sd_s: f64| {
        let noise = Noise::Known { sd_s };
        run(Method::Bayes(BayesConfig { noise, ..BayesConfig::default() }), &readings)
    };
    assert!(first(&stated(0.01), "noise-larger").is_some());
    assert_eq!(first(&stated(0.05), "noise-larger"), None);
}

#[test]
fn a_constant_offset_that_no_leak_explains_is_said_with_what_to_do() {
    let readings: Vec<Reading> = log(&tables(), Fault::Supply, 30, 0.005, 1, |k| k / 40.0)
        .into_iter()
        .map(|r| Reading { close_time_s: r.close_time_s.map(|t| t + 0.08), ..r })
        .collect();
    let prognoses = run(Method::default(), &readings);
    assert!(first(&prognoses, "offset").is_some(), "{:?}", notices(&prognoses));
    let text =
        prognoses.iter().flat_map(|p| &p.notices).find(|n| n.kind() == "offset").expect("it was said").to_string();
    assert!(text.contains("valve compare") && text.contains("valve explain"), "{text}");
}

#[test]
fn a_leak_on_a_valve_that_its_tables_are_far_off_is_found() {
    for fault in Fault::ALL {
        for seed in 0..20 {
            let readings: Vec<Reading> = log(&tables(), fault, 30, 0.01, seed, |k| (k - 5.0).max(0.0) / 40.0)
                .into_iter()
                .map(|reading| Reading {
                    close_time_s: reading.close_time_s.map(|time_s| 0.88 * time_s),
                    open_time_s: reading.open_time_s.map(|time_s| 1.04 * time_s),
                    ..reading
                })
                .collect();
            let prognoses = run(Method::default(), &readings);
            for one in &prognoses[22..] {
                assert_ne!(one.status, Status::Healthy, "{fault}, {seed}: {one:?}");
                assert!(one.fault.fault().is_none_or(|named| named == fault), "{fault}, {seed}: {one:?}");
            }
            let last = &prognoses[29];
            assert_eq!(last.fault.fault(), Some(fault), "{seed}: {last:?}");
            assert!((end(last) - 45.0).abs() < 6.0, "{fault}, {seed}: {last:?}");
        }
    }
}

#[test]
fn a_single_glitch_is_named_and_changes_little() {
    let mut readings = log(&tables(), Fault::Supply, 30, 0.01, 4, |k| k / 40.0);
    let without = run(Method::default(), &readings);
    readings[15].open_time_s = readings[15].open_time_s.map(|t| t + 1.0);
    let with = run(Method::default(), &readings);
    assert_eq!(first(&with, "glitch"), Some(15));
    for (a, b) in with.iter().zip(&without).skip(15) {
        assert!((end(a) - end(b)).abs() < 0.5, "{a:?}\n{b:?}");
    }
}

#[test]
fn a_stroke_that_does_not_finish_pulls_the_end_closer() {
    // The valve closes no more from cycle 20 on, which the leak at the stall
    // explains: the estimate must not fall behind.
    let tables = tables();
    let leak = |k: f64| k / 17.0;
    let mut noise = NoiseSource::new(5, 0);
    let readings: Vec<Reading> = (0..24)
        .map(|k| {
            let clean = reading(&tables, Fault::Atmosphere, k, leak(k as f64).min(1.125));
            noisy(clean, SD, &mut noise)
        })
        .collect();
    assert!(readings[20].close_time_s.is_none());
    let prognoses = run(Method::default(), &readings);
    let last = &prognoses[20];
    assert!(notices(&prognoses).contains(&(20, "not-finished")));
    assert_eq!(last.fault, FaultCall::from(Fault::Atmosphere));
    assert!((end(last) - 17.0).abs() < 0.5, "{last:?}");
}

#[test]
fn times_that_were_not_measured_are_no_stalls() {
    for fault in Fault::ALL {
        let mut readings = log(&tables(), fault, 45, SD, 8, |k| k / 50.0);
        for reading in readings.iter_mut().filter(|reading| reading.cycle % 4 == 1) {
            reading.close_time_s = None;
            if reading.cycle % 8 == 1 {
                reading.open_time_s = None;
            }
        }
        let prognoses = run(Method::default(), &readings);
        assert!(prognoses.iter().all(|one| one.status != Status::EolReached), "{fault}");
        assert_eq!(first(&prognoses, "not-finished"), None);
        assert!((end(&prognoses[40]) - 50.0).abs() < 1.5, "{fault}: {:?}", prognoses[40]);
    }
}

#[test]
fn a_lone_unfinished_stroke_of_a_healthy_valve_is_no_fault() {
    let mut readings = log(&tables(), Fault::Supply, 40, SD, 6, |_| 0.0);
    readings[20].close_time_s = None;
    readings[20].stalled[0] = true;
    let prognoses = run(Method::default(), &readings);
    assert_eq!(first(&prognoses, "not-finished"), Some(20));
    assert_eq!(prognoses[39].fault, FaultCall::None);
}

/// A first reading says nothing of how steadily wear grows, whatever it says of the valve's own healthy times.
#[test]
fn a_first_reading_does_not_tell_varying_growth_from_steady() {
    let tables = tables();
    let config = BayesConfig::default();
    let mut estimator = BayesEstimator::new(&config);
    estimator.update(&tables, &reading(&tables, Fault::Atmosphere, 0, 0.0));
    let record = serde_json::to_value(estimator.record()).expect("plain numbers");
    let share = |mode: &str| -> f64 {
        let parts = record["parts"].as_array().expect("hypotheses").iter();
        let own = parts.filter(|part| part["cause"]["Wear"] == 0 && part["law"] == "Linear" && part["mode"] == mode);
        own.map(|part| part["ln_weight"].as_f64().expect("a number").exp()).sum()
    };
    let before = config.growth_prior.rough / config.growth_prior.steady;
    let after = share("Rough") / share("Steady");
    assert!((after / before - 1.0).abs() < 0.05, "{before} before, {after} after");
}
