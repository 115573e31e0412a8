//! Recordings in three languages, turned round and in odd units: what is understood is read back as the strokes were.

use std::fmt::Write;

use super::draft::{DraftRun, draft};
use super::*;
use crate::{Campaign, ValveFacts};

const STROKE_M: f64 = 0.0254;

/// What is known of the valve of all recorders.
const FACTS: ValveFacts =
    ValveFacts { ambient_pressure_pa: 101_325.0, supply_pressure_pa: 618e3, temperature_k: 293.15, stroke_m: STROKE_M };

/// How a recorder writes down a stroke.
struct Recorder {
    header: &'static str,
    /// Time in s, told to close, position in mm, chamber pressure in Pa absolute.
    row: fn(f64, bool, f64, f64) -> String,
    hints: fn(&mut Hints),
}

/// Position from the closed stop, mm, and chamber pressure, Pa absolute, of a valve that closes at 0.3 s and opens at 2 s.
fn valve(time_s: f64) -> (bool, f64, f64) {
    let close = (0.3..2.0).contains(&time_s);
    let closed = ((time_s - 0.5) / 0.4).clamp(0.0, 1.0) - ((time_s - 2.3) / 0.6).clamp(0.0, 1.0);
    let pressure = if time_s < 0.3 {
        0.0
    } else if time_s < 2.0 {
        1.0 - (-(time_s - 0.3) / 0.2).exp()
    } else {
        (-(time_s - 2.0) / 0.3).exp()
    };
    (close, 25.4 * (1.0 - closed), 101_325.0 + 517e3 * pressure)
}

fn record(recorder: &Recorder) -> String {
    let mut text = format!("{}\n", recorder.header);
    for step in 0..2000 {
        let time_s = f64::from(step) * 2e-3;
        let (close, position_mm, pressure_pa) = valve(time_s);
        let noise = 0.03 * ((f64::from(step) * 12.9898).sin() * 43_758.545_3).fract();
        writeln!(text, "{}", (recorder.row)(time_s, close, position_mm + noise, pressure_pa)).unwrap();
    }
    text
}

fn comma(number: f64, digits: usize) -> String {
    format!("{number:.digits$}").replace('.', ",")
}

fn hints() -> Hints {
    Hints { stroke_m: Some(STROKE_M), ambient_pressure_pa: 101_325.0, ..Hints::default() }
}

fn understood(recorder: &Recorder) -> (Understanding, Recording, String) {
    let text = record(recorder);
    let recording = Recording::read(text.as_bytes(), "75psig.csv").unwrap();
    let mut hints = hints();
    (recorder.hints)(&mut hints);
    (understand(std::slice::from_ref(&recording), &hints), recording, text)
}

fn read_back(recorder: &Recorder) -> Campaign {
    let (found, recording, csv) = understood(recorder);
    assert_eq!(found.unknown, [], "{}: {:?}", recorder.header, found.said);
    let supply = found.supply[0].clone().unwrap();
    let run = DraftRun {
        file: "75psig.csv".into(),
        supply_pressure: supply.text,
        supply_from: supply.from.into(),
        temperature: Some("20 degC".into()),
        leak: None,
    };
    let text = draft("a \"valve\"", &found, &recording, &[run]);
    Campaign::parse(&text, "c.toml", &FACTS, &|_| Ok(csv.clone().into_bytes()))
        .unwrap_or_else(|error| panic!("{error}\n{text}"))
}

