//! Times that repeat exactly, row after row: a recorder whose source is gone goes on with its last value, and no wear rests so.
//!
//! How likely a repeat is depends on how finely times are recorded and on how much they wander, and both are taken from the valve's
//! own rows. Times that are recorded more coarsely than they wander repeat by themselves, and are never doubted.

use std::f64::consts::PI;

use leak_table::Stroke;
use serde::{Deserialize, Serialize};

use crate::reading::Reading;

/// Bends of the path of a time that are remembered, from whose median its wander is told: so many that one outlier, which bends it
/// three times, does not move it.
const BENDS: usize = 8;
/// A bend is the second difference of a time: in standard deviations of independent noise its median is 0.6745 times the root of 6.
const MEDIAN_BEND: f64 = 1.652;
/// Steps of the record that times must wander by, one standard deviation, for repeats to say anything: a time that goes to and fro
/// between two steps bends by two, as if it wandered by 1.2.
const WANDERS: f64 = 1.5;
/// Times that differ by less than this are the same, s: no log has so many digits, and units are converted.
const SAME_S: f64 = 1e-9;
/// Probability of a run of repeats below which its rows are no new readings.
const UNLIKELY: f64 = 1e-2;
/// The same below which they are said to be none: once in a million runs.
const DOUBTED: f64 = 1e-6;

/// How a stroke's times have moved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Path {
    /// The last two times, s, the later one first.
    last_s: [Option<f64>; 2],
    /// Smallest first or second difference that was seen: at least the step in which times are recorded, s.
    step_s: f32,
    /// The last bends, s, and how many there were, up to all.
    bends_s: [f32; BENDS],
    count: u8,
    next: u8,
}

impl Default for Path {
    fn default() -> Self {
        Self { last_s: [None; 2], step_s: f32::INFINITY, bends_s: [0.0; BENDS], count: 0, next: 0 }
    }
}

impl Path {
    #[expect(clippy::cast_possible_truncation, reason = "single precision is meant, and a small number")]
    fn add(&mut self, time_s: f64) {
        if let Some(last_s) = self.last_s[0] {
            self.meets((time_s - last_s).abs());
            if let Some(before_s) = self.last_s[1] {
                let bend_s = (time_s - 2.0 * last_s + before_s).abs();
                self.meets(bend_s);
                self.bends_s[usize::from(self.next)] = bend_s as f32;
                self.next = (self.next + 1) % BENDS as u8;
                self.count = (self.count + 1).min(BENDS as u8);
            }
        }
        self.last_s = [Some(time_s), self.last_s[0]];
    }

    #[expect(clippy::cast_possible_truncation, reason = "single precision is meant")]
    fn meets(&mut self, difference_s: f64) {
        if difference_s > SAME_S {
            self.step_s = self.step_s.min(difference_s as f32);
        }
    }

    /// Probability that the next time is the same: of a Gaussian difference about nothing, the step over its width. 1 where too
    /// little is known, or where times hardly wander by the step.
    fn chance(&self) -> f64 {
        if usize::from(self.count) < BENDS {
            return 1.0;
        }
        let mut bends_s = self.bends_s;
        bends_s.sort_unstable_by(f32::total_cmp);
        let median_s = 0.5 * f64::from(bends_s[BENDS / 2 - 1] + bends_s[BENDS / 2]);
        let (wander_s, step_s) = (median_s / MEDIAN_BEND, f64::from(self.step_s));
        if wander_s > WANDERS * step_s { step_s / (2.0 * PI.sqrt() * wander_s) } else { 1.0 }
    }
}

/// The rows of a valve that repeat the one before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Repeats {
    paths: [Path; 2],
    /// Rows in succession so far, and the cycle of the first.
    rows: u64,
    since: u64,
    /// How likely one more was when they began, as a logarithm.
    ln_chance: f32,
}

/// A row that repeats the one before too often to be a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Repeated {
    /// So many rows do so far.
    pub rows: u64,
    /// The cycle of the first.
    pub since: u64,
    /// Whether so many are worth a word.
    pub is_doubted: bool,
}

impl Repeats {
    /// Takes in the times of a row; what it is if it is no reading.
    pub(crate) fn take(&mut self, reading: &Reading) -> Option<Repeated> {
        let times = Stroke::ALL.map(|stroke| reading.time_s(stroke));
        let stalled = reading.stalled.contains(&true);
        if times == [None; 2] && !stalled {
            return None;
        }
        let is_same = |(time, path): (&Option<f64>, &Path)| match (time, path.last_s[0]) {
            (Some(time), Some(last)) => (time - last).abs() < SAME_S,
            (time, _) => time.is_none(),
        };
        if !stalled && times.iter().zip(&self.paths).all(is_same) {
            return self.repeated(reading.cycle, times);
        }
        // What the times did while nobody measured them is not known.
        if self.is_unlikely() {
            self.paths.iter_mut().for_each(|path| path.last_s = [None; 2]);
        }
        self.rows = 0;
        self.add(times);
        None
    }

