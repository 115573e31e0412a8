//! A bounded memory of the past: the last few readings in full and a thinned
//! sample of all since the origin.

use crate::reading::Reading;

/// Readings kept in full.
pub(crate) const RECENT: usize = 8;
/// Readings kept of the whole past, at least half of it filled.
const SAMPLE: usize = 32;

/// A reading and the logarithm of how probable it was before it came.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Recent {
    pub reading: Reading,
    pub ln_predicted: f64,
}

/// What is remembered.
#[derive(Clone, Debug, Default)]
pub(crate) struct History {
    recent: Vec<Recent>,
    sample: Vec<Reading>,
    every: u64,
    seen: u64,
}

impl History {
    /// Remembers one more reading.
    pub(crate) fn push(&mut self, reading: Reading) {
        if self.recent.len() == RECENT {
            self.recent.remove(0);
        }
        self.recent.push(Recent { reading, ln_predicted: 0.0 });
        if self.sample.len() == SAMPLE {
            let mut index = 0;
            self.sample.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.every *= 2;
        }
        if self.seen.is_multiple_of(self.every.max(1)) {
            self.every = self.every.max(1);
            self.sample.push(reading);
        }
        self.seen += 1;
    }

    /// Notes how probable the last reading was before it came.
    pub(crate) fn predicted(&mut self, ln_predicted: f64) {
        if let Some(last) = self.recent.last_mut() {
            last.ln_predicted = ln_predicted;
        }
    }

    /// Number of readings since the origin.
    pub(crate) fn seen(&self) -> u64 {
        self.seen
    }

    /// The last readings, oldest first.
    pub(crate) fn recent(&self) -> &[Recent] {
        &self.recent
    }

    /// A sample of all readings, oldest first, the last few in full.
    pub(crate) fn sample(&self) -> Vec<Reading> {
        let mut all = self.sample.clone();
        let last = all.last().map_or(0, |reading| reading.cycle);
        all.extend(self.recent.iter().map(|r| r.reading).filter(|r| r.cycle > last));
        all
    }

    /// Forgets everything before the last `keep` readings.
    pub(crate) fn restart(&mut self, keep: usize) {
        let kept: Vec<Recent> = self.recent.split_off(self.recent.len().saturating_sub(keep));
        *self = Self::default();
        for entry in kept {
            self.push(entry.reading);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stays_bounded_and_spans_the_past() {
        let mut history = History::default();
        for cycle in 0..10_000 {
            history.push(Reading { cycle, close_time_s: None, open_time_s: None });
            assert!(history.sample().len() <= SAMPLE + RECENT);
            assert!(history.recent().len() <= RECENT);
        }
        let sample = history.sample();
        assert_eq!(sample[0].cycle, 0);
        assert_eq!(sample[sample.len() - 1].cycle, 9_999);
        assert!(sample.windows(2).all(|pair| pair[0].cycle < pair[1].cycle));
        assert!(sample.len() >= SAMPLE / 2);
    }
}
