//! A campaign made ready for identification: its records, their runs to simulate, and the noise and activity of their rows.
//!
//! A row is the mean over a thirtieth of a stroke's travel where the valve moves (`rows.rs`), and each cycle may be a record of
//! its own (`cycles.rs`). The model is averaged over the same samples.

use std::ops::Range;
use std::sync::Arc;

use campaign::{Campaign, Run as RecordedRun};
use identify::{GroupPrior, Record, Row, Series};
use valve_model::prescribed::Prescribed;
use valve_model::{Fidelity, Parameters, Run, Schedule, Start};

use super::cycles::{LEAD_S, Part, driven_parts, lead_s, looked_at, parts};
use super::rounded::{Rounded, add_what_is_common};
use super::rows::{cut, mean, rows, sample};
use super::start::{Beginning, beginning};
use super::turns::count_turns;
use crate::data::{Channel, Dataset, RunData, TimingGroup, same_conditions};

/// Rows over the travel of one stroke.
const ROWS_A_TRAVEL: f64 = 30.0;

/// Samples of the model in a row, at most.
const MOST_SAMPLES: usize = 8;

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
    /// Which samples of the recorded run it is of.
    pub samples: Range<usize>,
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
pub struct Recording {
    /// Its file, and its place in it where the file holds several.
    pub name: String,
    /// The run to simulate; its time 0 is [`Recording::origin_s`] of the record.
    pub run: Run,
    /// The measured pressures that drive it with another draw of their noise.
    pub redrawn: Option<Arc<Prescribed>>,
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
    /// The recordings, in the order of the records.
    pub recordings: Vec<Recording>,
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
    pub is_prescribed: bool,
    /// How much a simulation begins before a record that begins at rest, s.
    pub lead_s: f64,
    /// How long a stroke would travel at its quickest, s: what rows and steps follow.
    pub travel_s: f64,
    /// How long the quicker stroke does travel from end to end, s: much longer where a piston that stuck leaps.
    pub whole_travel_s: f64,
    /// Recorded cycles that are not looked at, since the records hold so many.
    pub cycles_left_out: usize,
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
        let travel_s = median(data.runs.iter().filter_map(|run| quickest_s(run, stroke_m)))
            .unwrap_or_else(|| 0.2 * data.runs.first().map_or(1.0, |run| run.run.end_s));
        let whole_travel_s =
            median(data.runs.iter().filter_map(shortest_s)).map_or(travel_s, |whole| whole.max(travel_s));
        let push_n = (parameters.supply_pressure_pa - ambient_pa).abs() * parameters.piston_area_m2;
        let is_prescribed = campaign.inputs.pipe_pressure || campaign.inputs.chamber_pressure;
        let fidelity = Fidelity {
            most_inert_kg: INERTIA_SHARE * push_n * travel_s * travel_s / stroke_m,
            ..Fidelity::with_step(step_s(travel_s)).with_most_substeps(MOST_SUBSTEPS).with_every_step()
        };
        let mut recordings = Vec::new();
        let mut records: Vec<Record> = Vec::new();
        let mut rounded: Vec<Vec<Vec<Rounded>>> = Vec::new();
        let cycles_of = |(recorded, run)| cycles(recorded, run, travel_s, (stroke_m, ambient_pa), is_prescribed);
        let cycles: Vec<Vec<Part>> = campaign.runs.iter().zip(&data.runs).map(cycles_of).collect();
        let counts: Vec<usize> = cycles.iter().map(Vec::len).collect();
        let chosen = looked_at(&counts);
        for (source, (run, (cycles, chosen))) in data.runs.iter().zip(cycles.iter().zip(&chosen)).enumerate() {
            for cycle in chosen {
                let of_many = (cycles.len() > 1).then_some(cycle + 1);
                let (recording, record, of_channels) =
                    trace_recording(run, &cycles[*cycle], of_many, travel_s, (stroke_m, ambient_pa));
                recordings.push(Recording { fidelity, source, ..recording });
                records.push(record);
                rounded.push(of_channels);
            }
        }
        add_what_is_common(&mut records, &rounded);
        for (index, group) in data.timing_groups.iter().enumerate() {
            let (recording, record) = times_recording(data, group);
            recordings.push(Recording { fidelity, source: data.runs.len() + index, ..recording });
            records.push(record);
        }
        for index in 0..records.len() {
            let same = (0..index)
                .find(|other| same_conditions(&recordings[*other].run.conditions, &recordings[index].run.conditions));
            records[index].condition = same.map_or(index, |other| records[other].condition);
        }
        let block_s = travel_s / ROWS_A_TRAVEL;
        let position = GroupPrior {
            multiplier_sigma: if data.noise_is_stated { 0.1 } else { 1.0 },
            multiplier: (0.3, 20.0),
            discrepancy: (1e-5, 0.3),
            time_s: (block_s, 0.25 * stroke_s(data, travel_s)),
        };
        let times = GroupPrior { multiplier_sigma: if data.timings_are_repeated { 0.1 } else { 0.3 }, ..position };
        let positions = records.iter().flat_map(|record| &record.series).filter(|series| series.group == 0);
        let noise_m = positions.flat_map(|series| &series.rows).map(|row| row.sigma).reduce(f64::max);
        Self {
            recordings,
            records: Arc::new(records),
            noise_m,
            groups: vec![position, position, times],
            schedule: data.schedule,
            stroke_m,
            ambient_pa,
            is_prescribed,
            lead_s: data.runs.iter().map(lead_s).fold(LEAD_S, f64::max),
            travel_s,
            whole_travel_s,
            cycles_left_out: counts.iter().sum::<usize>() - chosen.iter().map(Vec::len).sum::<usize>(),
        }
    }

    /// The same campaign with only some of its records.
    #[must_use]
    pub fn only(&self, keep: &[usize]) -> Self {
        Self {
            recordings: keep.iter().map(|index| self.recordings[*index].clone()).collect(),
            records: Arc::new(keep.iter().map(|index| self.records[*index].clone()).collect()),
            ..self.clone()
        }
    }

    /// Lets the simulation of a record begin at rest so long before its first row.
    pub(super) fn begin_earlier(&mut self, recording: usize, lead_s: f64) {
        let recording = &mut self.recordings[recording];
        let by = -lead_s - recording.origin_s;
        recording.origin_s = -lead_s;
        recording.run.end_s -= by;
        for edge in &mut recording.run.commands {
            edge.time_s -= by;
        }
        for driving in [&mut recording.run.prescribed, &mut recording.redrawn].into_iter().flatten() {
            let time_s = driving.time_s.iter().map(|time| time - by).collect();
            *driving = Arc::new(Prescribed { time_s, ..Prescribed::clone(driving) });
        }
    }

    /// Lets the simulation of a record begin open and vented, its first command in its first row.
    pub(super) fn begin_open(&mut self, recording: usize) {
        self.begin_earlier(recording, self.lead_s);
        self.recordings[recording].beginning = Beginning::Open;
    }

    /// Lets the simulation of a record begin closed and filled.
    pub(super) fn begin_closed(&mut self, recording: usize) {
        self.begin_earlier(recording, self.lead_s);
        let lead_s = self.lead_s;
        let recording = &mut self.recordings[recording];
        recording.beginning = Beginning::Closed;
        recording.run.start = Start::ClosedRest;
        recording.run.commands.retain(|edge| !edge.closes() || edge.time_s > lead_s);
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

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Share of the span over which the quickest travel is looked for.
const QUICKEST_SHARE: f64 = 0.2;

/// Samples are averaged over this time before, s.
const AVERAGED_S: f64 = 4e-3;

/// Times and positions of a record, averaged, and the ends between which these lie.
fn averaged(run: &RunData) -> (Vec<(f64, f64)>, (f64, f64)) {
    let (times, samples) = (&run.times_s, &run.channels[0].samples);
    let means: Vec<(f64, f64)> = cut(times, samples, AVERAGED_S)
        .into_iter()
        .map(|range| mean(times, samples, range))
        .map(|(time_s, position_m, _)| (time_s, position_m))
        .collect();
    let ends = means.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |ends, (_, x)| (ends.0.min(*x), ends.1.max(*x)));
    (means, ends)
}

