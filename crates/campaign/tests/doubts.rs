//! Slips that make a campaign wrong without making it unreadable: each is named.

use campaign::{Campaign, Doubt, ValveFacts};

const VALVE: ValveFacts =
    ValveFacts { ambient_pressure_pa: 100e3, supply_pressure_pa: 617e3, temperature_k: 293.15, stroke_m: 0.02 };
const RUNS: &str = "name = \"bench\"\n\
    [[run]]\nfile = \"a.csv\"\nsupply_pressure = \"75 psig\"\ntemperature = \"20 degC\"\n\
    [[run]]\nfile = \"b.csv\"\nsupply_pressure = \"60 psig\"\ntemperature = \"20 degC\"\n";
const TIMINGS: &str = "name = \"log\"\n[timings]\nfile = \"t.csv\"\n";

/// One cycle of 2 s in steps of 1 ms, with a stroke of `stroke_s` and noise that `seed` decides.
fn rows(seed: f64, stroke_s: f64) -> Vec<String> {
    let row = |step: i32| {
        let time_s = f64::from(step) * 1e-3;
        let closed = ((time_s - 0.2) / stroke_s).clamp(0.0, 1.0) - ((time_s - 1.2) / stroke_s).clamp(0.0, 1.0);
        let noise = 0.02 * ((f64::from(step) * 12.9898 + seed).sin() * 43_758.545_3).fract();
        format!("{time_s:.3},{},{:.4}", u8::from(time_s < 1.0), 20.0 * (1.0 - closed) + noise)
    };
    (0..2000).map(row).collect()
}

fn text(rows: &[String]) -> String {
    format!("time_s,command,position_mm\n{}\n", rows.join("\n"))
}

fn read(campaign: &str, files: &[(&str, String); 2]) -> Result<Campaign, String> {
    Campaign::parse(campaign, "c.toml", &VALVE, &|name| {
        let found = files.iter().find(|(file, _)| *file == name);
        Ok(found.ok_or(std::io::ErrorKind::NotFound)?.1.clone().into_bytes())
    })
    .map_err(|error| error.to_string())
}

/// The warnings of a campaign whose runs are changed.
fn warnings(campaign: &str, change: impl Fn(&mut Vec<String>)) -> Vec<String> {
    let (mut first, second) = (rows(0.0, 0.4), rows(5.0, 0.5));
    change(&mut first);
    let read = read(campaign, &[("a.csv", text(&first)), ("b.csv", text(&second))]).unwrap();
    read.warnings.iter().map(ToString::to_string).collect()
}

#[test]
fn a_sound_campaign_is_not_doubted() {
    assert_eq!(warnings(RUNS, |_| ()), [""; 0]);
}

#[test]
fn conditions_that_hardly_can_be_are_doubted() {
    for (from, to, doubt) in [
        ("20 degC", "293 degC", "c.toml:2: a temperature of 566.1 K, which is 293.0 degC: is its unit right?"),
        ("75 psig", "750 psig", "c.toml:2: a supply pressure of 5271.1 kPa absolute, where the valve file has 617.0"),
        ("75 psig\"", "75 psig\"\nleak_to_atmosphere = \"0.15 m2\"", "c.toml:2: leak_to_atmosphere is 150000 mm2, as"),
        ("temperature = \"20 degC\"\n", "", "c.toml:2: the temperature is not given; the valve file's 293.15 K is"),
    ] {
        let found = warnings(&RUNS.replacen(from, to, 1), |_| ());
        assert!(found.len() == 1 && found[0].starts_with(doubt), "{to}: {found:?}");
    }
}

#[test]
fn the_same_recording_under_two_names_is_named() {
    let (first, cut) = (rows(0.0, 0.4), rows(0.0, 0.4)[..1500].to_vec());
    for second in [first.clone(), cut] {
        let read = read(RUNS, &[("a.csv", text(&first)), ("b.csv", text(&second))]).unwrap();
        assert_eq!(
            read.warnings[0].to_string(),
            "b.csv:1: the same recording as a.csv: was one of them copied under a second name?"
        );
    }
}

#[test]
fn gaps_and_rows_far_apart_are_named() {
    let gap = warnings(RUNS, |rows| drop(rows.drain(600..1100)));
    let expected = "a.csv:2: 1 gap without a position of 0.10 s or more, the longest of 0.50 s at 0.599 s";
    assert!(gap.len() == 1 && gap[0].starts_with(expected), "{gap:?}");
    let unread = warnings(RUNS, |rows| {
        for row in &mut rows[300..800] {
            row.truncate(8);
        }
    });
    assert!(unread.iter().any(|text| text.contains("the longest of 0.50 s at 0.299 s")), "{unread:?}");
    let milliseconds = warnings(RUNS, |rows| {
        for (step, row) in rows.iter_mut().enumerate() {
            *row = format!("{step}{}", &row[5..]);
        }
    });
    assert!(milliseconds[0].starts_with("a.csv:2: the rows are 1 s apart: are the times in ms?"), "{milliseconds:?}");
}