const RECORDERS: [Recorder; 13] = [
    Recorder {
        header: "time_s,command,position_mm",
        row: |t, c, x, _| format!("{t:.3},{},{x:.4}", u8::from(c)),
        hints: |hints| hints.one_closes = Some(true),
    },
    Recorder {
        header: "Zeit [s];Ventil;Weg [mm];Kammerdruck [bar]",
        row: |t, c, x, p| {
            format!("{};{};{};{}", comma(t, 3), u8::from(c), comma(x, 3), comma((p - 101_325.0) / 1e5, 4))
        },
        hints: |_| (),
    },
    // 1 opens, and the transmitter counts from the open stop in inches.
    Recorder {
        header: "Time (ms),Solenoid,Stem travel (in),Cylinder pressure (psig)",
        row: |t, c, x, p| {
            format!("{:.1},{},{:.5},{:.3}", t * 1e3, u8::from(!c), (25.4 - x) / 25.4, (p - 101_325.0) / 6894.757)
        },
        hints: |_| (),
    },
    // Volts of a coil and of a sensor.
    Recorder {
        header: "Temps;Commande [V];Course [V];Pression chambre [bara]",
        row: |t, c, x, p| {
            format!(
                "{};{};{};{}",
                comma(t, 3),
                if c { "23,9" } else { "0,1" },
                comma(0.5 + x * 0.15, 4),
                comma(p / 1e5, 4)
            )
        },
        hints: |_| (),
    },
    // Words of a coil, and words that say what they mean.
    Recorder {
        header: "time (s)\tSOL\tTravel (mm)\tP_cyl (psia)",
        row: |t, c, x, p| format!("{t:.3}\t{}\t{x:.4}\t{:.3}", if c { "ON" } else { "OFF" }, p / 6894.757),
        hints: |_| (),
    },
    Recorder {
        header: "Zeit [s];Befehl;Weg [mm]",
        row: |t, c, x, _| format!("{};{};{}", comma(t, 3), if c { "zu" } else { "auf" }, comma(x, 3)),
        hints: |_| (),
    },
    // The name says what 1 means.
    Recorder {
        header: "Uhrzeit\tMagnetventil auf\tHub\n-\t-\tmm",
        row: |t, c, x, _| format!("12:00:{:06.3}\t{}\t{x:.3}", t, u8::from(!c)),
        hints: |_| (),
    },
    // A pipe pressure alone tells the command; the zero is elsewhere.
    Recorder {
        header: "t,LVDT [mm],Leitungsdruck [kPa]",
        row: |t, _, x, p| format!("{t:.3},{:.3},{:.2}", x + 7.0, p / 1e3),
        hints: |_| (),
    },
    // The same above the atmosphere.
    Recorder {
        header: "t,LVDT [mm],Leitungsdruck [barg]",
        row: |t, _, x, p| format!("{t:.3},{x:.3},{:.4}", (p - 101_325.0) / 1e5),
        hints: |_| (),
    },
    // Limit switches beside the command.
    Recorder {
        header: "Zeit [s];Endlage zu;Endlage auf;Befehl zu;Weg [mm]",
        row: |t, c, x, _| {
            format!("{};{};{};{};{}", comma(t, 3), u8::from(x < 1.0), u8::from(x > 24.0), u8::from(c), comma(x, 3))
        },
        hints: |_| (),
    },
    // A position of a transmitter in mA without a word, named by the user.
    Recorder {
        header: "Timestamp,DI_3,AI_7,AI_8",
        row: |t, c, x, _| {
            format!(
                "2026-03-01T10:00:{t:06.3}Z,{},{:.4},{:.3}",
                u8::from(c),
                4.0 + 16.0 * x / 25.4,
                20.0 + 0.01 * t.sin()
            )
        },
        hints: |hints| {
            hints.columns = vec![("position".into(), "AI_7".into())];
            hints.grows_to_open = Some(true);
        },
    },
    // Percent of the stroke, by its heading; the position lies a little beyond the stops, which give way.
    Recorder {
        header: "t_ms,sol,pos_pct",
        row: |t, c, x, _| format!("{:.1},{},{:.4}", t * 1e3, u8::from(c), x / 0.254),
        hints: |hints| {
            hints.one_closes = Some(true);
            hints.grows_to_open = Some(true);
        },
    },
    // The same, closed.
    Recorder {
        header: "t_ms,sol,Stellung [%]",
        row: |t, c, x, _| format!("{:.1},{},{:.4}", t * 1e3, u8::from(c), 100.0 - x / 0.254),
        hints: |hints| {
            hints.one_closes = Some(true);
            hints.grows_to_open = Some(false);
        },
    },
];

