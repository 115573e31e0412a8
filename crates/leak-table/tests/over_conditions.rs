//! Tables over supply pressure and temperature: against the function that they were made from, both ways,
//! and on disk.

use std::f64::consts::PI;

use leak_table::{
    Condition, ConditionInfo, ConditionRange, ConditionTable, Conditions, ConditionsError, Degradation,
    InterpolationError, Limits, NodeTimes, RowError, SeverityAt, Stroke,
};

const PRESSURES_PA: (f64, f64) = (550e3, 690e3);
const TEMPERATURES_K: (f64, f64) = (270.0, 310.0);
const INFO: ConditionInfo = ConditionInfo {
    interpolation_error: InterpolationError { up_to_limit_s: 1e-4, beyond_limit_s: 2e-4 },
    checked: 48,
    stall_share: Some(1.02),
};

fn chebyshev((from, to): (f64, f64), count: usize) -> Vec<f64> {
    let angle = |j: usize| PI * j as f64 / (count - 1) as f64;
    (0..count).map(|j| f64::midpoint(from, to) - 0.5 * (to - from) * angle(j).cos()).collect()
}

/// Where the times end, more of it at higher pressure.
fn end(conditions: &Conditions) -> f64 {
    0.6e-6 * (conditions.supply_pressure_pa / 620e3).powf(0.8) * (conditions.temperature_k / 290.0)
}

/// Closing ever more slowly, opening ever faster, both depending on the conditions.
fn times_s(severity: f64, conditions: &Conditions) -> [f64; 2] {
    let share = severity / end(conditions);
    let pressure = conditions.supply_pressure_pa / 620e3;
    let warm = (290.0 / conditions.temperature_k).sqrt();
    [warm / pressure / (1.0 - 0.7 * share), warm * pressure * 2.0 / (1.0 + share)]
}

fn table(degradation: &Degradation, pressures: usize, temperatures: usize) -> ConditionTable {
    let pressures_pa = chebyshev(PRESSURES_PA, pressures);
    let temperatures_k = chebyshev(TEMPERATURES_K, temperatures);
    let shares: Vec<f64> = (0..=24).map(|i| f64::from(i) / 24.0).collect();
    let mut nodes = Vec::new();
    for &supply_pressure_pa in &pressures_pa {
        for &temperature_k in &temperatures_k {
            let conditions = Conditions { supply_pressure_pa, temperature_k };
            let end = end(&conditions);
            let times =
                |stroke: Stroke| shares.iter().map(|u| times_s(u * end, &conditions)[stroke as usize]).collect();
            nodes.push(NodeTimes { end, close_time_s: times(Stroke::Close), open_time_s: times(Stroke::Open) });
        }
    }
    ConditionTable::new(degradation, pressures_pa, temperatures_k, shares, &nodes, INFO).expect("a smooth function")
}

fn leak() -> &'static Degradation {
    Degradation::from_id("atmosphere").expect("of the catalogue")
}

/// Conditions spread over the range, and severities up to the end there.
fn places() -> impl Iterator<Item = (Conditions, f64)> {
    (0..200).map(|i| {
        let part = |step: f64| (0.37 + f64::from(i) * step).fract();
        let within = |(from, to): (f64, f64), part: f64| from + part * (to - from);
        let conditions = Conditions {
            supply_pressure_pa: within(PRESSURES_PA, part(0.618_034)),
            temperature_k: within(TEMPERATURES_K, part(0.414_214)),
        };
        (conditions, part(0.732_051) * end(&conditions))
    })
}

#[test]
fn times_and_slopes_are_those_of_the_function() {
    let table = table(leak(), 7, 4);
    for (conditions, severity) in places() {
        let found = table.times(severity, &conditions).expect("inside");
        for stroke in Stroke::ALL {
            let exact = |severity: f64, pressure: f64, temperature: f64| {
                let conditions = Conditions { supply_pressure_pa: pressure, temperature_k: temperature };
                times_s(severity, &conditions)[stroke as usize]
            };
            let (p, t) = (conditions.supply_pressure_pa, conditions.temperature_k);
            let near = |found: f64, exact: f64, tolerance: f64| {
                assert!((found - exact).abs() < tolerance, "{stroke} {conditions:?} {severity}: {found}, {exact}");
            };
            let stroke = found.stroke(stroke);
            near(stroke.time_s, exact(severity, p, t), 1e-4);
            near(
                stroke.by_severity * 1e-6,
                (exact(severity + 1e-10, p, t) - exact(severity - 1e-10, p, t)) / 2e-4,
                0.02,
            );
            near(
                stroke.by_supply_pressure * 1e5,
                (exact(severity, p + 1.0, t) - exact(severity, p - 1.0, t)) / 2e-5,
                2e-3,
            );
            near(stroke.by_temperature, (exact(severity, p, t + 1e-3) - exact(severity, p, t - 1e-3)) / 2e-3, 2e-4);
        }
    }
}

