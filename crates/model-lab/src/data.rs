//! What was recorded, made ready to be compared: block means in units of their noise.
//!
//! The motion of a valve is slow against the sampling of a recorder. A few neighbouring samples are
//! averaged into a block, which loses nothing (the model is averaged over the same samples) and makes
//! every fit as many times cheaper.

use std::sync::Arc;

use campaign::{Campaign, Run as RecordedRun, TimingRow, ValveFacts, estimate_position_noise_m};
use valve_model::driven::Driven;
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{CommandEdge, Conditions, Fidelity, Run, Schedule, Start, Valve};

/// The time over which samples are averaged, s.
const BLOCK_S: f64 = 4e-3;

/// Relative noise of a stroke time whose noise is not stated, at least, s.
const LEAST_TIMING_NOISE_S: f64 = 1e-4;

/// Which recorded channel a block belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Position, m.
    Position,
    /// Chamber pressure, Pa.
    ChamberPressure,
    /// Pipe pressure, Pa.
    PipePressure,
}

/// The mean of a few neighbouring samples of one channel.
#[derive(Debug, Clone, Copy)]
pub struct Block {
    /// Index of its first sample.
    pub first: usize,
    /// Index after its last sample.
    pub end: usize,
    /// Mean of its valid samples, SI.
    pub mean: f64,
    /// One over the standard deviation of that mean, 1/SI.
    pub inverse_sigma: f64,
    /// Mean time of its samples, s.
    pub time_s: f64,
}

/// One channel of one run.
#[derive(Debug, Clone)]
pub struct ChannelData {
    /// Which channel.
    pub channel: Channel,
    /// The samples; gaps are NaN.
    pub samples: Vec<f64>,
    /// One standard deviation of a sample, SI.
    pub noise: f64,
    /// The blocks with at least one valid sample, in order of time.
    pub blocks: Vec<Block>,
}

/// One recorded run.
#[derive(Debug, Clone)]
pub struct RunData {
    /// Its file.
    pub name: String,
    /// How to simulate it.
    pub run: Run,
    /// Times of the samples, s.
    pub times_s: Vec<f64>,
    /// Its channels, position first.
    pub channels: Vec<ChannelData>,
}

/// Stroke times recorded under one set of conditions.
#[derive(Debug, Clone)]
pub struct TimingGroup {
    /// The conditions.
    pub conditions: Conditions,
    /// Cycles to simulate; the last one counts.
    pub cycles: usize,
    /// The rows of the campaign, by index into [`Dataset::timing_rows`].
    pub rows: Vec<usize>,
}

/// How closely runs are followed for results: to a hundredth of a micrometre of the motion. More substeps would only serve
/// parameters far from any valve.
pub const FINE_FIT: Fidelity = Fidelity { most_substeps: 4, ..Fidelity::FINE };

/// For the way there: to a micrometre or so of the motion, in half the time.
pub const ROUGH_FIT: Fidelity =
    Fidelity { step_s: 2.0 * DEFAULT_STEP_S, most_substeps: 2, roughness: 2.0, ..Fidelity::FINE };

/// Supply pressures and leaks that differ by less than this share are the same condition.
const SAME_SHARE: f64 = 5e-3;

/// The same for temperatures, K.
const SAME_TEMPERATURE_K: f64 = 1.0;

/// Whether conditions are the same but for how well a gauge is read.
pub fn same_conditions(one: &Conditions, other: &Conditions) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() <= SAME_SHARE * a.abs().max(b.abs());
    near(one.supply_pressure_pa, other.supply_pressure_pa)
        && (one.temperature_k - other.temperature_k).abs() <= SAME_TEMPERATURE_K
        && near(one.leak_to_atmosphere_m2, other.leak_to_atmosphere_m2)
        && near(one.leak_from_supply_m2, other.leak_from_supply_m2)
}

/// What reading a campaign takes from the valve that it was recorded on.
pub fn valve_facts(valve: &Valve) -> ValveFacts {
    let parameters = valve.parameters();
    ValveFacts {
        ambient_pressure_pa: parameters.ambient_pressure_pa,
        supply_pressure_pa: parameters.supply_pressure_pa,
        temperature_k: parameters.temperature_k,
        stroke_m: parameters.stroke_m,
    }
}

