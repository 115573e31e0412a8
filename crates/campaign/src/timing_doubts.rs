//! Which stroke times look mistyped, swapped or in another unit.
//!
//! Rows under the same conditions are held against each other: what a sound valve repeats within a percent, a slip
//! of the pen does not. The row is named; where two others agree on what is right, what is wrong is left out.

use crate::noise::{MEDIAN_SIZE, quantile};
use crate::types::{Campaign, RunConditions, TimingRow};
use crate::warning::{Doubt, Warning};

/// How many times the usual spread of repeats a time is away before it is doubted: normal spread hardly ever is.
const SPREADS: f64 = 8.0;
/// Times exchanged are near those of other rows where they differ by less than this share, however well these agree.
const LEAST_SHARE: f64 = 0.02;
/// Fewer deviations of repeats than this tell nothing of their spread, and nothing is doubted.
const FEWEST_DEVIATIONS: usize = 4;
/// Stroke times above this in every row are likelier milliseconds, s.
const LONG_S: f64 = 300.0;
/// Supply pressures that differ by less than this share count as one, Pa/Pa.
const SAME_PRESSURE: f64 = 0.02;

/// Columns are exchanged where pairs that say so outnumber those against by so many tenths of all, that is nine in ten.
const SWAPPED_TENTHS: i64 = 8;

/// One of the two strokes.
#[derive(Debug, Clone, Copy)]
struct Stroke {
    name: &'static str,
    time: fn(&TimingRow) -> Option<f64>,
    leave_out: fn(&mut TimingRow),
}

const STROKES: [Stroke; 2] = [
    Stroke { name: "closing", time: |row| row.close_time_s, leave_out: |row| row.close_time_s = None },
    Stroke { name: "opening", time: |row| row.open_time_s, leave_out: |row| row.open_time_s = None },
];

/// Names what looks wrong in rows of stroke times, and leaves out what at least two other rows under the same conditions
/// say is wrong.
pub(crate) fn leave_out(rows: &mut [TimingRow], file: &str) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |line: usize, doubt: Doubt| warnings.push(Warning { file: file.to_owned(), line, doubt });
    for stroke in STROKES {
        let all: Vec<f64> = rows.iter().filter_map(stroke.time).collect();
        let usual_s = quantile(&all, 0.5);
        if usual_s > LONG_S {
            warn(rows[0].line, Doubt::LooksLikeMilliseconds { stroke: stroke.name, time_s: usual_s });
        }
    }
    if columns_swapped(rows) {
        warn(rows[0].line, Doubt::SwappedTimeColumns);
    }
    let groups = groups(rows);
    let spreads = STROKES.map(|stroke| Spread::of(rows, &groups, stroke));
    for group in &groups {
        let swapped: Vec<usize> = group.iter().copied().filter(|row| is_swapped(rows, *row, group, &spreads)).collect();
        // Of two rows that differ, nobody knows which is right.
        let is_known = group.len() > swapped.len() + 1;
        for row in &swapped {
            warn(rows[*row].line, Doubt::SwappedTimes { is_left_out: is_known });
            if is_known {
                for stroke in STROKES {
                    (stroke.leave_out)(&mut rows[*row]);
                }
            }
        }
        let sound: Vec<usize> = group.iter().copied().filter(|row| !swapped.contains(row)).collect();
        for (stroke, spread) in STROKES.into_iter().zip(&spreads) {
            for (row, usual_s, is_known) in unlike(rows, &sound, stroke, spread) {
                let time_s = (stroke.time)(&rows[row]).unwrap_or(f64::NAN);
                let spread_s = spread.at(usual_s);
                let doubt =
                    Doubt::UnlikeRepeats { stroke: stroke.name, time_s, usual_s, spread_s, is_left_out: is_known };
                warn(rows[row].line, doubt);
                if is_known {
                    (stroke.leave_out)(&mut rows[row]);
                }
            }
        }
    }
    warnings.sort_by_key(|warning| warning.line);
    warnings
}

