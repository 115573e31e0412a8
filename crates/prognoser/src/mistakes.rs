//! Readings that say something, but not what their columns say: times in another unit, two times exchanged, and conditions under which
//! the tables know nothing of the times.

use leak_table::{Condition, Stroke, TableBundle};
use serde::{Deserialize, Serialize};

use crate::bayes::healthy_times_s;
use crate::notice::Notice;
use crate::reading::Reading;

/// A time that is this many times longer or shorter than every one that the tables know is in another unit.
const OTHER_UNIT: f64 = 20.0;

/// Two times are exchanged that differ by more than the one factor from those before, and the other way round by less than the
/// other: wear never takes a valve from its times to their mirror image at once.
const STRANGE: f64 = 1.3;
const OWN: f64 = 1.1;

/// By which share a healthy time may have changed from the edge of the tables to a condition beyond them, going on as it does inside:
/// farther out, times read by the edge would look as worn or as sound as no valve's share of the tables' error.
const EXTRAPOLATED: f64 = 0.1;
/// The share of the tables' range from whose edge it is told how the times go on.
const EDGE: f64 = 0.1;

/// A valve whose times seem to be exchanged for longer than so many rows is another one, such as after a repair.
const ROWS: u32 = 3;

/// The times of a valve so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Times {
    /// The closing and the opening time of the last row that had both, the right way round, s; none at first, when they are supposed
    /// to be those of a healthy valve.
    own_s: Option<[f64; 2]>,
    /// Whether a row was ever the right way round.
    known: bool,
    /// Rows in succession that were not.
    exchanged: u32,
    /// The times before so many exchanged ones came that these are believed, s; none once a row is like those before again.
    before_s: Option<[f64; 2]>,
    /// Cycle of the first exchanged row.
    since: u64,
}

impl Times {
    /// Whether the times of the next row are exchanged.
    fn are_exchanged(&mut self, tables: &TableBundle, close_s: f64, open_s: f64) -> bool {
        let own = self.own_s.or_else(|| healthy(tables));
        let lasts = self.known && self.exchanged >= ROWS;
        // A log that was never the right way round is so until a row says the contrary as clearly: on the way of a leak both times
        // may be alike.
        let never = !self.known && self.exchanged >= ROWS;
        let is_so = |own| are_exchanged(own, close_s, open_s) || never && !are_exchanged(own, open_s, close_s);
        if !lasts && own.is_some_and(is_so) {
            self.exchanged += 1;
            // A log that is wrong from its first row on goes on as a valve wears.
            if !self.known {
                self.own_s = Some([open_s, close_s]);
            }
            return true;
        }
        if self.before_s.is_some_and(|before| apart(before, [close_s, open_s]) < STRANGE) {
            self.before_s = None;
        } else if lasts && own.is_some_and(is_so) {
            self.before_s = own;
        }
        *self = Self { own_s: Some([close_s, open_s]), known: true, exchanged: 0, ..*self };
        false
    }

    /// In words that times which are believed now would fit as well the other way round, if they would.
    pub(crate) fn doubt(&self) -> Option<String> {
        self.before_s.map(|_| format!("or the two times are exchanged since cycle {}", self.since))
    }
}

/// The reading without what is mistaken, and whether that leaves nothing of what was measured.
pub(crate) fn left_out(
    tables: &TableBundle,
    reading: &Reading,
    so_far: &mut Times,
    notices: &mut Vec<Notice>,
) -> (Reading, bool) {
    if let Some(far) = far_conditions(tables, reading) {
        notices.push(far);
        let left = Reading { supply_pressure_pa: None, temperature_k: None, ..without(reading, [true, true]) };
        return (left, true);
    }
    let times = Stroke::ALL.map(|stroke| reading.time_s(stroke));
    if let [Some(close_s), Some(open_s)] = times
        && so_far.are_exchanged(tables, close_s, open_s)
    {
        if so_far.exchanged <= 1 {
            so_far.since = reading.cycle;
        }
        notices.push(Notice::Exchanged);
        return (without(reading, [true, true]), true);
    }
    let mut other_unit = [false; 2];
    for (stroke, time) in Stroke::ALL.into_iter().zip(times) {
        let Some(found_s) = time else { continue };
        let is_far =
            |(shortest_s, longest_s): (f64, f64)| found_s > OTHER_UNIT * longest_s || found_s < shortest_s / OTHER_UNIT;
        let span = |entry: usize| {
            let (a, b) = tables.entry(entry).table.curve(stroke).end_times_s();
            (a.min(b), a.max(b))
        };
        // Most times lie near the first table.
        if !is_far(span(0)) {
            continue;
        }
        let limit_s = tables.manifest().limits.within_s(stroke);
        let (shortest_s, longest_s) = (0..tables.entries().len())
            .map(span)
            .fold((limit_s, limit_s), |all, one| (all.0.min(one.0), all.1.max(one.1)));
        if is_far((shortest_s, longest_s)) {
            other_unit[stroke as usize] = true;
            notices.push(Notice::OtherUnit { stroke, found_s, shortest_s, longest_s });
        }
    }
    let left = without(reading, other_unit);
    let tells = left.close_time_s.is_some() || left.open_time_s.is_some() || left.stalled.contains(&true);
    (left, !tells && other_unit.contains(&true))
}

/// A condition of a row that is so far beyond the tables that they tell nothing of its times.
fn far_conditions(tables: &TableBundle, reading: &Reading) -> Option<Notice> {
    let range = tables.condition_range()?;
    let stated = [Condition::SupplyPressure, Condition::Temperature];
    stated.into_iter().zip([reading.supply_pressure_pa, reading.temperature_k]).find_map(|(condition, value)| {
        let (found, covered) = (value?, range.get(condition));
        let (low, high) = covered;
        if (low..=high).contains(&found) || low == high {
            return None;
        }
        let inwards = EDGE * (high - low);
        let (edge, inside) = if found < low { (low, low + inwards) } else { (high, high - inwards) };
        let [at_edge, at_inside] = [edge, inside].map(|value| healthy_times_s(tables, condition, value));
        let change = |stroke: usize| (at_edge[stroke] / at_inside[stroke]).ln().abs() * (found - edge).abs() / inwards;
        (change(0).max(change(1)) > EXTRAPOLATED).then_some(Notice::FarConditions { condition, found, covered })
    })
}

/// The times of a healthy valve.
fn healthy(tables: &TableBundle) -> Option<[f64; 2]> {
    let first = tables.entry(0).table.points().first()?;
    Some([first.close_time_s?, first.open_time_s?])
}

/// Whether two times are strange beside those before, and much like them the other way round.
fn are_exchanged(before: [f64; 2], close_s: f64, open_s: f64) -> bool {
    apart(before, [close_s, open_s]) > STRANGE && apart(before, [open_s, close_s]) < OWN
}

/// By which factor one of two times differs from the one before, the larger of both.
fn apart(before: [f64; 2], times: [f64; 2]) -> f64 {
    let factor = |a: f64, b: f64| (a / b).max(b / a);
    factor(times[0], before[0]).max(factor(times[1], before[1]))
}

fn without(reading: &Reading, [close, open]: [bool; 2]) -> Reading {
    Reading {
        close_time_s: reading.close_time_s.filter(|_| !close),
        open_time_s: reading.open_time_s.filter(|_| !open),
        ..*reading
    }
}
