//! The cycles of a record, and where the simulation of each begins.

use std::ops::Range;
use std::sync::Arc;

use campaign::Run as RecordedRun;
use valve_model::prescribed::Prescribed;
use valve_model::{CommandEdge, Run, Start};

use super::start::{Beginning, ON_STOP, beginning, window_s};
use crate::data::RunData;

/// How much a simulation begins before a record that begins at rest, so that a command may come early, s.
pub(super) const LEAD_S: f64 = 0.1;

/// The same in rows of a slow recorder, which writes a command down up to one of them too late.
const LEAD_ROWS: f64 = 2.0;

/// How much a simulation begins before this record.
pub(super) fn lead_s(data: &RunData) -> f64 {
    LEAD_S.max(rows_s(data, LEAD_ROWS))
}

/// The time of so many rows, s.
fn rows_s(data: &RunData, count: f64) -> f64 {
    let mut rows: Vec<f64> = data.times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    rows.sort_by(f64::total_cmp);
    rows.get(rows.len() / 2).map_or(0.0, |row| count * row)
}

/// How long before each command of a run the row before it was written: the longest time of commands to close, and of those
/// to open, s.
pub(super) fn unseen_s(data: &RunData, commands: &[CommandEdge]) -> [f64; 2] {
    let mut longest = [0.0_f64; 2];
    for edge in commands {
        let row = data.times_s.partition_point(|time| *time < edge.time_s);
        if row > 0 && row < data.times_s.len() {
            let of_kind = &mut longest[usize::from(!edge.closes())];
            *of_kind = of_kind.max(data.times_s[row] - data.times_s[row - 1]);
        }
    }
    longest
}

/// A stretch of a record that counts as a record of its own, and where its simulation begins.
pub(super) struct Part {
    /// From when on its rows are taken, s of the record.
    pub from_s: f64,
    /// The end of that, s of the record.
    pub until_s: f64,
    /// When its simulation begins, s of the record.
    pub origin_s: f64,
    /// In which state it begins.
    pub beginning: Beginning,
}

impl Part {
    /// How long nobody saw each kind of command, s.
    pub fn unseen_s(&self, data: &RunData) -> [f64; 2] {
        let inside = |edge: &&CommandEdge| edge.time_s >= self.from_s && edge.time_s < self.until_s;
        let commands: Vec<CommandEdge> = data.run.commands.iter().filter(inside).copied().collect();
        unseen_s(data, &commands)
    }

    /// Its run, in its own time.
    pub fn run(&self, data: &RunData) -> Run {
        let mut run = data.run.clone();
        run.end_s = self.until_s.min(data.run.end_s) - self.origin_s;
        run.commands.retain(|edge| edge.time_s >= self.origin_s && edge.time_s < self.until_s);
        for edge in &mut run.commands {
            edge.time_s -= self.origin_s;
        }
        if self.beginning == Beginning::Closed {
            run.start = Start::ClosedRest;
            run.commands.retain(|edge| !edge.closes() || edge.time_s > -self.origin_s);
        }
        run.prescribed = run.prescribed.map(|whole| self.driving(data, &whole));
        run
    }

    /// What drives it of what drives the whole record, in its own time.
    pub fn driving(&self, data: &RunData, whole: &Arc<Prescribed>) -> Arc<Prescribed> {
        if self.origin_s == 0.0 && self.until_s >= data.run.end_s {
            return Arc::clone(whole);
        }
        // A recorder's clock may see what comes a little later.
        Arc::new(whole.between(self.origin_s, self.until_s + LEAD_S))
    }
}

