//! A broker's message: pattern, topic, map and payload, parted by lines of three dashes.

use payload_map::{PayloadMap, ResultTopic, TopicPattern};

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    let mut parts = bytes.splitn(4, |byte| *byte == b'\n').map(String::from_utf8_lossy);
    let mut next = || parts.next().unwrap_or_default();
    let (pattern, topic, results) = (next(), next(), next());
    let rest = next();
    let (map, payload) = rest.split_once("\n---\n").unwrap_or(("", &rest));
    let name = match TopicPattern::parse(&pattern) {
        Ok(pattern) => {
            assert!(!pattern.filter().contains("{valve}"));
            pattern.name_in(&topic).map(str::to_owned)
        }
        Err(_) => None,
    };
    let _ = broker_link::TopicFilter::parse(&pattern);
    let _ = broker_link::BrokerAddress::parse(&topic);
    let map = if map.is_empty() { Ok(PayloadMap::plain()) } else { PayloadMap::parse(map, "map.toml") };
    let Ok(map) = map else { return };
    match map.row(name.as_deref(), payload.as_bytes(), false) {
        Ok(row) => {
            assert!(!row.valve.is_empty() && !row.valve.contains(char::is_control));
            let times = [row.reading.close_time_s, row.reading.open_time_s];
            assert!(times.into_iter().flatten().all(|time_s| (0.0..=86_400.0).contains(&time_s)), "{row:?}");
            let conditions = [row.reading.supply_pressure_pa, row.reading.temperature_k];
            assert!(conditions.into_iter().flatten().all(|value| value.is_finite() && value > 0.0), "{row:?}");
            assert!(row.reading.cycle <= 1 << 53);
            if let Ok(topic) = ResultTopic::parse(&results) {
                assert!(!topic.of(&row.valve).contains(['+', '#', '\0']));
            }
        }
        Err(error) => {
            let told = error.to_string();
            assert!(!told.contains(|letter: char| letter.is_control()), "{told:?}");
            assert!(told.len() < 4096, "{told}");
        }
    }
}
