//! A campaign made ready for identification: rows that follow the motion, with their noise and their activity.
//!
//! Where the valve moves, a row is the mean over a thirtieth of a stroke's travel; where it rests, over ten times
//! that. The model is averaged over the same samples.

use std::ops::Range;
use std::sync::Arc;

use campaign::{Campaign, Run as RecordedRun};
use identify::{GroupPrior, Record, Row, Series};
use valve_model::driven::Driven;
use valve_model::{CommandEdge, Fidelity, Parameters, Run, Schedule, Start};

use super::start::{Beginning, beginning, window_s};
use crate::data::{Channel, Dataset, RunData, TimingGroup, same_conditions};

/// Rows over the travel of one stroke.
const ROWS_A_TRAVEL: f64 = 30.0;

/// Rows at rest are this many times longer.
const LONGER_AT_REST: f64 = 10.0;

/// Samples of the model in a row, at most.
const MOST_SAMPLES: usize = 8;

/// The model error at rest as a share of that at full speed.
const ACTIVITY_AT_REST: f64 = 0.03;

/// Groups of errors: positions, pressures, stroke times.
pub const GROUPS: usize = 3;

/// A channel of a recorded run.
#[derive(Debug, Clone)]
pub struct ChannelRows {
    /// Which.
    pub channel: Channel,
    /// Times at which the model is sampled, s.
    pub samples_s: Vec<f64>,
    /// For each row the samples that it is the mean of.
    pub rows: Vec<(usize, usize)>,
}

/// A recorded run.
#[derive(Debug, Clone)]
pub struct Trace {
    /// Its channels, in the order of the record's series.
    pub channels: Vec<ChannelRows>,
}

/// Stroke times under one set of conditions.
#[derive(Debug, Clone)]
pub struct Times {
    /// Cycles to simulate; the last one counts.
    pub cycles: usize,
    /// For each row of the record: whether it is a closing time.
    pub closing: Vec<bool>,
}

/// What a record is of.
#[derive(Debug, Clone)]
pub enum Kind {
    /// A recorded run.
    Trace(Trace),
    /// Stroke times alone.
    Times(Times),
}

/// One record and how to simulate it.
#[derive(Debug, Clone)]
pub struct Unit {
    /// Its file, and its place in it where the file holds several.
    pub name: String,
    /// The run to simulate; its time 0 is [`Unit::origin_s`] of the record.
    pub run: Run,
    /// When the simulation begins, in the time of the record, s.
    pub origin_s: f64,
    /// How the simulation begins.
    pub beginning: Beginning,
    /// How long before a command to close, and one to open, the row before it was written, s: when in that time the command
    /// was given is not recorded. The longest of each.
    pub unseen_s: [f64; 2],
    /// How closely it is simulated.
    pub fidelity: Fidelity,
    /// The recorded run that it is a part of, by index; stroke times follow the runs.
    pub source: usize,
    /// What it is of.
    pub kind: Kind,
}

/// A campaign made ready.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The units, in the order of the records.
    pub units: Vec<Unit>,
    /// What was observed.
    pub records: Arc<Vec<Record>>,
    /// What is known of the errors of each group.
    pub groups: Vec<GroupPrior>,
    /// Largest noise of a row of positions, before the multiplier, m; none where no positions were recorded.
    pub noise_m: Option<f64>,
    /// Cycle of stroke times without traces.
    pub schedule: Schedule,
    /// Travel between the stops, m.
    pub stroke_m: f64,
    /// Atmospheric pressure, Pa.
    pub ambient_pa: f64,
    /// Whether a recorded pressure drives the model.
    pub is_driven: bool,
    /// How much a simulation begins before a record that begins at rest, s.
    pub lead_s: f64,
    /// How long a stroke travels, s.
    pub travel_s: f64,
}

/// How much a simulation begins before a record that begins at rest, so that a command may come early, s.
const LEAD_S: f64 = 0.1;

/// The same in rows of a slow recorder, which writes a command down up to one of them too late.
const LEAD_ROWS: f64 = 2.0;