/// The cycles of a record whose recorded pressure drives the model: each from shortly before a command to close. Such a
/// cylinder may never rest on a stop, and a simulation of many cycles at a stretch adds up what the model is off by; the
/// position and the speed at the beginning of each are in the record. One that came to its stop a moment before still
/// bounces there, or vents: it is simulated from the motion that led there.
pub(super) fn driven_parts(
    recorded: &RecordedRun,
    data: &RunData,
    start: Beginning,
    (stroke_m, travel_s): (f64, f64),
) -> Vec<Part> {
    let window_s = judged_over_s(data, travel_s);
    let closings = recorded.commands.iter().filter(|edge| edge.close).map(|edge| edge.time_s);
    let mut parts = vec![Part { from_s: f64::NEG_INFINITY, until_s: f64::INFINITY, origin_s: 0.0, beginning: start }];
    for closing_s in closings.skip(1) {
        let rest_s = steady_before(data, closing_s, window_s, travel_s);
        let begins = begins_before(recorded, data, rest_s, (stroke_m, travel_s));
        let Some((from_s, begins)) = begins.filter(|(from_s, _)| *from_s < closing_s) else { continue };
        let Some(before) = parts.last_mut().filter(|before| from_s >= before.from_s.max(before.origin_s) + travel_s)
        else {
            continue;
        };
        let falling_s =
            (begins == Beginning::Open).then(|| still_settles(data, from_s, before.from_s, stroke_m)).flatten();
        let falling = falling_s.and_then(|falling_s| begins_at(recorded, data, falling_s, (stroke_m, travel_s)));
        let falling = falling.filter(|(_, begins)| begins.is_moving());
        let (origin_s, beginning) = falling.unwrap_or((from_s, begins));
        before.until_s = from_s;
        parts.push(Part { from_s, until_s: f64::INFINITY, origin_s, beginning });
    }
    parts
}

/// So many times as long as it took to the stop from the middle of its stroke a piston may still bounce there, and its chamber vent
/// through the port that let it come: two whole strokes. Later bounces are past what a simulation that begins with a read-off motion can
/// follow (at twelve times that missed by half more than a piston at rest does).
const SETTLED: f64 = 4.0;

/// When a piston that seems to rest open at a time was in the middle of the stroke that led there, s of the record; nothing where
/// that is so long ago that its bounces are over and its chamber is vented, or before a given time. While it moves its gas balances the
/// other forces; of a piston on a stop nobody knows the gas, and bounces as small as the sensor's noise change when it leaves.
fn still_settles(data: &RunData, rests_s: f64, since_s: f64, stroke_m: f64) -> Option<f64> {
    let position = &data.channels[0].samples;
    let end = data.times_s.partition_point(|time| *time < rests_s);
    let middle = (0..end).rev().find(|row| position[*row] < 0.5 * stroke_m)?;
    let there = (middle..end).find(|row| position[*row] > (1.0 - ON_STOP) * stroke_m)?;
    let [middle_s, there_s] = [middle, there].map(|row| data.times_s[row]);
    (middle_s > since_s && rests_s - there_s < SETTLED * (there_s - middle_s)).then_some(middle_s)
}

/// How long the beginning of a cycle is looked at, s.
fn judged_over_s(data: &RunData, travel_s: f64) -> f64 {
    window_s(travel_s).max(rows_s(data, LEAD_ROWS))
}

/// The row from which on a cycle is taken that begins before something happens, s of the record, and how it begins there.
fn begins_before(
    recorded: &RecordedRun,
    data: &RunData,
    happens_s: f64,
    (stroke_m, travel_s): (f64, f64),
) -> Option<(f64, Beginning)> {
    begins_at(recorded, data, happens_s - AHEAD * judged_over_s(data, travel_s), (stroke_m, travel_s))
}

/// The first row at or after a time, s of the record, and how a cycle begins there.
fn begins_at(
    recorded: &RecordedRun,
    data: &RunData,
    earliest_s: f64,
    (stroke_m, travel_s): (f64, f64),
) -> Option<(f64, Beginning)> {
    let first = data.times_s.partition_point(|time| *time < earliest_s);
    let from_s = *data.times_s.get(first)?;
    let times: Vec<f64> = data.times_s[first..].iter().map(|time| time - from_s).collect();
    let mut edges = recorded.commands.clone();
    edges.retain(|edge| edge.time_s >= from_s);
    for edge in &mut edges {
        edge.time_s -= from_s;
    }
    let position = &data.channels[0];
    Some((from_s, beginning(&times, &position.samples[first..], position.noise, &edges, stroke_m, travel_s)))
}

