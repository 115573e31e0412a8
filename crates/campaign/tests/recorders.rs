//! Campaigns in the handwriting of recorders, spreadsheets and control systems.

use std::fmt::Write;

use campaign::{Campaign, ValveFacts};

const VALVE: ValveFacts =
    ValveFacts { ambient_pressure_pa: 100e3, supply_pressure_pa: 617e3, temperature_k: 293.15, stroke_m: 0.02 };
const RUN: &str =
    "name = \"bench\"\n[[run]]\nfile = \"a.csv\"\nsupply_pressure = \"75 psig\"\ntemperature = \"20 degC\"\n";

fn read_bytes(campaign: &str, bytes: &[u8]) -> Result<Campaign, String> {
    Campaign::parse(campaign, "c.toml", &VALVE, &|_| Ok(bytes.to_vec())).map_err(|error| error.to_string())
}

fn read(campaign: &str, text: &str) -> Campaign {
    read_bytes(campaign, text.as_bytes()).unwrap()
}

fn words(campaign: &Campaign) -> Vec<String> {
    campaign.warnings.iter().map(ToString::to_string).collect()
}

/// A closing and an opening stroke of 20 mm within 2 s, every 2 ms: time in s, command, position in mm.
fn stroke() -> Vec<(f64, bool, f64)> {
    let row = |step: i32| {
        let time_s = f64::from(step) * 2e-3;
        let closed = ((time_s - 0.2) / 0.4).clamp(0.0, 1.0) - ((time_s - 1.2) / 0.4).clamp(0.0, 1.0);
        let noise = 0.02 * ((f64::from(step) * 12.9898).sin() * 43_758.545_3).fract();
        (time_s, time_s < 1.0, 20.0 * (1.0 - closed) + noise)
    };
    (0..1000).map(row).collect()
}

fn text(header: &str, row: impl Fn(f64, bool, f64) -> String) -> String {
    let mut text = format!("{header}\n");
    for (time_s, close, position_mm) in stroke() {
        writeln!(text, "{}", row(time_s, close, position_mm)).unwrap();
    }
    text
}

fn comma(number: f64, digits: usize) -> String {
    format!("{number:.digits$}").replace('.', ",")
}

/// Whether a campaign holds the strokes as they were, to the digits that were written.
fn holds_the_strokes(campaign: &Campaign) {
    let trace = &campaign.runs[0].trace;
    assert_eq!(trace.time_s.len(), 1000);
    for (index, (time_s, close, position_mm)) in stroke().into_iter().enumerate() {
        assert!((trace.time_s[index] - time_s).abs() < 1e-6, "{}", trace.time_s[index]);
        assert_eq!(trace.command_close[index], close);
        assert!((trace.position_m[index] - position_mm * 1e-3).abs() < 1e-6);
    }
}

#[test]
fn a_german_recorder_is_read_and_every_guess_is_said() {
    let csv = text("Zeit;Ventil;Weg;Kammerdruck\nms;-;cm;bar(g)", |t, c, x| {
        format!("{};{};{};2,5", comma(1000.0 * t, 1), u8::from(c), comma(0.1 * x, 5))
    });
    let campaign = read(
        &format!(
            "{RUN}[columns]\ntime = \"Zeit\"\ncommand = \"Ventil\"\nposition = \"Weg\"\nchamber_pressure = \"kammerdruck\"\n"
        ),
        &csv,
    );
    holds_the_strokes(&campaign);
    assert!((campaign.runs[0].trace.chamber_pressure_pa.as_ref().unwrap()[0] - 350e3).abs() < 1e-6);
    let said = words(&campaign);
    assert_eq!(
        said[..],
        [
            "a.csv:2: the row under the header was taken as units: Zeit in ms, Weg in cm, Kammerdruck in bar(g)",
            "a.csv:3: numbers such as \"0,0\" were read with a decimal comma",
        ]
    );
}

#[test]
fn timestamps_units_in_brackets_and_utf_16_are_read() {
    let csv = text("Time\tCommand\tPosition [mm]", |t, c, x| {
        format!("2026-03-01T23:59:{:06.3}+01:00\t{}\t{x:.5}", 50.0 + t, u8::from(c))
    });
    let campaign = format!("{RUN}[columns]\ntime = \"Time\"\n");
    let utf_16: Vec<u8> = format!("\u{feff}{csv}").encode_utf16().flat_map(u16::to_le_bytes).collect();
    for bytes in [csv.as_bytes(), &utf_16] {
        let campaign = read_bytes(&campaign, bytes).unwrap();
        holds_the_strokes(&campaign);
        let said = words(&campaign).pop().unwrap();
        assert_eq!(
            said,
            "a.csv:2: the time is a timestamp such as \"2026-03-01T23:59:50.000+01:00\", read as a time with its zone"
        );
    }
}

