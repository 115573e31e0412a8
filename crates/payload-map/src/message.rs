//! A message to a reading.

use prognoser::{ConditionColumn, LogErrorKind, Reading, fields};
use serde_json::Value;

use crate::error::PayloadError;
use crate::field::{CONDITION, Field, In, Object, kind, number_of};
use crate::map::PayloadMap;

/// A row as a message has it.
#[derive(Debug, Clone, PartialEq)]
pub struct MappedRow {
    /// The valve's name.
    pub valve: String,
    /// Its cycle and times.
    pub reading: Reading,
    /// When it was, RFC 3339.
    pub time: Option<String>,
}

impl PayloadMap {
    /// Reads a message. `name` is the valve's, where its topic tells it; `empty_is_stalled` takes a time that is null for a
    /// stroke that did not arrive.
    pub fn row(&self, name: Option<&str>, payload: &[u8], empty_is_stalled: bool) -> Result<MappedRow, PayloadError> {
        let value: Value =
            serde_json::from_slice(payload).map_err(|error| PayloadError::NotJson { reason: error.to_string() })?;
        let Value::Object(object) = value else { return Err(PayloadError::NotObject { found: kind(&value) }) };
        let valve = match (name, &self.valve) {
            (Some(name), _) => name.to_owned(),
            (None, Some(field)) => field.label(&object, "the name of a valve")?,
            (None, None) => return Err(PayloadError::NoName),
        };
        fields::valve(&valve)?;
        let [_, _, close_column, open_column] = fields::COLUMNS;
        let close = self.close.stroke(&object, close_column, empty_is_stalled)?;
        let open = self.open.stroke(&object, open_column, empty_is_stalled)?;
        let [supply_pressure_pa, temperature_k] = match &self.conditions {
            None => conditions_by_name(&object)?,
            Some([supply, temperature]) => [
                supply.as_ref().map(|field| field.condition(&object)).transpose()?.flatten(),
                temperature.as_ref().map(|field| field.condition(&object)).transpose()?.flatten(),
            ],
        };
        let reading = Reading {
            cycle: self.cycle.cycle(&object)?,
            close_time_s: close.time_s,
            open_time_s: open.time_s,
            stalled: [close.stalled, open.stalled],
            supply_pressure_pa,
            temperature_k,
        };
        let time = self.time.as_ref().map(|field| field.time(&object)).transpose()?.flatten();
        Ok(MappedRow { valve, reading, time })
    }
}

