//! Reading campaigns: every format that recorders write, and every refusal.

use std::collections::HashMap;
use std::fmt::Write;

use campaign::{Campaign, CampaignError, CommandEdge, Doubt, Uncertainty, ValveFacts};
use column_source::NoticeKind;

const AMBIENT_PA: f64 = 100e3;
const VALVE: ValveFacts =
    ValveFacts { ambient_pressure_pa: AMBIENT_PA, supply_pressure_pa: 600e3, temperature_k: 293.15, stroke_m: 0.02 };

const RUN: &str = "name = \"bench\"\n[[run]]\nfile = \"a.csv\"\nsupply_pressure = \"75 psig\"\n\
                   temperature = \"20 degC\"\n";

/// Position of a valve of 20 mm that closes from 0.2 to 0.6 s and opens from 1.2 to 1.6 s, mm.
fn position_mm(time_s: f64) -> f64 {
    let closed = ((time_s - 0.2) / 0.4).clamp(0.0, 1.0) - ((time_s - 1.2) / 0.4).clamp(0.0, 1.0);
    // A little deterministic noise with a spread of some 10 micrometres.
    let noise = 0.02 * (((time_s * 1e3).round() * 12.9898).sin() * 43_758.545_3).fract();
    20.0 * (1.0 - closed) + noise
}

fn command(time_s: f64) -> u8 {
    u8::from(time_s < 1.0)
}

/// A trace of 2 s in steps of 1 ms; `row` gives what follows the time.
fn trace(header: &str, row: impl Fn(f64) -> String) -> String {
    let mut text = format!("{header}\n");
    for step in 0..2000 {
        let time_s = f64::from(step) * 1e-3;
        writeln!(text, "{time_s:.3},{}", row(time_s)).unwrap();
    }
    text
}

fn usual() -> String {
    trace("time_s,command,position_mm", |t| format!("{},{:.4}", command(t), position_mm(t)))
}

fn read_files(text: &str, files: &[(&str, &str)]) -> Result<Campaign, CampaignError> {
    let files: HashMap<&str, &str> = files.iter().copied().collect();
    Campaign::parse(text, "c.toml", &VALVE, &|name| {
        files.get(name).map(|text| text.as_bytes().to_vec()).ok_or_else(|| std::io::ErrorKind::NotFound.into())
    })
}

fn read(text: &str, csv: &str) -> Campaign {
    read_files(text, &[("a.csv", csv)]).unwrap()
}

fn refusal(text: &str, csv: &str) -> String {
    read_files(text, &[("a.csv", csv)]).unwrap_err().to_string()
}

fn doubts(campaign: &Campaign) -> Vec<&Doubt> {
    campaign.warnings.iter().map(|warning| &warning.doubt).collect()
}

#[test]
fn a_plain_campaign_is_read_in_si_without_a_word() {
    let text = format!(
        "{RUN}leak_to_atmosphere = \"0.15 mm2\"\n[sensors]\nposition_noise = \"0.03 mm\"\n\
         pressure_noise = \"0.5 kPa\"\ntiming_noise = \"3 ms\"\n"
    );
    let campaign = read(&text, &usual());
    assert!(campaign.warnings.is_empty(), "{:?}", campaign.warnings);
    let run = &campaign.runs[0];
    assert_eq!((campaign.name.as_str(), run.file.as_str()), ("bench", "a.csv"));
    assert_eq!(run.conditions.supply_pressure_pa, 75.0 * 6894.757 + AMBIENT_PA);
    assert_eq!(run.conditions.temperature_k, 293.15);
    assert!((run.conditions.leak_to_atmosphere_m2 - 0.15e-6).abs() < 1e-20);
    assert_eq!(run.conditions.leak_from_supply_m2, 0.0);
    assert!((campaign.sensors.position_noise_m.unwrap() - 30e-6).abs() < 1e-12);
    assert_eq!((campaign.sensors.pressure_noise_pa, campaign.sensors.timing_noise_s), (Some(500.0), Some(0.003)));
    let edges = [CommandEdge { time_s: 0.0, close: true }, CommandEdge { time_s: 1.0, close: false }];
    assert_eq!(run.commands, edges);
    assert_eq!(run.trace.time_s.len(), 2000);
    assert!((run.trace.position_m[0] - 0.02).abs() < 1e-4 && run.trace.position_m[800].abs() < 1e-4);
    assert_eq!(run.trace.chamber_pressure_pa, None);
}