/// A campaign made ready for comparison with the model.
#[derive(Debug, Clone)]
pub struct Dataset {
    /// Its name.
    pub name: String,
    /// Recorded runs.
    pub runs: Vec<RunData>,
    /// Stroke times without traces, grouped by conditions.
    pub timing_groups: Vec<TimingGroup>,
    /// The rows themselves.
    pub timing_rows: Vec<TimingRow>,
    /// Noise of a stroke time, s.
    pub timing_noise_s: f64,
    /// The cycle in which stroke times were taken.
    pub schedule: Schedule,
    /// Whether the position noise was stated (or estimated).
    pub noise_is_stated: bool,
    /// How finely it is simulated.
    pub fidelity: Fidelity,
}

impl Dataset {
    /// Makes a campaign ready. `schedule` is that of the valve file, for stroke times without traces.
    pub fn new(campaign: &Campaign, schedule: Schedule) -> Self {
        let position_noise = campaign.sensors.position_noise_m.unwrap_or_else(|| pooled_position_noise(campaign));
        let runs = campaign.runs.iter().map(|run| run_data(run, campaign, position_noise)).collect();
        let mut timing_groups: Vec<TimingGroup> = Vec::new();
        for (index, row) in campaign.timings.iter().enumerate() {
            let conditions = conditions(&row.conditions);
            let leaked = conditions.leak_to_atmosphere_m2 > 0.0 || conditions.leak_from_supply_m2 > 0.0;
            match timing_groups.iter_mut().find(|group| group.conditions == conditions) {
                Some(group) => group.rows.push(index),
                None => timing_groups.push(TimingGroup {
                    conditions,
                    cycles: if leaked { 2 } else { 1 },
                    rows: vec![index],
                }),
            }
        }
        let timing_noise_s = campaign
            .sensors
            .timing_noise_s
            .unwrap_or_else(|| repeat_noise(&timing_groups, &campaign.timings))
            .max(LEAST_TIMING_NOISE_S);
        Self {
            name: campaign.name.clone(),
            runs,
            timing_groups,
            timing_rows: campaign.timings.clone(),
            timing_noise_s,
            schedule,
            noise_is_stated: campaign.sensors.position_noise_m.is_some() || campaign.sensors.timing_noise_s.is_some(),
            fidelity: FINE_FIT,
        }
    }

    /// The same blocks for the way to a result: each one sample at its mean time, simulated roughly.
    #[must_use]
    pub fn rough(&self) -> Self {
        let runs = self.runs.iter().map(RunData::thinned).collect();
        Self {
            runs,
            fidelity: ROUGH_FIT,
            timing_groups: self.timing_groups.clone(),
            timing_rows: self.timing_rows.clone(),
            ..self.without_units()
        }
    }

    /// How many residuals the dataset has: blocks of all channels, two for each row of stroke times.
    pub fn residual_count(&self) -> usize {
        let blocks: usize = self.runs.iter().map(RunData::block_count).sum();
        blocks + 2 * self.timing_rows.len()
    }

    /// The units in which a dataset can be taken apart: runs first, then groups of stroke times.
    pub fn unit_count(&self) -> usize {
        self.runs.len() + self.timing_groups.len()
    }

    /// The conditions of a unit.
    pub fn unit_conditions(&self, unit: usize) -> &Conditions {
        match self.runs.get(unit) {
            Some(run) => &run.run.conditions,
            None => &self.timing_groups[unit - self.runs.len()].conditions,
        }
    }

    /// The units by condition: every supply pressure, temperature and opened leak is one group.
    pub fn units_by_condition(&self) -> Vec<Vec<usize>> {
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for unit in 0..self.unit_count() {
            let conditions = self.unit_conditions(unit);
            match groups.iter_mut().find(|group| same_conditions(self.unit_conditions(group[0]), conditions)) {
                Some(group) => group.push(unit),
                None => groups.push(vec![unit]),
            }
        }
        groups
    }

    /// The dataset with only these units.
    #[must_use]
    pub fn only(&self, keep: impl Fn(usize) -> bool) -> Self {
        let runs = self.runs.iter().enumerate().filter(|(unit, _)| keep(*unit)).map(|(_, run)| run.clone()).collect();
        let mut timing_rows = Vec::new();
        let mut timing_groups = Vec::new();
        for (index, group) in self.timing_groups.iter().enumerate() {
            if keep(self.runs.len() + index) {
                let first = timing_rows.len();
                timing_rows.extend(group.rows.iter().map(|row| self.timing_rows[*row]));
                timing_groups.push(TimingGroup { rows: (first..timing_rows.len()).collect(), ..group.clone() });
            }
        }
        Self { runs, timing_groups, timing_rows, ..self.without_units() }
    }