    fn repeated(&mut self, cycle: u64, times: [Option<f64>; 2]) -> Option<Repeated> {
        if self.rows == 0 {
            // What moves both times moves them together: the one that tells more, and not the product.
            let told = times.iter().zip(&self.paths).filter(|(time, _)| time.is_some());
            let chance = told.map(|(_, path)| path.chance()).fold(1.0, f64::min);
            #[expect(clippy::cast_possible_truncation, reason = "single precision is meant")]
            let ln_chance = chance.ln() as f32;
            (self.since, self.ln_chance) = (cycle, ln_chance);
        }
        self.rows += 1;
        if !self.is_unlikely() {
            self.add(times);
            return None;
        }
        Some(Repeated { rows: self.rows, since: self.since, is_doubted: self.ln_of_run() < DOUBTED.ln() })
    }

    fn ln_of_run(&self) -> f64 {
        self.rows as f64 * f64::from(self.ln_chance)
    }

    fn is_unlikely(&self) -> bool {
        self.rows > 0 && self.ln_of_run() < UNLIKELY.ln()
    }

    fn add(&mut self, times: [Option<f64>; 2]) {
        for (path, time) in self.paths.iter_mut().zip(times) {
            if let Some(time) = time {
                path.add(time);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::NoiseSource;

    /// The row at which repeats are first named and how many were left out by then, of so many rows whose times wander by `sd_s`, are
    /// recorded in steps of `step_s`, grow by `growth_s` a row, and are stuck from a row on.
    fn named(rows: u64, sd_s: f64, step_s: f64, growth_s: f64, stuck_from: u64) -> (Option<u64>, u64) {
        let (mut noise, mut repeats) = (NoiseSource::new(7, 0), Repeats::default());
        let (mut named, mut left_out, mut last) = (None, 0, Reading::default());
        for cycle in 0..rows {
            let mut time = |healthy: f64| {
                let time = healthy + growth_s * cycle as f64 + sd_s * noise.normal();
                Some((time / step_s).round() * step_s)
            };
            let fresh = Reading { cycle, close_time_s: time(1.0), open_time_s: time(2.0), ..Reading::default() };
            last = if cycle < stuck_from { fresh } else { Reading { cycle, ..last } };
            if let Some(repeated) = repeats.take(&last) {
                left_out += 1;
                if repeated.is_doubted {
                    named = named.or(Some(cycle));
                    assert_eq!(repeated.since, stuck_from);
                }
            }
        }
        (named, left_out)
    }

    #[test]
    fn a_recorder_that_is_stuck_is_named_and_its_rows_are_left_out() {
        for (sd_s, step_s, growth_s, within) in
            [(0.005, 1e-4, 0.0, 6), (0.005, 1e-4, 0.02, 6), (0.012, 1e-6, 0.0, 6), (0.005, 1e-3, 0.02, 10)]
        {
            let (named, left_out) = named(80, sd_s, step_s, growth_s, 40);
            let named = named.unwrap_or_else(|| panic!("{sd_s} {step_s} {growth_s}"));
            assert!(named < 40 + within && left_out > 36, "{sd_s} {step_s} {growth_s}: {named} {left_out}");
        }
    }

    #[test]
    fn times_that_are_recorded_coarsely_repeat_by_themselves() {
        for (sd_s, step_s) in [(0.005, 0.1), (0.005, 0.01), (0.002, 0.01), (0.0003, 1e-3), (0.012, 0.04), (0.0, 1e-4)] {
            for growth_s in [0.0, 0.0001, 0.004, 0.05] {
                let (named_at, left_out) = named(20_000, sd_s, step_s, growth_s, u64::MAX);
                assert!(named_at.is_none() && left_out < 100, "{sd_s} {step_s} {growth_s}: {named_at:?} {left_out}");
                // Wear that rests, below what is recorded.
                if sd_s < 0.5 * step_s {
                    assert_eq!(named(200, sd_s, step_s, growth_s, 40).0, None, "{sd_s} {step_s} {growth_s}");
                }
            }
        }
        for (sd_s, step_s) in [(0.012, 0.005), (0.005, 1e-3), (0.005, 1e-4)] {
            assert_eq!(named(200_000, sd_s, step_s, 0.0, u64::MAX).0, None, "{sd_s} {step_s}");
        }
    }
}
