//! The forward simulation of a dataset: residuals of many parameter sets at once.

use rayon::prelude::*;
use valve_model::cycle::{CycleTimes, cycles};
use valve_model::real::LANES;
use valve_model::{Fidelity, Outcome, Prepared, Run, Trajectory, Valve, simulate};

use crate::data::{Channel, ChannelData, Dataset, FINE_FIT, RunData};

/// Residuals beyond this many standard deviations carry no more information.
const LARGEST_RESIDUAL: f64 = 1e4;

/// Runs handed to one task, at least and at most: the lanes filled once, and often.
const BATCH: (usize, usize) = (LANES, 8 * LANES);

/// Tasks for each thread, so that none waits long for another.
const TASKS: usize = 4;

/// What a recorder would have written down of a simulated run, at its sample times.
pub use valve_model::measurement::Record as Predicted;

/// A channel of a record.
pub fn channel_of(record: &Predicted, channel: Channel) -> &[f64] {
    match channel {
        Channel::Position => &record.position_m,
        Channel::ChamberPressure => &record.chamber_pressure_pa,
        Channel::PipePressure => &record.pipe_pressure_pa,
    }
}

/// The record of a simulated run as the sensors of the valve would give it.
pub fn record(valve: &Valve, nodes: &Trajectory, times_s: &[f64], into: &mut Predicted) {
    valve.measurement().record(nodes, times_s, into);
}

/// A run to simulate with a valve, the recordings to compare it with, and where the residuals of each go.
struct Job<'a> {
    valve: &'a Valve,
    run: &'a Run,
    recorded: Vec<(&'a RunData, &'a mut [f64])>,
}

/// The residuals of a dataset for each valve: data minus model in units of the noise, all blocks of
/// all runs one after the other, then closing and opening of every row of stroke times.
pub fn residuals(data: &Dataset, valves: &[Valve]) -> Vec<Vec<f64>> {
    let mut all = vec![vec![0.0; data.residual_count()]; valves.len()];
    let times = if data.timing_rows.is_empty() { Vec::new() } else { timing_predictions(data, valves) };
    let alike = alike(data);
    // Of each valve, the stretch of every run.
    let mut stretches: Vec<Vec<Option<&mut [f64]>>> = Vec::with_capacity(valves.len());
    for (set, all) in all.iter_mut().enumerate() {
        let mut rest = all.as_mut_slice();
        let of_run = |run: &RunData| rest.split_off_mut(..run.block_count());
        stretches.push(data.runs.iter().map(of_run).collect());
        if let Some(times) = times.get(set) {
            timing_residuals(data, times, rest);
        }
    }
    let mut jobs = Vec::with_capacity(alike.len() * valves.len());
    for runs in &alike {
        for (valve, stretches) in valves.iter().zip(&mut stretches) {
            let recorded = runs.iter().filter_map(|run| Some((&data.runs[*run], stretches[*run].take()?))).collect();
            jobs.push(Job { valve, run: &data.runs[runs[0]].run, recorded });
        }
    }
    compare(jobs, data.fidelity);
    all
}

/// The residuals of single recordings, each against a run and a valve of its own.
pub fn residuals_of(recorded: &[(&RunData, Run, Valve)], fidelity: Fidelity) -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = recorded.iter().map(|(recorded, ..)| vec![0.0; recorded.block_count()]).collect();
    let jobs = recorded.iter().zip(&mut all).map(|((recorded, run, valve), into)| Job {
        valve,
        run,
        recorded: vec![(*recorded, into.as_mut_slice())],
    });
    compare(jobs.collect(), fidelity);
    all
}

/// Writes the residuals of every recording of every job.
fn compare(jobs: Vec<Job<'_>>, fidelity: Fidelity) {
    let prepare = |job: &Job<'_>| Prepared::new(job.valve, job.run, fidelity);
    let prepared: Vec<Prepared> = jobs.par_iter().map(prepare).collect();
    let pressures = jobs.iter().flat_map(|job| &job.recorded).any(|(recorded, _)| recorded.channels.len() > 1);
    let length = batch_length(jobs.len());
    // Together those that share the lanes.
    let mut kinds: Vec<(Vec<Job<'_>>, Vec<Prepared>)> = Vec::new();
    for (job, run) in jobs.into_iter().zip(prepared) {
        match kinds.iter_mut().find(|(_, runs)| runs[0].fits_beside(&run)) {
            Some((jobs, runs)) => {
                jobs.push(job);
                runs.push(run);
            }
            None => kinds.push((vec![job], vec![run])),
        }
    }
    let batches: Vec<_> =
        kinds.iter_mut().flat_map(|(jobs, runs)| jobs.chunks_mut(length).zip(runs.chunks(length))).collect();
    batches.into_par_iter().for_each(|(jobs, runs)| {
        let mut predicted = Predicted::default();
        simulate(runs, pressures, |index, nodes, _| {
            let Job { valve, recorded, .. } = &mut jobs[index];
            if nodes.outcome != Outcome::Complete {
                // A parameter set that cannot be simulated explains nothing.
                for (_, into) in recorded {
                    into.fill(LARGEST_RESIDUAL);
                }
                return;
            }
            let mut sampled: Option<&[f64]> = None;
            for (recorded, into) in recorded {
                // Repeats are often sampled at the same times.
                if sampled != Some(&recorded.times_s) {
                    record(valve, nodes, &recorded.times_s, &mut predicted);
                    sampled = Some(&recorded.times_s);
                }
                run_residuals(recorded, &predicted, into);
            }
        });
    });
}

/// The runs of a dataset by index, those that are simulated alike together.
fn alike(data: &Dataset) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, run) in data.runs.iter().enumerate() {
        match groups.iter_mut().find(|group| data.runs[group[0]].run == run.run) {
            Some(group) => group.push(index),
            None => groups.push(vec![index]),
        }
    }
    groups
}

