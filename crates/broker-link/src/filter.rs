//! Topic filters: which messages a subscription is of (MQTT 5.0, sections 4.7 and 4.8).

use crate::error::FilterError;

/// Longest topic or filter, bytes: its length has two bytes.
const LONGEST: usize = 65_535;
/// What a shared subscription begins with.
const SHARED: &str = "$share/";

/// A filter that was checked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicFilter {
    text: String,
}

impl TopicFilter {
    /// Checks a filter, that of a shared subscription included.
    pub fn parse(text: &str) -> Result<Self, FilterError> {
        let refused = |problem| Err(FilterError { found: text.to_owned(), problem });
        let topic = match text.strip_prefix(SHARED) {
            None => text,
            Some(rest) => match rest.split_once('/') {
                Some((group, topic)) if !group.is_empty() && !group.contains(['+', '#']) => topic,
                _ => return refused("found no group, expected $share/GROUP/TOPIC"),
            },
        };
        if topic.is_empty() {
            return refused("found nothing, expected a topic, such as plant/+/stroke");
        }
        if text.len() > LONGEST {
            return refused("found more than 65535 bytes, expected a shorter one");
        }
        if text.contains(char::is_control) {
            return refused("found a control character, expected none");
        }
        let levels: Vec<&str> = topic.split('/').collect();
        for (place, level) in levels.iter().enumerate() {
            if level.contains('#') && (*level != "#" || place + 1 < levels.len()) {
                return refused("found # elsewhere than as the last level, expected it there, such as plant/#");
            }
            if level.contains('+') && *level != "+" {
                return refused(
                    "found + beside other letters, expected it alone between slashes, such as plant/+/stroke",
                );
            }
        }
        Ok(Self { text: text.to_owned() })
    }

    /// The filter as a broker gets it.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// Whether several clients share what it matches.
    pub fn is_shared(&self) -> bool {
        self.text.starts_with(SHARED)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_what_a_broker_takes() {
        for text in ["plant", "plant/+/stroke", "+", "#", "plant/#", "/a//b", "$share/fleet/plant/+"] {
            assert_eq!(TopicFilter::parse(text).expect(text).as_str(), text);
        }
        assert!(TopicFilter::parse("$share/fleet/#").expect("is one").is_shared());
    }

    #[test]
    fn refuses_what_a_broker_would_end_the_connection_for() {
        for text in ["", "a/#/b", "a#", "a+/b", "$share/fleet", "$share//a", "$share/a+/b", "$share/a/", "a\u{0}"] {
            let error = TopicFilter::parse(text).expect_err(text).to_string();
            assert!(error.contains("expected"), "{error}");
        }
        assert!(TopicFilter::parse(&"a".repeat(LONGEST + 1)).is_err());
    }
}