#[test]
fn slopes_are_those_of_the_times_themselves() {
    let table = table(leak(), 5, 3);
    let time = |severity: f64, p: f64, t: f64, stroke: Stroke| {
        let conditions = Conditions { supply_pressure_pa: p, temperature_k: t };
        table.times(severity, &conditions).expect("inside").stroke(stroke).time_s
    };
    for (conditions, severity) in places() {
        let (p, t) = (conditions.supply_pressure_pa, conditions.temperature_k);
        if p < PRESSURES_PA.0 + 2.0 || p > PRESSURES_PA.1 - 2.0 {
            continue;
        }
        for stroke in Stroke::ALL {
            let found = *table.times(severity, &conditions).expect("inside").stroke(stroke);
            let by_pressure = (time(severity, p + 1.0, t, stroke) - time(severity, p - 1.0, t, stroke)) / 2.0;
            assert!((found.by_supply_pressure - by_pressure).abs() < 1e-5 * by_pressure.abs() + 1e-11);
            let step = 1e-5 * severity;
            let by_severity =
                (time(severity + step, p, t, stroke) - time(severity - step, p, t, stroke)) / (2.0 * step);
            assert!((found.by_severity - by_severity).abs() < 1e-4 * by_severity.abs());
        }
    }
}

#[test]
fn a_slice_is_the_table_at_its_conditions_and_leads_back() {
    let table = table(leak(), 5, 3);
    for (conditions, severity) in places() {
        let slice = table.slice(&conditions).expect("inside");
        let cut = table.cut(&conditions).expect("inside");
        for part in [severity, -0.1 * severity, 1.5 * table.end(&conditions).expect("inside")] {
            let times = table.times(part, &conditions).expect("inside");
            for stroke in Stroke::ALL {
                let (time_s, slope) = slice.curve(stroke).extrapolated_time_and_slope(part);
                let found = times.stroke(stroke);
                assert!((found.time_s - time_s).abs() < 1e-11, "{stroke}: {} and {time_s}", found.time_s);
                assert!((found.by_severity - slope).abs() < 1e-9 * slope.abs());
                let (cut_s, cut_slope) = cut.times_and_slopes(part)[stroke as usize];
                assert!((cut_s - time_s).abs() < 1e-11, "{stroke}: {cut_s} and {time_s}");
                assert!((cut_slope - slope).abs() < 1e-9 * slope.abs());
                let back = slice.curve(stroke).extrapolated_severity(time_s);
                assert!((back - part).abs() < 1e-15, "{back} and {part}");
            }
        }
        let time_s = table.times(severity, &conditions).expect("inside").close.time_s;
        let back = table.severity_at(Stroke::Close, time_s, &conditions).expect("inside");
        assert!(matches!(back, SeverityAt::Within(back) if (back - severity).abs() < 1e-15));
    }
}

#[test]
fn the_limit_follows_the_conditions() {
    let table = table(leak(), 7, 4);
    let limits = Limits { close_within_s: 2.5, open_within_s: 9.0 };
    for (conditions, _) in places() {
        let slice = table.slice(&conditions).expect("inside");
        let severity = slice.limit_severity(&limits);
        assert!((times_s(severity, &conditions)[0] - 2.5).abs() < 1e-3);
        let late = Limits { close_within_s: 0.5, open_within_s: 9.0 };
        assert_eq!(slice.limit_severity(&late), 0.0);
        let never = Limits { close_within_s: 50.0, open_within_s: 50.0 };
        assert_eq!(slice.crossing(&never), None);
        let end = table.end(&conditions).expect("inside");
        assert!((slice.limit_severity(&never) - 1.02 * end).abs() < 1e-15, "the stall comes first");
        let just_beyond = Limits { close_within_s: 1.001 * times_s(end, &conditions)[0], open_within_s: 9.0 };
        let severity = slice.limit_severity(&just_beyond);
        assert!(severity > end && severity < 1.002 * end, "{severity} {end}");
    }
}

