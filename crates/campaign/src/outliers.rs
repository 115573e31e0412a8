//! Readings that no motion can have made: found before anything is judged by the extremes of a record.
//!
//! In the manner of Hampel's filter (Hampel 1974; Pearson 2002): a reading is held against a robust line
//! (Theil 1950, Sen 1968) through its neighbours on both sides. It is an outlier only where the neighbours
//! agree with each other and it lies far from them, so that fast motion, corners at the stops, ringing and
//! the recorder's own steps are left alone.

use crate::noise::{estimate_resolution, quantile, range};

/// Neighbours on each side that are asked.
const NEIGHBOURS: usize = 4;
/// Rows on each side whose noise counts: that of a sensor may change.
const VICINITY: usize = 50;
/// Fewer of them tell no noise: two outliers can be in half of their second differences.
const FEWEST: usize = 14;
/// Bad readings in a row, whatever their values.
const LONGEST_GROUP: usize = 3;
/// Bad readings in a row that all are one code, as of a loose plug.
const LONGEST_STUCK: usize = 48;
/// How far from its neighbours an outlier lies at least, in standard deviations of the record's noise: white noise
/// does so less than once in 1e20 readings, a sensor with heavy tails hardly ever.
const SIGMAS: f64 = 10.0;
/// The same in steps of the recorder.
const STEPS: f64 = 4.0;
/// The same in shares of the record's span; what is smaller decides nothing.
const SHARE_OF_SPAN: f64 = 3e-3;
/// The same in units of how far the neighbours lie from their own line.
const SPREADS: f64 = 4.0;
/// At an end of the record there are neighbours on one side alone: so many times farther, and so many times the
/// fastest motion from row to row.
const FARTHER_AT_END: f64 = 3.0;
/// The time within which no valve can leave a place and be back, s.
const TOO_SHORT_S: f64 = 0.05;
/// Where a recorder is slower than that: how long after two changes of the command a short stroke may be seen, s.
const SHORT_STROKE_S: f64 = 1.0;
/// A record with a larger share of outliers has no outliers but another kind of noise.
const LARGEST_SHARE: f64 = 0.05;

/// Chance, over all of a record, that a sensor in order shows the same reading so often in a row.
const CHANCE: f64 = 1e-6;
/// How much slower than before a sensor got stuck the motion may have been meanwhile: it may have come to its end.
const SLOWER: f64 = 10.0;
/// What so many times the fastest motion from row to row is no motion: none quickens as much within one row.
const LEAPS: f64 = 4.0;

/// Rows in a row in which a sensor was stuck in the midst of a motion: they repeat the reading before them, as noise lets it do
/// nowhere else in the record, and end in a leap to where the motion has come to. A valve that rests jumps nowhere, and one that
/// sticks slips over several rows. How much farther than its pace let expect a motion has come says nothing: it may have quickened.
pub(crate) fn stuck(time_s: &[f64], values: &[f64]) -> Vec<std::ops::Range<usize>> {
    let runs: Vec<_> = equal_runs(values).collect();
    let pairs = values.len().saturating_sub(1) as f64;
    let equal: f64 = runs.iter().map(|run| (run.len() - 1) as f64).sum();
    let Some((lowest, highest)) = range(values) else { return Vec::new() };
    let step = estimate_resolution(values).unwrap_or(0.0);
    let least = (SIGMAS * quiet_sigma(values)).max(STEPS * step).max(SHARE_OF_SPAN * (highest - lowest));
    let fastest = fastest(values);
    let is_stuck = |run: &std::ops::Range<usize>| {
        // Whether a reading repeats the one before it, in all the rest of the record.
        let again = (run.len() - 1) as f64;
        let share = (equal - again + 1.0) / (pairs - again + 2.0);
        let chance = pairs * share.powf(again);
        if chance > CHANCE || run.start < NEIGHBOURS || run.end >= values.len() {
            return false;
        }
        let value = values[run.start];
        let jump = values[run.end] - value;
        let since = run.start.saturating_sub(run.len().max(NEIGHBOURS));
        let moved = |before: &usize| (value - values[*before]).abs() > least;
        let Some(before) = (since..=run.start - NEIGHBOURS).rev().find(moved) else { return false };
        let pace = (value - values[before]) / (time_s[run.start] - time_s[before]);
        let expected = pace * (time_s[run.end] - time_s[run.start]);
        jump.abs() > least.max(LEAPS * fastest) && jump / expected > 1.0 / SLOWER
    };
    // The first reading of each is the last one that was true.
    runs.iter().filter(|run| is_stuck(run)).map(|run| run.start + 1..run.end).collect()
}