/// Into how long batches runs are cut: enough batches for all threads, with full lanes.
fn batch_length(runs: usize) -> usize {
    let even = runs.div_ceil(TASKS * rayon::current_num_threads());
    even.clamp(BATCH.0, BATCH.1).next_multiple_of(LANES)
}

/// Residuals of the blocks of one run.
fn run_residuals(run: &RunData, predicted: &Predicted, into: &mut [f64]) {
    let mut rest = into;
    for channel in &run.channels {
        if let Some(stretch) = rest.split_off_mut(..channel.blocks.len()) {
            channel_residuals(channel, channel_of(predicted, channel.channel), stretch);
        }
    }
}

fn channel_residuals(channel: &ChannelData, model: &[f64], into: &mut [f64]) {
    for (residual, block) in into.iter_mut().zip(&channel.blocks) {
        // A block has at least one sample that counts.
        let mean = if block.end - block.first == 1 {
            model[block.first]
        } else {
            let (mut sum, mut count) = (0.0, 0.0);
            for (sample, model) in channel.samples[block.first..block.end].iter().zip(&model[block.first..block.end]) {
                if sample.is_finite() {
                    sum += model;
                    count += 1.0;
                }
            }
            sum / count
        };
        *residual = bounded((block.mean - mean) * block.inverse_sigma);
    }
}

fn bounded(residual: f64) -> f64 {
    if residual.is_nan() { LARGEST_RESIDUAL } else { residual.clamp(-LARGEST_RESIDUAL, LARGEST_RESIDUAL) }
}

/// The stroke times of every group of stroke times for each valve.
pub fn timing_predictions(data: &Dataset, valves: &[Valve]) -> Vec<Vec<CycleTimes>> {
    let groups = data.timing_groups.len();
    // Stroke times close to a stall want all substeps.
    let fidelity = if data.fidelity == FINE_FIT { Fidelity::FINE } else { data.fidelity };
    let mut times: Vec<Vec<CycleTimes>> =
        vec![vec![CycleTimes { close_time_s: None, open_time_s: None }; groups]; valves.len()];
    for wanted in [1, 2] {
        let jobs: Vec<(usize, usize)> = (0..groups)
            .filter(|group| data.timing_groups[*group].cycles == wanted)
            .flat_map(|group| (0..valves.len()).map(move |set| (group, set)))
            .collect();
        let parts: Vec<Vec<Vec<CycleTimes>>> = jobs
            .par_chunks(batch_length(jobs.len()))
            .map(|chunk| {
                let batch: Vec<_> =
                    chunk.iter().map(|(group, set)| (&valves[*set], data.timing_groups[*group].conditions)).collect();
                cycles(&batch, &data.schedule, wanted, fidelity)
            })
            .collect();
        for ((group, set), cycle) in jobs.iter().zip(parts.into_iter().flatten()) {
            if let Some(last) = cycle.last() {
                let offset = valves[*set].measurement().offset_s;
                let shifted = |time: Option<f64>| time.map(|time| time + offset);
                times[*set][*group] =
                    CycleTimes { close_time_s: shifted(last.close_time_s), open_time_s: shifted(last.open_time_s) };
            }
        }
    }
    times
}

fn timing_residuals(data: &Dataset, times: &[CycleTimes], into: &mut [f64]) {
    let windows = (data.schedule.open_at_s - data.schedule.close_at_s, data.schedule.end_s - data.schedule.open_at_s);
    let rows =
        data.timing_groups.iter().zip(times).flat_map(|(group, times)| group.rows.iter().map(move |row| (row, times)));
    for (into, (row, times)) in into.chunks_exact_mut(2).zip(rows) {
        let row = &data.timing_rows[*row];
        into[0] = timing_residual(row.close_time_s, times.close_time_s, windows.0, data.timing_noise_s);
        into[1] = timing_residual(row.open_time_s, times.open_time_s, windows.1, data.timing_noise_s);
    }
}

/// A stroke that was not finished within its window is a censored reading: it only says "later".
fn timing_residual(measured: Option<f64>, model: Option<f64>, window: f64, noise: f64) -> f64 {
    let beyond = 1.2 * window;
    match (measured, model) {
        (Some(measured), model) => bounded((measured - model.unwrap_or(beyond)) / noise),
        (None, Some(model)) => bounded((window - model).max(0.0) / noise),
        (None, None) => 0.0,
    }
}