    /// The entries of a residual vector that belong to some of the units.
    pub fn rows_of(&self, residual: &[f64], keep: impl Fn(usize) -> bool) -> Vec<f64> {
        let lengths = self.runs.iter().map(RunData::block_count);
        let lengths = lengths.chain(self.timing_groups.iter().map(|group| 2 * group.rows.len()));
        let mut rows = Vec::with_capacity(residual.len());
        let mut start = 0;
        for (unit, length) in lengths.enumerate() {
            if keep(unit) {
                rows.extend_from_slice(&residual[start..start + length]);
            }
            start += length;
        }
        rows
    }

    fn without_units(&self) -> Self {
        Self {
            name: self.name.clone(),
            runs: Vec::new(),
            timing_groups: Vec::new(),
            timing_rows: Vec::new(),
            timing_noise_s: self.timing_noise_s,
            schedule: self.schedule,
            noise_is_stated: self.noise_is_stated,
            fidelity: self.fidelity,
        }
    }
}

impl RunData {
    /// Blocks of all its channels.
    pub fn block_count(&self) -> usize {
        self.channels.iter().map(|channel| channel.blocks.len()).sum()
    }

    /// One sample for each block.
    fn thinned(&self) -> Self {
        let mut cells: Vec<(usize, f64)> =
            self.channels.iter().flat_map(|c| c.blocks.iter().map(|block| (block.first, block.time_s))).collect();
        cells.sort_by_key(|cell| cell.0);
        cells.dedup_by_key(|cell| cell.0);
        let thin = |channel: &ChannelData| {
            let mut samples = vec![f64::NAN; cells.len()];
            let blocks = channel.blocks.iter().map(|block| {
                let cell = cells.partition_point(|(first, _)| *first < block.first);
                samples[cell] = block.mean;
                Block { first: cell, end: cell + 1, ..*block }
            });
            let blocks = blocks.collect();
            ChannelData { samples, blocks, ..*channel }
        };
        Self {
            name: self.name.clone(),
            run: self.run.clone(),
            times_s: cells.iter().map(|(_, time)| *time).collect(),
            channels: self.channels.iter().map(thin).collect(),
        }
    }
}

fn conditions(from: &campaign::RunConditions) -> Conditions {
    Conditions {
        supply_pressure_pa: from.supply_pressure_pa,
        temperature_k: from.temperature_k,
        leak_to_atmosphere_m2: from.leak_to_atmosphere_m2,
        leak_from_supply_m2: from.leak_from_supply_m2,
    }
}

fn run_data(recorded: &RecordedRun, campaign: &Campaign, position_noise: f64) -> RunData {
    let trace = &recorded.trace;
    let driven = driven(recorded, campaign);
    let run = Run {
        conditions: conditions(&recorded.conditions),
        commands: recorded.commands.iter().map(|edge| CommandEdge { time_s: edge.time_s, close: edge.close }).collect(),
        end_s: trace.time_s.last().copied().unwrap_or(0.0),
        driven: driven.map(Arc::new),
        start: Start::Rest,
    };
    let mut channels = vec![channel(Channel::Position, &trace.time_s, &trace.position_m, position_noise)];
    let pressures = [
        (Channel::ChamberPressure, &trace.chamber_pressure_pa, campaign.inputs.chamber_pressure),
        (Channel::PipePressure, &trace.pipe_pressure_pa, campaign.inputs.pipe_pressure),
    ];
    for (kind, samples, drives) in pressures {
        // A channel that drives the model cannot judge it.
        if let (Some(samples), false) = (samples, drives) {
            let noise = campaign.sensors.pressure_noise_pa.unwrap_or_else(|| difference_noise(samples));
            channels.push(channel(kind, &trace.time_s, samples, noise));
        }
    }
    RunData { name: recorded.file.clone(), run, times_s: trace.time_s.clone(), channels }
}

/// The measured pressures that drive the model, with gaps bridged: those that are declared, and the supply's.
fn driven(recorded: &RecordedRun, campaign: &Campaign) -> Option<Driven> {
    let inputs = campaign.inputs;
    let trace = &recorded.trace;
    let bridged = |samples: &Option<Vec<f64>>, wanted: bool| {
        samples.as_ref().filter(|_| wanted).map(|samples| bridge(&trace.time_s, samples))
    };
    let driven = Driven {
        time_s: trace.time_s.clone(),
        pipe_pressure_pa: bridged(&trace.pipe_pressure_pa, inputs.pipe_pressure),
        chamber_pressure_pa: bridged(&trace.chamber_pressure_pa, inputs.chamber_pressure),
        supply_pressure_pa: bridged(&trace.supply_pressure_pa, !inputs.pipe_pressure && !inputs.chamber_pressure),
    };
    let drives = driven.pipe_pressure_pa.is_some()
        || driven.chamber_pressure_pa.is_some()
        || driven.supply_pressure_pa.is_some();
    drives.then_some(driven)
}