#[test]
fn any_names_units_and_ends_are_mapped() {
    let csv = trace("t,valve,LVDT,PT-1", |t| {
        format!("{},{:.5},{:.3}", command(t), (20.0 - position_mm(t)) / 25.4 + 0.1, 14.0)
    });
    let text = format!(
        "{RUN}[columns]\ntime = \"t\"\ncommand = \"valve\"\n\
         position = {{ name = \"LVDT\", unit = \"in\", scale = -1.0, offset = \"22.54 mm\" }}\n\
         chamber_pressure = {{ name = \"PT-1\", unit = \"psia\" }}\n"
    );
    let campaign = read(&text, &csv);
    assert!(campaign.warnings.is_empty(), "{:?}", campaign.warnings);
    let trace = &campaign.runs[0].trace;
    for (time_s, position_m) in trace.time_s.iter().zip(&trace.position_m) {
        assert!((position_m - position_mm(*time_s) * 1e-3).abs() < 1e-6);
    }
    assert!((trace.chamber_pressure_pa.as_ref().unwrap()[0] - 14.0 * 6894.757).abs() < 1e-6);
}

#[test]
fn units_at_the_end_of_a_name_are_understood() {
    let csv = trace("time_s,command,position_in,pipe_pressure_barg", |t| {
        format!("{},{:.6},2.5", command(t), position_mm(t) / 25.4)
    });
    let campaign = read(RUN, &csv);
    let trace = &campaign.runs[0].trace;
    assert!((trace.position_m[0] - 0.02).abs() < 1e-4);
    assert!((trace.pipe_pressure_pa.as_ref().unwrap()[0] - 350e3).abs() < 1e-6);
    // A heading that says gauge leaves nothing to doubt.
    assert!(campaign.warnings.is_empty(), "{:?}", campaign.warnings);
}

#[test]
fn gaps_uneven_rows_and_several_cycles_are_kept() {
    let mut csv = String::from("# bench 3\ntime_s;command;position_mm\n");
    for step in 0..4000 {
        let time_s = f64::from(step) * 1e-3;
        let cycle_s = time_s % 2.0;
        // Every seventh row is missing, and every eleventh position.
        if step % 7 == 3 {
            continue;
        }
        let position =
            if step % 11 == 5 { "NaN".into() } else { format!("{:.3}", position_mm(cycle_s)).replace('.', ",") };
        writeln!(csv, "{};{};{position}", format!("{:.3}", 5.0 + time_s).replace('.', ","), command(cycle_s)).unwrap();
    }
    let campaign = read(RUN, &csv);
    let run = &campaign.runs[0];
    assert!(matches!(doubts(&campaign)[..], [Doubt::Read(NoticeKind::DecimalComma { .. })]));
    let times: Vec<(f64, bool)> =
        run.commands.iter().map(|edge| ((edge.time_s * 1e3).round() / 1e3, edge.close)).collect();
    assert_eq!(times, [(0.0, true), (1.0, false), (2.0, true), (3.0, false)]);
    assert_eq!(run.trace.time_s[0], 0.0);
    assert!(run.trace.position_m.iter().filter(|position| position.is_nan()).count() > 200);
}

#[test]
fn commands_come_from_a_threshold_on_another_channel() {
    let csv = trace("time_s,position_mm,pipe_pressure_kpa,coil", |t| {
        format!("{:.4},{},{}", position_mm(t), if t < 1.004 { 450 } else { 100 }, if t < 1.0 { 23.7 } else { 0.2 })
    });
    let times = |text: &str| read(&format!("{RUN}{text}"), &csv).runs[0].commands.clone();
    let pipe = times("[command_from]\nchannel = \"pipe_pressure\"\nthreshold = \"2 barg\"\nhysteresis = \"10 kPa\"\n");
    assert_eq!(pipe, [CommandEdge { time_s: 0.0, close: true }, CommandEdge { time_s: 1.004, close: false }]);
    let text = format!("{RUN}[command_from]\nchannel = \"pipe_pressure\"\nthreshold = \"2 barg\"\n");
    assert!(read(&text, &csv).runs[0].commands_inferred);
    let coil = times("[command_from]\nchannel = \"coil\"\nthreshold = 12\nabove = \"close\"\n");
    assert_eq!(coil[1], CommandEdge { time_s: 1.0, close: false });
    let message = refusal(&format!("{RUN}[command_from]\nchannel = \"koil\"\nthreshold = 12\n"), &csv);
    assert!(message.starts_with("a.csv:1: has no column \"koil\" (did you mean \"coil\"?)"), "{message}");
    let message = refusal(&format!("{RUN}[command_from]\nchannel = \"pipe_pressure\"\nthreshold = \"2 s\"\n"), &csv);
    assert!(message.contains("c.toml:8: command_from.threshold: \"s\" is a unit of a time"), "{message}");
}

