//! The valve as a problem of identification: a space of parameters and effects, and the nuisances around it.

use std::sync::Arc;

use identify::{Coordinate, Difference, Differences, Linear, Problem, Record, Request, Scope, Stop};
use rayon::prelude::*;
use valve_model::cycle::{CycleTimes, cycles};
use valve_model::measurement::Measurement;
use valve_model::prescribed::Prescribed;
use valve_model::real::LANES;
use valve_model::{
    ChamberStart, CommandEdge, Fidelity, ParameterId, Prepared, Run, Start, Trajectory, Valve, simulate,
};

use super::nuisance::{Entry, Nuisance};
use super::sensor_curve::SensorCurve;
use super::setup::{Kind, Recording, Setup, Trace};
use super::start::{Beginning, ON_STOP};
use crate::data::{Channel, Dataset};
use crate::forward::{Predicted, record, record_channel};
use crate::space::{Space, Target};

/// Bound of a tolerated parameter, in tolerances.
const PARAMETER_BOUND: f64 = 5.0;

/// Standard deviation of the prior of an effect's size, in typical sizes.
const SIZE_SIGMA: f64 = 2.0;

/// A stroke that was not finished counts as this many times its window.
const BEYOND: f64 = 1.2;

/// Batches that each thread gets: more share the work out more evenly, but at the end of each some lanes run empty.
const BATCHES_A_THREAD: usize = 2;

/// Differences in time for derivatives with respect to delays, s.
const TIME_STEP_S: f64 = 5e-4;

/// Steps back from what a bent curve shows to where the piston is: each leaves a fiftieth of the error before it.
const BACK: usize = 2;

/// A set of effects on a campaign.
#[derive(Debug, Clone)]
pub struct ValveProblem<'a> {
    setup: &'a Setup,
    /// The tolerated parameters and the effects.
    pub space: Space,
    /// The nuisances; their coordinates follow those of the space.
    pub nuisances: &'a [Entry],
    coordinates: Vec<Coordinate>,
    /// How much later than the last row the recorder's clock may see a motion, s.
    latest_s: f64,
    stop: &'a Stop,
}

/// How what is written down of one motion changes with the recorder alone, row by row.
#[derive(Debug, Clone, Default)]
struct Seen {
    /// With its clock, per second.
    by_time: Vec<f64>,
    /// With each bend of the position sensor's curve, per metre, by the place of its nuisance.
    by_bend: Vec<(usize, Vec<f64>)>,
}

/// A coordinate of a space with its prior.
pub(super) fn coordinate_of((index, of_space): (usize, &crate::space::Coordinate)) -> Coordinate {
    let (mean, sigma) = of_space.prior.unwrap_or((0.0, SIZE_SIGMA));
    let (lower, upper) = match of_space.target {
        Target::Base(_) => (-PARAMETER_BOUND, PARAMETER_BOUND),
        _ => (of_space.lower, of_space.upper),
    };
    let (name, scope) = (index.to_string(), Scope::Shared);
    Coordinate { name, scope, mean, sigma, lower, upper, step: 0.05, of_measuring: false }
}

impl<'a> ValveProblem<'a> {
    /// A space on a campaign with its nuisances.
    pub fn new(setup: &'a Setup, space: Space, nuisances: &'a [Entry], stop: &'a Stop) -> Self {
        let mut coordinates: Vec<Coordinate> = space.coordinates.iter().enumerate().map(coordinate_of).collect();
        coordinates.extend(nuisances.iter().map(|entry| entry.coordinate.clone()));
        let clock = nuisances.iter().find(|entry| entry.nuisance == Nuisance::Clock);
        let latest_s = clock.map_or(0.0, |entry| entry.size * -entry.coordinate.lower);
        Self { setup, space, nuisances, coordinates, latest_s, stop }
    }