/// So many times the window from which a beginning is judged a cycle begins before its pressures move.
const AHEAD: f64 = 2.0;

/// What changes by less than this share of its range from one window to the next is steady: of a pressure as much as the zero of
/// its sensor may be off by.
const STEADY: f64 = 0.01;

/// A recorded channel, with the least change of it that counts as one.
struct Recorded<'a> {
    time_s: &'a [f64],
    samples: &'a [f64],
    least: f64,
}

impl<'a> Recorded<'a> {
    fn new(time_s: &'a [f64], samples: &'a [f64]) -> Self {
        let range = |(low, high): (f64, f64), x: &f64| (low.min(*x), high.max(*x));
        let (low, high) = samples.iter().fold((f64::INFINITY, f64::NEG_INFINITY), range);
        Self { time_s, samples, least: STEADY * (high - low) }
    }

    /// Whether its mean stays from the window before the last one to the last one before a time. Without rows it does.
    fn is_steady(&self, until_s: f64, window_s: f64) -> bool {
        let place = |windows: f64| self.time_s.partition_point(|time| *time < until_s - windows * window_s);
        let mean = |rows: Range<usize>| {
            let seen = || self.samples[rows.clone()].iter().filter(|sample| sample.is_finite());
            seen().sum::<f64>() / seen().count() as f64
        };
        let change = mean(place(1.0)..place(0.0)) - mean(place(2.0)..place(1.0));
        change.is_nan() || change.abs() <= self.least
    }
}

/// The last time before a command, within twice a stroke's travel, at which a piston and the pressures that drive it were steady, s. A
/// command that was read off a pressure comes when that has risen halfway, and a pressure that stands still may do so because
/// the piston gives way. A piston that does not rest begins where the pressures were steady, or else with the command.
fn steady_before(data: &RunData, closing_s: f64, window_s: f64, travel_s: f64) -> f64 {
    let Some(prescribed) = data.driving.as_ref().map(|driving| &*driving.recorded) else { return closing_s };
    let measured = [&prescribed.pipe_pressure_pa, &prescribed.chamber_pressure_pa].into_iter().flatten();
    let pressures: Vec<Recorded<'_>> = measured.map(|samples| Recorded::new(&prescribed.time_s, samples)).collect();
    let position = Recorded::new(&data.times_s, &data.channels[0].samples);
    let is_steady = |until_s: f64| pressures.iter().all(|pressure| pressure.is_steady(until_s, window_s));
    let moments = || {
        let times = std::iter::successors(Some(closing_s), |time| Some(time - window_s));
        // The pressure rises for some time before the piston gives way, and the command may come in the midst of its travel.
        times.take_while(|time| *time > closing_s - 2.0 * travel_s)
    };
    let rests = |until_s: &f64| position.is_steady(*until_s, window_s) && is_steady(*until_s);
    let found = moments().find(rests).or_else(|| moments().find(|time| is_steady(*time)));
    found.unwrap_or(closing_s)
}