#[test]
fn a_signal_that_rises_and_falls_slowly_tells_both_commands_early() {
    // A pipe that is filled from the start and vented from 1 s on, each within about a second.
    let filled = |t: f64| 1.0 - (-t / 0.3).exp();
    let csv = trace("time_s,position_mm,pipe_pressure_kpa", |t| {
        let share = if t < 1.0 { filled(t) } else { filled(1.0) * (-(t - 1.0) / 0.3).exp() };
        format!("{:.4},{:.3}", position_mm(t), 100.0 + 400.0 * share)
    });
    let of = |more: &str| {
        let text = format!(
            "{RUN}[command_from]\nchannel = \"pipe_pressure\"\nthreshold = \"180 kPa\"\nhysteresis = \"20 kPa\"\n{more}"
        );
        read(&text, &csv).runs[0].commands.clone()
    };
    let [close, open] = of("release = \"420 kPa\"\n")[..] else { panic!("one stroke there and back") };
    assert!(close.close && close.time_s < 0.1, "{close:?}");
    assert!(!open.close && open.time_s > 1.0 && open.time_s < 1.1, "{open:?}");
    let late = of("");
    assert!(late[1].time_s > 1.4, "{late:?}");
    // A record that begins while the pipe empties begins with no command to close.
    let emptying = trace("time_s,position_mm,pipe_pressure_kpa", |t| {
        let share = if t < 1.5 { 0.6 * (-t / 0.3).exp() } else { filled(t - 1.5) };
        format!("{:.4},{:.3}", position_mm(t), 100.0 + 400.0 * share)
    });
    let text =
        format!("{RUN}[command_from]\nchannel = \"pipe_pressure\"\nthreshold = \"180 kPa\"\nrelease = \"420 kPa\"\n");
    let commands = read(&text, &emptying).runs[0].commands.clone();
    assert!(commands.len() == 1 && commands[0].close && commands[0].time_s > 1.5, "{commands:?}");
    // As shares of each recording's own rise and fall.
    let shares =
        format!("{RUN}[command_from]\nchannel = \"pipe_pressure\"\nthreshold = \"20 %\"\nrelease = \"80 %\"\n");
    let commands = read(&shares, &csv).runs[0].commands.clone();
    assert!(commands.len() == 2 && (commands[0].time_s - close.time_s).abs() < 0.02, "{commands:?}");
    assert!((commands[1].time_s - open.time_s).abs() < 0.02, "{commands:?}");
    let idle = trace("time_s,position_mm,pipe_pressure_kpa", |t| {
        format!("{:.4},{:.3}", position_mm(t), 100.0 + 0.2 * (t * 12345.0).sin())
    });
    let message = refusal(&shares, &idle);
    assert!(message.contains("kPa and hardly moves, so that it tells no command"), "{message}");
    let mixed = shares.replace("80 %", "420 kPa");
    let message = refusal(&mixed, &csv);
    assert!(message.contains("c.toml:9: command_from.release is \"420 kPa\"; expected a share such as"), "{message}");
    let message = refusal(&shares.replace("20 %", "120 %"), &csv);
    assert!(message.contains("c.toml:8: command_from.threshold is \"120 %\"; expected a share such as"), "{message}");
    let text =
        format!("{RUN}[command_from]\nchannel = \"pipe_pressure\"\nthreshold = \"180 kPa\"\nrelease = \"150 kPa\"\n");
    let message = refusal(&text, &csv);
    assert!(
        message.contains("c.toml:9: command_from.release is ") && message.contains("above the threshold"),
        "{message}"
    );
}

#[test]
fn a_run_that_never_crosses_the_threshold_is_left_out_and_named() {
    let with = |closed_kpa: f64| {
        trace("time_s,position_mm,pipe_pressure_kpa", |t| {
            format!("{:.4},{:.2}", position_mm(t), if command(t) == 1 { closed_kpa } else { 100.0 })
        })
    };
    let from = "[command_from]\nchannel = \"pipe_pressure\"\nthreshold = \"2 barg\"\n";
    let second = RUN.split_once("[[run]]").unwrap().1.replace("a.csv", "b.csv");
    let text = format!("{RUN}[[run]]{second}{from}");
    let both = read_files(&text, &[("a.csv", &with(250.0)), ("b.csv", &with(600.0))]).unwrap();
    assert_eq!(both.runs.len(), 1);
    assert_eq!(both.runs[0].file, "b.csv");
    let warning = both.warnings.iter().find(|one| matches!(one.doubt, Doubt::LeftOut { .. })).unwrap();
    let said = "a.csv:2: this run was left out: the pipe_pressure lies between 100.00 kPa and 250.00 kPa and never \
                crosses the threshold 300.00 kPa of command_from";
    assert!(warning.to_string().starts_with(said), "{warning}");
    // Without another run nothing is left.
    let alone = read_files(&format!("{RUN}{from}"), &[("a.csv", &with(250.0))]).unwrap_err().to_string();
    assert!(alone.starts_with("a.csv:2: the pipe_pressure lies between 100.00 kPa and 250.00 kPa"), "{alone}");
}

