//! Many valves, untidy logs, growing files.

mod common;

use std::collections::HashSet;
use std::sync::Arc;

use common::{log, notices, row, run, tables};
use leak_table::Fault;
use prognoser::{Method, Prognoser, Prognosis, Reading, Status};

fn supply_log(seed: u64) -> Vec<Reading> {
    log(&tables(), Fault::Supply, 25, 0.01, seed, |k| k / 30.0)
}

#[test]
fn interleaved_valves_do_not_disturb_each_other() {
    let logs: Vec<Vec<Reading>> = (0..5).map(supply_log).collect();
    let names = ["a", "b", "c", "d", "e"];
    let mut together = Prognoser::new(tables().into(), Method::default());
    let mut rows: Vec<Vec<Prognosis>> = vec![Vec::new(); 5];
    for cycle in 0..25 {
        for ((name, log), out) in names.iter().zip(&logs).zip(&mut rows) {
            out.push(together.push(&row(name, &log[cycle])));
        }
    }
    assert_eq!(together.valves(), 5);
    for (i, log) in logs.iter().enumerate() {
        let alone = run(Method::default(), log);
        for (a, b) in rows[i].iter().zip(&alone) {
            assert_eq!(a.eol_cycle, b.eol_cycle);
            assert_eq!(a.fault_probability, b.fault_probability);
        }
    }
}

#[test]
fn missed_cycles_are_said_and_cost_only_their_information() {
    let full = supply_log(1);
    let thinned: Vec<Reading> = full.iter().copied().filter(|r| r.cycle < 10 || r.cycle % 3 == 0).collect();
    let prognoses = run(Method::default(), &thinned);
    assert!(notices(&prognoses).contains(&(12, "missed-cycles")));
    let last = prognoses.last().expect("rows");
    assert!((last.eol_cycle.expect("an end") - 30.0).abs() < 1.0, "{last:?}");
}

#[test]
fn repeated_and_late_rows_are_said_and_not_used() {
    let tidy = supply_log(2);
    let mut untidy = tidy.clone();
    untidy.insert(11, tidy[10]);
    untidy.insert(15, tidy[2]);
    let (a, b) = (run(Method::default(), &tidy), run(Method::default(), &untidy));
    let said: Vec<_> =
        notices(&b).into_iter().filter(|(_, kind)| ["repeated-cycle", "out-of-order"].contains(kind)).collect();
    assert_eq!(said, [(10, "repeated-cycle"), (2, "out-of-order")]);
    assert_eq!(a.last().map(|p| p.eol_cycle), b.last().map(|p| p.eol_cycle));
    assert_eq!(b[11].eol_cycle, b[10].eol_cycle);
}

#[test]
fn a_row_for_each_stroke_tells_as_much_as_one_for_both() {
    let whole = supply_log(5);
    let strokes: Vec<Reading> = whole
        .iter()
        .flat_map(|both| [Reading { open_time_s: None, ..*both }, Reading { close_time_s: None, ..*both }])
        .collect();
    let (a, b) = (run(Method::default(), &whole), run(Method::default(), &strokes));
    assert_eq!(notices(&b), []);
    for (both, second) in a.iter().zip(b.iter().skip(1).step_by(2)).skip(5) {
        let [ends, seconds] = [both, second].map(|one| [one.rul_p05, one.rul_p95].map(|left| left.expect("an end")));
        let wide = ends[1] - ends[0];
        let is_alike = (0..2).all(|end| (ends[end] - seconds[end]).abs() < 0.2 * wide);
        assert!(is_alike, "{both:?} {second:?}");
    }
    // The same stroke of a cycle again is no new reading.
    let mut again = strokes.clone();
    again.insert(11, strokes[10]);
    again.insert(30, strokes[29]);
    let said: Vec<_> = notices(&run(Method::default(), &again)).into_iter().map(|(_, kind)| kind).collect();
    assert_eq!(said, ["repeated-cycle"; 2]);
}

#[test]
fn strokes_beyond_their_limit_end_a_life_in_rows_of_their_own_too() {
    let tables = tables();
    let limit_s = tables.manifest().limits.close_within_s;
    let over: Vec<Reading> = (0..4)
        .flat_map(|cycle| {
            let blank = Reading { cycle, ..Reading::default() };
            [
                Reading { close_time_s: Some(1.02 * limit_s), ..blank },
                Reading { open_time_s: Some(tables.entry(0).table.points()[0].open_time_s.expect("opens")), ..blank },
            ]
        })
        .collect();
    let prognoses = run(Method::default(), &over);
    assert_ne!(prognoses[0].status, Status::EolReached, "one may be an outlier");
    assert!(prognoses[2..].iter().all(|row| row.status == Status::EolReached));
}

