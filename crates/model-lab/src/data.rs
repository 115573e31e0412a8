//! What was recorded, made ready to be compared: channels with their noise, stroke times by their conditions.

use std::sync::Arc;

use campaign::{Campaign, Run as RecordedRun, TimingRow, TimingScatter, ValveFacts, estimate_resolution, pooled_noise};
use valve_model::prescribed::Prescribed;
use valve_model::{CommandEdge, Conditions, Run, Schedule, Start, Valve};

use crate::driving::{Driving, smoothed};
use crate::rounding;

/// Relative noise of a stroke time whose noise is not stated, at least, s.
const LEAST_TIMING_NOISE_S: f64 = 1e-4;

/// A recorded channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Position, m.
    Position,
    /// Chamber pressure, Pa.
    ChamberPressure,
    /// Pipe pressure, Pa.
    PipePressure,
}

/// One channel of one run.
#[derive(Debug, Clone)]
pub struct ChannelData {
    /// Which channel.
    pub channel: Channel,
    /// The samples; gaps are NaN.
    pub samples: Vec<f64>,
    /// One standard deviation of a sample, rounding included, SI.
    pub noise: f64,
    /// The step of its recorder, 0 where it shows none, SI.
    pub step: f64,
    /// The mean square of what samples at one place are rounded alike by, in SI units squared.
    pub common_variance: f64,
}

/// One recorded run.
#[derive(Debug, Clone)]
pub struct RunData {
    /// Its file.
    pub name: String,
    /// How to simulate it.
    pub run: Run,
    /// The measured pressures that drive it, if any do.
    pub driving: Option<Driving>,
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
    /// Whether replicates say how large it is.
    pub timings_are_repeated: bool,
    /// The cycle in which stroke times were taken.
    pub schedule: Schedule,
    /// Whether the position noise was stated (or estimated).
    pub noise_is_stated: bool,
}

impl Dataset {
    /// Makes a campaign ready. `schedule` is that of the valve file, for stroke times without traces.
    pub fn new(campaign: &Campaign, schedule: Schedule) -> Self {
        let position_noise = campaign.sensors.position_noise_m.unwrap_or_else(|| pooled_position_noise(campaign));
        let runs = campaign.runs.iter().map(|run| run_data(run, campaign, position_noise)).collect();
        let mut timing_groups: Vec<TimingGroup> = Vec::new();
        for (index, row) in campaign.timings.iter().enumerate() {
            if row.close_time_s.is_none() && row.open_time_s.is_none() {
                continue;
            }
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
        let (timing_noise_s, timings_are_repeated) = timing_noise_s(campaign.sensors.timing_noise_s, &campaign.timings);
        Self {
            name: campaign.name.clone(),
            runs,
            timing_groups,
            timing_rows: campaign.timings.clone(),
            timing_noise_s,
            timings_are_repeated,
            schedule,
            noise_is_stated: campaign.sensors.position_noise_m.is_some() || campaign.sensors.timing_noise_s.is_some(),
        }
    }

    /// Samples of all channels and stroke times, as they were recorded.
    pub fn reading_count(&self) -> usize {
        let channels = self.runs.iter().flat_map(|run| &run.channels);
        let samples: usize =
            channels.map(|channel| channel.samples.iter().filter(|sample| sample.is_finite()).count()).sum();
        let times = self.timing_rows.iter().flat_map(|row| [row.close_time_s, row.open_time_s]);
        samples + times.flatten().count()
    }

    /// Whether nothing is recorded.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty() && self.timing_rows.is_empty()
    }
}

pub(crate) fn conditions(from: &campaign::RunConditions) -> Conditions {
    Conditions {
        supply_pressure_pa: from.supply_pressure_pa,
        temperature_k: from.temperature_k,
        leak_to_atmosphere_m2: from.leak_to_atmosphere_m2,
        leak_from_supply_m2: from.leak_from_supply_m2,
    }
}

fn run_data(recorded: &RecordedRun, campaign: &Campaign, position_noise: f64) -> RunData {
    let trace = &recorded.trace;
    let driving = driving(recorded, campaign);
    let run = Run {
        conditions: conditions(&recorded.conditions),
        commands: recorded.commands.iter().map(|edge| CommandEdge::new(edge.time_s, edge.close)).collect(),
        end_s: trace.time_s.last().copied().unwrap_or(0.0),
        prescribed: driving.as_ref().map(|driving| Arc::clone(&driving.smooth)),
        start: Start::Rest,
    };
    let is_stated = campaign.sensors.position_noise_m.is_some();
    let mut channels = vec![channel(Channel::Position, &trace.position_m, position_noise, is_stated)];
    let pressures = [
        (Channel::ChamberPressure, &trace.chamber_pressure_pa, campaign.inputs.chamber_pressure),
        (Channel::PipePressure, &trace.pipe_pressure_pa, campaign.inputs.pipe_pressure),
    ];
    for (kind, samples, drives) in pressures {
        // A channel that drives the model cannot judge it.
        if let (Some(samples), false) = (samples, drives) {
            let stated = campaign.sensors.pressure_noise_pa;
            let noise = stated.unwrap_or_else(|| difference_noise(samples));
            channels.push(channel(kind, samples, noise, stated.is_some()));
        }
    }
    RunData { name: recorded.file.clone(), run, driving, times_s: trace.time_s.clone(), channels }
}