#[test]
fn what_is_understood_is_read_back_as_the_strokes_were() {
    for recorder in &RECORDERS {
        let campaign = read_back(recorder);
        let run = &campaign.runs[0];
        assert!((run.conditions.supply_pressure_pa - (101_325.0 + 75.0 * 6894.757)).abs() < 1.0, "{}", recorder.header);
        let mut last = f64::NEG_INFINITY;
        for (row, (time_s, position_m)) in run.trace.time_s.iter().zip(&run.trace.position_m).enumerate() {
            let (_, position_mm, _) = valve(*time_s);
            // What is scaled by plateaus is off by their noise.
            let off_mm = (position_m * 1e3 - position_mm).abs();
            assert!(off_mm < 0.15, "{}: {off_mm} mm at {time_s} s", recorder.header);
            assert!(*time_s > last && (time_s - 2e-3 * row as f64).abs() < 1e-6);
            last = *time_s;
        }
        let edges: Vec<(bool, f64)> = run.commands.iter().map(|edge| (edge.close, edge.time_s)).collect();
        assert!(edges.len() == 2 && edges[0].0 && !edges[1].0, "{}: {edges:?}", recorder.header);
        // A threshold on a pressure comes later than the command.
        let late_s = if run.commands_inferred && recorder.header.contains("Leitung") { 0.1 } else { 3e-3 };
        assert!(
            (edges[0].1 - 0.3).abs() < late_s && (edges[1].1 - 2.0).abs() < late_s,
            "{}: {edges:?}",
            recorder.header
        );
    }
}

#[test]
fn percent_is_of_the_stroke_wherever_the_ends_lie() {
    for recorder in &RECORDERS[RECORDERS.len() - 2..] {
        let (found, ..) = understood(recorder);
        let position = found.columns.iter().find(|column| column.channel == "position").unwrap();
        assert!((position.scale.abs() - 0.254).abs() < 1e-9, "{position:?}");
        assert!(position.offset == 0.0 || (position.offset - 0.0254).abs() < 1e-9, "{position:?}");
    }
}

#[test]
fn every_guess_is_said_with_its_reason() {
    let (found, ..) = understood(&RECORDERS[1]);
    for expected in [
        "time: column \"Zeit [s]\" (by its name, unit and shape), in s, as it says",
        "chamber_pressure: column \"Kammerdruck [bar]\" (by its name, unit and shape), in barg: it falls to 0.0000, which",
        "command: 1 means close (the pressure of \"Kammerdruck [bar]\" rises with it)",
        "position: counts towards open",
    ] {
        assert!(found.said.iter().any(|said| said.starts_with(expected)), "{expected}: {:#?}", found.said);
    }
}

#[test]
fn a_pipe_that_is_never_vented_tells_no_command() {
    let row: fn(f64, bool, f64, f64) -> String =
        |t, _, x, p| format!("{t:.3},{x:.3},{:.4}", 2.95 + 0.1 * (p - 101_325.0) / 517e3);
    let (found, ..) = understood(&Recorder { header: "t,LVDT [mm],Leitungsdruck [barg]", row, hints: |_| () });
    assert_eq!((found.unknown, found.threshold), (vec![Unknown::Command], None));
    let told = found.said.iter().any(|said| said.contains("a pipe that is vented would fall to the atmosphere"));
    assert!(told, "{:?}", found.said);
    // Nor is a pressure read in a unit that nobody has said.
    let row: fn(f64, bool, f64, f64) -> String = |t, _, x, p| format!("{t:.3},{x:.3},{:.4}", (p - 101_325.0) / 1e5);
    let (found, ..) = understood(&Recorder { header: "t,LVDT [mm],Leitungsdruck", row, hints: |_| () });
    assert_eq!(found.unknown, [Unknown::PressureUnit("pipe_pressure"), Unknown::Command]);
}

#[test]
fn what_cannot_be_known_is_not_guessed() {
    let unknown = |header: &'static str, row: fn(f64, bool, f64, f64) -> String, change: fn(&mut Hints)| {
        understood(&Recorder { header, row, hints: change }).0.unknown
    };
    let plain: fn(f64, bool, f64, f64) -> String = |t, c, x, _| format!("{t:.3},{},{x:.4}", u8::from(c));
    assert_eq!(unknown("time_s,command,position_mm", plain, |_| ()), [Unknown::Direction]);
    assert_eq!(unknown("time_s,a,b", plain, |_| ()), [Unknown::Position]);
    assert_eq!(unknown("time_s,limit switch,position_mm", plain, |_| ()), [Unknown::Command]);
    assert_eq!(unknown("time_s,command,Hub", plain, |hints| hints.stroke_m = None), [Unknown::PositionUnit]);
    let no_time: fn(f64, bool, f64, f64) -> String = |_, c, x, _| format!("1,{},{x:.4}", u8::from(c));
    assert_eq!(unknown("time_s,command,position_mm", no_time, |_| ()), [Unknown::Time]);
    assert!(understand(&[], &hints()).columns.is_empty());
}

