//! One recorded run against its simulation.

use valve_model::{Conditions, Valve};

use super::averages::{LongAverage, long_averages, neighbour_correlation};
use super::crossing::Smoothed;
use super::phases::{Direction, LevelTimes, Phase, StrokeWindow, boundaries, level_times, phase_at, phase_time_error};
use super::score::{Score, Squares};
use crate::data::{Channel, RunData};
use crate::forward::{Predicted, channel_of};

/// One stroke of a run.
#[derive(Debug, Clone)]
pub struct StrokeComparison {
    /// Its command and direction.
    pub window: StrokeWindow,
    /// When both motions pass each level; the last is the limit switch.
    pub levels: Vec<LevelTimes>,
}

impl StrokeComparison {
    /// Simulated minus measured time at the limit switch, s.
    pub fn time_error_s(&self) -> Option<f64> {
        self.levels.last()?.error_s()
    }

    /// By how much longer a phase takes in the simulation, and its standard error, s.
    pub fn phase_time_error(&self, phase: Phase) -> Option<(f64, f64)> {
        phase_time_error(&self.levels, phase)
    }
}

/// The error of one channel of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelScore {
    /// Which.
    pub channel: Channel,
    /// Root mean square of measured minus simulated, SI.
    pub rmse: f64,
    /// One standard deviation of the noise of a sample, SI.
    pub noise: f64,
}

/// One recorded run, or the stroke times recorded under one set of conditions.
#[derive(Debug, Clone)]
pub struct RunComparison {
    /// The file, or the lines of the stroke times.
    pub file: String,
    /// Its conditions.
    pub conditions: Conditions,
    /// Its errors.
    pub score: Score,
    /// Each channel.
    pub channels: Vec<ChannelScore>,
    /// Its strokes, in order of time; for stroke times one of each direction.
    pub strokes: Vec<StrokeComparison>,
    /// Averages of its residuals over longer times; empty for stroke times.
    pub averages: Vec<LongAverage>,
    /// Correlation of neighbouring block residuals of the position.
    pub neighbour_correlation: f64,
    /// The simulated record; empty for stroke times.
    pub predicted: Predicted,
}

/// Compares a run with its simulated record. `residual` are its block residuals.
pub(super) fn compare_run(valve: &Valve, data: &RunData, predicted: Predicted, residual: &[f64]) -> RunComparison {
    let position = data.channels.iter().find(|channel| channel.channel == Channel::Position);
    let (samples, noise_m) = position.map_or((&[] as &[f64], 1.0), |channel| (&channel.samples[..], channel.noise));
    let measured = Smoothed::new(&data.times_s, samples, samples);
    let simulated = Smoothed::new(&data.times_s, &predicted.position_m, samples);
    let stroke_m = valve.parameters().stroke_m;
    let limits = [valve.switches().closed_at * stroke_m, valve.switches().open_at * stroke_m];
    let mut strokes = Vec::new();
    let mut squares = Squares::default();
    for (index, command) in data.run.commands.iter().enumerate() {
        let until_s = data.run.commands.get(index + 1).map_or(f64::INFINITY, |next| next.time_s);
        let window = StrokeWindow { direction: Direction::of(command.close), command_s: command.time_s, until_s };
        let limit = limits[usize::from(!command.close)];
        let levels = level_times(&window, (&measured, &simulated), (stroke_m, limit), noise_m);
        let ends = boundaries(&levels, until_s.min(data.run.end_s) - command.time_s);
        let from = data.times_s.partition_point(|time| *time < command.time_s);
        let to = data.times_s.partition_point(|time| *time < until_s);
        let errors = samples[from..to].iter().zip(&predicted.position_m[from..to]).map(|(a, b)| a - b);
        for (error, time) in errors.zip(&data.times_s[from..to]) {
            if error.is_finite() {
                squares.add(window.direction, phase_at(&ends, time - command.time_s), error);
            }
        }
        strokes.push(StrokeComparison { window, levels });
    }
    let channels: Vec<ChannelScore> = data
        .channels
        .iter()
        .map(|channel| {
            let model = channel_of(&predicted, channel.channel);
            let (mut sum, mut count) = (0.0, 0.0);
            for error in channel.samples.iter().zip(model).map(|(a, b)| a - b).filter(|error| error.is_finite()) {
                sum += error * error;
                count += 1.0;
            }
            squares.add_channel(sum / (channel.noise * channel.noise), count);
            ChannelScore { channel: channel.channel, rmse: (sum / f64::max(count, 1.0)).sqrt(), noise: channel.noise }
        })
        .collect();
    let score = Score::new(&squares, noise_m, channels.first().map(|channel| channel.rmse), &strokes);
    RunComparison {
        file: data.name.clone(),
        conditions: data.run.conditions,
        score,
        channels,
        strokes,
        averages: long_averages(&[data], residual),
        neighbour_correlation: neighbour_correlation(data, residual),
        predicted,
    }
}
