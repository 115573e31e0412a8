//! A campaign that is written down comes back the same, in whatever handwriting.

use std::fmt::Write;

use campaign::{Campaign, ValveFacts};
use proptest::prelude::*;

const VALVE: ValveFacts =
    ValveFacts { ambient_pressure_pa: 101_325.0, supply_pressure_pa: 620e3, temperature_k: 293.15, stroke_m: 0.02 };

/// How a recorder writes.
#[expect(clippy::struct_excessive_bools, reason = "each is a habit of its own")]
#[derive(Debug, Clone, Copy)]
struct Hand {
    delimiter: char,
    comma: bool,
    milliseconds: bool,
    inches: bool,
    turned: bool,
    gauge: bool,
    units_row: bool,
    utf_16: bool,
}

fn hands() -> impl Strategy<Value = Hand> {
    (0usize..3, any::<[bool; 7]>()).prop_map(
        |(delimiter, [comma, milliseconds, inches, turned, gauge, units_row, utf_16])| {
            let delimiter = [',', ';', '\t'][delimiter];
            Hand { delimiter, comma: comma && delimiter != ',', milliseconds, inches, turned, gauge, units_row, utf_16 }
        },
    )
}

/// Time in ms, command, position in um from the closed stop, chamber pressure in Pa absolute.
fn rows(dead_ms: u32, close_ms: u32, wobble: u32) -> Vec<(u32, bool, u32, u32)> {
    let position = |time_ms: u32| {
        let closed = f64::from(time_ms.saturating_sub(200 + dead_ms)) / f64::from(close_ms);
        let opened = f64::from(time_ms.saturating_sub(1200 + dead_ms)) / f64::from(close_ms);
        20_000.0 * (1.0 - closed.min(1.0) + opened.min(1.0))
    };
    (0..1000)
        .map(|row| {
            let time_ms = 2 * row;
            let close = (200..1200).contains(&time_ms);
            let noise = f64::from(row * wobble % 40);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "micrometres of a stroke")]
            let position_um = (position(time_ms) + noise) as u32;
            (time_ms, close, position_um, if close { 600_000 } else { 101_000 } + row % 300)
        })
        .collect()
}

fn written(rows: &[(u32, bool, u32, u32)], hand: Hand) -> Vec<u8> {
    let Hand { delimiter, .. } = hand;
    let number = |value: f64, digits: usize| {
        let text = format!("{value:.digits$}");
        if hand.comma { text.replace('.', ",") } else { text }
    };
    let (time, length, pressure) = (
        if hand.milliseconds { "ms" } else { "s" },
        if hand.inches { "in" } else { "mm" },
        if hand.gauge { "barg" } else { "kPa" },
    );
    let mut text = if hand.units_row {
        format!(
            "Zeit{delimiter}Y1{delimiter}Weg{delimiter}p Kammer\n{time}{delimiter}-{delimiter}{length}{delimiter}{pressure}\n"
        )
    } else {
        format!("Zeit [{time}]{delimiter}Y1{delimiter}Weg ({length}){delimiter}p Kammer [{pressure}]\n")
    };
    for &(time_ms, close, position_um, pressure_pa) in rows {
        let time = f64::from(time_ms) * if hand.milliseconds { 1.0 } else { 1e-3 };
        let position_um = if hand.turned { 25_400.0 - f64::from(position_um) } else { f64::from(position_um) };
        let position = position_um * if hand.inches { 1e-3 / 25.4 } else { 1e-3 };
        let pressure = f64::from(pressure_pa);
        let pressure = if hand.gauge { (pressure - 101_325.0) / 1e5 } else { pressure / 1e3 };
        let cells = [number(time, 3), u8::from(close).to_string(), number(position, 7), number(pressure, 7)];
        writeln!(text, "{}", cells.join(&delimiter.to_string())).unwrap();
    }
    if hand.utf_16 {
        format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_le_bytes).collect()
    } else {
        text.into_bytes()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn a_campaign_comes_back_as_it_was(
        hand in hands(),
        dead_ms in 0u32..300,
        close_ms in 60u32..600,
        wobble in 1u32..40,
        supply in 3_000u32..9_000,
        temperature in -200i32..600,
        leak in 0u32..500,
    ) {
        let rows = rows(dead_ms, close_ms, wobble);
        let bytes = written(&rows, hand);
        let turned = if hand.turned { ", scale = -1.0, offset = \"25.4 mm\"" } else { "" };
        let text = format!(
            "name = \"c\"\n[columns]\ntime = \"Zeit\"\ncommand = \"Y1\"\nposition = {{ name = \"Weg\"{turned} }}\n\
             chamber_pressure = \"p Kammer\"\n[[run]]\nfile = \"a.csv\"\nsupply_pressure = \"{} barg\"\n\
             temperature = \"{} degC\"\nleak_to_atmosphere = \"{} mm2\"\n",
            f64::from(supply) / 1e3, f64::from(temperature) / 10.0, f64::from(leak) / 1e3,
        );
        let campaign = Campaign::parse(&text, "c.toml", &VALVE, &|_| Ok(bytes.clone())).map_err(|error| TestCaseError::fail(error.to_string()))?;
        let run = &campaign.runs[0];
        prop_assert!((run.conditions.supply_pressure_pa - (101_325.0 + 100.0 * f64::from(supply))).abs() < 1e-6);
        prop_assert!((run.conditions.temperature_k - 273.15 - f64::from(temperature) / 10.0).abs() < 1e-9);
        prop_assert!((run.conditions.leak_to_atmosphere_m2 - f64::from(leak) * 1e-9).abs() < 1e-18);
        prop_assert_eq!(run.trace.time_s.len(), rows.len());
        prop_assert_eq!(&run.trace.outliers, &[]);
        let chamber = run.trace.chamber_pressure_pa.as_ref().unwrap();
        for (index, &(time_ms, close, position_um, pressure_pa)) in rows.iter().enumerate() {
            prop_assert!((run.trace.time_s[index] - f64::from(time_ms) * 1e-3).abs() < 1e-9);
            prop_assert_eq!(run.trace.command_close[index], close);
            prop_assert!((run.trace.position_m[index] - f64::from(position_um) * 1e-6).abs() < 1e-8);
            prop_assert!((chamber[index] - f64::from(pressure_pa)).abs() < 0.1);
        }
    }
}