#[test]
fn headers_in_other_cases_and_milliseconds_need_no_mapping() {
    let csv = text("TIME_MS,Command,Position_MM", |t, c, x| format!("{:.1},{},{x:.5}", t * 1e3, u8::from(c)));
    let campaign = read(RUN, &csv);
    holds_the_strokes(&campaign);
    assert_eq!(words(&campaign), [""; 0]);
    // A mapped column keeps the unit at its end.
    let csv = text("t_ms,Y1,lvdt_cm", |t, c, x| format!("{:.1},{},{:.6}", t * 1e3, u8::from(c), x * 0.1));
    let mapped = format!("{RUN}[columns]\ntime = \"t_ms\"\ncommand = \"Y1\"\nposition = \"lvdt_cm\"\n");
    holds_the_strokes(&read(&mapped, &csv));
}

#[test]
fn units_that_do_not_fit_are_refused() {
    let csv =
        text("time_s,command,position_mm,chamber_pressure_bar", |t, c, x| format!("{t:.3},{},{x:.4},3", u8::from(c)));
    let refusal = read_bytes(RUN, csv.as_bytes()).unwrap_err();
    let expected = "a.csv:1: column \"chamber_pressure_bar\" is in bar, which does not say from where it counts; give it \
                    its unit in [columns], chamber_pressure = { name = \"chamber_pressure_bar\", unit = \"bara\" }";
    assert!(refusal.starts_with(expected), "{refusal}");
    let csv = text("time_s,command,Weg [kPa]", |t, c, x| format!("{t:.3},{},{x:.4}", u8::from(c)));
    let refusal = read_bytes(&format!("{RUN}[columns]\nposition = \"Weg [kPa]\"\n"), csv.as_bytes()).unwrap_err();
    assert!(refusal.starts_with("a.csv:1: column \"Weg [kPa]\" is in kPa; expected a length in mm"), "{refusal}");
    let csv = text("time_s,command,Weg,Weg", |t, c, x| format!("{t:.3},{},{x:.4},{x:.4}", u8::from(c)));
    let refusal = read_bytes(&format!("{RUN}[columns]\nposition = \"Weg\"\n"), csv.as_bytes()).unwrap_err();
    assert!(refusal.starts_with("a.csv:1: has two columns for position: \"Weg\" and \"Weg\""), "{refusal}");
}

#[test]
fn a_record_that_was_cut_off_keeps_its_whole_rows() {
    let csv = text("time_s,command,position_mm", |t, c, x| format!("{t:.3},{},{x:.4}", u8::from(c)));
    let campaign = read(RUN, &csv[..csv.len() - 4]);
    assert_eq!(campaign.runs[0].trace.time_s.len(), 999);
    assert_eq!(words(&campaign), ["a.csv:1001: the last row is cut off; it was left out"]);
}

#[test]
fn files_of_one_recorder_are_commented_once() {
    let csv = |noise: f64| {
        text("time_s;command;position_mm", |t, c, x| {
            format!("{};{};{}", comma(t, 3), u8::from(c), comma(x + noise * t, 4))
        })
    };
    let two = format!("{RUN}[[run]]\nfile = \"b.csv\"\nsupply_pressure = \"60 psig\"\ntemperature = \"20 degC\"\n");
    let (first, second) = (csv(0.0), csv(0.01));
    let load = |name: &str| Ok(if name == "a.csv" { first.clone() } else { second.clone() }.into_bytes());
    let campaign = Campaign::parse(&two, "c.toml", &VALVE, &load).unwrap();
    assert_eq!(words(&campaign), ["a.csv:2: numbers such as \"0,000\" were read with a decimal comma"]);
}

#[test]
fn stroke_times_go_through_the_same_mapping() {
    let csv =
        "# limit switches\nDruck;Schliesszeit;Oeffnungszeit\nbarg;ms;ms\n5,2;1.080,5;2.190,2\n4,1;1.390,5;1.880,5\n";
    let columns = "close_time = \"Schliesszeit\"\nopen_time = \"Oeffnungszeit\"\nsupply_pressure = \"Druck\"\n";
    let text = format!("name = \"log\"\n[timings]\nfile = \"a.csv\"\n[timings.columns]\n{columns}");
    let campaign = read(&text, csv);
    let row = &campaign.timings[0];
    assert!((row.close_time_s.unwrap() - 1.0805).abs() < 1e-12 && (row.open_time_s.unwrap() - 2.1902).abs() < 1e-12);
    assert!((row.conditions.supply_pressure_pa - 620e3).abs() < 1e-6);
    let plain = read(
        "name = \"log\"\n[timings]\nfile = \"a.csv\"\n",
        "supply_pressure_psig,temperature_degc,close_time_ms,open_time_ms\n75,20,1080.5,2190.2\n",
    );
    assert!((plain.timings[0].close_time_s.unwrap() - 1.0805).abs() < 1e-12);
    let unknown = read_bytes(&text.replace("Druck", "Drukc"), csv.as_bytes()).unwrap_err();
    assert!(unknown.starts_with("a.csv:2: has no column \"Drukc\" (did you mean \"Druck\"?)"), "{unknown}");
}