/// The cycles of a record: each from a command to close that finds the valve open and at rest to the next such. The
/// simulation of a later one begins with the cycle before it, which leaves some gas behind. One that finds the piston on its
/// way between the stops begins with the motion that the record shows, in which the gas about balances the other forces: a simulation of
/// many such cycles at a stretch adds up what the model is off by.
pub(super) fn parts(
    recorded: &RecordedRun,
    data: &RunData,
    start: Beginning,
    (stroke_m, travel_s): (f64, f64),
) -> Vec<Part> {
    let lead_s = lead_s(data);
    let origin_s = match start {
        Beginning::Open | Beginning::Closed | Beginning::Filling => -lead_s,
        Beginning::Moving { .. } | Beginning::Venting { .. } => 0.0,
    };
    let mut parts = vec![Part { from_s: f64::NEG_INFINITY, until_s: f64::INFINITY, origin_s, beginning: start }];
    // When the valve was open and at rest as the last of them began.
    let mut rested_s = None;
    for closing in recorded.commands.iter().filter(|edge| edge.close).skip(1) {
        let Some(before) = parts.last_mut() else { break };
        let part = if rests_open(data, closing.time_s, stroke_m, travel_s) {
            // Simulated from the beginning of the one before.
            let from = rested_s.map(|rested_s: f64| (rested_s - lead_s, Beginning::Open));
            let (origin_s, beginning) = from.unwrap_or((before.origin_s, before.beginning));
            rested_s = Some(closing.time_s);
            Part { from_s: closing.time_s, until_s: f64::INFINITY, origin_s, beginning }
        } else if let Some((from_s, beginning @ Beginning::Moving { position_m, .. })) =
            begins_before(recorded, data, closing.time_s, (stroke_m, travel_s))
            && (ON_STOP..1.0 - ON_STOP).contains(&(position_m / stroke_m))
            && from_s > before.from_s.max(before.origin_s) + travel_s
        {
            rested_s = None;
            Part { from_s, until_s: f64::INFINITY, origin_s: from_s, beginning }
        } else {
            continue;
        };
        before.until_s = part.from_s;
        parts.push(part);
    }
    parts
}

/// Whether a command finds the valve open and at rest.
fn rests_open(data: &RunData, command_s: f64, stroke_m: f64, travel_s: f64) -> bool {
    let channel = &data.channels[0];
    let about: Vec<f64> = data
        .times_s
        .iter()
        .zip(&channel.samples)
        .filter(|(at, sample)| **at >= command_s - 0.1 * travel_s && **at <= command_s && sample.is_finite())
        .map(|(_, sample)| *sample)
        .collect();
    let (low, high) = about.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    !about.is_empty() && low > (1.0 - AT_TOP) * stroke_m && high - low < AT_TOP * stroke_m
}

/// A valve this close to its open stop rests there, as a share of the stroke; recorders have zeros of their own.
const AT_TOP: f64 = 0.04;

/// Cycles of all records that are looked at, unless there are more records: further ones of the same conditions only make surer
/// what is known, by the root of their number, and cost as much time as the first ones.
const MOST_CYCLES: usize = 24;

/// Which cycles of each record are looked at, where records hold so many: all of those that hold few, and of the others as
/// many each as there is room for, spread evenly from the first to the last.
pub(super) fn looked_at(counts: &[usize]) -> Vec<Vec<usize>> {
    let all_with = |most: usize| counts.iter().map(|count| (*count).min(most)).sum::<usize>();
    let largest = counts.iter().copied().max().unwrap_or(0);
    let most = (1..=largest).rev().find(|most| all_with(*most) <= MOST_CYCLES).unwrap_or(1);
    let spread = |count: usize| -> Vec<usize> {
        let chosen = count.min(most);
        (0..chosen).map(|place| place * (count - 1) / (chosen - 1).max(1)).collect()
    };
    counts.iter().map(|count| spread(*count)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_long_records_cycles_are_looked_at_that_are_spread_over_them() {
        assert_eq!(looked_at(&[3, 2]), [vec![0, 1, 2], vec![0, 1]]);
        let [long, short, other] = &looked_at(&[40, 2, 17])[..] else { panic!("three records") };
        assert_eq!(long, &[0, 3, 7, 11, 15, 19, 23, 27, 31, 35, 39]);
        assert_eq!((short.len(), other.len(), other.last()), (2, 11, Some(&16)));
        assert_eq!(looked_at(&[9; 30]), vec![vec![0]; 30]);
        assert_eq!(looked_at(&[64])[0].len(), MOST_CYCLES);
        assert_eq!(looked_at(&[1, 0]), [vec![0], vec![]]);
    }
}
