//! Logs without noise but for their rounding: the right fault and the right
//! end from the second cycle on.

mod common;

use common::{log, notices, run, tables};
use leak_table::Fault;
use prognoser::bayes::{BayesConfig, Noise};
use prognoser::{Method, Status};

const END: f64 = 24.9;

fn methods() -> [Method; 3] {
    let known = Noise::Known { sd_s: 1e-3 };
    [Method::default(), Method::Bayes(BayesConfig { noise: known, ..BayesConfig::default() }), Method::Ols]
}

#[test]
fn the_end_is_told_within_half_a_cycle_from_cycle_2_on() {
    let tables = tables();
    for fault in Fault::ALL {
        let readings = log(&tables, fault, 27, 0.0, 0, |cycle| cycle / END);
        for method in methods() {
            for prognosis in run(method, &readings).iter().skip(2) {
                let context = format!("{fault}, {}: {prognosis:?}", method.name());
                assert_eq!(prognosis.fault.fault(), Some(fault), "{context}");
                let eol = prognosis.eol_cycle.expect("a fault has an end");
                assert!((eol - END).abs() < 0.5, "{context}");
            }
        }
    }
}

#[test]
fn the_state_climbs_the_ladder_to_the_end() {
    let tables = tables();
    for fault in Fault::ALL {
        let readings = log(&tables, fault, 27, 0.0, 0, |cycle| cycle / END);
        let prognoses = run(Method::default(), &readings);
        assert_eq!(prognoses[0].status, Status::Unknown);
        assert_eq!(prognoses[10].status, Status::Watch);
        assert_eq!(prognoses[20].status, Status::Plan);
        assert_eq!(prognoses[24].status, Status::ActNow);
        assert!(prognoses.windows(2).all(|pair| pair[0].status <= pair[1].status));
        assert_eq!(prognoses[26].status, Status::EolReached);
        assert_eq!(prognoses[26].rul_cycles, Some(0.0));
        let bounds = &prognoses[10];
        assert!(bounds.rul_p05 < bounds.rul_p50 && bounds.rul_p50 < bounds.rul_p95);
        let said = notices(&prognoses);
        assert!(said.iter().all(|(cycle, kind)| *kind == "above-limit" && *cycle >= 25), "{said:?}");
    }
}

#[test]
fn least_squares_give_whole_cycles() {
    let tables = tables();
    let readings = log(&tables, Fault::Supply, 25, 0.0, 0, |cycle| cycle / 25.0);
    for prognosis in run(Method::Ols, &readings).iter().skip(2) {
        let expected = 25.0 - prognosis.cycle as f64;
        assert_eq!(prognosis.rul_cycles, Some(expected));
    }
}

#[test]
fn a_valve_that_starts_with_a_leak_is_followed_all_the_same() {
    let tables = tables();
    for fault in Fault::ALL {
        let readings = log(&tables, fault, 25, 0.005, 3, |cycle| 0.4 + 0.6 * cycle / 25.0);
        let prognoses = run(Method::default(), &readings);
        let late = &prognoses[15];
        assert_eq!(late.fault.fault(), Some(fault));
        assert!((late.eol_cycle.expect("an end") - 25.0).abs() < 1.0, "{late:?}");
    }
}
