//! Names of valves that differ in nothing but capital letters and spaces.

use std::collections::{HashMap, HashSet};

/// So many are told one by one.
const TOLD: usize = 12;

/// The names of a log so far.
#[derive(Debug, Default)]
pub struct SameNames {
    seen: HashSet<String>,
    /// The first name of each that is the same but for case and spaces.
    alike: HashMap<String, String>,
    doubted: usize,
}

impl SameNames {
    /// Takes in the name of a row; what is to be asked about it, once.
    pub fn meet(&mut self, valve: &str) -> Option<String> {
        if self.seen.contains(valve) {
            return None;
        }
        self.seen.insert(valve.to_owned());
        let first = self.alike.entry(folded(valve)).or_insert_with(|| valve.to_owned());
        if first == valve {
            return None;
        }
        self.doubted += 1;
        (self.doubted <= TOLD).then(|| {
            format!(
                "{first:?} and {valve:?}: the same valve? Their names differ in nothing but capital letters or spaces, and each \
                 is followed by itself; write it one way"
            )
        })
    }

    /// How many more there were that were not told.
    pub fn untold(&self) -> Option<String> {
        let more = self.doubted.saturating_sub(TOLD);
        (more > 0).then(|| format!("{more} more names differ from others in nothing but capital letters or spaces"))
    }
}

/// A name without spaces, of any kind, in small letters.
fn folded(valve: &str) -> String {
    valve.chars().filter(|letter| !letter.is_whitespace()).flat_map(char::to_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use super::SameNames;

    #[test]
    fn names_that_look_alike_are_asked_about_once() {
        let mut names = SameNames::default();
        let told: Vec<bool> = ["FV-101", "FV-102", "fv-101", "FV-101", "fv-101", "FV -\u{a0}101", "FV-1 01x"]
            .map(|valve| names.meet(valve).is_some())
            .into();
        assert_eq!(told, [false, false, true, false, false, true, false]);
        assert_eq!(names.untold(), None);
    }
}
