//! Tables of everything that wears, alone and over conditions, against direct simulation.

use std::borrow::Cow;
use std::sync::OnceLock;

use leak_table::{
    BundleEntry, ConditionRange, Conditions as Cycle, Degradation, DegradationId, Monotone, Moves, Severity,
    SeverityAt, Stroke, TableBundle, TimeAt,
};
use lut_builder::{BuildError, Built, Notice, Options, Request, TableModel, Wear, Worn, build_request};
use valve_file::ValveFile;
use valve_model::cycle::{CycleTimes, cycles};
use valve_model::{Conditions, Valve};

const TESTBED: &str = include_str!("../../../models/testbed.toml");
/// One psi in Pa.
const PA_PER_PSI: f64 = 6894.757;
/// The interpolation error that tables promise up to the limit, s.
const UP_TO_LIMIT_S: f64 = 0.2e-3;
/// The same over conditions.
const OVER_CONDITIONS_S: f64 = 0.5e-3;

fn testbed() -> ValveFile {
    ValveFile::parse(TESTBED, "valve.toml").expect("a valve file")
}

fn psig(from: f64, to: f64) -> (f64, f64) {
    (101_325.0 + from * PA_PER_PSI, 101_325.0 + to * PA_PER_PSI)
}

fn tables(file: &ValveFile, request: &Request) -> Result<Built, BuildError> {
    let model = TableModel {
        name: file.name(),
        canonical_text: &file.canonical_model(),
        valve: file.valve(),
        schedule: file.schedule(),
        limits: file.limits(),
    };
    build_request(&model, request, &Options::default(), &|_| {})
}

/// Numbers in 0..1 that look random and are the same everywhere (Weyl sequence).
fn spread(count: u32, seed: f64) -> impl Iterator<Item = f64> {
    (1..=count).map(move |i| (seed + f64::from(i) * 0.618_033_988_749_895).fract())
}

/// The valve worn by the wear's own rule.
fn worn(valve: &Valve, wear: &Wear, conditions: Conditions, severity: f64) -> (Valve, Conditions) {
    let mut worn = Worn { parameters: valve.parameters().clone(), effects: valve.effects().to_vec(), conditions };
    (wear.apply)(&mut worn, severity).expect("possible");
    let custom = valve.custom().to_vec();
    (Valve::new(worn.parameters, valve.switches(), worn.effects, custom).expect("possible"), worn.conditions)
}

fn periodic(file: &ValveFile, runs: &[(Valve, Conditions)]) -> Vec<CycleTimes> {
    let runs: Vec<_> = runs.iter().map(|(valve, conditions)| (valve, *conditions)).collect();
    let all = cycles(&runs, &file.schedule(), 40, 1e-3).into_iter();
    all.map(|times| *times.last().expect("at least one cycle")).collect()
}

fn time_of(times: &CycleTimes, stroke: Stroke) -> Option<f64> {
    match stroke {
        Stroke::Close => times.close_time_s,
        Stroke::Open => times.open_time_s,
    }
}

/// The table of one degradation between its points, up to its limit.
fn sound(file: &ValveFile, entry: &BundleEntry<'_>, wear: &Wear) {
    let nominal = Conditions::nominal(file.valve().parameters());
    let severities: Vec<f64> = spread(16, 0.137).map(|u| u * entry.limit_severity).collect();
    let runs: Vec<_> = severities.iter().map(|severity| worn(file.valve(), wear, nominal, *severity)).collect();
    for (severity, times) in severities.iter().zip(periodic(file, &runs)) {
        for stroke in Stroke::ALL {
            let id = &entry.degradation.id;
            let TimeAt::Within(found_s) = entry.table.curve(stroke).time_at(*severity) else {
                panic!("{id}: no {stroke} time at {severity}")
            };
            let simulated_s = time_of(&times, stroke).expect("finished before the limit");
            assert!(
                (found_s - simulated_s).abs() < UP_TO_LIMIT_S,
                "{id} {stroke} at {severity}: {found_s}, {simulated_s}"
            );
        }
    }
}