    /// The point with every coordinate at its prior mean, effects at where their fits start.
    pub fn start(&self) -> Vec<f64> {
        self.space.start().into_iter().chain(self.nuisances.iter().map(|entry| entry.coordinate.mean)).collect()
    }

    /// The same with instruments and conditions at their word: nothing is off, and commands were given when they were written
    /// down. When a command was given that nobody wrote down stays where it is believed to be.
    pub fn at_their_word(&self) -> Vec<f64> {
        let word = |entry: &Entry| match entry.nuisance {
            Nuisance::UnseenEdge(_) => entry.coordinate.mean,
            _ => 0.0,
        };
        self.space.start().into_iter().chain(self.nuisances.iter().map(word)).collect()
    }

    /// The same problem on a campaign that was made ready in another way.
    pub fn on<'b>(&self, setup: &'b Setup) -> ValveProblem<'b>
    where
        'a: 'b,
    {
        ValveProblem { setup, ..self.clone() }
    }

    /// The same with one coordinate held at a value, in its own unit of prior deviations.
    #[must_use]
    pub fn held_at(&self, index: usize, u: f64) -> Self {
        let mut held = self.clone();
        let coordinate = &mut held.coordinates[index];
        (coordinate.lower, coordinate.upper) = (u, u);
        held
    }

    /// The campaign.
    pub fn setup(&self) -> &Setup {
        self.setup
    }

    /// The index of a nuisance's coordinate; nothing where there is no such nuisance.
    pub fn place_of(&self, which: Nuisance) -> Option<usize> {
        let place = self.nuisances.iter().position(|entry| entry.nuisance == which)?;
        Some(self.space.coordinates.len() + place)
    }

    /// The value of a nuisance at a point, in its own unit; zero where there is none.
    pub fn nuisance(&self, u: &[f64], which: Nuisance) -> f64 {
        let place = self.nuisances.iter().position(|entry| entry.nuisance == which);
        place.map_or(0.0, |place| self.nuisances[place].size * u[self.space.coordinates.len() + place])
    }

    /// The valve and the run of a record at a point; nothing if the point is no possible valve.
    fn simulation(&self, u: &[f64], index: usize) -> Option<(Valve, Run)> {
        let valve = self.space.valve(u)?;
        let mut parameters = valve.parameters().clone();
        let recording = &self.setup.recordings[index];
        let mut run = recording.run.clone();
        let load = self.nuisance(u, Nuisance::Load(index));
        if parameters.spring_stiffness_n_per_m > 0.0 {
            parameters.preload_compression_m *= 1.0 + load;
        } else {
            parameters.moving_mass_kg *= 1.0 + load;
        }
        parameters.stop_damping_n_s_per_m += self.nuisance(u, Nuisance::StopDamping);
        parameters.piston_area_m2 *= 1.0 + self.nuisance(u, Nuisance::Bore);
        let factor = (1.0 + self.nuisance(u, Nuisance::Supply(index))) * (1.0 + self.nuisance(u, Nuisance::Gauge));
        let ambient = self.setup.ambient_pa;
        run.conditions.supply_pressure_pa = ambient + factor * (run.conditions.supply_pressure_pa - ambient);
        run.conditions.temperature_k =
            (run.conditions.temperature_k + self.nuisance(u, Nuisance::Temperature(index))).max(1.0);
        run.conditions.leak_to_atmosphere_m2 *= (1.0 + self.nuisance(u, Nuisance::LeakToAtmosphere)).max(0.0);
        run.conditions.leak_from_supply_m2 *= (1.0 + self.nuisance(u, Nuisance::LeakFromSupply)).max(0.0);
        let zero = self.nuisance(u, Nuisance::DrivingZero);
        let gain = 1.0 + self.nuisance(u, Nuisance::DrivingGain);
        if (zero != 0.0 || gain != 1.0 || factor != 1.0)
            && let Some(prescribed) = &run.prescribed
        {
            let mapped = |channel: &Option<Vec<f64>>, by: &dyn Fn(f64) -> f64| {
                channel.as_ref().map(|values| values.iter().map(|value| by(*value).max(1.0)).collect())
            };
            let really = |shown: f64| ambient + (shown - zero - ambient) / gain;
            run.prescribed = Some(Arc::new(Prescribed {
                time_s: prescribed.time_s.clone(),
                pipe_pressure_pa: mapped(&prescribed.pipe_pressure_pa, &really),
                chamber_pressure_pa: mapped(&prescribed.chamber_pressure_pa, &really),
                supply_pressure_pa: mapped(&prescribed.supply_pressure_pa, &|value| {
                    ambient + factor * (value - ambient)
                }),
            }));
        }
        // The state in which a record begins in motion belongs to the recorder's clock; only the commands do not.
        let instruments = valve.measurement();
        let by_clock = if recording.beginning.is_moving() {
            self.nuisance(u, Nuisance::Clock) + instruments.offset_s
        } else {
            0.0
        };
        for edge in &mut run.commands {
            let which = if edge.closes() { Nuisance::CloseDelay(index) } else { Nuisance::OpenDelay(index) };
            edge.time_s = (edge.time_s + self.nuisance(u, which) + by_clock).max(0.0);
        }
        run.end_s += self.latest_s + TIME_STEP_S;
        if recording.beginning == Beginning::Filling
            && let Some(first) = run.commands.first_mut()
        {
            first.time_s = (first.time_s - self.nuisance(u, Nuisance::UnseenEdge(index))).max(0.0);
        }
        if let Beginning::Venting { pressure_pa, .. } = recording.beginning {
            let pressure_pa = pressure_pa + self.nuisance(u, Nuisance::StartPressure(index));
            run.start = Start::Venting { pressure_pa: pressure_pa.max(1.0) };
        }
        if let Beginning::Moving { acceleration_m_per_s2, .. } = recording.beginning
            && let Some((bent_m, velocity_m_per_s)) = self.begins_as(u, index, instruments)
        {
            // Less pressure than in balance lets it rise faster.
            let inertia_pa = parameters.moving_mass_kg * acceleration_m_per_s2 / parameters.piston_area_m2;
            run.start = Start::Moving {
                position_m: self.straight(u, bent_m),
                velocity_m_per_s,
                chamber: ChamberStart::Balance {
                    beyond_pa: self.nuisance(u, Nuisance::StartPressure(index)) - inertia_pa,
                },
                pipe_pressure_pa: None,
            };
        }
        let valve = Valve::new(parameters, valve.switches(), valve.effects().to_vec(), valve.custom().to_vec()).ok()?;
        Some((valve, run))
    }

    /// What a recorder writes down of a simulated run, row by row; `shift_s` moves its clock.
    fn rows(
        &self,
        u: &[f64],
        index: usize,
        trace: &Trace,
        valve: &Valve,
        nodes: &Trajectory,
        shift_s: f64,
    ) -> Vec<f64> {
        let recording = &self.setup.recordings[index];
        let (clock, origin_s) = (self.clock_s(u, recording, valve) + shift_s, recording.origin_s);
        let mut values = Vec::new();
        let mut sampled = Vec::new();
        let curve = self.curve(u);
        // A slow sensor shows late what its curve makes of the position.
        let slow = valve.measurement().lag_s > 0.0 && !curve.is_straight();
        let bent = slow.then(|| curve.shown(nodes));
        for channel in &trace.channels {
            let times: Vec<f64> = channel.samples_s.iter().map(|time| time - clock - origin_s).collect();
            let nodes = bent.as_ref().filter(|_| channel.channel == Channel::Position).unwrap_or(nodes);
            record_channel(valve, nodes, channel.channel, &times, &mut sampled);
            let means = channel
                .rows
                .iter()
                .map(|(first, end)| sampled[*first..*end].iter().sum::<f64>() / (end - first) as f64);
            let start = values.len();
            values.extend(means);
            let (offset, slope, gain) = if channel.channel == Channel::Position {
                let (zero, drift_m_per_s) = self.zero(u, index);
                (zero, drift_m_per_s, self.nuisance(u, Nuisance::Gain))
            } else {
                let zero = self.nuisance(u, Nuisance::PressureZero(channel.channel));
                (zero, 0.0, self.nuisance(u, Nuisance::PressureGain(channel.channel)))
            };
            let base = if channel.channel == Channel::Position { 0.0 } else { self.setup.ambient_pa };
            let bends_here = channel.channel == Channel::Position && !slow && !curve.is_straight();
            for (value, (first, end)) in values[start..].iter_mut().zip(&channel.rows) {
                let time = 0.5 * (channel.samples_s[*first] + channel.samples_s[*end - 1]);
                if bends_here {
                    *value += curve.at(*value).0;
                }
                *value += gain * (*value - base) + offset + slope * time;
            }
        }
        values
    }

    /// By how much the recorder's clock is shifted against a simulation, s. Where a record begins in motion, the commands are
    /// shifted instead.
    fn clock_s(&self, u: &[f64], recording: &Recording, valve: &Valve) -> f64 {
        if recording.beginning.is_moving() { -valve.measurement().offset_s } else { self.nuisance(u, Nuisance::Clock) }
    }

    /// What sensors that are right write down at a point at every sample time of the recorded runs: what stands in `records`, one
    /// for each run and simulated from rest, is replaced where a recording begins elsewhere.
    pub fn write_records(&self, u: &[f64], data: &Dataset, records: &mut [Predicted]) {
        let traces = (0..self.setup.recordings.len()).filter(|index| self.setup.recordings[*index].is_trace());
        let requests: Vec<Request> = traces.map(|record| Request { point: 0, record }).collect();
        let of_trace = |request: Request, trace: &Trace, valve: &Valve, nodes: &Trajectory| {
            let recording = &self.setup.recordings[request.record];
            let run = &data.runs[recording.source];
            let first_m =
                run.channels[0].samples.get(trace.samples.clone())?.iter().find(|sample| sample.is_finite())?;
            let at_rest = match recording.beginning {
                Beginning::Open | Beginning::Closed => true,
                Beginning::Filling => *first_m > (1.0 - ON_STOP) * self.setup.stroke_m,
                Beginning::Venting { .. } | Beginning::Moving { .. } => false,
            };
            if at_rest {
                return None;
            }
            let shift_s = self.clock_s(u, recording, valve) + recording.origin_s;
            let times: Vec<f64> = run.times_s.get(trace.samples.clone())?.iter().map(|time| time - shift_s).collect();
            let mut recorded = Predicted::default();
            record(valve, nodes, &times, &mut recorded);
            Some((recording.source, trace.samples.start, recorded))
        };
        let found = self.simulated(std::slice::from_ref(&u.to_vec()), &requests, of_trace, |_, _| None);
        for (source, from, recorded) in found.into_iter().flatten().flatten() {
            let record = &mut records[source];
            let channels = [
                (&mut record.position_m, recorded.position_m),
                (&mut record.chamber_pressure_pa, recorded.chamber_pressure_pa),
                (&mut record.pipe_pressure_pa, recorded.pipe_pressure_pa),
            ];
            for (channel, found) in channels {
                if let Some(part) = channel.get_mut(from..from + found.len()) {
                    part.copy_from_slice(&found);
                }
            }
        }
    }

    /// The zero of the position sensor in a record, m, and how it drifts, m/s.
    fn zero(&self, u: &[f64], index: usize) -> (f64, f64) {
        let end_s = self.setup.recordings[index].run.end_s.max(1e-9);
        (self.nuisance(u, Nuisance::Zero(index)), self.nuisance(u, Nuisance::Drift(index)) / end_s)
    }

    /// What a record that begins in motion says of its beginning, with all that is slow, scaled and shifted about its sensor taken
    /// back: the position that the sensor's curve makes of the piston's, m, and the velocity, m/s; nothing for other records.
    fn begins_as(&self, u: &[f64], index: usize, sensor: Measurement) -> Option<(f64, f64)> {
        let recording = &self.setup.recordings[index];
        let Beginning::Moving { position_m, velocity_m_per_s, .. } = recording.beginning else { return None };
        let gain = 1.0 + self.nuisance(u, Nuisance::Gain);
        let velocity_m_per_s = velocity_m_per_s / gain + self.nuisance(u, Nuisance::StartSpeed(index));
        let (zero_m, drift_m_per_s) = self.zero(u, index);
        let drift_m = drift_m_per_s * recording.origin_s;
        let shown_m = position_m + self.nuisance(u, Nuisance::StartPosition(index)) - zero_m - drift_m;
        // A slow sensor shows where the piston was.
        Some(((shown_m / gain - sensor.zero_m) / sensor.gain + velocity_m_per_s * sensor.lag_s, velocity_m_per_s))
    }

    /// Where the piston is when the sensor's curve shows a position.
    fn straight(&self, u: &[f64], bent_m: f64) -> f64 {
        let curve = self.curve(u);
        // A bend changes by a few percent of itself over its own size.
        (0..BACK).fold(bent_m, |position_m, _| bent_m - curve.at(position_m).0)
    }

    /// How much less the sensor would have to show at the start of a record for the same beginning, for one more unit of a
    /// nuisance: of the position, m, and of the velocity, m/s.
    fn less_shown(&self, u: &[f64], index: usize, nuisance: Nuisance) -> [f64; 2] {
        let recording = &self.setup.recordings[index];
        let Beginning::Moving { position_m, velocity_m_per_s, .. } = recording.beginning else { return [0.0; 2] };
        let gain = 1.0 + self.nuisance(u, Nuisance::Gain);
        match nuisance {
            Nuisance::Zero(_) => [1.0, 0.0],
            Nuisance::Drift(_) => [recording.origin_s / recording.run.end_s.max(1e-9), 0.0],
            Nuisance::Gain => [(position_m - self.zero(u, index).0) / gain, velocity_m_per_s / (gain * gain)],
            Nuisance::Linearity(half_waves) => {
                let Some(sensor) = self.space.valve(u).map(|valve| valve.measurement()) else { return [0.0; 2] };
                let begins = self.begins_as(u, index, sensor);
                let of_one = SensorCurve::straight(self.setup.stroke_m).with(half_waves, 1.0);
                let bend = begins.map_or(0.0, |(bent_m, _)| of_one.at(self.straight(u, bent_m)).0);
                [gain * sensor.gain * bend, 0.0]
            }
            _ => [0.0; 2],
        }
    }

    /// The position sensor's curve at a point.
    fn curve(&self, u: &[f64]) -> SensorCurve {
        let of_nuisances = self.nuisances.iter().zip(&u[self.space.coordinates.len()..]);
        of_nuisances.fold(SensorCurve::straight(self.setup.stroke_m), |curve, (entry, u)| match entry.nuisance {
            Nuisance::Linearity(half_waves) => curve.with(half_waves, entry.size * u),
            _ => curve,
        })
    }

    /// The stroke times of a record, row by row.
    fn times(&self, u: &[f64], index: usize, cycle: Option<&CycleTimes>) -> Vec<f64> {
        let Kind::Times(times) = &self.setup.recordings[index].kind else { return Vec::new() };
        let schedule = &self.setup.schedule;
        let clock = self.nuisance(u, Nuisance::Clock);
        let close = cycle.and_then(|cycle| cycle.close_time_s);
        let close = close.unwrap_or(BEYOND * (schedule.open_at_s - schedule.close_at_s));
        let open = cycle.and_then(|cycle| cycle.open_time_s);
        let open = open.unwrap_or(BEYOND * (schedule.end_s - schedule.open_at_s));
        let (close, open) = (close + clock, open + clock);
        times.closing.iter().map(|closing| if *closing { close } else { open }).collect()
    }

    /// Simulates records at points and hands what comes out to `of_trace` and `of_times`, in parallel; nothing for a point
    /// that is impossible, and for what was not begun when somebody asked to stop.
    fn simulated<T: Send + Clone>(
        &self,
        points: &[Vec<f64>],
        requests: &[Request],
        of_trace: impl Fn(Request, &Trace, &Valve, &Trajectory) -> T + Sync,
        of_times: impl Fn(Request, Option<&CycleTimes>) -> T + Sync,
    ) -> Vec<Option<T>> {
        let of_request = |request: &Request| {
            let (valve, run) = self.simulation(&points[request.point], request.record)?;
            let recording = &self.setup.recordings[request.record];
            let prepared = recording.is_trace().then(|| Prepared::new(&valve, &run, recording.fidelity));
            Some((valve, run, prepared))
        };
        let jobs: Vec<Option<(Valve, Run, Option<Prepared>)>> = requests.par_iter().map(of_request).collect();
        let pressures = self.setup.recordings.iter().any(Recording::has_pressures);
        let mut results: Vec<Option<T>> = vec![None; requests.len()];
        let mut traces: Vec<(usize, &Trace, &Valve, &Prepared)> = Vec::new();
        let mut times: [Vec<(usize, &Valve, &Run)>; 2] = [Vec::new(), Vec::new()];
        for (place, job) in jobs.iter().enumerate() {
            let Some((valve, run, prepared)) = job else { continue };
            match (&self.setup.recordings[requests[place].record].kind, prepared) {
                (Kind::Trace(trace), Some(prepared)) => traces.push((place, trace, valve, prepared)),
                (Kind::Times(of), _) => times[usize::from(of.cycles > 1)].push((place, valve, run)),
                (Kind::Trace(_), None) => {}
            }
        }
        // Runs of one record are equally long, so that the lanes of a batch end together; those with other terms run apart.
        let mut kinds: Vec<&Prepared> = Vec::new();
        for (.., prepared) in &traces {
            if !kinds.iter().any(|kind| kind.fits_beside(prepared)) {
                kinds.push(prepared);
            }
        }
        let kind_of = |prepared: &Prepared| kinds.iter().position(|kind| kind.fits_beside(prepared));
        traces.sort_by_cached_key(|(place, .., prepared)| (kind_of(prepared), requests[*place].record));
        let length = traces.len().div_ceil(BATCHES_A_THREAD * rayon::current_num_threads()).max(LANES);
        let of_batches: Vec<Vec<(usize, T)>> = traces
            .par_chunks(length.next_multiple_of(LANES))
            .map(|batch| {
                let mut found = Vec::with_capacity(batch.len());
                if self.stop.is_asked() {
                    return found;
                }
                let prepared: Vec<&Prepared> = batch.iter().map(|(.., prepared)| *prepared).collect();
                simulate(&prepared, pressures, |index, nodes, _| {
                    let (place, trace, valve, _) = &batch[index];
                    found.push((*place, of_trace(requests[*place], trace, valve, nodes)));
                });
                found
            })
            .collect();
        for (place, found) in of_batches.into_iter().flatten() {
            results[place] = Some(found);
        }
        let timed = self.setup.recordings.iter().find(|recording| matches!(recording.kind, Kind::Times(_)));
        let fidelity = timed.map_or(Fidelity::FINE, |recording| recording.fidelity);
        for (more, jobs) in times.iter().enumerate() {
            let of_batches: Vec<Vec<(usize, T)>> = jobs
                .par_chunks(jobs.len().div_ceil(4 * rayon::current_num_threads()).clamp(LANES, 8 * LANES))
                .map(|batch| {
                    if self.stop.is_asked() {
                        return Vec::new();
                    }
                    let valves: Vec<_> = batch.iter().map(|(_, valve, run)| (*valve, run.conditions)).collect();
                    let cycles = cycles(&valves, &self.setup.schedule, more + 1, fidelity);
                    let both = batch.iter().zip(cycles);
                    both.map(|((place, ..), cycle)| (*place, of_times(requests[*place], cycle.last()))).collect()
                })
                .collect();
            for (place, found) in of_batches.into_iter().flatten() {
                results[place] = Some(found);
            }
        }
        results
    }

    /// Derivatives of the rows of a record with respect to the nuisances that need no simulation. `simulated` are those
    /// with respect to all others.
    fn analytic(
        &self,
        u: &[f64],
        index: usize,
        at: &[f64],
        seen: &Seen,
        simulated: &[(usize, Vec<f64>)],
    ) -> Vec<(usize, Vec<f64>)> {
        let first = self.space.coordinates.len();
        let recording = &self.setup.recordings[index];
        let mut columns = Vec::new();
        let of_start = [Nuisance::StartPosition(index), Nuisance::StartSpeed(index)].map(|which| {
            let place = self.place_of(which)?;
            let (_, column) = simulated.iter().find(|(coordinate, _)| *coordinate == place)?;
            Some((self.nuisances[place - first].size, column))
        });
        for (place, entry) in self.nuisances.iter().enumerate() {
            if entry.is_simulated || !entry.coordinate.moves(index) {
                continue;
            }
            let mut column = match &recording.kind {
                Kind::Trace(trace) => match seen.by_bend.iter().find(|(bend, _)| *bend == place) {
                    Some((_, column)) => column.clone(),
                    None => self.trace_column(u, index, trace, entry.nuisance, at, &seen.by_time),
                },
                Kind::Times(times) => {
                    let by = if entry.nuisance == Nuisance::Clock { 1.0 } else { 0.0 };
                    vec![by; times.closing.len()]
                }
            };
            // What the sensor is off by also moves the beginning that is read off it.
            let less_shown = self.less_shown(u, index, entry.nuisance);
            for (less, (size, of_start)) in
                less_shown.into_iter().zip(&of_start).filter_map(|(less, of)| Some((less, (*of)?)))
            {
                column.iter_mut().zip(of_start).for_each(|(value, of_start)| *value -= less / size * of_start);
            }
            columns.push((first + place, column.into_iter().map(|value| value * entry.size).collect()));
        }
        columns
    }

    fn trace_column(
        &self,
        u: &[f64],
        index: usize,
        trace: &Trace,
        nuisance: Nuisance,
        at: &[f64],
        by_time: &[f64],
    ) -> Vec<f64> {
        let recording = &self.setup.recordings[index];
        let run = &recording.run;
        let mut column = Vec::with_capacity(at.len());
        let mut start = 0;
        for channel in &trace.channels {
            let is_position = channel.channel == Channel::Position;
            let base = if is_position { 0.0 } else { self.setup.ambient_pa };
            for (row, (first, end)) in channel.rows.iter().enumerate() {
                let time = 0.5 * (channel.samples_s[*first] + channel.samples_s[*end - 1]);
                let (at, by_time) = (at[start + row], by_time[start + row]);
                let last = run.commands.iter().rev().find(|edge| edge.time_s + recording.origin_s <= time);
                column.push(match nuisance {
                    Nuisance::Zero(_) if is_position => 1.0,
                    Nuisance::Drift(_) if is_position => time / run.end_s.max(1e-9),
                    Nuisance::Gain if is_position => {
                        let zero = self.nuisance(u, Nuisance::Zero(index));
                        (at - zero) / (1.0 + self.nuisance(u, Nuisance::Gain))
                    }
                    Nuisance::PressureZero(which) if which == channel.channel => 1.0,
                    Nuisance::PressureGain(which) if which == channel.channel => at - base,
                    Nuisance::Clock => by_time,
                    Nuisance::CloseDelay(_) if last.is_some_and(CommandEdge::closes) => by_time,
                    Nuisance::OpenDelay(_) if last.is_some_and(|edge| !edge.closes()) => by_time,
                    _ => 0.0,
                });
            }
            start += channel.rows.len();
        }
        column
    }
}

