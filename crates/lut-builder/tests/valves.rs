//! Tables of valves other than the reference valve, and of valves that can have none.

use std::sync::Mutex;

use leak_table::{Fault, SeverityAt, SeverityPoint, Stroke, TimeAt};
use lut_builder::{BuildError, Built, Notice, Options, Progress, TableModel, build};
use valve_file::ValveFile;
use valve_model::Conditions;
use valve_model::cycle::cycles;

const TESTBED: &str = include_str!("../../../models/testbed.toml");

/// The reference valve's file with some texts replaced.
fn changed(changes: &[(&str, &str)]) -> ValveFile {
    let text = changes.iter().fold(TESTBED.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from} is not in the file");
        text.replacen(from, to, 1)
    });
    ValveFile::parse(&text, "valve.toml").expect("a valve file")
}

fn tables(file: &ValveFile) -> Result<Built, BuildError> {
    let model = TableModel {
        name: file.name(),
        canonical_text: &file.canonical_model(),
        valve: file.valve(),
        schedule: file.schedule(),
        limits: file.limits(),
    };
    build(&model, &Options::default(), &|_| {})
}

/// Builds and compares with direct simulation between the points.
fn sound(file: &ValveFile) -> Built {
    let built = tables(file).expect("this valve has tables");
    for fault in Fault::ALL {
        let table = built.bundle.table(fault);
        let limit_m2 = built.bundle.limit_area_m2(fault);
        let last_m2 = [Stroke::Close, Stroke::Open].map(|stroke| table.curve(stroke).range().1);
        let last_m2 = last_m2[0].min(last_m2[1]);
        let areas: Vec<f64> = (1..24).map(|i| (f64::from(i) * 0.618_034).fract() * last_m2).collect();
        let conditions = areas.iter().map(|area| {
            let mut conditions = Conditions::nominal(file.valve().parameters());
            match fault {
                Fault::Atmosphere => conditions.leak_to_atmosphere_m2 = *area,
                Fault::Supply => conditions.leak_from_supply_m2 = *area,
            }
            (file.valve(), conditions)
        });
        let runs: Vec<_> = conditions.collect();
        for (area, times) in areas.iter().zip(cycles(&runs, &file.schedule(), 40, 1e-3)) {
            let tolerance_s = if *area <= limit_m2 { 0.2e-3 } else { 2e-3 };
            let times = times.last().expect("at least one cycle");
            for (stroke, simulated) in [(Stroke::Close, times.close_time_s), (Stroke::Open, times.open_time_s)] {
                let simulated = simulated.expect("finished below the stall");
                let TimeAt::Within(found) = table.curve(stroke).time_at(*area) else {
                    panic!("{fault}: no {stroke} time at {area}")
                };
                assert!((found - simulated).abs() < tolerance_s, "{fault} {stroke} at {area}: {found}, {simulated}");
            }
        }
    }
    built
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn valves_of_other_sizes_and_physics() {
    let small = [("\"31.17 cm2\"", "\"8 cm2\""), ("\"16 kN/m\"", "\"4 kN/m\""), ("\"0.5 mm2\"", "\"0.1 mm2\"")];
    sound(&changed(&small));
    sound(&changed(&[("\"600 N s/m\"", "\"6000 N s/m\"")]));
    sound(&changed(&[("compressibility = 1.0", "compressibility = 1.0\n[switches]\nclosed_at = 0.05\nopen_at = 0.9")]));
    let with = |effect: &str| changed(&[("[tolerance]", &format!("[[effect]]\n{effect}\n[tolerance]"))]);
    sound(&with("kind = \"dry-friction\"\ncoulomb_force = \"30 N\""));
    sound(&with("kind = \"gas-heating\"\nwall_conductance = \"0.5 W/K\""));
    sound(&with("kind = \"supply-droop\"\nresistance = \"100000000 Pa s/kg\""));
    sound(&with("kind = \"leak-to-atmosphere\"\narea = \"0.1 mm2\""));
}

#[test]
fn a_valve_that_does_not_close_is_refused() {
    let error = tables(&changed(&[("\"75 psig\"", "\"30 psig\"")])).expect_err("too little pressure to close");
    assert!(matches!(error, BuildError::HealthyNotFinished { stroke: Stroke::Close, .. }), "{error}");
}

#[test]
fn a_valve_beyond_its_limit_is_refused() {
    let error =
        tables(&changed(&[("close_within = \"3 s\"", "close_within = \"1 s\"")])).expect_err("closes in 1.04 s");
    assert!(matches!(error, BuildError::HealthyBeyondLimit { stroke: Stroke::Close, .. }), "{error}");
    assert!(error.to_string().contains("1.0422"), "{error}");
}

#[test]
fn a_limit_beyond_the_cycle_ends_life_at_the_stall() {
    let built = sound(&changed(&[("close_within = \"3 s\"", "close_within = \"9 s\"")]));
    let expected =
        Notice::LimitBeyondCycle { fault: "atmosphere".into(), stroke: Stroke::Close, limit_s: 9.0, window_s: 4.0 };
    assert_eq!(built.notices, [expected]);
    let info = built.bundle.manifest().fault(Fault::Atmosphere).close;
    let (limit, stall) = (info.limit_severity.expect("the stall"), info.stall_severity.expect("it stalls"));
    assert!(limit < stall && stall - limit < 1e-5 * stall);
}

#[test]
fn impossible_options_are_refused() {
    let file = changed(&[]);
    let text = file.canonical_model();
    let model = TableModel {
        name: file.name(),
        canonical_text: &text,
        valve: file.valve(),
        schedule: file.schedule(),
        limits: file.limits(),
    };
    for options in [
        Options { step_s: 0.0, ..Options::default() },
        Options { tolerance_beyond_s: f64::NAN, ..Options::default() },
        Options { most_cycles: 1, ..Options::default() },
    ] {
        let error = build(&model, &options, &|_| {}).expect_err("impossible");
        assert!(matches!(error, BuildError::Option { .. }), "{error}");
    }
}

#[test]
#[cfg_attr(debug_assertions, ignore = "slow: runs with --release")]
fn a_tighter_tolerance_is_met_with_more_points() {
    let file = changed(&[]);
    let text = file.canonical_model();
    let model = TableModel {
        name: file.name(),
        canonical_text: &text,
        valve: file.valve(),
        schedule: file.schedule(),
        limits: file.limits(),
    };
    let usual = Options::default();
    let [loose, tight] = [4.0, 0.5].map(|times| Options {
        tolerance_up_to_limit_s: times * usual.tolerance_up_to_limit_s,
        tolerance_beyond_s: times * usual.tolerance_beyond_s,
        ..Options::default()
    });
    let promised_s = tight.tolerance_up_to_limit_s;
    let loose = build(&model, &loose, &|_| {}).expect("tables");
    let seen = Mutex::new(Vec::new());
    let tight = build(&model, &tight, &|report| seen.lock().expect("no panic").push(report)).expect("tables");
    for fault in Fault::ALL {
        assert!(tight.bundle.table(fault).points().len() > loose.bundle.table(fault).points().len());
        assert!(tight.bundle.manifest().fault(fault).interpolation_error.up_to_limit_s <= 0.5 * promised_s);
    }
    let seen = seen.into_inner().expect("no panic");
    for fault in Fault::ALL {
        let reports: Vec<&Progress> = seen.iter().filter(|report| report.place == fault as usize).collect();
        let rises =
            |a: &&Progress, b: &&Progress| a.stage <= b.stage && a.share <= b.share && a.simulated <= b.simulated;
        assert!(reports.is_sorted_by(rises), "{reports:?}");
        assert_eq!(reports.last().map(|report| report.share), Some(1.0));
    }
}

#[test]
fn a_stroke_time_that_jumps_is_in_the_table_and_told() {
    // A pull that comes for a moment: a piston that is not there yet is there at once.
    let effect = "[[effect]]\nkind = \"custom\"\nname = \"pull\"\nacts_on = \"force\"\n\
                  formula = \"-pull * exp(-abs((t_since_command - 2.1) / 0.05)^8)\"\n[effect.parameters]\n\
                  pull = { start = 300, lower = 0, upper = 900, unit = \"N\" }\n[tolerance]";
    let built = tables(&changed(&[("[tolerance]", effect)])).expect("tables");
    let jump = built.notices.iter().find_map(|notice| match notice {
        Notice::Jumps { fault, stroke: Stroke::Close, by_s, .. } if fault == "atmosphere" => Some(*by_s),
        _ => None,
    });
    let by_s = jump.unwrap_or_else(|| panic!("the jump is told: {:?}", built.notices));
    let table = built.bundle.table(Fault::Atmosphere);
    let curve = table.curve(Stroke::Close);
    let times = |pair: &[SeverityPoint]| Some([pair[0].close_time_s?, pair[1].close_time_s?]);
    let pairs = table.points().windows(2).filter_map(|pair| Some((pair[0].severity, pair[1].severity, times(pair)?)));
    let (low, high, [before_s, after_s]) =
        pairs.max_by(|a, b| (a.2[1] - a.2[0]).total_cmp(&(b.2[1] - b.2[0]))).expect("points");
    assert!(by_s > 5e-3 && (after_s - before_s - by_s).abs() < 1e-9, "{by_s} s");
    assert!(high - low < 1e-6 * high, "from {low} to {high}");
    for share in [0.0, 0.01, 0.3, 0.7, 0.99, 1.0] {
        match curve.severity_at(before_s + share * by_s) {
            SeverityAt::Within(severity) => assert!((low..=high).contains(&severity), "{severity}"),
            outside => panic!("{outside:?}"),
        }
    }
    let error = built.bundle.manifest().fault(Fault::Atmosphere).interpolation_error;
    assert!(error.up_to_limit_s <= Options::default().tolerance_up_to_limit_s, "{error:?}");
}

#[test]
fn a_formula_that_is_no_number_for_a_worn_valve_is_refused_with_the_severity() {
    // A number while the pipe of the closed valve is at the supply's pressure, which a leak keeps it from.
    let effect = "[[effect]]\nkind = \"custom\"\nname = \"odd\"\nacts_on = \"force\"\n\
                  formula = \"0 * sqrt(max(max(p_p / p_s - 0.98, 3.5 - t_since_command), 0.5 - p_p / p_s))\"\n\
                  [tolerance]";
    let error = tables(&changed(&[("[tolerance]", effect)])).expect_err("no time is known with a leak");
    assert!(matches!(error, BuildError::NoNumber { .. }), "{error}");
    assert!(error.to_string().starts_with("fault \"atmosphere\": at "), "{error}");
}

#[test]
fn friction_that_sticks_and_slips_leaves_tables_through_the_middle_of_times_that_wander() {
    let friction = "\n[[effect]]\nkind = \"dry-friction\"\ncoulomb_force = \"35 N\"\nstatic_force = \"70 N\"\n\
                    stribeck_velocity = \"0.01 m/s\"\nbristle_stiffness = \"200 kN/m\"\n";
    let text = format!("{TESTBED}{friction}");
    let built = tables(&ValveFile::parse(&text, "valve.toml").expect("a valve file")).expect("it has tables");
    let by_s = built.notices.iter().find_map(|notice| match notice {
        Notice::Uneven { fault, by_s } if fault == "atmosphere" => Some(*by_s),
        _ => None,
    });
    let by_s = by_s.expect("that they wander is said");
    assert!(by_s > 0.2e-3 && by_s < 40e-3, "{by_s} s");
    let curve = built.bundle.table(Fault::Atmosphere).curve(Stroke::Close);
    let (_, last_m2) = curve.range();
    let at = |share: f64| match curve.time_at(share * last_m2) {
        TimeAt::Within(time_s) => time_s,
        _ => panic!("within the table"),
    };
    let times: Vec<f64> = (0..200).map(|step| at(f64::from(step) / 200.0)).collect();
    assert!(times.windows(2).all(|pair| pair[1] > pair[0]), "a leak is told by every time");
}
