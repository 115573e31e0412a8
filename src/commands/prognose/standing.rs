//! A state as people see it: a word, a sign that is told apart without colour, and a colour.

use prognoser::Status;
use report::html::{Cell, Tone};

/// How a state is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Standing {
    word: &'static str,
    /// The same as on the page of `valve watch`.
    sign: char,
    tone: Tone,
}

impl Standing {
    /// That of a state.
    pub const fn of(status: Status) -> Self {
        let (sign, tone) = match status {
            Status::EolReached => ('■', Tone::Bad),
            Status::ActNow => ('▲', Tone::Bad),
            Status::Plan => ('◆', Tone::Caution),
            Status::Watch => ('●', Tone::Note),
            Status::Unknown => ('?', Tone::Faint),
            Status::Healthy => ('✓', Tone::Good),
        };
        Self { word: status.name(), sign, tone }
    }

    /// Sign and word with something between them, in its tone.
    pub fn cell(self, between: &str) -> Cell {
        Cell::toned(format!("{} {between}{}", self.sign, self.word), self.tone)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_state_has_a_sign_of_its_own() {
        let mut signs: Vec<char> = Status::ALL.map(|status| Standing::of(status).sign).into();
        signs.sort_unstable();
        signs.dedup();
        assert_eq!(signs.len(), Status::ALL.len());
    }
}