#[test]
fn a_column_in_percent_goes_by_its_name_and_is_never_taken_for_mm() {
    let csv = text("time_s,command,XV-1203.ZT [%]", |t, c, x| format!("{t:.3},{},{:.5}", u8::from(c), 5.0 * x));
    for name in ["XV-1203.ZT", "XV-1203.ZT [%]"] {
        let scaled = format!("{RUN}[columns]\nposition = {{ name = \"{name}\", unit = \"mm\", scale = 0.2 }}\n");
        holds_the_strokes(&read(&scaled, &csv));
        let refusal = read_bytes(&format!("{RUN}[columns]\nposition = \"{name}\"\n"), csv.as_bytes()).unwrap_err();
        assert!(refusal.starts_with("a.csv:1: column \"XV-1203.ZT [%]\" is in %; expected a length"), "{refusal}");
    }
    // The same in a row of units.
    let below = csv.replacen("time_s,command,XV-1203.ZT [%]\n", "time,command,XV-1203.ZT\ns,-,%\n", 1);
    let refusal = read_bytes(&format!("{RUN}[columns]\nposition = \"XV-1203.ZT\"\n"), below.as_bytes()).unwrap_err();
    assert!(refusal.contains("column \"XV-1203.ZT\" is in %; expected a length"), "{refusal}");
    let scaled = format!("{RUN}[columns]\nposition = {{ name = \"XV-1203.ZT\", unit = \"mm\", scale = 0.2 }}\n");
    holds_the_strokes(&read(&scaled, &below));
}

#[test]
fn each_recording_has_its_own_time_column() {
    let stamps =
        |header: &str| text(header, |t, c, x| format!("2026-03-01T23:59:{:06.3}Z,{},{x:.5}", 10.0 + t, u8::from(c)));
    let plain = text("Time [ms],command,position_mm", |t, c, x| format!("{:.1},{},{x:.5}", t * 1e3, u8::from(c)));
    let files = ["Timestamp", "Time", "Time Stamp (UTC)", "Datum"]
        .map(|time| stamps(&format!("{time},command,position_mm")))
        .into_iter()
        .chain([plain])
        .collect::<Vec<_>>();
    let mut runs = String::new();
    for file in 0..files.len() {
        write!(runs, "[[run]]\nfile = \"{file}\"\nsupply_pressure = \"75 psig\"\ntemperature = \"20 degC\"\n").unwrap();
    }
    let parsed = |columns: &str| {
        let campaign = format!("name = \"bench\"\n{columns}{runs}");
        Campaign::parse(&campaign, "c.toml", &VALVE, &|name| {
            Ok(files[name.parse::<usize>().unwrap()].clone().into_bytes())
        })
    };
    for columns in ["", "[columns]\ntime = \"Timestamp\"\n"] {
        let mut campaign = parsed(columns).unwrap();
        assert_eq!(campaign.runs.len(), 5);
        let taken = words(&campaign).iter().filter(|said| said.contains("names for the time; its")).count();
        assert_eq!(taken, if columns.is_empty() { 0 } else { 4 });
        for _ in 0..5 {
            holds_the_strokes(&campaign);
            campaign.runs.remove(0);
        }
    }
    // A name that none of them has is mistyped.
    let refusal = parsed("[columns]\ntime = \"Timestmp\"\n").unwrap_err().to_string();
    assert!(refusal.starts_with("0:1: has no column \"Timestmp\" (did you mean \"Timestamp\"?)"), "{refusal}");
}

#[test]
fn a_time_in_a_form_that_is_not_read_is_told_which_ones_are() {
    let csv = text("Zeit,command,position_mm", |t, c, x| format!("Nov 17 8h{:.3},{},{x:.4}", t, u8::from(c)));
    let refusal = read_bytes(&format!("{RUN}[columns]\ntime = \"Zeit\"\n"), csv.as_bytes()).unwrap_err();
    assert!(
        refusal.starts_with("a.csv:2: column \"Zeit\": \"Nov 17 8h0.000\" is not a number and no time"),
        "{refusal}"
    );
    assert!(refusal.contains("17.11.2026 08:36:03,120") && refusal.contains("+01:00"), "{refusal}");
    let csv = text("Zeit;command;position_mm", |t, c, x| {
        format!("17.11.2026 08:36:{} +01:00;{};{}", comma(10.0 + t, 3), u8::from(c), comma(x, 4))
    });
    let campaign = read(RUN, &csv);
    holds_the_strokes(&campaign);
    assert!(words(&campaign).iter().any(|said| said.ends_with("read as day.month.year, with its zone")));
}
