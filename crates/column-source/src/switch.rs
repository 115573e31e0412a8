//! Commands that recorders write as words.

/// What stands for a coil with current, for a condition that holds.
const HIGH: [&str; 15] = [
    "on",
    "true",
    "yes",
    "high",
    "active",
    "energised",
    "energized",
    "ein",
    "an",
    "wahr",
    "ja",
    "bestromt",
    "oui",
    "vrai",
    "marche",
];
/// What stands for the contrary.
const LOW: [&str; 16] = [
    "off",
    "false",
    "no",
    "low",
    "inactive",
    "de-energised",
    "de-energized",
    "deenergized",
    "aus",
    "falsch",
    "nein",
    "stromlos",
    "non",
    "faux",
    "arret",
    "arrêt",
];
/// What tells a valve to close.
const CLOSE: [&str; 9] =
    ["close", "closed", "zu", "geschlossen", "schließen", "schliessen", "fermer", "ferme", "fermé"];
/// What tells it to open.
const OPEN: [&str; 8] = ["open", "opened", "auf", "offen", "öffnen", "oeffnen", "ouvrir", "ouvert"];

/// A command that a field tells in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Switch {
    /// Whether it is the one of two words that stands for 1: of ON and OFF the first, of CLOSE and OPEN the first.
    pub is_one: bool,
    /// Whether the word names the direction itself.
    pub is_direction: bool,
}

impl Switch {
    /// What a field says; nothing for a field that is no such word.
    #[must_use]
    pub fn parse(field: &str) -> Option<Self> {
        let word = field.trim().to_lowercase();
        let lists: [(&[&str], bool, bool); 4] =
            [(&HIGH, true, false), (&LOW, false, false), (&CLOSE, true, true), (&OPEN, false, true)];
        let found = lists.into_iter().find(|(words, ..)| words.contains(&word.as_str()));
        found.map(|(_, is_one, is_direction)| Self { is_one, is_direction })
    }

    /// As the number that a recorder would write in its place.
    #[must_use]
    pub fn number(self) -> f64 {
        f64::from(u8::from(self.is_one))
    }
}

#[cfg(test)]
mod tests {
    use super::Switch;

    #[test]
    fn words_of_recorders_are_a_command() {
        for (one, other, is_direction) in [
            ("ON", "OFF", false),
            ("True", "False", false),
            (" Ein ", "Aus", false),
            ("CLOSE", "OPEN", true),
            ("ZU", "AUF", true),
        ] {
            let [one, other] = [one, other].map(|word| Switch::parse(word).unwrap());
            assert_eq!([one.number(), other.number()], [1.0, 0.0]);
            assert_eq!([one.is_direction, other.is_direction], [is_direction; 2]);
        }
        for text in ["", "1", "Bad Input", "onset", "12.5"] {
            assert_eq!(Switch::parse(text), None, "{text}");
        }
    }
}