#[test]
fn a_word_inside_another_one_names_nothing() {
    let row: fn(f64, bool, f64, f64) -> String = |t, c, x, _| format!("{t:.3},{},{:.4},{x:.4}", u8::from(c), t.sin());
    let header = "time_s,command,system state,pos";
    let hints: fn(&mut Hints) = |hints| hints.one_closes = Some(true);
    let (found, ..) = understood(&Recorder { header, row, hints });
    assert_eq!(found.columns.iter().find(|column| column.channel == "position").unwrap().name, "pos");
}

#[test]
fn a_part_of_a_stroke_in_no_unit_is_not_stretched_to_the_stops() {
    let row: fn(f64, bool, f64, f64) -> String = |t, c, x, _| format!("{t:.3},{},{:.4}", u8::from(c), 3.0 + 0.7 * x);
    let found = |name: Option<&'static str>| {
        let text = record(&Recorder { header: "time_s,close,desl", row, hints: |_| () });
        let recording = Recording::read(text.as_bytes(), "75psig.csv").unwrap();
        let mut hints = hints();
        hints.columns.extend(name.map(|name| ("position".into(), name.into())));
        understand(std::slice::from_ref(&recording), &hints)
    };
    let silent = found(None);
    assert_eq!(silent.unknown, [Unknown::PositionUnit]);
    assert!(
        silent.said.iter().any(|said| said.contains("in mm it would move over a part of the stroke")),
        "{silent:?}"
    );
    let in_mm = found(Some("desl [mm]"));
    let position = in_mm.columns.iter().find(|column| column.channel == "position").unwrap();
    assert_eq!((position.unit.as_deref(), position.scale, position.factor), (Some("mm"), 1.0, 1e-3));
    assert!(in_mm.unknown.is_empty() && in_mm.said.iter().any(|said| said.contains("in mm, as you said")), "{in_mm:?}");
    // Where the ends are said to be the stops, they are.
    let scaled = found(Some("desl [-]"));
    let position = scaled.columns.iter().find(|column| column.channel == "position").unwrap();
    assert!(scaled.unknown.is_empty() && (position.scale - 1.0 / 0.7).abs() < 0.02, "{scaled:?}");
}

#[test]
fn an_export_from_the_newest_row_to_the_oldest_is_understood() {
    let recorder = Recorder {
        header: "id,date,time,command,position_mm",
        row: |t, c, x, _| format!("7,2026-03-01,10:00:{t:06.3},{},{x:.4}", u8::from(c)),
        hints: |hints| hints.one_closes = Some(true),
    };
    let text = record(&recorder);
    let mut lines: Vec<&str> = text.lines().collect();
    lines[1..].reverse();
    let recording = Recording::read(lines.join("\n").as_bytes(), "75psig.csv").unwrap();
    let mut hints = hints();
    (recorder.hints)(&mut hints);
    let found = understand(std::slice::from_ref(&recording), &hints);
    assert!(found.unknown.is_empty(), "{found:?}");
    let time = found.columns.iter().find(|column| column.channel == "time").unwrap();
    assert_eq!((time.name.as_str(), recording.columns[time.index][0]), ("time", 0.0));
}

/// Recordings of the same strokes: their texts, named "75psig.csv" and "2.csv".
fn understood_together(texts: [&str; 2], change: fn(&mut Hints)) -> (Understanding, Vec<Recording>) {
    let files = ["75psig.csv", "2.csv"];
    let recordings: Vec<Recording> =
        texts.into_iter().zip(files).map(|(text, file)| Recording::read(text.as_bytes(), file).unwrap()).collect();
    let mut hints = hints();
    change(&mut hints);
    (understand(&recordings, &hints), recordings)
}