#[test]
fn conditions_outside_are_told() {
    let table = table(leak(), 5, 3);
    let outside = Conditions { supply_pressure_pa: 500e3, temperature_k: 290.0 };
    let error = table.times(0.0, &outside).expect_err("outside");
    assert!(matches!(error, ConditionsError::Outside { condition: Condition::SupplyPressure, .. }));
    assert!(error.to_string().contains("found 500000 Pa absolute, expected 550000 to 690000"), "{error}");
    let ConditionRange { supply_pressure_pa, temperature_k } = table.range();
    assert_eq!((supply_pressure_pa, temperature_k), (PRESSURES_PA, TEMPERATURES_K));
    assert_eq!(table.range().nearest(&outside).supply_pressure_pa, 550e3);
}

#[test]
fn grids_that_are_none_and_times_that_turn_are_refused() {
    let node = |close: [f64; 3]| NodeTimes { end: 1e-6, close_time_s: close.into(), open_time_s: vec![3.0, 2.0, 1.0] };
    let shares = || vec![0.0, 0.5, 1.0];
    let new = |pressures: Vec<f64>, shares: Vec<f64>, nodes: &[NodeTimes]| {
        ConditionTable::new(leak(), pressures, vec![290.0], shares, nodes, INFO)
    };
    let good = [node([1.0, 2.0, 3.0]), node([2.0, 3.0, 4.0])];
    new(vec![5e5, 6e5], shares(), &good).expect("a grid");
    assert!(matches!(new(vec![5e5], shares(), &good), Err(RowError::Grid { .. })));
    assert!(matches!(new(vec![6e5, 5e5], shares(), &good), Err(RowError::Grid { .. })));
    assert!(matches!(new(vec![5e5, 6e5], vec![0.0, 0.5, 0.9], &good), Err(RowError::Grid { .. })));
    let turning = [node([1.0, 2.0, 3.0]), node([2.0, 4.0, 3.0])];
    assert!(matches!(new(vec![5e5, 6e5], shares(), &turning), Err(RowError::NotMonotone { row: 5, .. })));
    // Monotone at three nodes, but the parabola through them turns between the last two.
    let between = [node([1.0, 1.5, 3.0]), node([1.0, 1.01, 3.0]), node([1.0, 1.8, 3.0])];
    let error = new(vec![5e5, 5.5e5, 7e5], shares(), &between).expect_err("turns");
    assert!(matches!(error, RowError::NotMonotoneBetween { stroke: Stroke::Close, .. }), "{error}");
}

#[test]
fn a_time_that_stays_stays_under_all_conditions() {
    let exhaust = Degradation::from_id("exhaust").expect("of the catalogue");
    let node = |fall: f64| NodeTimes {
        end: 0.7,
        close_time_s: vec![1.0, 1.0, 1.0 - fall, 0.9 - fall],
        open_time_s: vec![2.0, 3.0, 4.0, 5.0],
    };
    let nodes = [node(0.0), node(0.0), node(0.05)];
    let shares = vec![0.0, 0.4, 0.8, 1.0];
    let table = ConditionTable::new(exhaust, vec![5e5, 6e5, 7e5], vec![290.0], shares, &nodes, INFO).expect("a grid");
    for i in 0..=100 {
        let conditions = Conditions { supply_pressure_pa: 5e5 + 2e3 * f64::from(i), temperature_k: 290.0 };
        let mut before = f64::INFINITY;
        let cut = table.cut(&conditions).expect("inside");
        for k in 0..=100 {
            let (time_s, slope) = cut.times_and_slopes(0.7e-2 * f64::from(k))[0];
            assert!(time_s <= before && slope <= 0.0, "{i} {k}: {time_s} after {before}");
            let close = table.times(0.7e-2 * f64::from(k), &conditions).expect("inside").close;
            assert!(close.time_s <= before && close.by_severity <= 0.0, "{i} {k}: {close:?} after {before}");
            before = close.time_s;
        }
    }
}