impl Problem for ValveProblem<'_> {
    fn coordinates(&self) -> &[Coordinate] {
        &self.coordinates
    }

    fn records(&self) -> &[Record] {
        &self.setup.records
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        self.simulated(
            points,
            requests,
            |request, trace, valve, nodes| self.rows(&points[request.point], request.record, trace, valve, nodes, 0.0),
            |request, cycle| self.times(&points[request.point], request.record, cycle),
        )
    }

    fn linearise(&self, u: &[f64], steps: &[Difference]) -> Option<Vec<Linear>> {
        let first = self.space.coordinates.len();
        let is_simulated =
            |index: &usize| index.checked_sub(first).is_none_or(|nuisance| self.nuisances[nuisance].is_simulated);
        let simulated: Vec<usize> = (0..u.len()).filter(is_simulated).collect();
        let records = self.setup.recordings.len();
        let differences = Differences::new(&self.coordinates, records, u, steps, simulated);
        let points = &differences.points;
        let simulated = self.simulated(
            points,
            &differences.requests,
            |Request { point, record }, trace, valve, nodes| {
                let rows = |u: &[f64], shift_s: f64| self.rows(u, record, trace, valve, nodes, shift_s);
                let now = rows(&points[point], 0.0);
                let seen = || {
                    let pairs = rows(u, TIME_STEP_S).into_iter().zip(rows(u, -TIME_STEP_S));
                    let by_time = pairs.map(|(late, early)| (late - early) / (2.0 * TIME_STEP_S)).collect();
                    let of_bend = |(place, entry): (usize, &Entry)| {
                        let mut more = u.to_vec();
                        more[first + place] += 1.0;
                        let of_row =
                            rows(&more, 0.0).into_iter().zip(&now).map(|(more, now)| (more - now) / entry.size);
                        (place, of_row.collect())
                    };
                    let is_bend = |(_, entry): &(usize, &Entry)| matches!(entry.nuisance, Nuisance::Linearity(_));
                    let by_bend = self.nuisances.iter().enumerate().filter(is_bend).map(of_bend).collect();
                    Seen { by_time, by_bend }
                };
                let seen = if point == 0 { seen() } else { Seen::default() };
                (now, seen)
            },
            |Request { point, record }, cycle| (self.times(&points[point], record, cycle), Seen::default()),
        );
        let mut at_the_point: Vec<Seen> = Vec::with_capacity(records);
        let predicted = simulated.into_iter().map(|one| {
            let (predicted, seen) = one?;
            if at_the_point.len() < records {
                at_the_point.push(seen);
            }
            Some(predicted)
        });
        let mut linear = differences.linear(predicted.collect())?;
        for (index, (linear, seen)) in linear.iter_mut().zip(&at_the_point).enumerate() {
            let columns: Vec<(usize, Vec<f64>)> = self.analytic(u, index, &linear.predicted, seen, &linear.columns);
            linear.columns.extend(columns);
        }
        Some(linear)
    }

    fn stop(&self) -> &Stop {
        self.stop
    }
}

/// Parameters that may be off by more than is tolerated where a valve file has no tolerances, with the standard
/// deviations that are assumed.
pub const DEFAULT_TOLERANCES: [(ParameterId, f64); 7] = [
    (ParameterId::ViscousFriction, 0.5),
    (ParameterId::SolenoidOrificeArea, 0.2),
    (ParameterId::PortOrificeArea, 0.2),
    (ParameterId::DeadVolume, 0.2),
    (ParameterId::PipeVolume, 0.2),
    (ParameterId::SpringStiffness, 0.05),
    (ParameterId::PreloadCompression, 0.05),
];