#[test]
fn planned_runs_have_commands_and_no_trace() {
    let text = "name = \"plan\"\n[[run]]\nsupply_pressure = \"5 bara\"\nend = \"3 s\"\n\
                commands = [ { at = \"0 s\", close = true }, { at = \"600 ms\", close = false } ]\n";
    let campaign = read(text, "");
    assert!(campaign.runs.is_empty());
    let planned = &campaign.planned[0];
    assert_eq!(planned.commands[1], CommandEdge { time_s: 0.6, close: false });
    assert_eq!((planned.conditions.supply_pressure_pa, planned.end_s), (5e5, Some(3.0)));
    let message = refusal(&text.replace("600 ms", "0 s"), "");
    assert!(message.contains("c.toml:5") && message.contains("expected a time after 0 s"), "{message}");
    assert!(refusal(&text.replace("\"3 s\"", "\"0.5 s\""), "").contains("c.toml:4: run.end is before"));
    assert!(refusal("name = \"p\"\n[[run]]\n", "").contains("c.toml:2: \"run.file\" is missing"));
    assert!(
        refusal(&format!("{RUN}commands = []\n"), &usual()).contains("c.toml:6: run.commands is given beside a file")
    );
}

#[test]
fn inputs_need_their_channel_in_every_run() {
    let with =
        trace("time_s,command,position_mm,pipe_pressure_kpa", |t| format!("{},{:.4},300", command(t), position_mm(t)));
    let text = format!("{RUN}[inputs]\npipe_pressure = \"measured\"\n");
    assert!(read(&text, &with).inputs.pipe_pressure);
    assert!(refusal(&text, &usual()).starts_with("a.csv:1: has no column \"pipe_pressure_kpa\""));
    assert!(
        refusal(&text.replace("\"measured\"", "\"given\""), &with)
            .contains("c.toml:7: inputs.pipe_pressure is \"given\"")
    );
}

#[test]
fn stroke_times_are_read_with_their_conditions() {
    let csv = "supply_pressure_psig,leak_to_atmosphere_mm2,leak_from_supply_mm2,temperature_k,close_time_s,open_time_s\n\
               75,0,0,293.15,1.0759,2.1786\n60,0.1,0,300,1.5,\n75,0,0.05,293.15,,2.5\n";
    let text = "name = \"log\"\n[timings]\nfile = \"a.csv\"\n";
    let campaign = read(text, csv);
    assert!(campaign.warnings.is_empty());
    let rows = &campaign.timings;
    assert_eq!(rows.len(), 3);
    assert_eq!(rows[0].conditions.supply_pressure_pa, 75.0 * 6894.757 + AMBIENT_PA);
    assert_eq!((rows[0].close_time_s, rows[0].open_time_s), (Some(1.0759), Some(2.1786)));
    assert_eq!((rows[1].line, rows[1].open_time_s, rows[1].conditions.temperature_k), (3, None, 300.0));
    assert_eq!(rows[2].close_time_s, None);
    assert!((rows[2].conditions.leak_from_supply_m2 - 0.05e-6).abs() < 1e-20);
    let changed = |from: &str, to: &str| refusal(text, &csv.replacen(from, to, 1));
    assert!(changed("close_time_s", "closing").starts_with("a.csv:1: has no column \"close_time_s\""));
    assert!(changed("1.0759", "fast").starts_with("a.csv:2: column \"close_time_s\": \"fast\" is not a number"));
    assert!(changed("1.0759", "-1").starts_with("a.csv:2: column \"close_time_s\": -1; expected a stroke time"));
    assert!(changed("60,", "-60,").starts_with("a.csv:3: supply_pressure is"));
    assert!(changed("300,", "20,").starts_with("a.csv:3: temperature is 20 K"));
    let misspelt = read(text, &csv.replacen("leak_to_atmosphere_mm2", "leak_to_atmosfere_mm2", 1));
    assert!(matches!(doubts(&misspelt)[..], [Doubt::UnreadColumn { .. }]));
}

