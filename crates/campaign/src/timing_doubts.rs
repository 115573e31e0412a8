//! Which stroke times look mistyped, swapped or in another unit.
//!
//! Rows under the same conditions are held against each other: what a sound valve repeats within a percent, a slip
//! of the pen does not. Nothing is taken out; the row is named.

use crate::noise::quantile;
use crate::types::{Campaign, RunConditions, TimingRow};
use crate::warning::{Doubt, Warning};

/// How many times the usual spread of repeats a time is away before it is doubted: normal spread hardly ever is.
const SPREADS: f64 = 8.0;
/// What is nearer than this share to its repeats is not doubted, however well the others agree.
const LEAST_SHARE: f64 = 0.02;
/// Stroke times above this in every row are likelier milliseconds, s.
const LONG_S: f64 = 300.0;
/// Supply pressures that differ by less than this share count as one, Pa/Pa.
const SAME_PRESSURE: f64 = 0.02;

/// Columns are exchanged where pairs that say so outnumber those against by so many tenths of all, that is nine in ten.
const SWAPPED_TENTHS: i64 = 8;

/// The time of one of the two strokes.
type Time = fn(&TimingRow) -> Option<f64>;

const TIMES: [(&str, Time); 2] = [("closing", |row| row.close_time_s), ("opening", |row| row.open_time_s)];

/// What looks wrong in rows of stroke times.
pub(crate) fn find(rows: &[TimingRow], file: &str) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |line: usize, doubt: Doubt| warnings.push(Warning { file: file.to_owned(), line, doubt });
    for (stroke, time) in TIMES {
        let all: Vec<f64> = rows.iter().filter_map(time).collect();
        let usual_s = quantile(&all, 0.5);
        if usual_s > LONG_S {
            warn(rows[0].line, Doubt::LooksLikeMilliseconds { stroke, time_s: usual_s });
        }
    }
    let groups = groups(rows);
    let spread = usual_spread(&groups);
    let mut doubted = Vec::new();
    for group in &groups {
        for (place, row) in group.iter().enumerate() {
            let others = || group.iter().enumerate().filter(|(index, _)| *index != place).map(|(_, row)| *row);
            if group.len() > 1 && swapped(row, others(), spread) {
                warn(row.line, Doubt::SwappedTimes);
                doubted.push(row.line);
            }
        }
    }
    for (stroke, time) in TIMES {
        for group in &groups {
            let sound: Vec<&TimingRow> = group.iter().copied().filter(|row| !doubted.contains(&row.line)).collect();
            for (row, usual_s) in unlike(&sound, time, spread) {
                let time_s = time(row).unwrap_or(f64::NAN);
                warn(row.line, Doubt::UnlikeRepeats { stroke, time_s, usual_s, spread });
            }
        }
    }
    if columns_swapped(rows) {
        warn(rows[0].line, Doubt::SwappedTimeColumns);
    }
    warnings.sort_by_key(|warning| warning.line);
    warnings
}

/// Rows under the same conditions.
fn groups(rows: &[TimingRow]) -> Vec<Vec<&TimingRow>> {
    let mut groups: Vec<(RunConditions, Vec<&TimingRow>)> = Vec::new();
    for row in rows {
        match groups.iter_mut().find(|(conditions, _)| *conditions == row.conditions) {
            Some((_, group)) => group.push(row),
            None => groups.push((row.conditions, vec![row])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// The usual relative spread of repeats: the median of how far times are from their group's median, as one standard
/// deviation. NaN where nothing is repeated.
fn usual_spread(groups: &[Vec<&TimingRow>]) -> f64 {
    let mut apart = Vec::new();
    for group in groups.iter().filter(|group| group.len() > 1) {
        for (_, time) in TIMES {
            let times: Vec<f64> = group.iter().filter_map(|row| time(row)).collect();
            let middle = quantile(&times, 0.5);
            // One time of each group is its median itself and says nothing.
            let mut sizes: Vec<f64> = times.iter().map(|time| (time / middle - 1.0).abs()).collect();
            sizes.sort_by(f64::total_cmp);
            apart.extend(sizes.into_iter().skip(1));
        }
    }
    quantile(&apart, 0.5) / 0.6745
}

/// Rows far from their repeats, with what the others have.
fn unlike<'a>(group: &[&'a TimingRow], time: Time, spread: f64) -> Vec<(&'a TimingRow, f64)> {
    let timed: Vec<(&TimingRow, f64)> = group.iter().filter_map(|row| Some((*row, time(row)?))).collect();
    let far = |(_, time_s): &(&TimingRow, f64), usual_s: f64| {
        (time_s / usual_s - 1.0).abs() > LEAST_SHARE.max(SPREADS * spread)
    };
    let mut found = Vec::new();
    for (place, row) in timed.iter().enumerate() {
        let others: Vec<f64> =
            timed.iter().enumerate().filter(|(index, _)| *index != place).map(|(_, (_, time_s))| *time_s).collect();
        // Of two that differ, neither is the one to believe: the second is named, with the first beside it.
        if others.is_empty() || others.len() == 1 && place == 0 {
            continue;
        }
        let usual_s = quantile(&others, 0.5);
        if far(row, usual_s) {
            found.push((row.0, usual_s));
        }
    }
    found
}

/// Whether a row fits its repeats only with closing and opening time exchanged.
fn swapped<'a>(row: &TimingRow, others: impl Iterator<Item = &'a TimingRow>, spread: f64) -> bool {
    let (Some(close_s), Some(open_s)) = (row.close_time_s, row.open_time_s) else { return false };
    let others: Vec<(f64, f64)> = others.filter_map(|other| Some((other.close_time_s?, other.open_time_s?))).collect();
    let usual_close_s = quantile(&others.iter().map(|other| other.0).collect::<Vec<_>>(), 0.5);
    let usual_open_s = quantile(&others.iter().map(|other| other.1).collect::<Vec<_>>(), 0.5);
    let tolerated = LEAST_SHARE.max(SPREADS * spread.min(1.0));
    let near = |one: f64, other: f64| (one / other - 1.0).abs() < tolerated;
    let fits = near(close_s, usual_close_s) || near(open_s, usual_open_s);
    !fits && near(close_s, usual_open_s) && near(open_s, usual_close_s)
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
        for ((stroke, time), most_s) in TIMES.into_iter().zip([close_for_s, open_for_s]) {
            let beyond = |row: &&TimingRow| time(row).is_some_and(|time_s| time_s > most_s);
            let count = self.timings.iter().filter(beyond).count();
            if let Some(row) = self.timings.iter().find(beyond) {
                let time_s = time(row).unwrap_or(f64::NAN);
                let doubt = Doubt::LongerThanCycle { stroke, time_s, most_s, count };
                self.warnings.push(Warning { file: file.clone(), line: row.line, doubt });
            }
        }
    }
}