/// Fills gaps by straight lines, the ends by the nearest value.
fn bridge(times: &[f64], samples: &[f64]) -> Vec<f64> {
    let valid: Vec<usize> = (0..samples.len()).filter(|i| samples[*i].is_finite()).collect();
    (0..samples.len())
        .map(|i| {
            let right = valid.partition_point(|v| *v < i);
            match (right.checked_sub(1).map(|r| valid[r]), valid.get(right).copied()) {
                (_, Some(r)) if r == i => samples[i],
                (Some(l), Some(r)) => {
                    samples[l] + (samples[r] - samples[l]) * (times[i] - times[l]) / (times[r] - times[l])
                }
                (Some(l), None) => samples[l],
                (None, Some(r)) => samples[r],
                (None, None) => 0.0,
            }
        })
        .collect()
}

fn channel(kind: Channel, times: &[f64], samples: &[f64], noise: f64) -> ChannelData {
    // A recorder's resolution adds the variance of rounding.
    let resolution = resolution(samples);
    let noise = (noise * noise + resolution * resolution / 12.0).sqrt();
    let mut blocks = Vec::new();
    let mut first = 0;
    while first < samples.len() {
        let mut end = first + 1;
        while end < samples.len() && times[end] - times[first] < BLOCK_S - 1e-9 {
            end += 1;
        }
        let valid: Vec<usize> = (first..end).filter(|i| samples[*i].is_finite()).collect();
        if !valid.is_empty() {
            let count = valid.len() as f64;
            blocks.push(Block {
                first,
                end,
                mean: valid.iter().map(|i| samples[*i]).sum::<f64>() / count,
                inverse_sigma: count.sqrt() / noise,
                time_s: valid.iter().map(|i| times[*i]).sum::<f64>() / count,
            });
        }
        first = end;
    }
    ChannelData { channel: kind, samples: samples.to_vec(), noise, blocks }
}

/// The smallest difference between two samples of a channel that is rounded, 0 if it is not.
fn resolution(samples: &[f64]) -> f64 {
    let mut values: Vec<f64> = samples.iter().copied().filter(|value| value.is_finite()).take(2000).collect();
    values.sort_by(f64::total_cmp);
    let span = values.last().copied().unwrap_or(0.0) - values.first().copied().unwrap_or(0.0);
    let gaps = || values.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > 1e-9 * span);
    let smallest = gaps().fold(f64::INFINITY, f64::min);
    // Rounded values repeat; of unrounded ones, hardly two are equal.
    let repeated = values.len() > 10 && gaps().count() < values.len() / 2;
    if repeated && smallest.is_finite() { smallest } else { 0.0 }
}

fn pooled_position_noise(campaign: &Campaign) -> f64 {
    let variances: Vec<f64> = campaign
        .runs
        .iter()
        .filter_map(|run| estimate_position_noise_m(&run.trace))
        .map(|noise| noise * noise)
        .collect();
    (variances.iter().sum::<f64>() / variances.len().max(1) as f64).sqrt().max(1e-7)
}

/// Noise from the median size of row-to-row differences, for white noise on a slow signal.
fn difference_noise(samples: &[f64]) -> f64 {
    let mut sizes: Vec<f64> =
        samples.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|size| size.is_finite()).collect();
    if sizes.is_empty() {
        return 1.0;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    (*median / (0.6745 * core::f64::consts::SQRT_2)).max(1.0)
}

/// Noise of stroke times from their repeats.
fn repeat_noise(groups: &[TimingGroup], rows: &[TimingRow]) -> f64 {
    let (mut sum, mut freedom) = (0.0, 0.0);
    for group in groups {
        for time in [|row: &TimingRow| row.close_time_s, |row: &TimingRow| row.open_time_s] {
            let times: Vec<f64> = group.rows.iter().filter_map(|row| time(&rows[*row])).collect();
            if times.len() > 1 {
                let mean = times.iter().sum::<f64>() / times.len() as f64;
                sum += times.iter().map(|t| (t - mean).powi(2)).sum::<f64>();
                freedom += times.len() as f64 - 1.0;
            }
        }
    }
    if freedom > 0.0 { (sum / freedom).sqrt() } else { 5e-3 }
}