#[test]
fn faults_of_the_campaign_file_are_refused_with_its_line() {
    let changed = |from: &str, to: &str| refusal(&RUN.replacen(from, to, 1), &usual());
    assert_eq!(
        changed("a.csv", "b.csv"),
        "b.csv:1: cannot be read: entity not found (the campaign names it in line 3)"
    );
    assert!(
        changed("75 psig", "75 psgi")
            .contains("c.toml:4: run.supply_pressure: unknown unit \"psgi\" (did you mean \"psig\"?)")
    );
    assert!(changed("75 psig", "75 kPa").contains("c.toml:4: run.supply_pressure is 75000 Pa absolute"));
    assert!(changed("supply_pressure", "suply_pressure").contains("c.toml:4: unknown key \"run.suply_pressure\""));
    assert!(refusal("name = \"none\"\n", "").contains("\"run\" is missing"));
    assert!(
        refusal(&format!("{RUN}[sensors]\nposition_noise = \"0 mm\"\n"), "")
            .contains("c.toml:7: sensors.position_noise")
    );
    let twice = format!("{RUN}[[run]]\nfile = \"./a.csv\"\nsupply_pressure = \"80 psig\"\n");
    assert!(
        refusal(&twice, &usual()).contains("c.toml:7: run.file is \"./a.csv\", which the run in line 2 has already")
    );
    let unit = format!("{RUN}[columns]\nposition = {{ name = \"position_mm\", unit = \"bar\" }}\n");
    assert!(refusal(&unit, &usual()).contains("c.toml:7: columns.position.unit is \"bar\"; expected a length"));
    let psi = format!("{RUN}[columns]\nchamber_pressure = {{ name = \"p\", unit = \"psi\" }}\n");
    assert!(refusal(&psi, &usual()).contains("columns.chamber_pressure.unit is \"psi\""));
    let supply = read("name = \"bench\"\n[[run]]\nfile = \"a.csv\"\n", &usual());
    assert!(matches!(doubts(&supply)[..], [Doubt::SupplyAssumed { .. }, Doubt::TemperatureAssumed { .. }]));
    assert_eq!(supply.runs[0].conditions.supply_pressure_pa, VALVE.supply_pressure_pa);
}

#[test]
fn a_supply_pressure_in_another_unit_is_doubted() {
    let with = |supply: &str| read(&RUN.replace("75 psig", supply), &usual());
    for wrong in ["75 barg", "7.5 psig"] {
        let campaign = with(wrong);
        let [Doubt::SupplyFar { usual_kpa, .. }] = doubts(&campaign)[..] else {
            panic!("{wrong}: {:?}", campaign.warnings)
        };
        assert!((usual_kpa - VALVE.supply_pressure_pa / 1e3).abs() < 1e-9);
    }
    assert!(doubts(&with("40 psig")).is_empty() && doubts(&with("150 psig")).is_empty());
}

#[test]
fn faults_of_a_trace_are_refused_with_its_line() {
    let good = usual();
    let changed = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        refusal(RUN, &good.replacen(from, to, 1))
    };
    assert_eq!(
        changed("position_mm", "pos"),
        "a.csv:1: has no column \"position_mm\"; expected position_mm, position_in, or its name in [columns]; found \
         \"time_s\", \"command\", \"pos\""
    );
    assert!(changed("\n0.005,", "\n0.004,").starts_with("a.csv:7: time 0.004 s follows 0.004 s"));
    assert!(changed("\n0.005,", "\n-0.005,").starts_with("a.csv:7: time -0.005 s follows 0.004 s"));
    assert!(changed("\n0.005,", "\nfive,").starts_with("a.csv:7: column \"time_s\": \"five\" is not a number"));
    assert!(changed("\n0.005,1", "\n0.005,0.5").starts_with("a.csv:7: command is 0.5"));
    assert!(changed("\n0.005,1", "\n0.005,1,7").starts_with("a.csv:7: has 4 fields; expected 3"));
    assert!(refusal(RUN, "").starts_with("a.csv:1: the file is empty"));
    assert!(refusal(RUN, "time_s,command,position_mm\n").starts_with("a.csv:1: has 0 usable rows"));
    let dead = trace("time_s,command,position_mm", |t| format!("{},NaN", command(t)));
    assert!(refusal(RUN, &dead).starts_with("a.csv:2: column \"position_mm\" holds no number at all"));
    let doubled = trace("time_s,command,position_mm,position_in", |t| format!("{},1,1", command(t)));
    assert!(refusal(RUN, &doubled).starts_with("a.csv:1: has two columns for position"));
}