#[test]
fn a_sensor_that_was_stuck_while_the_valve_moved_is_named_with_its_rows() {
    let found = warnings(RUNS, |rows| {
        let held = rows[300].rsplit_once(',').unwrap().1.to_owned();
        for row in &mut rows[301..751] {
            *row = format!("{},{held}", row.rsplit_once(',').unwrap().0);
        }
    });
    let expected = "a.csv:303: the position stays at 15.0031 mm for 450 rows, from 0.3010 s on, and then jumps to where the motion has \
                    come: was the sensor or the recorder stuck? They were left out";
    assert_eq!(found.iter().filter(|text| text.contains("stuck")).collect::<Vec<_>>(), [expected], "{found:?}");
}

/// Doubts about the noise that `[sensors]` states.
fn noise_doubts(sensors: &str, change: &dyn Fn(f64) -> f64) -> (Vec<String>, Campaign) {
    let campaign = RUNS.replacen("[[run]]", &format!("[sensors]\n{sensors}\n[[run]]"), 1);
    let changed = |rows: Vec<String>| {
        let row = |row: &String| {
            let (before, position) = row.rsplit_once(',').unwrap();
            format!("{before},{:.6}", change(position.parse().unwrap()))
        };
        text(&rows.iter().map(row).collect::<Vec<_>>())
    };
    let read = read(&campaign, &[("a.csv", changed(rows(0.0, 0.4))), ("b.csv", changed(rows(5.0, 0.5)))]).unwrap();
    (read.warnings.iter().map(ToString::to_string).collect(), read)
}

#[test]
fn stated_noise_that_the_record_contradicts_is_doubted_with_both_numbers() {
    for (stated, expected) in [
        (
            "0.03 m",
            "c.toml:3: position_noise is stated as 30 mm, 4200 times more than what the recordings show: from reading to",
        ),
        (
            "0.00003 um",
            "c.toml:3: position_noise is stated as 0.00000003 mm, 240000 times less than what the recordings show",
        ),
    ] {
        let (found, read) = noise_doubts(&format!("position_noise = \"{stated}\""), &|mm| mm);
        assert!(found.len() == 1 && found[0].starts_with(expected), "{stated}: {found:?}");
        assert_eq!(read.sensors.position_noise_m, None, "what the record shows counts");
    }
}