/// The fastest motion from row to row. Motion goes on for more than one row; what jumps there and back does not count, nor a
/// jump in two leaps.
fn fastest(values: &[f64]) -> f64 {
    let changes: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sustained: Vec<f64> = changes
        .windows(2)
        .filter(|pair| pair[0] * pair[1] > 0.0)
        .map(|pair| pair[0].abs().min(pair[1].abs()))
        .collect();
    sustained.sort_by(|a, b| b.total_cmp(a));
    sustained.get(2).or(sustained.last()).copied().unwrap_or(0.0)
}

/// Ranges of two and more equal readings.
fn equal_runs(values: &[f64]) -> impl Iterator<Item = std::ops::Range<usize>> {
    let mut start = 0;
    values.chunk_by(|a, b| a == b).filter_map(move |chunk| {
        let run = start..start + chunk.len();
        start = run.end;
        (run.len() > 1).then_some(run)
    })
}

/// What was found in one channel.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Found {
    /// Rows with an outlier, in order.
    pub rows: Vec<usize>,
    /// More rows than outliers can be: then `rows` is empty, and this is how many looked like one.
    pub too_many: usize,
}

/// The outliers of a channel; `edges_s` are the times at which the command changes.
pub(crate) fn find(time_s: &[f64], values: &[f64], edges_s: &[f64]) -> Found {
    let mut rows = Vec::new();
    // A cluster of outliers hides some of its members until others are gone.
    for _ in 0..4 {
        let good: Vec<usize> =
            (0..values.len()).filter(|row| values[*row].is_finite() && rows.binary_search(row).is_err()).collect();
        let Some(record) = Record::new(time_s, values, edges_s, &good) else { break };
        let found = record.outliers();
        if found.is_empty() {
            break;
        }
        rows.extend(found.into_iter().map(|index| good[index]));
        rows.sort_unstable();
    }
    if rows.len() as f64 > LARGEST_SHARE * values.len() as f64 {
        return Found { too_many: rows.len(), rows: Vec::new() };
    }
    Found { rows, too_many: 0 }
}

/// The valid readings of a channel.
struct Record<'a> {
    time_s: Vec<f64>,
    value: Vec<f64>,
    edges_s: &'a [f64],
    /// How far an outlier lies from its neighbours at least.
    least: f64,
    /// The fastest motion from row to row.
    fastest: f64,
}

/// Share of the readings at either end that the span of a record leaves out, for outliers are among them.
const TAIL: f64 = 0.02;

impl<'a> Record<'a> {
    /// `None` where there are too few readings, or all are one.
    fn new(time_s: &[f64], values: &[f64], edges_s: &'a [f64], good: &[usize]) -> Option<Self> {
        if good.len() < 3 * NEIGHBOURS {
            return None;
        }
        let value: Vec<f64> = good.iter().map(|row| values[*row]).collect();
        let time_s = good.iter().map(|row| time_s[*row]).collect();
        let span = quantile(&value, 1.0 - TAIL) - quantile(&value, TAIL);
        let sigma = quiet_sigma(&value);
        let step = estimate_resolution(&value).unwrap_or(0.0);
        let least = (SIGMAS * sigma).max(STEPS * step).max(SHARE_OF_SPAN * span);
        let fastest = fastest(&value);
        (least > 0.0 || value.windows(2).any(|pair| pair[0] != pair[1])).then_some(Self {
            time_s,
            value,
            edges_s,
            least,
            fastest,
        })
    }

    /// Indices of the outliers.
    fn outliers(&self) -> Vec<usize> {
        let mut found: Vec<usize> = Vec::new();
        let mut index = 0;
        while index < self.value.len() {
            match self.group_at(index, &found) {
                Some(length) => {
                    found.extend(index..index + length);
                    index += length;
                }
                None => index += 1,
            }
        }
        found
    }

    /// The length of the group of outliers that begins here.
    fn group_at(&self, first: usize, found: &[usize]) -> Option<usize> {
        let left: Vec<usize> =
            (0..first).rev().filter(|index| found.binary_search(index).is_err()).take(2 * NEIGHBOURS).collect();
        // Nothing to ask where the reading is near the one before.
        if left.first().is_some_and(|before| (self.value[first] - self.value[*before]).abs() <= self.least) {
            return None;
        }
        let code = self.value[first];
        let stuck = self.value[first..].iter().take(LONGEST_STUCK + 1).take_while(|value| **value == code).count();
        let stuck = (LONGEST_GROUP + 1..=LONGEST_STUCK).contains(&stuck).then_some(stuck);
        (1..=LONGEST_GROUP).chain(stuck).find(|length| self.is_group(first, *length, &left))
    }