#[test]
fn a_counter_that_starts_again_starts_the_estimate_anew() {
    let mut readings = supply_log(3);
    readings.extend(supply_log(4));
    let prognoses = run(Method::default(), &readings);
    assert!(notices(&prognoses).contains(&(2, "counter-restarted")), "{:?}", notices(&prognoses));
    let last = prognoses.last().expect("rows");
    assert!((last.eol_cycle.expect("an end") - 30.0).abs() < 1.0, "{last:?}");
}

#[test]
fn a_valve_that_does_not_stroke_at_all_is_at_its_end_and_gives_finite_numbers() {
    let dead = |cycle| Reading { cycle, stalled: [true; 2], ..Reading::default() };
    let absurd = |cycle| Reading { cycle, close_time_s: Some(1e300), open_time_s: Some(0.0), ..Reading::default() };
    for method in [Method::default(), Method::Ols] {
        let both = [(&dead as &dyn Fn(u64) -> Reading, Status::EolReached), (&absurd, Status::Unknown)];
        for (make, status) in both {
            let readings: Vec<Reading> = (0..30).map(make).collect();
            let prognoses = run(method, &readings);
            assert_eq!(prognoses[1].status, status);
            let text = serde_json::to_string(&prognoses[29]).expect("is JSON");
            let finite = [prognoses[29].eol_cycle, prognoses[29].rul_p95, prognoses[29].leak_area_mm2];
            assert!(finite.iter().flatten().all(|value| value.is_finite()), "{text}");
        }
    }
}

#[test]
fn times_in_another_unit_or_exchanged_are_named_and_end_no_life() {
    let tidy = supply_log(6);
    let in_ms = |reading: &Reading| Reading {
        close_time_s: reading.close_time_s.map(|time| 1e3 * time),
        open_time_s: reading.open_time_s.map(|time| 1e3 * time),
        ..*reading
    };
    let turned = |reading: &Reading| Reading {
        close_time_s: reading.open_time_s,
        open_time_s: reading.close_time_s,
        ..*reading
    };
    for kind in ["other-unit", "exchanged"] {
        let wrong = |reading: &Reading| if kind == "exchanged" { turned(reading) } else { in_ms(reading) };
        for method in [Method::default(), Method::Ols] {
            let all: Vec<Reading> = tidy.iter().map(&wrong).collect();
            let prognoses = run(method, &all);
            let of_kind = notices(&prognoses).iter().filter(|(_, said)| *said == kind).count();
            assert!(of_kind >= all.len(), "{kind}: {:?}", notices(&prognoses));
            assert!(prognoses.iter().all(|one| one.status == Status::Unknown), "{kind}");
            // One row of many tells nothing, and costs no more than that.
            let mut once = tidy.clone();
            once[16] = wrong(&tidy[16]);
            let (with, without) = (run(method, &once), run(method, &tidy));
            assert!(notices(&with).contains(&(16, kind)));
            let ends = [with, without].map(|all| all.last().and_then(|last| last.eol_cycle).expect("an end"));
            assert!((ends[0] - ends[1]).abs() < 0.3, "{kind}: {ends:?}");
        }
    }
    // On the way of a leak to the atmosphere both times are alike for a while.
    let crossing = log(&tables(), Fault::Atmosphere, 25, 0.01, 6, |k| k / 26.0);
    let all: Vec<Reading> = crossing.iter().map(turned).collect();
    let told = run(Method::default(), &all);
    assert!(told.iter().all(|one| one.status == Status::Unknown), "{:?}", notices(&told));
    // A valve whose times turn for good is another one.
    let mut changed = tidy.clone();
    changed.iter_mut().skip(5).for_each(|reading| *reading = turned(reading));
    let told = run(Method::default(), &changed);
    let cycles: Vec<u64> =
        notices(&told).into_iter().filter(|(_, kind)| *kind == "exchanged").map(|(cycle, _)| cycle).collect();
    assert_eq!(cycles, [5, 6, 7]);
    // A valve near its end, and one that is slow in both strokes, are no mistakes.
    let slow = tidy.iter().map(|reading| Reading {
        close_time_s: reading.close_time_s.map(|time| 1.5 * time),
        open_time_s: reading.open_time_s.map(|time| 1.5 * time),
        ..*reading
    });
    for readings in [tidy.clone(), slow.collect()] {
        let said =
            notices(&run(Method::default(), &readings)).into_iter().map(|(_, kind)| kind).collect::<HashSet<_>>();
        assert!(!said.contains("exchanged") && !said.contains("other-unit"), "{said:?}");
    }
}

