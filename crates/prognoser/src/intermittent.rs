//! Faults that come and go: times that leave what is known of a valve and return to it, again and again. Each time by itself looks
//! like a reading of no use, or like a step and a repair, and between them the valve is healthy.

use serde::{Deserialize, Serialize};

use crate::bayes::Change;

/// Share of the rows of a sound valve that are off in every stroke, or after which it seems to be repaired: a row that was mistyped or
/// is another valve's, and a repair now and then.
const USUALLY_OFF: f64 = 0.01;
/// The same of a valve whose fault comes and goes.
const OFF: f64 = 0.15;
/// Nats for the latter from which on it is told: three such rows close to each other.
const TOLD_FROM: f64 = 7.0;
/// Nats that are remembered at most, so that a hundred sound rows are an end of it.
const REMEMBERED: f64 = 22.0;

/// How often the times of a valve were off and came back: a sequential test (Wald) that begins anew wherever it speaks against it
/// (Page's CUSUM).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Intermittent {
    /// Nats for a fault that comes and goes; nothing is known where there are none.
    nats: f32,
    /// How often times were off and came back, and in which cycle first.
    times: u32,
    since: u64,
    /// How far the times were on the way from healthy ones to a limit, at worst: whenever they were off, and since the valve was
    /// last healthy.
    worst: f32,
    latest: f32,
    /// Whether a step has not gone again yet.
    has_stepped: bool,
}

/// What a row seems to be.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seen {
    /// Off in every stroke that it tells.
    pub is_off: bool,
    /// What changes in it.
    pub change: Option<Change>,
    /// Nothing wears.
    pub is_healthy: bool,
    /// How far its times are on the way from healthy ones to a limit.
    pub way: f64,
}

impl Intermittent {
    /// Takes in a row; in words what to say of the fault, if it comes and goes.
    pub(crate) fn take(&mut self, cycle: u64, seen: &Seen) -> Option<String> {
        // A step that is none any more went as it came, which are two things that no sound valve does.
        let is_repaired = seen.change == Some(Change::Repaired);
        let returns = self.has_stepped && (is_repaired || seen.is_healthy);
        let is_off = seen.is_off || is_repaired || returns;
        let count = if returns { 2.0 } else { 1.0 };
        self.has_stepped = (self.has_stepped || seen.change == Some(Change::Stepped)) && !is_off;
        #[expect(clippy::cast_possible_truncation, reason = "a share that nobody needs closely")]
        let way = seen.way as f32;
        self.latest = self.latest.max(way);
        let nats = if is_off { count * (OFF / USUALLY_OFF).ln() } else { ((1.0 - OFF) / (1.0 - USUALLY_OFF)).ln() };
        let nats = (f64::from(self.nats) + nats).min(REMEMBERED);
        if nats <= 0.0 {
            *self = Self { has_stepped: self.has_stepped, latest: self.latest, ..Self::default() };
        }
        if is_off {
            self.since = if self.times == 0 { cycle } else { self.since };
            self.times += 1;
            self.worst = self.worst.max(self.latest);
        }
        if seen.is_healthy {
            self.latest = 0.0;
        }
        #[expect(clippy::cast_possible_truncation, reason = "a number of nats")]
        let kept = nats.max(0.0) as f32;
        self.nats = kept;
        (nats >= TOLD_FROM).then(|| {
            format!(
                "comes and goes: {} times since cycle {}, up to {:.0} % of the way to a limit",
                self.times,
                self.since,
                100.0 * self.worst
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(is_off: bool) -> Seen {
        Seen { is_off, is_healthy: true, way: if is_off { 0.3 } else { 0.0 }, ..Seen::default() }
    }

    #[test]
    fn it_is_told_after_some_rows_and_forgotten_after_many() {
        let mut one = Intermittent::default();
        // Now and then a row is mistyped.
        assert!((0..1000).all(|cycle| one.take(cycle, &row(cycle % 60 == 7)).is_none()));
        let mut one = Intermittent::default();
        let told: Vec<u64> = (0..40).filter(|cycle| one.take(*cycle, &row(cycle % 6 == 0)).is_some()).collect();
        assert!((18..=30).contains(&told[0]), "{told:?}");
        let forgotten = (40..400).find(|cycle| one.take(*cycle, &row(false)).is_none()).expect("forgotten");
        assert!((45..160).contains(&forgotten), "{forgotten}");
    }

    #[test]
    fn bursts_that_end_are_told_and_steps_that_stay_are_not() {
        let burst = |cycle: u64| cycle % 14 >= 7;
        let of = |cycle: u64| Seen {
            change: match cycle % 14 {
                7 => Some(Change::Stepped),
                0 if cycle > 0 => Some(Change::Repaired),
                _ => None,
            },
            is_healthy: !burst(cycle),
            way: if burst(cycle) { 0.6 } else { 0.02 },
            is_off: false,
        };
        let mut one = Intermittent::default();
        let told: Vec<String> = (0..60).filter_map(|cycle| one.take(cycle, &of(cycle))).collect();
        assert!(told[0].ends_with("up to 60 % of the way to a limit"), "{told:?}");
        let mut one = Intermittent::default();
        let growing = |cycle: u64| Seen {
            change: cycle.is_multiple_of(5).then_some(Change::Stepped),
            way: 0.01 * cycle as f64,
            ..Seen::default()
        };
        assert!((0..60).all(|cycle| one.take(cycle, &growing(cycle)).is_none()));
    }
}