#[test]
fn a_command_that_never_changes_is_refused_unless_it_is_one_stroke() {
    for value in [0, 1] {
        let csv = trace("time_s,command,position_mm", |t| format!("{value},{:.4}", position_mm(t)));
        assert!(refusal(RUN, &csv).starts_with(&format!("a.csv:2: the command is {value} from the first row")));
    }
    // A record may begin anywhere in the stroke.
    for before_s in [0.0, 0.3, 0.5] {
        let one = |value: u8, position: &dyn Fn(f64) -> f64| {
            let csv = trace("time_s,command,position_mm", |t| format!("{value},{:.4}", position(before_s + t)));
            read(RUN, &csv)
        };
        assert!(doubts(&one(1, &|t| position_mm(t.min(1.1)))).contains(&&Doubt::OnlyClosing));
        assert!(doubts(&one(0, &|t| position_mm(t + 1.0))).contains(&&Doubt::OnlyOpening));
    }
}

#[test]
fn a_record_may_begin_in_motion_before_rest_or_after_the_command() {
    for before_s in [0.3, 0.45, 0.7, 1.05, 1.4] {
        let two_cycles = |t: f64| (command((t + before_s) % 2.0), position_mm((t + before_s) % 2.0));
        let csv = trace("time_s,command,position_mm", |t| {
            let (command, position) = two_cycles(t);
            format!("{command},{position:.4}")
        });
        let campaign = read(RUN, &csv);
        assert!(campaign.warnings.is_empty(), "{before_s}: {:?}", campaign.warnings);
        let run = &campaign.runs[0];
        assert_eq!(run.trace.command_close[0], two_cycles(0.0).0 == 1);
        assert!((run.trace.position_m[0] - two_cycles(0.0).1 * 1e-3).abs() < 1e-6);
        assert!(!run.commands_inferred);
    }
}

#[test]
fn outliers_are_taken_out_before_anything_is_judged_and_are_named() {
    let good = usual();
    let value = |row: usize| good.lines().nth(row).unwrap().to_owned();
    let spiked = good.replacen(&value(101), "0.100,1,320.5", 1).replacen(&value(901), "0.900,1,99999", 1);
    let campaign = read(RUN, &spiked);
    let [Doubt::Outliers { count: 2, named, .. }] = doubts(&campaign)[..] else { panic!("{:?}", campaign.warnings) };
    assert!(named.contains(" mm at 0.1000 s (line 102), 99999") && named.contains("at 0.9000 s (line 902)"), "{named}");
    assert!(campaign.warnings[0].to_string().starts_with("a.csv:102: 2 readings of the position are far"));
    let trace = &campaign.runs[0].trace;
    let rows: Vec<(usize, usize)> = trace.outliers.iter().map(|outlier| (outlier.row, outlier.line)).collect();
    assert_eq!(rows, [(100, 102), (900, 902)]);
    assert!(trace.outliers[1].value > 99.0 && trace.outliers.iter().all(|outlier| outlier.channel == "position"));
    assert!(trace.position_m[100].is_nan() && trace.position_m[900].is_nan() && trace.position_m[101].is_finite());
}

#[test]
fn uncertainties_are_read_in_si_and_refused_where_they_make_no_sense() {
    let text = format!(
        "{RUN}[uncertainty]\nposition_zero = \"0.1 mm\"\nposition_gain = 0.01\nposition_linearity = 0.003\nposition_drift = \"0.05 mm\"\n\
         supply_pressure = 0.015\nsupply_gauge = 0.02\ntemperature = \"5 degC\"\nclock = \"25 ms\"\n\
         command_delay = \"4 ms\"\nleak_area = 0.1\n"
    );
    let stated = Uncertainty {
        position_zero_m: Some(1e-4),
        position_gain: Some(0.01),
        position_linearity: Some(0.003),
        position_drift_m: Some(5e-5),
        supply_pressure: Some(0.015),
        supply_gauge: Some(0.02),
        temperature_k: Some(5.0),
        clock_s: Some(0.025),
        command_delay_s: Some(0.004),
        leak_area: Some(0.1),
    };
    assert_eq!(read(&text, &usual()).uncertainty, stated);
    assert_eq!(read(RUN, &usual()).uncertainty, Uncertainty::default());
    let changed = |from: &str, to: &str| refusal(&text.replacen(from, to, 1), &usual());
    assert!(changed("0.01\n", "2\n").contains("c.toml:8: uncertainty.position_gain is 2; expected a share below 1"));
    assert!(changed("\"25 ms\"", "\"0 ms\"").contains("c.toml:14: uncertainty.clock is 0; expected one standard"));
    assert!(changed("leak_area", "leak_size").contains("c.toml:16: unknown key \"uncertainty.leak_size\""));
    assert!(changed("\"0.1 mm\"", "0.1").contains("c.toml:7: uncertainty.position_zero is the bare number 0.1"));
}