/// Pressure and temperature under the names of a log's columns.
fn conditions_by_name(object: &Object) -> Result<[Option<f64>; 2], PayloadError> {
    let mut found = [None, None];
    let mut there = [false, false];
    for (name, value) in object {
        let Some(column) = ConditionColumn::named(name) else { continue };
        let place = usize::from(!column.is_pressure());
        if std::mem::replace(&mut there[place], true) {
            return Err(LogErrorKind::RepeatedColumn { column: column.quantity() }.into());
        }
        found[place] = match value {
            Value::Null => None,
            value => {
                let field = Field::named(name, In::Si);
                column.of_number(number_of(value).ok_or_else(|| field.wrong(value, CONDITION))?)?
            }
        };
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(payload: &str) -> Result<MappedRow, String> {
        PayloadMap::plain().row(None, payload.as_bytes(), false).map_err(|error| error.to_string())
    }

    #[test]
    fn a_payload_may_look_like_a_row_of_a_log() {
        let row = plain(
            r#"{"valve": "FV-101", "cycle": 7, "close_time_s": 2.25, "open_time_s": null,
                "time": "2026-01-31T06:00:00Z", "supply_pressure_kpa": 500, "temperature_degc": "20", "shift": "B"}"#,
        )
        .expect("is a reading");
        let reading = Reading {
            cycle: 7,
            close_time_s: Some(2.25),
            supply_pressure_pa: Some(500e3),
            temperature_k: Some(293.15),
            ..Reading::default()
        };
        assert_eq!((row.valve.as_str(), row.reading), ("FV-101", reading));
        assert_eq!(row.time.as_deref(), Some("2026-01-31T06:00:00Z"));
    }

    #[test]
    fn a_map_names_fields_and_units() {
        let map = PayloadMap::parse(
            "valve = \"/asset/tag\"\ncycle = \"n\"\nclose_time = { field = \"/t/close\", unit = \"ms\" }\n\
             open_time = { field = \"/t/0~1\", unit = \"min\" }\nsupply_pressure = { field = \"p\", unit = \"barg\" }\n\
             temperature = { field = \"T\", unit = \"degF\" }\n",
            "map.toml",
        )
        .expect("is a map");
        let payload = br#"{"asset": {"tag": 12}, "n": "8", "t": {"close": 2250, "0/": "stalled"}, "p": 4, "T": 68}"#;
        let row = map.row(None, payload, false).expect("is a reading");
        assert_eq!((row.valve.as_str(), row.reading.cycle, row.reading.stalled), ("12", 8, [false, true]));
        assert_eq!(row.reading.close_time_s, Some(2.25));
        assert_eq!(row.reading.supply_pressure_pa, Some(501_325.0));
        assert!(row.reading.temperature_k.is_some_and(|kelvin| (kelvin - 293.15).abs() < 1e-9));
        // The topic's name comes first.
        assert_eq!(map.row(Some("FV-1"), payload, false).expect("is a reading").valve, "FV-1");
    }

    #[test]
    fn what_is_wrong_with_a_payload_is_told() {
        let with =
            |more: &str| plain(&format!(r#"{{"valve": "A", "cycle": 1, "close_time_s": 1, "open_time_s": 2{more}}}"#));
        assert!(with("").is_ok());
        for (payload, expected) in [
            ("not json", "found a payload that is not JSON"),
            ("[1]", "found a list as payload, expected an object"),
            (
                r#"{"valve": "A", "cycle": 1, "close_time_s": 1}"#,
                "found no field \"open_time_s\" in the payload, expected a time from 0 to 86400 s, null",
            ),
            (r#"{"cycle": 1, "close_time_s": 1, "open_time_s": 2}"#, "found no field \"valve\""),
            (
                r#"{"valve": true, "cycle": 1, "close_time_s": 1, "open_time_s": 2}"#,
                "valve: found true or false, expected the name of a valve",
            ),
            (
                r#"{"valve": "A", "cycle": 9007199254740993, "close_time_s": 1, "open_time_s": 2}"#,
                "cycle: found \"9007199254740993\"",
            ),
            (r#"{"valve": "A", "cycle": 1.5, "close_time_s": 1, "open_time_s": 2}"#, "cycle: found \"1.5\""),
            (
                r#"{"valve": "A", "cycle": 1, "close_time_s": -1, "open_time_s": 2}"#,
                "close_time_s: found -1, expected a time",
            ),
            (r#"{"valve": "A", "cycle": 1, "close_time_s": 1, "open_time_s": "fast"}"#, "open_time_s: found \"fast\""),
            (r#"{"valve": "A", "cycle": 1, "close_time_s": 1, "open_time_s": {}}"#, "open_time_s: found an object"),
            (r#"{"valve": "A\u0007", "cycle": 1, "close_time_s": 1, "open_time_s": 2}"#, "without control characters"),
        ] {
            let error = plain(payload).expect_err(payload);
            assert!(error.contains(expected), "{error}");
        }
        for (more, expected) in [
            (r#", "supply_pressure_psig": 75, "supply_pressure_kpa": 600"#, "\"supply_pressure_UNIT\" twice"),
            (r#", "temperature_k": -1"#, "temperature_k: found \"-1\""),
            (r#", "temperature_k": [1]"#, "temperature_k: found a list"),
            (r#", "time": 1700000000"#, "time: found 1700000000, expected a time of RFC 3339"),
        ] {
            let error = with(more).expect_err(more);
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn what_is_wrong_with_a_map_is_told_with_its_line() {
        let times = "cycle = \"n\"\nclose_time = { field = \"c\", unit = \"s\" }\nopen_time = { field = \"o\", unit = \"s\" }\n";
        for (text, expected) in [
            (String::from("cycle = \"n\"\n"), "map.toml:1: \"close_time\" is missing"),
            (format!("{times}pressure = \"p\"\n"), "map.toml:4: unknown key \"pressure\""),
            (times.replacen("\"s\"", "\"mm\"", 1), "map.toml:2: close_time.unit is \"mm\"; expected a time"),
            (times.replacen("\"c\"", "\"\"", 1), "map.toml:2: close_time.field is \"\""),
            (format!("{times}supply_pressure = {{ field = \"p\", unit = \"bar\" }}\n"), "\"barg\" (gauge) or \"bara\""),
        ] {
            let error = PayloadMap::parse(&text, "map.toml").expect_err(&text).to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