/// The largest difference of a table over conditions from simulations up to the limit, s.
fn worst_over_conditions(file: &ValveFile, bundle: &TableBundle, id: &str, seed: f64) -> f64 {
    let entry = bundle.get(id).expect("was built");
    let table = entry.over_conditions.expect("was built over conditions");
    let wear = Wear::catalogue().into_iter().find(|wear| wear.degradation.id == id).expect("of the catalogue");
    let ConditionRange { supply_pressure_pa: pressures, temperature_k: temperatures } = table.range();
    let within = |(from, to): (f64, f64), part: f64| from + part * (to - from);
    let places = spread(24, seed).zip(spread(24, seed * seed)).zip(spread(24, 1.0 - seed)).map(|((p, t), s)| {
        let at =
            Cycle { supply_pressure_pa: within(pressures, p), temperature_k: within(temperatures, (t * 7.0).fract()) };
        let limit = table.slice(&at).expect("covered").limit_severity(&bundle.manifest().limits);
        let end = table.end(&at).expect("covered");
        (at, (s * 5.0).fract() * limit.min(end))
    });
    let places: Vec<(Cycle, f64)> = places.collect();
    let run = |(at, severity): &(Cycle, f64)| {
        let conditions = Conditions {
            supply_pressure_pa: at.supply_pressure_pa,
            temperature_k: at.temperature_k,
            ..Conditions::nominal(file.valve().parameters())
        };
        worn(file.valve(), &wear, conditions, *severity)
    };
    let runs: Vec<_> = places.iter().map(run).collect();
    let mut worst = 0.0_f64;
    for ((at, severity), times) in places.iter().zip(periodic(file, &runs)) {
        let found = table.times(*severity, at).expect("covered");
        for stroke in Stroke::ALL {
            let simulated_s = time_of(&times, stroke).expect("finished before the limit");
            worst = worst.max((found.stroke(stroke).time_s - simulated_s).abs());
        }
    }
    worst
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn everything_that_wears_has_a_table() {
    let file = testbed();
    let wears = Wear::catalogue();
    let built = tables(&file, &Request { wears: wears.clone(), conditions: None, both_leaks: false }).expect("tables");
    assert_eq!(built.notices, []);
    assert_eq!(built.bundle.len(), wears.len());
    let sound_times = built.bundle.entry(0).table.points()[0];
    for (entry, wear) in built.bundle.entries().zip(&wears) {
        assert_eq!(entry.degradation, &wear.degradation);
        assert_eq!(
            entry.table.points()[0],
            sound_times,
            "{}: a sound valve is one whatever may wear",
            entry.degradation.id
        );
        for stroke in Stroke::ALL {
            let found = entry.table.curve(stroke).direction();
            let expected = entry.degradation.moves.stroke(stroke);
            assert!(expected.is_none() || found == expected, "{} {stroke}: {found:?}", entry.degradation.id);
        }
        sound(&file, &entry, wear);
    }
    // A clogged exhaust leaves the closing as it is, which then tells nothing.
    let exhaust = built.bundle.get("exhaust").expect("was built");
    let close_s = sound_times.close_time_s.expect("closes");
    assert_eq!(exhaust.table.curve(Stroke::Close).severity_at(close_s + 1e-3), SeverityAt::Untold);
    let (time_s, slope) = exhaust.table.curve(Stroke::Close).extrapolated_time_and_slope(0.3);
    assert_eq!((time_s, slope), (close_s, 0.0));
}

#[test]
fn tables_of_leaks_are_the_same_whatever_else_is_built() {
    let file = testbed();
    let alone = tables(&file, &Request::default()).expect("tables");
    let with = Request { wears: Wear::catalogue().into_iter().take(4).collect(), conditions: None, both_leaks: false };
    let with = tables(&file, &with).expect("tables");
    for index in 0..2 {
        assert_eq!(alone.bundle.entry(index).table, with.bundle.entry(index).table);
    }
}

/// A valve of 63 mm whose piston holds far more at rest than while it slides.
const STICKING: &str = r#"
name = "HV-1"
[actuator]
stroke = "40 mm"
piston_area = "30.7 cm2"
moving_mass = "2.1 kg"
dead_volume = "37 cm3"
viscous_friction = "418 N s/m"
[spring]
stiffness = "11.5 N/mm"
preload_compression = "39 mm"
[stops]
contact_stiffness = "10 MN/m"
[gas]
ratio_of_specific_heats = 1.4
specific_gas_constant = "287.05 J/(kg K)"
compressibility = 1.0
[pneumatics]
supply_pressure = "5.5 barg"
ambient_pressure = "101.325 kPa"
temperature = "20 degC"
flow_coefficient = 0.86
solenoid_orifice_area = "1.05 mm2"
port_orifice_area = "6.6 mm2"
pipe_volume = "21.7 cm3"
[cycle]
close_at = "0 s"
open_at = "3 s"
end = "9 s"
[limits]
close_within = "2 s"
open_within = "4.5 s"
[[effect]]
kind = "dry-friction"
coulomb_force = "47.5 N"
static_force = "84 N"
stribeck_velocity = "0.012 m/s"
"#;

#[test]
#[ignore = "takes most of a minute: looks for a smooth table first"]
fn times_that_turn_to_and_fro_have_a_table_over_pressure_through_their_middle() {
    let file = ValveFile::parse(STICKING, "valve.toml").expect("a valve file");
    let t = file.valve().parameters().temperature_k;
    let range = ConditionRange { supply_pressure_pa: (642_800.0, 659_900.0), temperature_k: (t, t) };
    let built = tables(&file, &Request { conditions: Some(range), ..Request::default() }).expect("tables");
    let rough = built.notices.iter().find_map(|notice| match notice {
        Notice::RoughOverConditions { fault, by_s } => Some((fault.clone(), *by_s)),
        _ => None,
    });
    let (fault, by_s) = rough.unwrap_or_else(|| panic!("a notice: {:?}", built.notices));
    assert!((0.005..0.1).contains(&by_s), "{by_s}");
    // As good as that where it was not measured.
    let worst_s = worst_over_conditions(&file, &built.bundle, &fault, 0.17);
    assert!(worst_s < 2.0 * by_s, "{worst_s} for {by_s}");
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn tables_over_pressure_agree_with_the_simulation() {
    let file = testbed();
    let t = file.valve().parameters().temperature_k;
    let range = ConditionRange { supply_pressure_pa: psig(66.0, 84.0), temperature_k: (t, t) };
    let built = tables(&file, &Request { wears: Wear::catalogue(), conditions: Some(range), both_leaks: false })
        .expect("tables");
    assert_eq!(built.notices, []);
    for (index, entry) in built.bundle.entries().enumerate() {
        let info = *entry.over_conditions.expect("over conditions").info();
        assert!(info.checked > 40 && info.interpolation_error.up_to_limit_s <= OVER_CONDITIONS_S, "{info:?}");
        let seed = 0.11 + 0.13 * index as f64;
        let worst_s = worst_over_conditions(&file, &built.bundle, &entry.degradation.id, seed);
        assert!(worst_s < OVER_CONDITIONS_S, "{}: {worst_s}", entry.degradation.id);
    }
    let leak = built.bundle.entry(0);
    let own = Cycle { supply_pressure_pa: file.valve().parameters().supply_pressure_pa, temperature_k: t };
    let slice = leak.over_conditions.expect("over conditions").slice(&own).expect("covered");
    let limit = slice.limit_severity(&built.bundle.manifest().limits);
    assert!((limit - leak.limit_severity).abs() < 1e-3 * leak.limit_severity, "{limit}, {}", leak.limit_severity);
    let directory = tempfile::tempdir().expect("a temporary directory");
    built.bundle.write(directory.path()).expect("written");
    assert!(TableBundle::read(directory.path()).expect("readable") == built.bundle);
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn a_fresh_valve_over_pressure_and_temperature() {
    // Drawn once: other sizes, another spring, another gas, and a vent that is restricted from the start.
    let drawn = [
        ("\"31.17 cm2\"", "\"23.6 cm2\""),
        ("\"16 kN/m\"", "\"9.7 kN/m\""),
        ("\"36 mm\"", "\"41 mm\""),
        ("\"600 N s/m\"", "\"913 N s/m\""),
        ("\"40 cm3\"", "\"63 cm3\""),
        ("\"0.5 mm2\"", "\"0.41 mm2\""),
        ("\"296.8 J/(kg K)\"", "\"287.1 J/(kg K)\""),
        ("[tolerance]", "[[effect]]\nkind = \"vent-restriction\"\narea_factor = 0.83\n[tolerance]"),
    ];
    let text = drawn.iter().fold(TESTBED.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from} is not in the file");
        text.replacen(from, to, 1)
    });
    let file = ValveFile::parse(&text, "valve.toml").expect("a valve file");
    let range = ConditionRange { supply_pressure_pa: psig(61.0, 92.0), temperature_k: (268.0, 313.0) };
    let built = tables(&file, &Request { conditions: Some(range), ..Request::default() }).expect("tables");
    for id in ["atmosphere", "supply"] {
        let worst_s = worst_over_conditions(&file, &built.bundle, id, 0.29);
        assert!(worst_s < OVER_CONDITIONS_S, "{id}: {worst_s}");
    }
}

#[test]
fn a_wear_of_ones_own_goes_through() {
    let degradation = Degradation {
        id: DegradationId::new("guide-drag"),
        name: Cow::Borrowed("drag of the guides"),
        short: Cow::Borrowed("drag of the guides"),
        severity: Severity {
            quantity: Cow::Borrowed("added viscous friction"),
            unit: Cow::Borrowed("kN s/m"),
            column: Cow::Borrowed("drag_kn_s_per_m"),
            per_si: 1e-3,
        },
        moves: Moves { close: Some(Monotone::Rising), open: Some(Monotone::Rising) },
        prior: 0.5,
    };
    let drag = Wear {
        degradation,
        reach: |_| vec![2e4, 8e4],
        apply: |worn, drag| {
            worn.parameters.viscous_friction_n_s_per_m += drag;
            Ok(())
        },
    };
    let file = testbed();
    let mut wears = Wear::leaks();
    wears.push(drag.clone());
    let built = tables(&file, &Request { wears, conditions: None, both_leaks: false }).expect("tables");
    let entry = built.bundle.get("guide-drag").expect("was built");
    sound(&file, &entry, &drag);
    let directory = tempfile::tempdir().expect("a temporary directory");
    built.bundle.write(directory.path()).expect("written");
    let read = TableBundle::read(directory.path()).expect("readable");
    assert!(read == built.bundle);
    assert_eq!(read.get("guide-drag").expect("was read").degradation.prior, 0.5);
}

#[test]
fn what_can_have_no_table_is_left_out_and_told() {
    let nothing = Wear {
        degradation: Degradation { id: DegradationId::new("nothing"), ..Wear::leaks()[0].degradation.clone() },
        reach: |_| vec![1e-6],
        apply: |_, _| Ok(()),
    };
    let mut wears = Wear::leaks();
    wears.push(nothing);
    let built =
        tables(&testbed(), &Request { wears, conditions: None, both_leaks: false }).expect("the leaks have tables");
    assert_eq!(built.bundle.len(), 2);
    let [Notice::Omitted { fault, reason }] = &built.notices[..] else { panic!("{:?}", built.notices) };
    assert!(fault == "nothing" && reason.contains("expected that a limit is crossed"), "{reason}");
}

#[test]
fn what_turns_the_stroke_times_back_is_left_out_and_told() {
    let turning = Wear {
        degradation: Degradation { id: DegradationId::new("turning"), ..Wear::leaks()[0].degradation.clone() },
        reach: |_| vec![1e-6],
        apply: |worn, severity| {
            // Wider up to a third of the reach, and narrower from there on.
            let share = severity / 1e-6;
            worn.parameters.solenoid_orifice_area_m2 *= 1.0 + 2.0 * share - 2.8 * share * share;
            Ok(())
        },
    };
    let mut wears = Wear::leaks();
    wears.push(turning);
    let built =
        tables(&testbed(), &Request { wears, conditions: None, both_leaks: false }).expect("the leaks have tables");
    let [Notice::Omitted { reason, .. }] = &built.notices[..] else { panic!("{:?}", built.notices) };
    assert!(reason.contains("time turns at a leak area of"), "{reason}");
}

#[test]
fn conditions_under_which_the_valve_does_not_stroke_are_refused() {
    let file = testbed();
    let range = ConditionRange { supply_pressure_pa: psig(30.0, 84.0), temperature_k: (293.15, 293.15) };
    let error = tables(&file, &Request { conditions: Some(range), ..Request::default() }).expect_err("does not close");
    assert!(matches!(error, BuildError::SoundNotFinished { stroke: Stroke::Close, .. }), "{error}");
    let backwards = ConditionRange { supply_pressure_pa: psig(84.0, 66.0), temperature_k: (293.15, 293.15) };
    let error = tables(&file, &Request { conditions: Some(backwards), ..Request::default() }).expect_err("backwards");
    assert!(matches!(error, BuildError::Conditions(_)), "{error}");
}

/// The table of added friction of the reference valve with an effect.
fn friction_of(effect: &str) -> (ValveFile, Built) {
    let file = ValveFile::parse(&format!("{TESTBED}\n{effect}"), "valve.toml").expect("a valve file");
    let mut request = Request::default();
    request.wears.extend(Wear::catalogue().into_iter().filter(|wear| wear.degradation.id == "friction"));
    let built = tables(&file, &request).expect("tables");
    (file, built)
}

#[test]
fn friction_that_grows_stays_as_uneven_as_it_was() {
    let (_, built) = friction_of(
        "[[effect]]\nkind = \"dry-friction\"\ncoulomb_force = \"20 N\"\nopening_factor = 0.3\nposition_slope = 0.2\n",
    );
    let entry = built.bundle.entries().find(|entry| entry.degradation.id == "friction").expect("its table");
    // Nothing leaps as the first newton comes on.
    let points = entry.table.points();
    let slope = |stroke: Stroke, at: usize| {
        let time_s = |index: usize| points[index].time_s(stroke).expect("a time");
        (time_s(at + 1) - time_s(at)) / (points[at + 1].severity - points[at].severity)
    };
    for stroke in Stroke::ALL {
        assert!((slope(stroke, 0) / slope(stroke, 1) - 1.0).abs() < 0.3, "{:?}", &points[..3]);
    }
    assert!(slope(Stroke::Open, 0) < 0.6 * slope(Stroke::Close, 0), "{:?}", &points[..3]);
}

#[test]
fn friction_has_a_table_up_to_the_force_that_holds_the_valve() {
    // As friction comes near to what the spring has left, the time to open rises ever more steeply, and ends.
    let slow = [("end = \"12 s\"", "end = \"30 s\""), ("open_within = \"6 s\"", "open_within = \"24 s\"")];
    let text = slow.iter().fold(TESTBED.to_owned(), |text, (from, to)| text.replacen(from, to, 1));
    let file = ValveFile::parse(&text, "valve.toml").expect("a valve file");
    let mut request = Request::default();
    request.wears.extend(Wear::catalogue().into_iter().filter(|wear| wear.degradation.id == "friction"));
    let built = tables(&file, &request).expect("tables");
    let entry = built.bundle.entries().find(|entry| entry.degradation.id == "friction");
    let entry = entry.unwrap_or_else(|| panic!("its table: {:?}", built.notices));
    let stalls = Stroke::ALL.map(|stroke| entry.info.stroke(stroke).stall_severity);
    let stall = stalls.into_iter().flatten().next().expect("one stroke stalls");
    assert!(entry.limit_severity <= stall && entry.limit_severity > 0.99 * stall, "{} {stall}", entry.limit_severity);
}

/// A little more than what ends the reference valve's life, a clogged share of its exhaust.
static MOST_CLOGGED: OnceLock<f64> = OnceLock::new();

#[test]
fn a_wear_that_has_no_table_over_conditions_keeps_its_own() {
    let exhaust = || Wear::catalogue().into_iter().find(|wear| wear.degradation.id == "exhaust").expect("it is known");
    let with = |wear: Wear, conditions: Option<ConditionRange>| {
        let wears = Wear::leaks().into_iter().chain([wear]).collect();
        tables(&testbed(), &Request { wears, conditions, both_leaks: false }).expect("tables")
    };
    let alone = with(exhaust(), None);
    let limit = alone.bundle.get("exhaust").expect("its table").limit_severity;
    MOST_CLOGGED.set(1.0001 * limit).expect("is set once");
    // Not reached where the pressure is lower and the valve has less to vent.
    let short = Wear { reach: |_| vec![*MOST_CLOGGED.get().expect("is set")], ..exhaust() };
    let kelvin = testbed().valve().parameters().temperature_k;
    let range = ConditionRange { supply_pressure_pa: psig(60.0, 76.0), temperature_k: (kelvin, kelvin) };
    let built = with(short, Some(range));
    let entry = built.bundle.get("exhaust").expect("its table");
    assert!(entry.over_conditions.is_none() && built.bundle.condition_range().is_some());
    let told = built.notices.iter().find(|notice| matches!(notice, Notice::NotOverConditions { .. }));
    let words = told.unwrap_or_else(|| panic!("it is told: {:?}", built.notices)).to_string();
    assert!(words.contains("no table of \"exhaust\" over pressure"), "{words}");
    // Written and read back it is the same.
    let folder = tempfile::tempdir().expect("a folder");
    built.bundle.write(folder.path()).expect("is written");
    assert!(TableBundle::read(folder.path()).expect("is read") == built.bundle);
}
