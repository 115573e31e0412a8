//! Messages that are in the states already.

use std::collections::{HashSet, VecDeque};

/// What a message is known by.
pub type Fingerprint = [u8; 16];

/// Messages that are remembered: as many as a broker can ever have sent without an acknowledgement (MQTT 5.0, 3.1.2.11.3).
pub(crate) const MOST: usize = 65_535;

/// The last messages that were taken, to know those that come again.
#[derive(Debug, Default)]
pub struct Taken {
    order: VecDeque<Fingerprint>,
    all: HashSet<Fingerprint>,
}

impl Taken {
    /// Adds a message; whether it is new.
    pub fn add(&mut self, fingerprint: Fingerprint) -> bool {
        if !self.all.insert(fingerprint) {
            return false;
        }
        self.order.push_back(fingerprint);
        if self.order.len() > MOST
            && let Some(oldest) = self.order.pop_front()
        {
            self.all.remove(&oldest);
        }
        true
    }

    /// Whether no message was taken yet.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_ones_are_known_and_the_oldest_let_go() {
        let of = |number: usize| (number as u128).to_le_bytes();
        let mut taken = Taken::default();
        assert!((0..=MOST).all(|number| taken.add(of(number))));
        assert!(!taken.add(of(1)) && !taken.add(of(MOST)), "are among the last");
        assert!(taken.add(of(0)), "was let go");
        assert_eq!((taken.order.len(), taken.all.len()), (MOST, MOST));
    }
}
