//! One recorded run against its simulation.

use identify::Problem;
use valve_model::{Conditions, Valve};

use super::phases::{LevelTimes, Phase, StrokeWindow, boundaries, level_times, phase_at, phase_time_error};
use super::score::{PhaseSquares, Score};
use crate::crossing::{Direction, Smoothed};
use crate::data::{Channel, RunData};
use crate::errors::Errors;
use crate::forward::Predicted;
use crate::identification::ValveProblem;
use crate::identification::nuisance::Nuisance;
use crate::identification::setup::Kind;

/// One stroke of a run.
#[derive(Debug, Clone)]
pub struct StrokeComparison {
    /// Its command and direction.
    pub window: StrokeWindow,
    /// When both motions pass each level; the last is the limit switch. Where the record falls short of it by less than the zero of
    /// a sensor is usually off, both are timed that far before it.
    pub levels: Vec<LevelTimes>,
}

impl StrokeComparison {
    /// Measured minus simulated time at the limit switch, s.
    pub fn time_error_s(&self) -> Option<f64> {
        self.levels.last()?.error_s()
    }

    /// By how much longer a phase takes in the record, and its standard error, s.
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
    /// The same in units of the rows' noise.
    pub normalised_rms: f64,
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
    /// The simulated record; empty for stroke times.
    pub predicted: Predicted,
}

/// Where a stroke is timed, m: at its limit, but so far before the stop at least as a sensor's zero may be off. Nearer to it, zero and
/// noise decide when, or whether, a record gets there.
fn timed_at(limit_m: f64, closes: bool, zero_m: f64, stroke_m: f64) -> f64 {
    let zero_m = zero_m.min(0.5 * stroke_m);
    if closes { limit_m.max(zero_m) } else { limit_m.min(stroke_m - zero_m) }
}

/// Compares a run, of its index among all, with its simulated record. The residuals are those of all recordings of a problem.
pub(super) fn compare_run(
    valve: &Valve,
    (source, data): (usize, &RunData),
    predicted: Predicted,
    (problem, residual): (&ValveProblem<'_>, &[Vec<f64>]),
) -> (RunComparison, PhaseSquares) {
    let position = data.channels.iter().find(|channel| channel.channel == Channel::Position);
    let (samples, noise_m) = position.map_or((&[] as &[f64], 1.0), |channel| (&channel.samples[..], channel.noise));
    let measured = Smoothed::new(&data.times_s, samples, samples);
    let simulated = Smoothed::new(&data.times_s, &predicted.position_m, samples);
    let stroke_m = valve.parameters().stroke_m;
    let limits = [valve.switches().closed_at * stroke_m, valve.switches().open_at * stroke_m];
    let zero_m = problem.nuisances.iter().filter(|entry| matches!(entry.nuisance, Nuisance::Zero(_)));
    let zero_m = zero_m.map(|entry| entry.size).fold(0.0, f64::max);
    let mut strokes = Vec::new();
    let mut ends = Vec::new();
    for (index, command) in data.run.commands.iter().enumerate() {
        let until_s = data.run.commands.get(index + 1).map_or(f64::INFINITY, |next| next.time_s);
        let window = StrokeWindow { direction: Direction::of(command.closes()), command_s: command.time_s, until_s };
        let limit = limits[usize::from(!command.closes())];
        let limit_m = timed_at(limit, command.closes(), zero_m, stroke_m);
        let levels = level_times(&window, (&measured, &simulated), (stroke_m, limit_m), noise_m);
        ends.push(boundaries(&levels, until_s.min(data.run.end_s) - command.time_s));
        strokes.push(StrokeComparison { window, levels });
    }
    let mut squares = PhaseSquares::default();
    let mut channels: Vec<(Channel, f64, f64, f64)> = Vec::new();
    let recordings = problem.setup().recordings.iter().zip(problem.records()).zip(residual);
    for ((recording, record), residual) in recordings.filter(|((recording, _), _)| recording.source == source) {
        let Kind::Trace(trace) = &recording.kind else { continue };
        let mut rest = residual.as_slice();
        for (series, rows) in record.series.iter().zip(&trace.channels) {
            let Some(residual) = rest.split_off(..series.rows.len()) else { continue };
            let known = channels.iter().position(|one| one.0 == rows.channel);
            let place = known.unwrap_or(channels.len());
            if known.is_none() {
                channels.push((rows.channel, 0.0, 0.0, 0.0));
            }
            for (row, residual) in series.rows.iter().zip(residual) {
                let sums = &mut channels[place];
                sums.1 += residual * residual;
                sums.2 += (residual / row.sigma).powi(2);
                sums.3 += 1.0;
                let stroke = strokes.iter().rposition(|stroke| stroke.window.command_s <= row.time_s);
                if let Some(index) = stroke.filter(|_| rows.channel == Channel::Position) {
                    let window = strokes[index].window;
                    squares.add(window.direction, phase_at(&ends[index], row.time_s - window.command_s), *residual);
                }
            }
        }
    }
    let noise = |which: Channel| data.channels.iter().find(|one| one.channel == which).map_or(0.0, |one| one.noise);
    let errors = Errors::of_recordings(problem, residual, |recording| recording.source == source);
    let compared = RunComparison {
        file: data.name.clone(),
        conditions: data.run.conditions,
        score: Score::new(errors, Some(&squares), &strokes),
        channels: channels
            .into_iter()
            .map(|(channel, sum, normalised, count)| ChannelScore {
                channel,
                rmse: (sum / f64::max(count, 1.0)).sqrt(),
                normalised_rms: (normalised / f64::max(count, 1.0)).sqrt(),
                noise: noise(channel),
            })
            .collect(),
        strokes,
        predicted,
    };
    (compared, squares)
}

#[cfg(test)]
mod tests {
    use super::timed_at;

    #[test]
    fn a_limit_at_a_stop_is_timed_where_a_sensor_can_show_it() {
        let (stroke_m, zero_m) = (0.04, 2e-4);
        assert_eq!(timed_at(0.0, true, zero_m, stroke_m), zero_m);
        assert_eq!(timed_at(stroke_m, false, zero_m, stroke_m), stroke_m - zero_m);
        // One that lies before the stop stays where it is, as does any where zeros are not off.
        assert_eq!(timed_at(1e-3, true, zero_m, stroke_m), 1e-3);
        assert_eq!(timed_at(0.038, false, zero_m, stroke_m), 0.038);
        assert_eq!(timed_at(0.0, true, 0.0, stroke_m), 0.0);
    }
}