/// Rows under the same conditions, by index.
pub(crate) fn groups(rows: &[TimingRow]) -> Vec<Vec<usize>> {
    let mut groups: Vec<(RunConditions, Vec<usize>)> = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        match groups.iter_mut().find(|(conditions, _)| *conditions == row.conditions) {
            Some((_, group)) => group.push(index),
            None => groups.push((row.conditions, vec![index])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// How far repeats of a stroke are usually apart, one standard deviation.
#[derive(Debug, Clone, Copy)]
struct Spread {
    /// Of a clock, s.
    absolute_s: f64,
    /// Of a valve, as a share of the time.
    share: f64,
}

impl Spread {
    /// From the median of how far times are from their group's median; infinite where too few are repeated. Rounded times
    /// are no closer than half their last digit.
    fn of(rows: &[TimingRow], groups: &[Vec<usize>], stroke: Stroke) -> Self {
        let (mut absolute, mut shares, mut steps) = (Vec::new(), Vec::new(), Vec::new());
        for group in groups {
            let mut times: Vec<f64> = group.iter().filter_map(|row| (stroke.time)(&rows[*row])).collect();
            times.sort_by(f64::total_cmp);
            steps.extend(times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0));
            let middle = quantile(&times, 0.5);
            let mut sizes: Vec<f64> = times.iter().map(|time| (time - middle).abs()).collect();
            sizes.sort_by(f64::total_cmp);
            // One time of each group is its median itself and says nothing.
            for size in sizes.into_iter().skip(1) {
                absolute.push(size);
                shares.push(size / middle);
            }
        }
        if absolute.len() < FEWEST_DEVIATIONS {
            return Self { absolute_s: f64::INFINITY, share: f64::INFINITY };
        }
        let rounded_s = 0.5 * steps.into_iter().fold(f64::INFINITY, f64::min);
        let rounded_s = if rounded_s.is_finite() { rounded_s } else { 0.0 };
        let deviation = |sizes: &[f64]| quantile(sizes, 0.5) / MEDIAN_SIZE;
        Self { absolute_s: deviation(&absolute).max(rounded_s), share: deviation(&shares) }
    }

    /// At a time, s: whether the clock or the valve scatters is not known.
    fn at(self, time_s: f64) -> f64 {
        self.absolute_s.max(self.share * time_s)
    }
}

/// Rows far from their repeats, with what the others have, and whether two others at least say so.
fn unlike(rows: &[TimingRow], group: &[usize], stroke: Stroke, spread: &Spread) -> Vec<(usize, f64, bool)> {
    let timed: Vec<(usize, f64)> = group.iter().filter_map(|row| Some((*row, (stroke.time)(&rows[*row])?))).collect();
    let mut found = Vec::new();
    for (place, (row, time_s)) in timed.iter().enumerate() {
        let others: Vec<f64> =
            timed.iter().enumerate().filter(|(index, _)| *index != place).map(|(_, (_, time_s))| *time_s).collect();
        // Of two that differ, neither is the one to believe: the second is named, with the first beside it.
        if others.is_empty() || others.len() == 1 && place == 0 {
            continue;
        }
        let usual_s = quantile(&others, 0.5);
        let far_s = SPREADS * spread.at(usual_s);
        if (time_s - usual_s).abs() > far_s {
            let agree = others.iter().filter(|other| (**other - usual_s).abs() <= far_s).count();
            found.push((*row, usual_s, agree > 1));
        }
    }
    found
}

/// Whether a row fits its repeats only with closing and opening time exchanged.
fn is_swapped(rows: &[TimingRow], row: usize, group: &[usize], spreads: &[Spread; 2]) -> bool {
    let both = |row: usize| Some([(STROKES[0].time)(&rows[row])?, (STROKES[1].time)(&rows[row])?]);
    let Some(times) = both(row) else { return false };
    let others: Vec<[f64; 2]> = group.iter().filter(|other| **other != row).filter_map(|other| both(*other)).collect();
    if others.is_empty() {
        return false;
    }
    let usual = [0, 1].map(|stroke| quantile(&others.iter().map(|times| times[stroke]).collect::<Vec<_>>(), 0.5));
    let near = |time_s: f64, stroke: usize| {
        let spread_s = spreads[stroke].at(usual[stroke]).min(LEAST_SHARE * usual[stroke]);
        (time_s - usual[stroke]).abs() < (SPREADS * spread_s).max(LEAST_SHARE * usual[stroke])
    };
    let fits = near(times[0], 0) || near(times[1], 1);
    !fits && near(times[0], 1) && near(times[1], 0)
}

/// Whether closing takes longer and opening less long the higher the supply pressure is, in a valve that is closed by
/// pressure and opened by a spring or by its weight: then the columns are exchanged.
fn columns_swapped(rows: &[TimingRow]) -> bool {
    let sealed =
        |row: &&TimingRow| row.conditions.leak_to_atmosphere_m2 == 0.0 && row.conditions.leak_from_supply_m2 == 0.0;
    let mut trends = [0i64; 2];
    let mut pairs = 0i64;
    let sealed: Vec<&TimingRow> = rows.iter().filter(sealed).collect();
    for (place, one) in sealed.iter().enumerate() {
        for other in &sealed[place + 1..] {
            let (low, high) = if one.conditions.supply_pressure_pa < other.conditions.supply_pressure_pa {
                (one, other)
            } else {
                (other, one)
            };
            if high.conditions.supply_pressure_pa < (1.0 + SAME_PRESSURE) * low.conditions.supply_pressure_pa {
                continue;
            }
            let (Some(low_close), Some(high_close)) = (low.close_time_s, high.close_time_s) else { continue };
            let (Some(low_open), Some(high_open)) = (low.open_time_s, high.open_time_s) else { continue };
            pairs += 1;
            trends[0] += i64::from(high_close > low_close) - i64::from(high_close < low_close);
            trends[1] += i64::from(high_open > low_open) - i64::from(high_open < low_open);
        }
    }
    pairs > 0 && 10 * trends[0] >= SWAPPED_TENTHS * pairs && 10 * trends[1] <= -SWAPPED_TENTHS * pairs
}

impl Campaign {
    /// Doubts stroke times that are longer than the part of the cycle in which they were taken: `close_for_s` from the
    /// command to close to the one to open, `open_for_s` from there to the end. The reader does not know the cycle.
    pub fn doubt_times_beyond(&mut self, close_for_s: f64, open_for_s: f64) {
        let Some(file) = self.timings_file.clone() else { return };
        for (stroke, most_s) in STROKES.into_iter().zip([close_for_s, open_for_s]) {
            let beyond = |row: &&TimingRow| (stroke.time)(row).is_some_and(|time_s| time_s > most_s);
            let count = self.timings.iter().filter(beyond).count();
            if let Some(row) = self.timings.iter().find(beyond) {
                let time_s = (stroke.time)(row).unwrap_or(f64::NAN);
                let doubt = Doubt::LongerThanCycle { stroke: stroke.name, time_s, most_s, count };
                self.warnings.push(Warning { file: file.clone(), line: row.line, doubt });
            }
        }
    }
}
