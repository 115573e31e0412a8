//! Strokes repeated under the same conditions, and how their records lie beside each other.
//!
//! A recorder is started by hand: the command comes now half a second after the start of a record, now a
//! little later, and between two samples. Repeats are compared at the same time after their first command.

use valve_model::CommandEdge;

use crate::data::{ChannelData, Dataset, RunData, same_conditions};

/// Commands that come this close to the same time after the first are the same, s.
const SAME_COMMAND_S: f64 = 0.02;

/// Blocks further apart have a gap between them, s.
const GAP_S: f64 = 0.02;

/// Strokes repeated under the same conditions.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeats {
    /// The units: runs, then single rows of stroke times.
    pub units: Vec<usize>,
    /// For each of them, where its record stands at the same times; as many for all.
    pub places: Vec<Vec<Place>>,
}

/// A time in the record of a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The last residual of the unit before it.
    before: usize,
    /// How far it is on the way to the next one.
    share: f64,
}

impl Place {
    /// The residual of the unit that is nearest.
    pub fn nearest(self) -> usize {
        self.before + usize::from(self.share > 0.5)
    }

    /// A quantity of every residual of the unit, by a straight line.
    pub fn between(self, value: impl Fn(usize) -> f64) -> f64 {
        if self.share == 0.0 {
            return value(self.before);
        }
        (1.0 - self.share) * value(self.before) + self.share * value(self.before + 1)
    }

    /// The variance of such a quantity from that of every residual, if those are independent.
    pub fn variance_between(self, variance: impl Fn(usize) -> f64) -> f64 {
        if self.share == 0.0 {
            return variance(self.before);
        }
        (1.0 - self.share).powi(2) * variance(self.before) + self.share.powi(2) * variance(self.before + 1)
    }
}

/// The repeated strokes of a dataset: at least two in each group.
pub fn repeats(data: &Dataset) -> Vec<Repeats> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, run) in data.runs.iter().enumerate() {
        match groups.iter_mut().find(|group| are_repeats(&data.runs[group[0]], run)) {
            Some(group) => group.push(index),
            None => groups.push(vec![index]),
        }
    }
    let traces = groups.into_iter().map(|units| {
        let runs: Vec<&RunData> = units.iter().map(|unit| &data.runs[*unit]).collect();
        Repeats { places: places(&runs), units }
    });
    let mut timed: Vec<(usize, Vec<usize>)> = Vec::new();
    let mut next = data.runs.len();
    for (index, group) in data.timing_groups.iter().enumerate() {
        let rows = next..next + group.rows.len();
        next = rows.end;
        let same = |first: usize| same_conditions(&data.timing_groups[first].conditions, &group.conditions);
        match timed.iter_mut().find(|(first, _)| same(*first)) {
            Some((_, units)) => units.extend(rows),
            None => timed.push((index, rows.collect())),
        }
    }
    let closing_and_opening = [0, 1].map(|before| Place { before, share: 0.0 });
    let timings =
        timed.into_iter().map(|(_, units)| Repeats { places: vec![closing_and_opening.to_vec(); units.len()], units });
    traces.chain(timings).filter(|repeats| repeats.units.len() > 1 && !repeats.places[0].is_empty()).collect()
}

fn are_repeats(one: &RunData, other: &RunData) -> bool {
    let channels = |run: &RunData| run.channels.iter().map(|channel| channel.channel).collect::<Vec<_>>();
    let after = |run: &RunData, edge: &CommandEdge| edge.time_s - first_command_s(run);
    let commands = (&one.run.commands, &other.run.commands);
    same_conditions(&one.run.conditions, &other.run.conditions)
        && channels(one) == channels(other)
        && commands.0.len() == commands.1.len()
        && commands
            .0
            .iter()
            .zip(commands.1)
            .all(|(a, b)| a.close == b.close && (after(one, a) - after(other, b)).abs() < SAME_COMMAND_S)
}

fn first_command_s(run: &RunData) -> f64 {
    run.run.commands.first().map_or(0.0, |edge| edge.time_s)
}

/// Where every run stands at the times of the first one's blocks after its first command, as far as all of
/// them were recorded.
fn places(runs: &[&RunData]) -> Vec<Vec<Place>> {
    let mut places = vec![Vec::new(); runs.len()];
    let mut starts = vec![0; runs.len()];
    for channel in 0..runs[0].channels.len() {
        for block in &runs[0].channels[channel].blocks {
            let after = block.time_s - first_command_s(runs[0]);
            let at = |(run, start): (&&RunData, &usize)| {
                let place = place(&run.channels[channel], after + first_command_s(run))?;
                Some(Place { before: start + place.before, ..place })
            };
            let beside: Option<Vec<Place>> = runs.iter().zip(&starts).map(at).collect();
            for (places, place) in places.iter_mut().zip(beside.into_iter().flatten()) {
                places.push(place);
            }
        }
        for (start, run) in starts.iter_mut().zip(runs) {
            *start += run.channels[channel].blocks.len();
        }
    }
    places
}

/// Where a channel stands at a time; nothing outside its record and in its gaps.
fn place(channel: &ChannelData, time_s: f64) -> Option<Place> {
    /// Rounding of times, s.
    const ROUNDING_S: f64 = 1e-9;
    let blocks = &channel.blocks;
    let before = blocks.partition_point(|block| block.time_s <= time_s + ROUNDING_S).checked_sub(1)?;
    let late = time_s - blocks[before].time_s;
    if late.abs() <= ROUNDING_S {
        return Some(Place { before, share: 0.0 });
    }
    let width = blocks.get(before + 1)?.time_s - blocks[before].time_s;
    (width < GAP_S).then_some(Place { before, share: late / width })
}