/// A recording with the supply pressure, 517 kPa above the atmosphere, in a unit of Pa behind a heading.
fn with_supply(header: &'static str, columns: fn(String, String) -> String, zero_pa: f64, unit_pa: f64) -> String {
    let mut text = format!("{header}\n");
    for step in 0..2000 {
        let time_s = f64::from(step) * 2e-3;
        let (close, position_mm, _) = valve(time_s);
        let supply = (zero_pa + 517e3 + 100.0 * f64::from(step % 3)) / unit_pa;
        let front = format!("{time_s:.3},{},{position_mm:.4}", u8::from(close));
        writeln!(text, "{}", columns(front, format!("{supply:.4}"))).unwrap();
    }
    text
}

#[test]
fn recordings_in_different_units_become_one_campaign() {
    let front: fn(String, String) -> String = |front, supply| format!("{front},{supply}");
    let back: fn(String, String) -> String = |front, supply| format!("{supply},{front}");
    let (psi, bar) = (6894.757, 1e5);
    for (texts, named) in [
        (
            [
                with_supply("time_s,command,position_mm,Versorgungsdruck [bar(g)]", front, 0.0, bar),
                // In another order, too.
                with_supply("Versorgungsdruck [psig],time_s,command,position_mm", back, 0.0, psi),
            ],
            "supply_pressure = \"Versorgungsdruck\"\n",
        ),
        (
            [
                with_supply("time_s,command,position_mm,Supply_PSIG", front, 0.0, psi),
                with_supply("time_s,command,position_mm,Supply_kPa", front, 101_325.0, 1e3),
            ],
            "supply_pressure = \"Supply\"\n",
        ),
    ] {
        let (found, recordings) = understood_together([&texts[0], &texts[1]], |hints| hints.one_closes = Some(true));
        assert!(found.unknown.is_empty() && found.conflicts.is_empty(), "{found:?}");
        assert!(found.said.iter().any(|said| said.contains("each recording's own unit counts")), "{found:?}");
        let runs = ["75psig.csv", "2.csv"].map(|file| DraftRun {
            file: file.into(),
            supply_pressure: "5.17 barg".into(),
            temperature: Some("20 degC".into()),
            ..DraftRun::default()
        });
        let text = draft("both", &found, &recordings[0], &runs);
        assert!(text.contains(named), "{named}{text}");
        let load = |file: &str| Ok(texts[usize::from(file == "2.csv")].clone().into_bytes());
        let campaign = Campaign::parse(&text, "c.toml", &FACTS, &load).unwrap();
        let alike = |warning: &crate::Warning| matches!(warning.doubt, crate::Doubt::SameRecording { .. });
        assert!(campaign.warnings.iter().all(alike), "{:?}", campaign.warnings);
        for run in &campaign.runs {
            let supply_pa = run.trace.supply_pressure_pa.as_ref().unwrap();
            assert!(supply_pa.iter().all(|pa| (pa - 618_425.0).abs() < 120.0), "{}: {:?}", run.file, &supply_pa[..3]);
        }
        assert_eq!(found.supply[1].as_ref().unwrap().text, "618.4 kPa");
    }
}