    fn is_group(&self, first: usize, length: usize, left: &[usize]) -> bool {
        let end = first + length;
        let count = self.value.len();
        if end > count {
            return false;
        }
        let at_end = left.is_empty() || end == count;
        // Where one side has too few of them the other gives more.
        let right = (count - end).min(NEIGHBOURS);
        let before = left.len().min(2 * NEIGHBOURS - right);
        let right = end..(end + 2 * NEIGHBOURS - before).min(count);
        let neighbours: Vec<usize> = left[..before].iter().copied().chain(right).collect();
        if neighbours.len() < NEIGHBOURS + 2 {
            return false;
        }
        let line = Line::through(&self.time_s, &self.value, &neighbours);
        let mut apart: Vec<f64> = neighbours.iter().map(|index| self.from(&line, *index)).collect();
        apart.sort_by(f64::total_cmp);
        // One of the neighbours may be an outlier itself.
        let spread = apart[apart.len() - 2];
        let (before, after) = (first.saturating_sub(VICINITY)..first, end..(end + VICINITY).min(count));
        let noise =
            |rows: std::ops::Range<usize>| if rows.len() < FEWEST { 0.0 } else { quiet_sigma(&self.value[rows]) };
        let sigma = noise(before).max(noise(after));
        let mut least = self.least.max(SPREADS * spread).max(SIGMAS * sigma);
        if at_end {
            least = FARTHER_AT_END * least.max(self.fastest);
        }
        (first..end).all(|index| self.from(&line, index) > least) && !self.may_be_a_stroke(first, end, length)
    }

    /// How far a reading is from a line.
    fn from(&self, line: &Line, index: usize) -> f64 {
        (self.value[index] - line.at(self.time_s[index])).abs()
    }

    /// Whether a recorder this slow may have seen a short stroke in these rows.
    fn may_be_a_stroke(&self, first: usize, end: usize, length: usize) -> bool {
        let start_s = self.time_s[first.saturating_sub(1)];
        let end_s = self.time_s[end.min(self.time_s.len() - 1)];
        if end_s - start_s < TOO_SHORT_S {
            return false;
        }
        // At an end of the record the way back is not seen, and one change is enough.
        let changes = if first == 0 || end == self.time_s.len() { 1 } else { 2 };
        let since_s = start_s - SHORT_STROKE_S;
        length > LONGEST_GROUP
            || self.edges_s.iter().filter(|edge_s| (since_s..=end_s).contains(*edge_s)).count() >= changes
    }
}

/// The noise of readings, one standard deviation, from the smaller of their second differences: motion cancels in
/// them, and a quarter of them at least is free of its changes and of outliers. A quarter of |N(0, s)| lies below
/// 0.3186 s; the variance is 1 + 4 + 1 times that of a reading.
fn quiet_sigma(value: &[f64]) -> f64 {
    let sizes: Vec<f64> = value.windows(3).map(|three| (three[2] - 2.0 * three[1] + three[0]).abs()).collect();
    if sizes.is_empty() { 0.0 } else { quantile(&sizes, 0.25) / (0.3186 * 6f64.sqrt()) }
}

/// A straight line.
struct Line {
    slope: f64,
    level: f64,
    origin_s: f64,
}

impl Line {
    /// The line with the median of the slopes between all pairs, and the median level (Theil 1950, Sen 1968).
    fn through(time_s: &[f64], value: &[f64], points: &[usize]) -> Self {
        let origin_s = time_s[points[0]];
        let mut slopes = Vec::with_capacity(points.len() * points.len() / 2);
        for (place, one) in points.iter().enumerate() {
            for other in &points[place + 1..] {
                slopes.push((value[*other] - value[*one]) / (time_s[*other] - time_s[*one]));
            }
        }
        let slope = quantile(&slopes, 0.5);
        let levels: Vec<f64> = points.iter().map(|point| value[*point] - slope * (time_s[*point] - origin_s)).collect();
        Self { slope, level: quantile(&levels, 0.5), origin_s }
    }

    fn at(&self, time_s: f64) -> f64 {
        self.level + self.slope * (time_s - self.origin_s)
    }
}

#[cfg(test)]
mod tests;