#[test]
fn json_has_the_names_others_rely_on() {
    let prognoses = run(Method::default(), &supply_log(5));
    let value = serde_json::to_value(&prognoses[20]).expect("is JSON");
    for key in [
        "valve",
        "cycle",
        "fault",
        "fault_probability",
        "leak_area_mm2",
        "leak_rate_mm2_per_cycle",
        "eol_cycle",
        "rul_cycles",
        "rul_p05",
        "rul_p50",
        "rul_p95",
        "replace_by_cycle",
        "caveat",
        "status",
        "notices",
    ] {
        assert!(value.get(key).is_some(), "{key} is missing in {value}");
    }
    assert_eq!(value["fault"], "supply");
    assert_eq!(value["status"], "plan");
    for key in ["none", "atmosphere", "supply"] {
        assert!(value["fault_probability"][key].is_f64(), "{value}");
    }
}

#[test]
fn the_state_of_a_valve_does_not_grow() {
    let readings = log(&tables(), Fault::Supply, 5_000, 0.02, 6, |_| 0.0);
    let mut prognoser = Prognoser::new(tables().into(), Method::default());
    let mut largest = 0;
    let mut last = None;
    for (index, reading) in readings.iter().enumerate() {
        last = Some(prognoser.push(&row("V", reading)));
        if index < 30 || index % 500 == 0 {
            largest = largest.max(numbers(&prognoser));
        }
    }
    let last = last.expect("rows");
    assert!(last.fault_probability.expect("bayes").none > 0.99, "{last:?}");
    // In single precision, with three small enumerations a story: 44 stories at most.
    assert!(4 * largest < 5600, "{largest} numbers");
}

/// How many numbers and words the state of the valve has.
fn numbers(prognoser: &Prognoser) -> usize {
    fn count(value: &serde_json::Value) -> usize {
        match value {
            serde_json::Value::Array(all) => all.iter().map(count).sum(),
            serde_json::Value::Object(all) => all.values().map(count).sum(),
            _ => 1,
        }
    }
    count(&serde_json::to_value(prognoser.state("V").expect("was seen")).expect("is JSON"))
}

#[test]
fn a_state_that_was_kept_goes_on_as_if_nothing_had_happened() {
    let readings = supply_log(7);
    let mut whole = Prognoser::new(tables().into(), Method::default());
    let all: Vec<Prognosis> = readings.iter().map(|reading| whole.push(&row("V", reading))).collect();
    let mut first = Prognoser::new(tables().into(), Method::default());
    for reading in &readings[..12] {
        first.push(&row("V", reading));
    }
    let kept = serde_json::to_string(&first.state("V").expect("was seen")).expect("is JSON");
    let mut second = Prognoser::new(tables().into(), Method::default());
    assert!(second.resume("V", serde_json::from_str(&kept).expect("was just written")));
    for (reading, expected) in readings[12..].iter().zip(&all[12..]) {
        assert_eq!(second.push(&row("V", reading)), *expected);
    }
}

#[test]
fn a_row_that_is_passed_leaves_status_notices_and_what_comes_later_as_they_are() {
    let tables = Arc::new(tables());
    let mut statuses = HashSet::new();
    for (seed, noise_s) in [(1, 0.002), (2, 0.01), (3, 0.031_6), (4, 0.031_6)] {
        let leak = |k: f64| if seed == 4 { (k / 40.0).powi(2) } else { k / 40.0 };
        let readings = log(&tables, Fault::Supply, 44, noise_s, seed, leak);
        let told = run(Method::default(), &readings);
        let mut prognoser = Prognoser::new(Arc::clone(&tables), Method::default());
        let (last, passed) = readings.split_last().expect("rows");
        for (reading, told) in passed.iter().zip(&told) {
            let one = prognoser.pass(&row("V", reading));
            assert_eq!((one.status, &one.notices), (told.status, &told.notices), "{seed}, {}", one.cycle);
            statuses.insert(told.status.name());
        }
        assert_eq!(Some(&prognoser.push(&row("V", last))), told.last(), "{seed}");
    }
    assert!(["watch", "plan", "act-now", "eol-reached"].iter().all(|rung| statuses.contains(rung)), "{statuses:?}");
}