#[test]
fn stated_noise_that_may_be_is_believed() {
    let none: [&str; 0] = [];
    for stated in ["0.005 mm", "0.05 mm", "0.002 mm"] {
        let (found, read) = noise_doubts(&format!("position_noise = \"{stated}\""), &|mm| mm);
        assert!(found == none && read.sensors.position_noise_m.is_some(), "{stated}: {found:?}");
    }
    // Of a converter with steps of 0.2 mm, whose sensor is quiet.
    let coarse = |mm: f64| (mm / 0.2).round() * 0.2;
    assert_eq!(noise_doubts("position_noise = \"0.001 mm\"", &coarse).0, none);
    assert_eq!(noise_doubts("position_noise = \"0.1 mm\"", &coarse).0, none);
    // Of a sensor whose noise a filter makes slow: from reading to reading there is a twentieth of it.
    let state = std::cell::Cell::new((1u64, 0.0));
    let filtered = |mm: f64| {
        let (seed, slow) = state.get();
        let seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let white = (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        state.set((seed, 0.999 * slow + 0.03 * white));
        mm + state.get().1
    };
    assert_eq!(noise_doubts("position_noise = \"0.2 mm\"", &filtered).0, none);
}

#[test]
fn pressures_above_the_stated_supply_are_named() {
    // 75 psig and 100 kPa of ambient pressure are 617 kPa.
    let found = |heading: &str, chamber: &dyn Fn(f64) -> f64| {
        let row = |(step, row): (usize, &String)| {
            let at_s = step as f64 * 1e-3;
            format!("{row},{:.4}", chamber(if (0.1..1.0).contains(&at_s) { 1.0 } else { 0.0 }))
        };
        let csv = |rows: &[String]| {
            let rows: Vec<String> = rows.iter().enumerate().map(row).collect();
            format!("time_s,command,position_mm,{heading}\n{}\n", rows.join("\n"))
        };
        let run = &RUNS[..RUNS.rfind("[[run]]").unwrap()];
        let read = read(run, &[("a.csv", csv(&rows(0.0, 0.4))), ("b.csv", String::new())]).unwrap();
        let above = read.warnings.iter().filter(|warning| matches!(warning.doubt, Doubt::AboveSupply { .. }));
        above.map(ToString::to_string).collect::<Vec<_>>()
    };
    // What gauges may be off by is no doubt.
    assert_eq!(found("chamber_pressure_kpa", &|part| 100.0 + 550.0 * part), [""; 0]);
    let above = found("pipe_pressure_kpa", &|part| 100.0 + 700.0 * part);
    let expected = "a.csv:1: the pipe pressure (column \"pipe_pressure_kpa\") reaches 800.0 kPa absolute, above the supply \
                    pressure of 617.1 kPa that its run states: was that mistyped or exchanged";
    assert!(above.len() == 1 && above[0].starts_with(expected), "{above:?}");
    // kPa under a heading that says bar.
    let unit = found("Chamber pressure (barg)", &|part| 510.0 * part);
    assert!(
        unit.len() == 1 && unit[0].contains("(column \"Chamber pressure (barg)\") reaches 51100.0 kPa"),
        "{unit:?}"
    );
}

/// Stroke times at six supply pressures, four of each, that agree within half a percent.
fn timings() -> Vec<[f64; 6]> {
    let mut rows = Vec::new();
    for (place, psig) in [50.0, 60.0, 70.0, 80.0, 90.0, 100.0].into_iter().enumerate() {
        for repeat in 0..4 {
            let noise = |phase: f64| 1.0 + 0.005 * (phase + 2.1 * (repeat + 5 * place) as f64).sin();
            rows.push([psig, 0.0, 0.0, 293.15, 80.0 / psig * noise(0.0), 0.025 * psig * noise(1.0)]);
        }
    }
    rows
}

fn timed(change: impl Fn(&mut Vec<[f64; 6]>)) -> Campaign {
    let mut rows = timings();
    change(&mut rows);
    let mut csv =
        "supply_pressure_psig,leak_to_atmosphere_mm2,leak_from_supply_mm2,temperature_k,close_time_s,open_time_s\n"
            .to_owned();
    for row in rows {
        csv.push_str(&row.map(|number| number.to_string()).join(","));
        csv.push('\n');
    }
    let mut campaign = read(TIMINGS, &[("t.csv", csv), ("", String::new())]).unwrap();
    campaign.doubt_times_beyond(4.0, 8.0);
    campaign
}

fn timing_warnings(change: impl Fn(&mut Vec<[f64; 6]>)) -> Vec<String> {
    timed(change).warnings.iter().map(ToString::to_string).collect()
}

#[test]
fn sound_stroke_times_are_not_doubted() {
    assert_eq!(timing_warnings(|_| ()), [""; 0]);
    // Nor a valve that stalls at times, nor rows without repeats.
    assert_eq!(timing_warnings(|rows| rows[3][5] = f64::NAN), [""; 0]);
    assert_eq!(timing_warnings(|rows| *rows = rows.iter().copied().step_by(4).collect()), [""; 0]);
    // Nor times that a controller takes every 20 ms, or an operator to a tenth of a second.
    for step_s in [0.02, 0.1] {
        let rounded = |time_s: f64| (time_s / step_s).round() * step_s;
        let found = timing_warnings(|rows| {
            for time in rows.iter_mut().flat_map(|row| &mut row[4..]) {
                *time = rounded(*time);
            }
        });
        assert_eq!(found, [""; 0], "{step_s}");
    }
}

#[test]
fn stated_noise_of_stroke_times_is_held_against_their_repeats() {
    let doubt = |stated: &str, change: &dyn Fn(&mut Vec<[f64; 6]>)| {
        let mut rows = timings();
        change(&mut rows);
        let rows: Vec<String> = rows.iter().map(|row| row.map(|number| number.to_string()).join(",")).collect();
        let header =
            "supply_pressure_psig,leak_to_atmosphere_mm2,leak_from_supply_mm2,temperature_k,close_time_s,open_time_s";
        let campaign = format!("name = \"log\"\n[sensors]\ntiming_noise = \"{stated}\"\n[timings]\nfile = \"t.csv\"\n");
        let read =
            read(&campaign, &[("t.csv", format!("{header}\n{}\n", rows.join("\n"))), ("", String::new())]).unwrap();
        let texts: Vec<String> = read.warnings.iter().map(ToString::to_string).collect();
        assert_eq!(read.sensors.timing_noise_s.is_none(), !texts.is_empty());
        texts
    };
    let single = |rows: &mut Vec<[f64; 6]>| *rows = rows.iter().copied().step_by(4).collect();
    let found = doubt("3 s", &|_| ());
    let expected = "c.toml:3: timing_noise is stated as 3000 ms, 440 times more than what the stroke times show: repeated under one \
                    condition they scatter by 6.83 ms.";
    assert!(found.len() == 1 && found[0].starts_with(expected), "{found:?}");
    assert!(doubt("3 us", &|_| ())[0].contains("times less than what the stroke times show"));
    let found = doubt("3 s", &single);
    let expected = "c.toml:3: timing_noise is stated as 3 s, where the longest stroke takes 2.5 s: is its unit right?";
    assert!(found.len() == 1 && found[0].starts_with(expected), "{found:?}");
    // What a clock or a hand may do, however often the strokes were repeated.
    for stated in ["1 ms", "3 ms", "20 ms", "50 ms"] {
        assert_eq!(doubt(stated, &|_| ()), [""; 0], "{stated}");
        assert_eq!(doubt(stated, &single), [""; 0], "{stated}");
    }
    // Times to a tenth of a second hide how they scatter.
    let rounded = |rows: &mut Vec<[f64; 6]>| {
        for time in rows.iter_mut().flat_map(|row| &mut row[4..]) {
            *time = (*time / 0.1).round() * 0.1;
        }
    };
    assert_eq!(doubt("0.1 s", &rounded), [""; 0]);
}

#[test]
fn one_slip_among_stroke_times_is_named_with_its_row() {
    let one = |change: &dyn Fn(&mut Vec<[f64; 6]>), expected: &str| {
        let found = timing_warnings(change);
        assert!(found.len() == 1 && found[0].starts_with(expected), "{expected}: {found:?}");
    };
    one(&|rows| rows[5][4] *= 1.07, "t.csv:7: a closing time of 1.42");
    one(&|rows| rows[9].swap(4, 5), "t.csv:11: closing and opening time of this row fit the rows under the same");
    one(&|rows| rows.iter_mut().for_each(|row| row.swap(4, 5)), "t.csv:2: closing takes longer and opening less long");
    one(&|rows| rows[23][5] = 5.0, "t.csv:25: an opening time of 5 s, where rows");
}

#[test]
fn what_two_others_say_is_wrong_is_left_out() {
    let slipped = timed(|rows| rows[5][4] *= 1.07);
    assert!(slipped.warnings[0].to_string().ends_with("is it mistyped? It was left out"), "{}", slipped.warnings[0]);
    assert_eq!((slipped.timings[5].close_time_s, slipped.timings[5].open_time_s.is_some()), (None, true));
    let swapped = timed(|rows| rows[9].swap(4, 5));
    assert!(swapped.warnings[0].to_string().ends_with("were they swapped? It was left out"), "{}", swapped.warnings[0]);
    assert_eq!((swapped.timings[9].close_time_s, swapped.timings[9].open_time_s), (None, None));
    // Of two rows nobody knows which one is right.
    let of_two = timed(|rows| {
        *rows = rows.iter().copied().enumerate().filter(|(place, _)| place % 4 < 2).map(|(_, row)| row).collect();
        rows[3][4] *= 1.2;
    });
    assert!(of_two.warnings[0].to_string().ends_with("is it mistyped?"), "{}", of_two.warnings[0]);
    assert!(of_two.timings[3].close_time_s.is_some());
}

#[test]
fn milliseconds_under_seconds_and_times_beyond_the_cycle_are_named() {
    let found = timing_warnings(|rows| rows.iter_mut().for_each(|row| row[4] *= 1e3));
    assert!(
        found[0].starts_with("t.csv:2: closing times of") && found[0].contains("are they milliseconds?"),
        "{found:?}"
    );
    assert!(
        found[1].starts_with("t.csv:2: 24 closing times are longer than the 4 s that the valve file's cycle"),
        "{found:?}"
    );
}

#[test]
fn an_empty_condition_is_refused_and_no_number_is_put_in_its_place() {
    let header =
        "supply_pressure_psig,leak_to_atmosphere_mm2,leak_from_supply_mm2,temperature_k,close_time_s,open_time_s";
    for (column, name) in
        ["supply_pressure_psig", "leak_to_atmosphere_mm2", "leak_from_supply_mm2", "temperature_k"].iter().enumerate()
    {
        let mut cells = ["75", "0", "0", "293.15", "1.07", "2.2"];
        cells[column] = "";
        let csv = format!("{header}\n75,0,0,293.15,1.07,2.2\n{}\n", cells.join(","));
        let refused = read(TIMINGS, &[("t.csv", csv), ("", String::new())]).unwrap_err();
        assert!(
            refused.starts_with(&format!("t.csv:3: column \"{name}\" is empty in this row; expected its value")),
            "{refused}"
        );
    }
}

#[test]
fn every_doubt_has_its_place() {
    let campaign = read(RUNS, &[("a.csv", text(&rows(0.0, 0.4))), ("b.csv", text(&rows(0.0, 0.4)))]).unwrap();
    assert!(campaign.warnings.iter().all(|warning| warning.line > 0 && !warning.file.is_empty()));
    assert!(matches!(campaign.warnings[0].doubt, Doubt::SameRecording { .. }));
}