#[test]
fn positions_in_the_wrong_unit_or_direction_are_refused() {
    let scaled = |factor: f64| {
        refusal(RUN, &trace("time_s,command,position_mm", |t| format!("{},{:.6}", command(t), position_mm(t) * factor)))
    };
    assert!(scaled(1.0 / 25.4).contains("inches called mm (a factor of 25.4)"));
    assert!(scaled(0.1).contains("centimetres called mm"));
    assert!(scaled(1e-3).contains("metres called mm"));
    assert!(scaled(1e3).contains("micrometres called mm"));
    assert!(scaled(2.0).contains("the recorded motion spans 40"));
    let turned = trace("time_s,command,position_mm", |t| format!("{},{:.4}", command(t), 20.0 - position_mm(t)));
    assert!(refusal(RUN, &turned).contains("the position grows while the valve is told to close"));
}

#[test]
fn what_looks_wrong_but_can_be_used_is_said() {
    let doubt = |position: &dyn Fn(f64) -> f64| {
        let csv = trace("time_s,command,position_mm", |t| format!("{},{:.4}", command(t), position(t)));
        doubts(&read(RUN, &csv)).into_iter().cloned().collect::<Vec<_>>()
    };
    assert!(matches!(doubt(&|t| 20.0 + position_mm(0.0) - position_mm(t.min(0.1)))[..], [Doubt::NoMotion { .. }]));
    // A partial stroke of a tenth is short, and not in centimetres.
    assert!(matches!(doubt(&|t| 18.0 + 0.1 * position_mm(t))[..], [Doubt::ShortMotion { .. }]));
    assert!(matches!(doubt(&|t| 0.02 * position_mm(1e3 * t + 5.0))[..], [Doubt::NoMotion { .. }]));
    assert!(matches!(doubt(&|t| 10.0 + 0.5 * position_mm(t))[..], [Doubt::ShortMotion { .. }]));
    assert!(matches!(doubt(&|t| 5.0 + position_mm(t))[..], [Doubt::Offset { .. }]));
    assert!(matches!(doubt(&|t| position_mm(t).min(18.5))[..], [Doubt::Clipped { .. }]));
    assert!(matches!(doubt(&|t| position_mm(t).max(0.5))[..], [Doubt::Clipped { .. }]));
    assert!(matches!(doubt(&|t| if t > 1.0 { f64::NAN } else { position_mm(t) })[..], [Doubt::ManyGaps { .. }]));
    let gauge = trace("time_s,command,position_mm,chamber_pressure_kpa", |t| {
        format!("{},{:.4},{}", command(t), position_mm(t), if t < 1.0 { 350 } else { 0 })
    });
    assert!(matches!(doubts(&read(RUN, &gauge))[..], [Doubt::LooksGauge { .. }]));
    let lost = usual().replacen("\n0.005,", "\n,", 1).replacen("\n0.007,1", "\n0.007,", 1);
    let campaign = read(RUN, &lost);
    assert_eq!(doubts(&campaign), [&Doubt::RowsWithoutTime { rows: 1 }, &Doubt::RowsWithoutCommand { rows: 1 }]);
    assert_eq!(campaign.runs[0].commands.len(), 2);
}

#[test]
fn quiet_sensors_are_not_called_clipped() {
    let csv = trace("time_s,command,position_mm", |t| format!("{},{:.1}", command(t), position_mm(t)));
    assert!(read(RUN, &csv).warnings.is_empty());
}

#[test]
fn files_are_found_beside_the_campaign() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c.toml");
    std::fs::write(&path, RUN).unwrap();
    let message = Campaign::read(&path, &VALVE).unwrap_err().to_string();
    assert!(message.contains("a.csv:1: cannot be read"), "{message}");
    std::fs::write(folder.path().join("a.csv"), usual()).unwrap();
    assert_eq!(Campaign::read(&path, &VALVE).unwrap().runs.len(), 1);
    std::fs::write(folder.path().join("a.csv"), b"time_s,command,position_mm\n0,1,\x02\n").unwrap();
    assert!(Campaign::read(&path, &VALVE).unwrap_err().to_string().contains("a.csv:2: is not text"));
}