/// A piston within this share of the span from one of its ends is there.
const AT_END: f64 = 0.1;

/// How long a recorded stroke travels from end to end, s: the shortest of the run's; nothing where none is whole.
fn shortest_s(run: &RunData) -> Option<f64> {
    let (means, (low, high)) = averaged(run);
    let near = AT_END * (high - low);
    let (mut left, mut shortest) = (None, None);
    for (time_s, position_m) in means {
        let is_high = if position_m < low + near {
            false
        } else if position_m > high - near {
            true
        } else {
            continue;
        };
        if let Some((left_s, was_high)) = left
            && was_high != is_high
        {
            shortest = Some(f64::min(shortest.unwrap_or(f64::INFINITY), time_s - left_s));
        }
        left = Some((time_s, is_high));
    }
    shortest
}

/// How long a recorded stroke travels at its quickest, s: five times the shortest time in which a fifth of the span is
/// covered.
fn quickest_s(run: &RunData, stroke_m: f64) -> Option<f64> {
    let (means, (low, high)) = averaged(run);
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

impl Recording {
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

/// The cycles of a record.
fn cycles(
    recorded: &RecordedRun,
    data: &RunData,
    travel_s: f64,
    (stroke_m, ambient_pa): (f64, f64),
    is_prescribed: bool,
) -> Vec<Part> {
    let (position, commands) = (&data.channels[0], &recorded.commands);
    let mut start = beginning(&data.times_s, &position.samples, position.noise, commands, stroke_m, travel_s);
    let levels_pa = (ambient_pa, data.run.conditions.supply_pressure_pa);
    for pressure in &data.channels[1..] {
        start = start.with_pressure(&data.times_s, &pressure.samples, pressure.noise, commands, levels_pa);
    }
    if is_prescribed {
        driven_parts(recorded, data, start, (stroke_m, travel_s))
    } else {
        parts(recorded, data, start, (stroke_m, travel_s))
    }
}

/// A cycle of a record, and its number in it where that holds several.
fn trace_recording(
    data: &RunData,
    part: &Part,
    number: Option<usize>,
    travel_s: f64,
    (stroke_m, ambient_pa): (f64, f64),
) -> (Recording, Record, Vec<Vec<Rounded>>) {
    let span_pa = (data.run.conditions.supply_pressure_pa - ambient_pa).abs().max(0.1 * ambient_pa);
    let mut series = Vec::new();
    let mut channels = Vec::new();
    let mut of_channels = Vec::new();
    let inside = |time: &f64| *time >= part.from_s && *time < part.until_s;
    let first = data.times_s.iter().position(inside).unwrap_or(0);
    let end = data.times_s.iter().rposition(inside).map_or(0, |last| last + 1);
    let times = &data.times_s[first..end];
    for channel in &data.channels {
        let is_position = channel.channel == Channel::Position;
        let scale = if is_position { stroke_m } else { span_pa };
        let samples = &channel.samples[first..end];
        let cut = rows(times, samples, channel, scale, travel_s / ROWS_A_TRAVEL);
        let mut samples_s = Vec::new();
        let mut ranges = Vec::with_capacity(cut.ranges.len());
        for range in cut.ranges {
            let first = samples_s.len();
            sample(times, samples, range, MOST_SAMPLES, &mut samples_s);
            ranges.push((first, samples_s.len()));
        }
        series.push(Series { rows: cut.rows, group: usize::from(!is_position), is_process: true });
        of_channels.push(cut.rounded);
        channels.push(ChannelRows { channel: channel.channel, samples_s, rows: ranges });
    }
    let run = part.run(data);
    let edges_s: Vec<f64> = run.commands.iter().map(|edge| edge.time_s + part.origin_s).collect();
    count_turns(&mut series, &edges_s, stroke_m);
    let name = number.map_or_else(|| data.name.clone(), |number| format!("{}, cycle {number}", data.name));
    let recording = Recording {
        name,
        run,
        redrawn: data.driving.as_ref().map(|driving| part.driving(data, &driving.redrawn)),
        origin_s: part.origin_s,
        unseen_s: part.unseen_s(data),
        beginning: part.beginning,
        fidelity: Fidelity::FINE,
        source: 0,
        kind: Kind::Trace(Trace { channels, samples: first..end }),
    };
    (recording, Record { series, condition: 0 }, of_channels)
}

fn times_recording(data: &Dataset, group: &TimingGroup) -> (Recording, Record) {
    let mut rows = Vec::new();
    let mut closing = Vec::new();
    for row in &group.rows {
        let row = &data.timing_rows[*row];
        for (time, closes) in [(row.close_time_s, true), (row.open_time_s, false)] {
            if let Some(observed) = time {
                rows.push(Row {
                    time_s: rows.len() as f64,
                    observed,
                    sigma: data.timing_noise_s,
                    activity: observed,
                    turns: 0,
                });
                closing.push(closes);
            }
        }
    }
    let run = Run {
        conditions: group.conditions,
        commands: Vec::new(),
        end_s: data.schedule.end_s,
        prescribed: None,
        start: Start::Rest,
    };
    let series = vec![Series { rows, group: 2, is_process: false }];
    let kind = Kind::Times(Times { cycles: group.cycles, closing });
    let recording = Recording {
        name: "stroke times".into(),
        run,
        redrawn: None,
        origin_s: 0.0,
        beginning: Beginning::Open,
        unseen_s: [0.0; 2],
        fidelity: Fidelity::FINE,
        source: 0,
        kind,
    };
    (recording, Record { series, condition: 0 })
}