/// The measured pressures that drive the model, with gaps bridged: those that are declared, and the supply's.
fn driving(recorded: &RecordedRun, campaign: &Campaign) -> Option<Driving> {
    let inputs = campaign.inputs;
    let trace = &recorded.trace;
    let bridged = |samples: &Option<Vec<f64>>, wanted: bool| {
        samples.as_ref().filter(|_| wanted).map(|samples| bridge(&trace.time_s, samples))
    };
    let prescribed = Prescribed {
        time_s: trace.time_s.clone(),
        pipe_pressure_pa: bridged(&trace.pipe_pressure_pa, inputs.pipe_pressure),
        chamber_pressure_pa: bridged(&trace.chamber_pressure_pa, inputs.chamber_pressure),
        supply_pressure_pa: bridged(&trace.supply_pressure_pa, !inputs.pipe_pressure && !inputs.chamber_pressure),
    };
    let drives = prescribed.pipe_pressure_pa.is_some()
        || prescribed.chamber_pressure_pa.is_some()
        || prescribed.supply_pressure_pa.is_some();
    let noise_pa = |samples: &[f64]| {
        let noise = campaign.sensors.pressure_noise_pa.unwrap_or_else(|| difference_noise(samples));
        with_rounding(noise, samples)
    };
    drives.then(|| smoothed(prescribed, noise_pa))
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

/// A channel with its noise: what is stated is without rounding, what its samples show has it already.
fn channel(kind: Channel, samples: &[f64], noise: f64, is_stated: bool) -> ChannelData {
    let step = estimate_resolution(samples).unwrap_or(0.0);
    let white = if is_stated { noise } else { (noise * noise - rounding::variance(step)).max(0.0).sqrt() };
    ChannelData {
        channel: kind,
        samples: samples.to_vec(),
        noise: noise.hypot(rounding::variance(step).sqrt()),
        step,
        common_variance: rounding::common_variance(step, white),
    }
}

/// A channel's noise with what its recorder's resolution adds: the variance of rounding.
fn with_rounding(noise: f64, samples: &[f64]) -> f64 {
    noise.hypot(rounding::variance(estimate_resolution(samples).unwrap_or(0.0)).sqrt())
}

/// Noise that a position sensor has at least, m, where none is stated.
const LEAST_POSITION_NOISE_M: f64 = 1e-7;

/// Noise of stroke times that nothing tells, s: a hand's, or a controller's that looks every ten milliseconds.
const USUAL_TIMING_NOISE_S: f64 = 5e-3;

/// Degrees of freedom of replicates from which they tell how far strokes scatter where nothing else does, and from which they tell
/// it better (to a fifth) than what is stated.
const FEWEST_REPLICATES: usize = 3;
const ENOUGH_REPLICATES: usize = 12;

/// Median size of a normal deviate, in standard deviations.
pub(crate) const MEDIAN_SIZE: f64 = 0.6745;

fn pooled_position_noise(campaign: &Campaign) -> f64 {
    let positions = campaign.runs.iter().map(|run| run.trace.position_m.as_slice());
    pooled_noise(positions).unwrap_or(0.0).max(LEAST_POSITION_NOISE_M)
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
    (*median / (MEDIAN_SIZE * core::f64::consts::SQRT_2)).max(1.0)
}

/// Noise of stroke times: as it is stated, or what replicates differ by where a valve scatters more than the clock that times
/// it, and whether these are enough to tell.
fn timing_noise_s(stated_s: Option<f64>, rows: &[TimingRow]) -> (f64, bool) {
    let TimingScatter { sigma_s, freedom, .. } = TimingScatter::of(rows);
    let enough = if stated_s.is_some() { ENOUGH_REPLICATES } else { FEWEST_REPLICATES };
    let noise_s = match (stated_s, sigma_s.filter(|_| freedom >= enough)) {
        (Some(stated_s), Some(scatter_s)) => stated_s.max(scatter_s),
        (one, other) => one.or(other).unwrap_or(USUAL_TIMING_NOISE_S),
    };
    (noise_s.max(LEAST_TIMING_NOISE_S), freedom >= ENOUGH_REPLICATES)
}