#[test]
fn a_recording_in_place_of_a_campaign_is_called_one() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes, format) in
        [("a.csv.gz", &b"\x1f\x8b\x08\0\xff"[..], "a gzip file"), ("a.csv", usual().as_bytes(), "a table of numbers")]
    {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let message = Campaign::read(&path, &VALVE).unwrap_err().to_string();
        let said = format!("{name}: is a recording ({format}), no campaign file; expected a TOML file that names");
        assert!(message.contains(&said) && message.contains("`valve init campaign "), "{message}");
    }
    let path = folder.path().join("c.toml");
    std::fs::write(&path, RUN.replace("]]", "]")).unwrap();
    let message = Campaign::read(&path, &VALVE).unwrap_err().to_string();
    assert!(message.contains("not valid TOML"), "{message}");
}

proptest::proptest! {
    #![proptest_config(proptest::test_runner::Config::with_cases(64))]
    #[test]
    fn no_damaged_file_makes_the_reader_panic(
        place in 0usize..30_000,
        length in 0usize..20_000,
        slip in proptest::collection::vec(proptest::num::u8::ANY, 0..6),
        in_table in proptest::bool::ANY,
    ) {
        let campaign = format!(
            "{RUN}[columns]\ntime = \"time_s\"\nposition = {{ unit = \"mm\", scale = 1.0, offset = \"0 mm\" }}\n\
             [sensors]\nposition_noise = \"0.01 mm\"\n[[run]]\ncommands = [{{ at = \"0 s\", close = true }}]\n"
        );
        let csv = usual();
        let damaged = |text: &str| {
            let bytes = text.as_bytes();
            let start = place % bytes.len();
            [&bytes[..start], &slip, &bytes[(start + length).min(bytes.len())..]].concat()
        };
        let (campaign, csv) = if in_table {
            (campaign.into_bytes(), damaged(&csv))
        } else {
            (damaged(&campaign), csv.into_bytes())
        };
        let text = String::from_utf8_lossy(&campaign);
        if let Err(error) = Campaign::parse(&text, "c.toml", &VALVE, &|_| Ok(csv.clone())) {
            // Every refusal names a file and a line.
            let mut parts = error.to_string().split(':').map(str::to_owned).collect::<Vec<_>>().into_iter();
            proptest::prop_assert!(parts.next().is_some_and(|file| !file.is_empty()));
            proptest::prop_assert!(parts.next().is_some_and(|line| line.parse::<usize>().is_ok()));
        }
    }
}

#[test]
fn all_that_is_wrong_with_a_campaign_is_told_before_its_recordings_are() {
    let text = "nam = \"c\"\n[sensors]\nposition_noise = \"3 s\"\n[[run]]\nfile = \"a.csv\"\nsupply_pressure = \"5 bar\"\n\
                [[run]]\nfile = \"b.csv\"\ntemperature = \"20 C\"\nsupply_pressure = \"75 psig\"\n";
    let told = read_files(text, &[("a.csv", "x\n")]).unwrap_err().to_string();
    let places: Vec<&str> = told.lines().map(|line| line.split(": ").next().unwrap()).collect();
    assert_eq!(places, ["c.toml:1", "c.toml:1", "c.toml:3", "c.toml:6", "c.toml:9"], "{told}");
    // With these mended, what is wrong with a recording comes next.
    let sound = "name = \"c\"\n[[run]]\nfile = \"a.csv\"\nsupply_pressure = \"75 psig\"\n";
    let told = read_files(sound, &[("a.csv", "x\n")]).unwrap_err().to_string();
    assert!(told.starts_with("a.csv:"), "{told}");
}

#[test]
fn rows_from_the_newest_to_the_oldest_are_turned_round() {
    let forward = usual();
    let mut lines: Vec<&str> = forward.lines().collect();
    lines[1..].reverse();
    let campaign = read(RUN, &lines.join("\n"));
    let expected = read(RUN, &forward);
    let (run, other) = (&campaign.runs[0], &expected.runs[0]);
    assert_eq!((&run.commands, &run.trace.position_m), (&other.commands, &other.trace.position_m));
    assert!(run.trace.time_s.iter().zip(&other.trace.time_s).all(|(one, other)| (one - other).abs() < 1e-9));
    assert_eq!(doubts(&campaign), [&Doubt::Read(NoticeKind::NewestFirst)]);
    // One row out of place is still refused, in either order.
    lines.swap(500, 501);
    assert!(refusal(RUN, &lines.join("\n")).contains("expected times that increase"));
}