#[test]
fn what_is_named_is_taken_left_out_or_refused_by_name() {
    let front: fn(String, String) -> String = |front, supply| format!("{front},{supply}");
    let texts = ["barg", "bar"].map(|unit| {
        let header = format!("time_s,command,position_mm,Supply_Pressure_{unit}");
        with_supply("", front, 0.0, 1e5).replacen('\n', &format!("{header}\n"), 1)
    });
    let conflicts = |texts: [&str; 2], change: fn(&mut Hints)| understood_together(texts, change).0.conflicts;
    // One of them does not say from where it counts: no name of both can be right.
    let found = conflicts([&texts[0], &texts[1]], |hints| hints.one_closes = Some(true));
    assert!(matches!(&found[..], [Conflict::Units { channel, .. }] if channel == "supply_pressure"), "{found:?}");
    assert!(found[0].to_string().contains("is in barg in 75psig.csv and in bar in 2.csv"), "{}", found[0]);
    let found = conflicts([&texts[0], &texts[0]], |hints| {
        hints.one_closes = Some(true);
        hints.columns = vec![("supply_pressure".into(), "Suply_Pressure".into())];
    });
    let said = found.iter().map(ToString::to_string).collect::<String>();
    assert!(said.starts_with("75psig.csv has no column \"Suply_Pressure\" (did you mean"), "{said}");
    let (found, recordings) = understood_together([&texts[0], &texts[1]], |hints| {
        hints.one_closes = Some(true);
        hints.left_out = vec!["supply_pressure".into()];
    });
    assert!(found.conflicts.is_empty() && found.unknown.is_empty(), "{found:?}");
    let run = DraftRun { file: "2.csv".into(), supply_pressure: "5.17 barg".into(), ..DraftRun::default() };
    let text = draft("both", &found, &recordings[1], &[run]);
    assert!(text.contains("supply_pressure = \"none\"\n"), "{text}");
    let campaign = Campaign::parse(&text, "c.toml", &FACTS, &|_| Ok(texts[1].clone().into_bytes())).unwrap();
    assert!(campaign.runs[0].trace.supply_pressure_pa.is_none());
    let needed = text.replace("[columns]\n", "[columns]\nposition = \"none\"\n");
    let refused = Campaign::parse(&needed, "c.toml", &FACTS, &|_| Ok(Vec::new())).unwrap_err().to_string();
    assert!(refused.contains("nothing is read without the position"), "{refused}");
}

#[test]
fn a_column_in_percent_is_named_with_or_without_its_unit() {
    for (heading, named) in
        [("XV-1203.ZT [%]", "XV-1203.ZT"), ("XV-1203.ZT [%]", "XV-1203.ZT [%]"), ("XV-1203.ZT", "XV-1203.ZT [%]")]
    {
        let text = record(&RECORDERS[0]).replacen("position_mm", heading, 1);
        let (_, recordings) = understood_together([&text, &text], |_| ());
        let mut hints = hints();
        hints.one_closes = Some(true);
        hints.columns = vec![("position".into(), named.into())];
        let found = understand(&recordings, &hints);
        assert!(found.conflicts.is_empty() && found.unknown.is_empty(), "{heading}, {named}: {found:?}");
        let position = found.columns.iter().find(|column| column.channel == "position").unwrap();
        assert_eq!(position.name, heading);
    }
}

#[test]
fn times_of_other_names_and_timestamps_become_one_campaign() {
    let recorder = |header, row| record(&Recorder { header, row, hints: |_| () });
    let in_ms = |header| recorder(header, |t, c, x, _| format!("{:.1},{},{x:.4}", t * 1e3, u8::from(c)));
    let stamped =
        |header| recorder(header, |t, c, x, _| format!("2026-03-01 10:00:{:06.3},{},{x:.4}", 10.0 + t, u8::from(c)));
    for texts in [
        [in_ms("Zeit [ms],command,position_mm"), stamped("Zeit,command,position_mm")],
        [stamped("Zeit,command,position_mm"), in_ms("Zeit [ms],command,position_mm")],
        [stamped("Timestamp,command,position_mm"), stamped("Time Stamp (UTC),command,position_mm")],
        [stamped("Time,command,position_mm"), in_ms("time_ms,command,position_mm")],
    ] {
        let (found, recordings) = understood_together([&texts[0], &texts[1]], |hints| hints.one_closes = Some(true));
        assert!(found.conflicts.is_empty() && found.unknown.is_empty(), "{found:?}");
        let run = |file: &str| DraftRun { file: file.into(), supply_pressure: "75 psig".into(), ..DraftRun::default() };
        let text = draft("both", &found, &recordings[0], &["75psig.csv", "2.csv"].map(run));
        let load = |file: &str| Ok(texts[usize::from(file == "2.csv")].clone().into_bytes());
        let campaign =
            Campaign::parse(&text, "c.toml", &FACTS, &load).unwrap_or_else(|error| panic!("{error}\n{text}"));
        for run in &campaign.runs {
            assert!((run.trace.time_s[1999] - 3.998).abs() < 1e-6, "{text}");
        }
    }
}
