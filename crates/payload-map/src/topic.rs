//! Where a valve's name stands in topics.

use std::fmt::Write;

use crate::error::PatternError;

/// What stands for a valve's name.
const PLACE: &str = "{valve}";
/// Letters of a name that mean something else in a topic, and the one that stands for them.
const ESCAPED: [char; 4] = ['/', '+', '#', '%'];

/// Topics to subscribe to, with the place of the valve's name if one of their levels is it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicPattern {
    filter: String,
    /// Which level of a topic is the name.
    level: Option<usize>,
}

/// Topics to write to: one a valve.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResultTopic {
    before: String,
    after: String,
}

impl TopicPattern {
    /// Reads a filter with at most one level `{valve}`.
    pub fn parse(text: &str) -> Result<Self, PatternError> {
        let wrong = |problem| PatternError { found: text.to_owned(), problem };
        // The first two levels of a shared subscription are none of its topics.
        let hidden = if text.starts_with("$share/") { 2 } else { 0 };
        let mut level = None;
        let mut filter = Vec::new();
        for (place, part) in text.split('/').enumerate() {
            if part == PLACE {
                if level.is_some() || place < hidden {
                    return Err(wrong(
                        "found {valve} twice or in the name of a group, expected it for one level of the topic",
                    ));
                }
                level = Some(place - hidden);
                filter.push("+");
            } else if part.contains(['{', '}']) {
                return Err(wrong("found a brace, expected {valve} as a whole level between slashes, or none"));
            } else {
                filter.push(part);
            }
        }
        Ok(Self { filter: filter.join("/"), level })
    }

    /// The filter to subscribe with.
    pub fn filter(&self) -> &str {
        &self.filter
    }

    /// Whether topics carry the valve's name.
    pub fn names_valves(&self) -> bool {
        self.level.is_some()
    }

    /// The name in a topic, if the pattern has a place for it.
    pub fn name_in<'a>(&self, topic: &'a str) -> Option<&'a str> {
        topic.split('/').nth(self.level?)
    }
}

impl ResultTopic {
    /// Reads a topic with `{valve}` in it, once.
    pub fn parse(text: &str) -> Result<Self, PatternError> {
        let wrong = |problem| Err(PatternError { found: text.to_owned(), problem });
        let Some((before, after)) = text.split_once(PLACE) else {
            return wrong("found no {valve}, expected it where the valve's name goes, such as plant/{valve}/prognosis");
        };
        let rest = [before, after].concat();
        if rest.contains(['{', '}']) {
            return wrong("found another brace, expected {valve} once and no others");
        }
        if rest.contains(['+', '#']) {
            return wrong("found + or #, expected a topic without them: results go to one topic a valve");
        }
        if rest.contains(char::is_control) || rest.len() > 1 << 12 {
            return wrong("found a control character or more than 4096 bytes, expected a shorter, plain topic");
        }
        if text.starts_with('$') {
            return wrong("found $ at its beginning, expected another letter: such topics are the broker's own");
        }
        Ok(Self { before: before.to_owned(), after: after.to_owned() })
    }

    /// The topic of a valve. Letters that mean something else in a topic stand as in addresses: `/` is `%2F`.
    pub fn of(&self, valve: &str) -> String {
        let mut topic = self.before.clone();
        for letter in valve.chars() {
            if ESCAPED.contains(&letter) || letter.is_control() {
                let mut bytes = [0; 4];
                for byte in letter.encode_utf8(&mut bytes).bytes() {
                    // Writing to memory cannot fail.
                    let _ = write!(topic, "%{byte:02X}");
                }
            } else {
                topic.push(letter);
            }
        }
        topic.push_str(&self.after);
        topic
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_the_name() {
        let pattern = TopicPattern::parse("plant/{valve}/stroke/#").expect("is one");
        assert_eq!((pattern.filter(), pattern.name_in("plant/FV-1/stroke/a")), ("plant/+/stroke/#", Some("FV-1")));
        let shared = TopicPattern::parse("$share/fleet/plant/{valve}").expect("is one");
        assert_eq!((shared.filter(), shared.name_in("plant/FV-1")), ("$share/fleet/plant/+", Some("FV-1")));
        let plain = TopicPattern::parse("plant/strokes").expect("is one");
        assert_eq!((plain.names_valves(), plain.name_in("plant/strokes")), (false, None));
    }

    #[test]
    fn other_braces_are_refused() {
        for text in ["{valve}/{valve}", "a/{tag}", "a/x{valve}", "$share/{valve}/a", "a/}"] {
            assert!(TopicPattern::parse(text).is_err(), "{text}");
        }
        for text in ["a/b", "a/{valve}/#", "{valve}/{valve}", "$SYS/{valve}", "a\n/{valve}"] {
            assert!(ResultTopic::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn every_name_has_a_topic_of_its_own() {
        let topic = ResultTopic::parse("plant/{valve}/prognosis").expect("is one");
        let names = ["FV-1", "FV/1", "FV%2F1", "FV+1", "FV#1", "Ventil ü", "FV\u{7}1"];
        let topics: Vec<String> = names.iter().map(|name| topic.of(name)).collect();
        assert_eq!(topics[..3], ["plant/FV-1/prognosis", "plant/FV%2F1/prognosis", "plant/FV%252F1/prognosis"]);
        for (at, one) in topics.iter().enumerate() {
            assert!(!topics[..at].contains(one) && one.split('/').count() == 3, "{one}");
            assert!(!one.contains(['+', '#']) && !one.contains(char::is_control), "{one}");
        }
    }
}