/// How much a simulation begins before this record.
fn lead_s(data: &RunData) -> f64 {
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
fn unseen_s(data: &RunData, commands: &[CommandEdge]) -> [f64; 2] {
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

/// Substeps that a step is cut into at most, unless more are needed.
const MOST_SUBSTEPS: u32 = 4;

/// The inertia of a stroke that takes its time evenly may be this share of what the supply can push with.
const INERTIA_SHARE: f64 = 1e-4;

/// The usual step of the integrator, s: a millisecond, longer where a stroke takes very long, shorter where it is over at once.
fn step_s(travel_s: f64) -> f64 {
    (travel_s / 100.0).clamp(2e-4, (travel_s / 600.0).clamp(1e-3, 0.02))
}

impl Setup {
    /// Makes a campaign ready. `data` is the same campaign as the comparison sees it.
    pub fn new(campaign: &Campaign, data: &Dataset, parameters: &Parameters) -> Self {
        let (stroke_m, ambient_pa) = (parameters.stroke_m, parameters.ambient_pressure_pa);
        let travel_s = travel_s(data, stroke_m);
        let push_n = (parameters.supply_pressure_pa - ambient_pa).abs() * parameters.piston_area_m2;
        let is_driven = campaign.inputs.pipe_pressure || campaign.inputs.chamber_pressure;
        let fidelity = Fidelity {
            most_inert_kg: INERTIA_SHARE * push_n * travel_s * travel_s / stroke_m,
            ..Fidelity::with_step(step_s(travel_s)).with_most_substeps(MOST_SUBSTEPS).with_every_step()
        };
        let mut units = Vec::new();
        let mut records: Vec<Record> = Vec::new();
        for (source, (recorded, run)) in campaign.runs.iter().zip(&data.runs).enumerate() {
            for (unit, record) in trace_units(recorded, run, travel_s, (stroke_m, ambient_pa), is_driven) {
                units.push(Unit { fidelity, source, ..unit });
                records.push(record);
            }
        }
        for (index, group) in data.timing_groups.iter().enumerate() {
            let (unit, record) = times_unit(data, group);
            units.push(Unit { fidelity, source: data.runs.len() + index, ..unit });
            records.push(record);
        }
        for index in 0..records.len() {
            let same =
                (0..index).find(|other| same_conditions(&units[*other].run.conditions, &units[index].run.conditions));
            records[index].condition = same.map_or(index, |other| records[other].condition);
        }
        let block_s = travel_s / ROWS_A_TRAVEL;
        let position = GroupPrior {
            multiplier_sigma: if data.noise_is_stated { 0.1 } else { 1.0 },
            multiplier: (0.3, 20.0),
            discrepancy: (1e-5, 0.3),
            time_s: (block_s, 0.25 * stroke_s(data, travel_s)),
        };
        let times = GroupPrior { multiplier_sigma: 0.3, ..position };
        let positions = records.iter().flat_map(|record| &record.series).filter(|series| series.group == 0);
        let noise_m = positions.flat_map(|series| &series.rows).map(|row| row.sigma).reduce(f64::max);
        Self {
            units,
            records: Arc::new(records),
            noise_m,
            groups: vec![position, position, times],
            schedule: data.schedule,
            stroke_m,
            ambient_pa,
            is_driven,
            lead_s: data.runs.iter().map(lead_s).fold(LEAD_S, f64::max),
            travel_s,
        }
    }

    /// The same campaign with only some of its records.
    #[must_use]
    pub fn only(&self, keep: &[usize]) -> Self {
        Self {
            units: keep.iter().map(|index| self.units[*index].clone()).collect(),
            records: Arc::new(keep.iter().map(|index| self.records[*index].clone()).collect()),
            ..self.clone()
        }
    }

    /// Lets the simulation of a record begin at rest so long before its first row.
    pub(super) fn begin_earlier(&mut self, unit: usize, lead_s: f64) {
        let unit = &mut self.units[unit];
        let by = -lead_s - unit.origin_s;
        unit.origin_s = -lead_s;
        unit.run.end_s -= by;
        for edge in &mut unit.run.commands {
            edge.time_s -= by;
        }
        if let Some(driven) = &unit.run.driven {
            let time_s = driven.time_s.iter().map(|time| time - by).collect();
            unit.run.driven = Some(Arc::new(Driven { time_s, ..Driven::clone(driven) }));
        }
    }

    /// Lets the simulation of a record begin open and vented, its first command in its first row.
    pub(super) fn begin_open(&mut self, unit: usize) {
        self.begin_earlier(unit, self.lead_s);
        self.units[unit].beginning = Beginning::Open;
    }

    /// Lets the simulation of a record begin closed and filled.
    pub(super) fn begin_closed(&mut self, unit: usize) {
        self.begin_earlier(unit, self.lead_s);
        let lead_s = self.lead_s;
        let unit = &mut self.units[unit];
        unit.beginning = Beginning::Closed;
        unit.run.start = Start::ClosedRest;
        unit.run.commands.retain(|edge| !edge.closes() || edge.time_s > lead_s);
    }

    /// Counts what a simulation cuts short as noise: `errors_m`, by record and row, in the units of the rows. Rows about one
    /// of them count as well, since a fit moves in time what happens there.
    pub(super) fn add_noise(&mut self, errors: &[Vec<f64>]) {
        for (record, errors) in Arc::make_mut(&mut self.records).iter_mut().zip(errors) {
            let mut first = 0;
            for series in &mut record.series {
                let of_series = &errors[first..first + series.rows.len()];
                first += series.rows.len();
                for (index, row) in series.rows.iter_mut().enumerate() {
                    let about = index.saturating_sub(1)..(index + 2).min(of_series.len());
                    let error = of_series[about].iter().fold(0.0, |most: f64, error| most.max(error.abs()));
                    row.sigma = row.sigma.hypot(error);
                }
            }
        }
    }
}

/// How long a recorded stroke travels at its quickest, s: five times the shortest time in which a fifth of the span is
/// covered, the median over the runs.
fn travel_s(data: &Dataset, stroke_m: f64) -> f64 {
    let mut travels: Vec<f64> = data.runs.iter().filter_map(|run| quickest_s(run, stroke_m)).collect();
    travels.sort_by(f64::total_cmp);
    travels.get(travels.len() / 2).copied().unwrap_or_else(|| 0.2 * data.runs.first().map_or(1.0, |run| run.run.end_s))
}

/// Share of the span over which the quickest travel is looked for.
const QUICKEST_SHARE: f64 = 0.2;

/// Samples are averaged over this time before, s.
const AVERAGED_S: f64 = 4e-3;

fn quickest_s(run: &RunData, stroke_m: f64) -> Option<f64> {
    let (times, samples) = (&run.times_s, &run.channels[0].samples);
    let means: Vec<(f64, f64)> = cut(times, samples, AVERAGED_S)
        .into_iter()
        .map(|range| mean(times, samples, range))
        .map(|(time_s, position_m, _)| (time_s, position_m))
        .collect();
    let (low, high) =
        means.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |ends, (_, x)| (ends.0.min(*x), ends.1.max(*x)));
    let far = QUICKEST_SHARE * (high - low);
    if high - low < 0.1 * stroke_m {
        return None;
    }
    let mut quickest = f64::INFINITY;
    for (index, first) in means.iter().enumerate() {
        for later in &means[index + 1..] {
            let time = later.0 - first.0;
            if time >= quickest {
                break;
            }
            if (later.1 - first.1).abs() >= far {
                quickest = time;
            }
        }
    }
    quickest.is_finite().then_some(quickest / QUICKEST_SHARE)
}

/// About how long a stroke takes from its command, s.
fn stroke_s(data: &Dataset, travel_s: f64) -> f64 {
    let lengths = data.runs.iter().map(|run| run.run.end_s / run.run.commands.len().max(1) as f64);
    lengths.fold(f64::INFINITY, f64::min).clamp(travel_s, 4.0 * travel_s)
}

impl Unit {
    /// For each row of the record: whether its last command is another than one to close (or to open), and such a one came
    /// before it.
    pub(super) fn followed_by_another(&self, closes: bool, record: &Record) -> Vec<bool> {
        let edges = || self.run.commands.iter().rev();
        let of_row = |row: &Row| {
            let time = row.time_s - self.origin_s;
            let mut before = edges().filter(|edge| edge.time_s <= time);
            before.next().is_some_and(|last| last.closes() != closes) && before.any(|edge| edge.closes() == closes)
        };
        record.rows().map(of_row).collect()
    }

    /// Whether it is a recorded run.
    pub fn is_trace(&self) -> bool {
        matches!(self.kind, Kind::Trace(_))
    }

    /// Whether pressures were recorded that judge the model.
    pub fn has_pressures(&self) -> bool {
        matches!(&self.kind, Kind::Trace(trace) if trace.channels.len() > 1)
    }
}

fn trace_units(
    recorded: &RecordedRun,
    data: &RunData,
    travel_s: f64,
    (stroke_m, ambient_pa): (f64, f64),
    is_driven: bool,
) -> Vec<(Unit, Record)> {
    let span_pa = (recorded.conditions.supply_pressure_pa - ambient_pa).abs().max(0.1 * ambient_pa);
    let position = &data.channels[0];
    let start = beginning(&data.times_s, &position.samples, position.noise, &recorded.commands, stroke_m, travel_s);
    let parts = if is_driven {
        driven_parts(recorded, data, start, (stroke_m, travel_s))
    } else {
        parts(data, start, stroke_m, travel_s)
    };
    let count = parts.len();
    parts
        .into_iter()
        .enumerate()
        .map(|(index, part)| {
            let mut series = Vec::new();
            let mut channels = Vec::new();
            let inside = |time: &f64| *time >= part.from_s && *time < part.until_s;
            let first = data.times_s.iter().position(inside).unwrap_or(0);
            let end = data.times_s.iter().rposition(inside).map_or(0, |last| last + 1);
            let times = &data.times_s[first..end];
            for channel in &data.channels {
                let is_position = channel.channel == Channel::Position;
                let scale = if is_position { stroke_m } else { span_pa };
                let samples = &channel.samples[first..end];
                let (rows, cut) = rows(times, samples, channel.noise, scale, travel_s / ROWS_A_TRAVEL);
                let mut samples_s = Vec::new();
                let mut ranges = Vec::with_capacity(cut.len());
                for range in cut {
                    let first = samples_s.len();
                    sample(times, samples, range, MOST_SAMPLES, &mut samples_s);
                    ranges.push((first, samples_s.len()));
                }
                series.push(Series { rows, group: usize::from(!is_position), is_process: true });
                channels.push(ChannelRows { channel: channel.channel, samples_s, rows: ranges });
            }
            let name = if count > 1 { format!("{}, cycle {}", data.name, index + 1) } else { data.name.clone() };
            let unit = Unit {
                name,
                run: part.run(data),
                origin_s: part.origin_s,
                unseen_s: part.unseen_s(data),
                beginning: part.beginning,
                fidelity: Fidelity::FINE,
                source: 0,
                kind: Kind::Trace(Trace { channels }),
            };
            (unit, Record { series, condition: 0 })
        })
        .collect()
}

/// A stretch of a record that counts as a record of its own, and where its simulation begins.
struct Part {
    from_s: f64,
    until_s: f64,
    origin_s: f64,
    beginning: Beginning,
}

impl Part {
    fn unseen_s(&self, data: &RunData) -> [f64; 2] {
        let inside = |edge: &&CommandEdge| edge.time_s >= self.from_s && edge.time_s < self.until_s;
        let commands: Vec<CommandEdge> = data.run.commands.iter().filter(inside).copied().collect();
        unseen_s(data, &commands)
    }

    fn run(&self, data: &RunData) -> Run {
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
        if let Some(driven) = &run.driven
            && (self.origin_s != 0.0 || self.until_s < data.run.end_s)
        {
            // A recorder's clock may see what comes a little later.
            run.driven = Some(Arc::new(driven.between(self.origin_s, self.until_s + LEAD_S)));
        }
        run
    }
}

/// The cycles of a record whose recorded pressure drives the model: each from shortly before a command to close. Such a
/// cylinder may never rest on a stop, and a simulation of many cycles at a stretch adds up what the model is off by; the
/// position and the speed at the beginning of each are in the record.
fn driven_parts(
    recorded: &RecordedRun,
    data: &RunData,
    start: Beginning,
    (stroke_m, travel_s): (f64, f64),
) -> Vec<Part> {
    let window_s = window_s(travel_s).max(rows_s(data, LEAD_ROWS));
    let closings = recorded.commands.iter().filter(|edge| edge.close).map(|edge| edge.time_s);
    let mut parts = vec![Part { from_s: f64::NEG_INFINITY, until_s: f64::INFINITY, origin_s: 0.0, beginning: start }];
    for closing_s in closings.skip(1).take(MOST_PARTS) {
        let rest_s = steady_before(data, closing_s, window_s, travel_s);
        let first = data.times_s.partition_point(|time| *time < rest_s - AHEAD * window_s);
        let Some(&from_s) = data.times_s.get(first).filter(|from| **from < closing_s) else { continue };
        if parts.last().is_some_and(|before| from_s < before.origin_s + travel_s) {
            continue;
        }
        let times: Vec<f64> = data.times_s[first..].iter().map(|time| time - from_s).collect();
        let mut edges = recorded.commands.clone();
        edges.retain(|edge| edge.time_s >= from_s);
        for edge in &mut edges {
            edge.time_s -= from_s;
        }
        let position = &data.channels[0];
        let begins = beginning(&times, &position.samples[first..], position.noise, &edges, stroke_m, travel_s);
        if let Some(before) = parts.last_mut() {
            before.until_s = from_s;
        }
        parts.push(Part { from_s, until_s: f64::INFINITY, origin_s: from_s, beginning: begins });
    }
    parts
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
    let Some(driven) = data.run.driven.as_deref() else { return closing_s };
    let measured = [&driven.pipe_pressure_pa, &driven.chamber_pressure_pa].into_iter().flatten();
    let pressures: Vec<Recorded<'_>> = measured.map(|samples| Recorded::new(&driven.time_s, samples)).collect();
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
/// simulation of a later one begins with the cycle before it, which leaves some gas behind.
fn parts(data: &RunData, start: Beginning, stroke_m: f64, travel_s: f64) -> Vec<Part> {
    let lead_s = lead_s(data);
    let origin_s = match start {
        Beginning::Open | Beginning::Closed | Beginning::Filling => -lead_s,
        Beginning::Moving { .. } => 0.0,
    };
    let rests = |time: f64| {
        let channel = &data.channels[0];
        let about: Vec<f64> = data
            .times_s
            .iter()
            .zip(&channel.samples)
            .filter(|(at, sample)| **at >= time - 0.1 * travel_s && **at <= time && sample.is_finite())
            .map(|(_, sample)| *sample)
            .collect();
        let (low, high) = about.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
        !about.is_empty() && low > (1.0 - AT_TOP) * stroke_m && high - low < AT_TOP * stroke_m
    };
    let closings: Vec<f64> = data.run.commands.iter().filter(|edge| edge.closes()).map(|edge| edge.time_s).collect();
    let mut cuts: Vec<f64> = closings.iter().copied().skip(1).filter(|time| rests(*time)).collect();
    cuts.truncate(MOST_PARTS);
    let mut parts = Vec::with_capacity(cuts.len() + 1);
    let mut before = (f64::NEG_INFINITY, origin_s, start);
    for cut in cuts.iter().copied().chain([f64::INFINITY]) {
        parts.push(Part { from_s: before.0, until_s: cut, origin_s: before.1, beginning: before.2 });
        // The next one is simulated from the beginning of this one, if that was at rest.
        let first = parts.len() == 1;
        before = if first && origin_s == 0.0 {
            (cut, before.1, before.2)
        } else {
            let from = if first { origin_s } else { cuts[parts.len() - 2] - lead_s };
            (cut, from, if first { start } else { Beginning::Open })
        };
    }
    parts
}

/// A valve this close to its open stop rests there, as a share of the stroke; recorders have zeros of their own.
const AT_TOP: f64 = 0.04;

/// Cycles of one record that are looked at one by one.
const MOST_PARTS: usize = 63;

/// A change between neighbouring rows from which something moves: in deviations of its noise, and as a share of
/// the whole travel.
const MOVING: (f64, f64) = (5.0, 2e-3);

/// Rows about a moving one that stay short.
const ABOUT: usize = 3;

/// The rows of a channel and the samples of each.
fn rows(times: &[f64], samples: &[f64], noise: f64, scale: f64, fast_s: f64) -> (Vec<Row>, Vec<(usize, usize)>) {
    let short = cut(times, samples, fast_s);
    let means: Vec<(f64, f64, f64)> = short.iter().map(|range| mean(times, samples, *range)).collect();
    let moving: Vec<bool> = (0..means.len())
        .map(|index| {
            let (before, after) = (means[index.saturating_sub(1)], means[(index + 1).min(means.len() - 1)]);
            let deviation = noise * (1.0 / before.2 + 1.0 / after.2).sqrt();
            (after.1 - before.1).abs() > (MOVING.0 * deviation).max(MOVING.1 * scale)
        })
        .collect();
    let near = |index: usize| (index.saturating_sub(ABOUT)..(index + ABOUT + 1).min(moving.len())).any(|i| moving[i]);
    let mut ranges: Vec<(usize, usize)> = Vec::new();
    let mut merged = 0.0;
    for (index, range) in short.iter().enumerate() {
        match ranges.last_mut() {
            Some(last) if !near(index) && merged > 0.0 && merged < LONGER_AT_REST => {
                last.1 = range.1;
                merged += 1.0;
            }
            _ => {
                ranges.push(*range);
                merged = if near(index) { 0.0 } else { 1.0 };
            }
        }
    }
    let means: Vec<(f64, f64, f64)> = ranges.iter().map(|range| mean(times, samples, *range)).collect();
    let rates = rates(&means, noise);
    let fastest = rates.iter().fold(0.0, |a: f64, b| a.max(*b)).max(1e-9 * scale);
    let rows = means
        .iter()
        .zip(rates)
        .map(|((time_s, observed, count), rate)| Row {
            time_s: *time_s,
            observed: *observed,
            sigma: noise / count.sqrt(),
            activity: scale * (ACTIVITY_AT_REST + rate / fastest),
        })
        .collect();
    (rows, ranges)
}

/// Stretches of samples of about a duration, each with at least one that counts.
fn cut(times: &[f64], samples: &[f64], duration_s: f64) -> Vec<(usize, usize)> {
    let mut ranges = Vec::new();
    let mut first = 0;
    while first < samples.len() {
        let mut end = first + 1;
        while end < samples.len() && times[end] - times[first] < duration_s - 1e-9 {
            end += 1;
        }
        if samples[first..end].iter().any(|sample| sample.is_finite()) {
            ranges.push((first, end));
        }
        first = end;
    }
    ranges
}

/// Mean time, mean and count of the samples of a stretch that count.
fn mean(times: &[f64], samples: &[f64], (first, end): (usize, usize)) -> (f64, f64, f64) {
    let mut sum = (0.0, 0.0, 0.0);
    for (time, sample) in times[first..end].iter().zip(&samples[first..end]).filter(|(_, sample)| sample.is_finite()) {
        sum = (sum.0 + time, sum.1 + sample, sum.2 + 1.0);
    }
    (sum.0 / sum.2, sum.1 / sum.2, sum.2)
}

/// The speed at each row with what noise alone would show taken out.
fn rates(means: &[(f64, f64, f64)], noise: f64) -> Vec<f64> {
    (0..means.len())
        .map(|index| {
            let (before, after) = (means[index.saturating_sub(1)], means[(index + 1).min(means.len() - 1)]);
            let time = (after.0 - before.0).max(1e-9);
            let variance = noise * noise * (1.0 / before.2 + 1.0 / after.2) / (time * time);
            (((after.1 - before.1) / time).powi(2) - variance).max(0.0).sqrt()
        })
        .collect()
}

/// Times at which the model is sampled for a stretch: its own samples, or a few in their place.
fn sample(times: &[f64], samples: &[f64], (first, end): (usize, usize), most: usize, into: &mut Vec<f64>) {
    let valid: Vec<f64> = (first..end).filter(|index| samples[*index].is_finite()).map(|index| times[index]).collect();
    if valid.len() <= most {
        into.extend(valid);
        return;
    }
    // The middles of equal parts.
    let parts = most as f64;
    into.extend((0..most).map(|part| {
        let place = (part as f64 + 0.5) / parts * valid.len() as f64 - 0.5;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place among a few samples")]
        let left = place.floor().max(0.0) as usize;
        let share = place - left as f64;
        valid[left] + share * (valid[(left + 1).min(valid.len() - 1)] - valid[left])
    }));
}

fn times_unit(data: &Dataset, group: &TimingGroup) -> (Unit, Record) {
    let mut rows = Vec::new();
    let mut closing = Vec::new();
    for row in &group.rows {
        let row = &data.timing_rows[*row];
        for (time, closes) in [(row.close_time_s, true), (row.open_time_s, false)] {
            if let Some(observed) = time {
                rows.push(Row { time_s: rows.len() as f64, observed, sigma: data.timing_noise_s, activity: observed });
                closing.push(closes);
            }
        }
    }
    let run = Run {
        conditions: group.conditions,
        commands: Vec::new(),
        end_s: data.schedule.end_s,
        driven: None,
        start: Start::Rest,
    };
    let series = vec![Series { rows, group: 2, is_process: false }];
    let kind = Kind::Times(Times { cycles: group.cycles, closing });
    let unit = Unit {
        name: "stroke times".into(),
        run,
        origin_s: 0.0,
        beginning: Beginning::Open,
        unseen_s: [0.0; 2],
        fidelity: Fidelity::FINE,
        source: 0,
        kind,
    };
    (unit, Record { series, condition: 0 })
}
