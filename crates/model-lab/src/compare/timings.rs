//! Stroke times without traces against the simulation.

use valve_model::Valve;

use super::phases::{LevelTimes, StrokeWindow};
use super::runs::{RunComparison, StrokeComparison};
use super::score::Score;
use crate::crossing::Direction;
use crate::data::{Dataset, TimingGroup};
use crate::errors::Errors;
use crate::forward::{Predicted, timing_predictions};
use crate::identification::ValveProblem;

/// Compares the stroke times of a dataset, one entry for each set of conditions.
pub(super) fn compare_times(
    data: &Dataset,
    valve: &Valve,
    (problem, residual): (&ValveProblem<'_>, &[Vec<f64>]),
) -> Vec<RunComparison> {
    if data.timing_groups.is_empty() {
        return Vec::new();
    }
    let predicted = timing_predictions(data, valve);
    data.timing_groups
        .iter()
        .zip(&predicted)
        .enumerate()
        .map(|(index, (group, times))| {
            let strokes: Vec<StrokeComparison> = [times.close_time_s, times.open_time_s]
                .into_iter()
                .zip(Direction::ALL)
                .map(|(simulated_s, direction)| stroke(data, group, direction, simulated_s))
                .collect();
            let source = data.runs.len() + index;
            let errors = Errors::of_recordings(problem, residual, |recording| recording.source == source);
            RunComparison {
                file: lines(data, group),
                conditions: group.conditions,
                score: Score::new(errors, None, &strokes),
                channels: Vec::new(),
                strokes,
                predicted: Predicted::default(),
            }
        })
        .collect()
}

/// The mean of the measured times of one direction beside the simulated one.
fn stroke(data: &Dataset, group: &TimingGroup, direction: Direction, simulated_s: Option<f64>) -> StrokeComparison {
    let measured: Vec<f64> = group
        .rows
        .iter()
        .filter_map(|row| match direction {
            Direction::Closing => data.timing_rows[*row].close_time_s,
            Direction::Opening => data.timing_rows[*row].open_time_s,
        })
        .collect();
    let window_s = match direction {
        Direction::Closing => data.schedule.open_at_s - data.schedule.close_at_s,
        Direction::Opening => data.schedule.end_s - data.schedule.open_at_s,
    };
    let count = measured.len() as f64;
    let level = LevelTimes {
        travelled: 1.0,
        measured_s: (count > 0.0).then(|| measured.iter().sum::<f64>() / count),
        simulated_s,
        standard_error_s: data.timing_noise_s / count.max(1.0).sqrt(),
    };
    let command_s = match direction {
        Direction::Closing => data.schedule.close_at_s,
        Direction::Opening => data.schedule.open_at_s,
    };
    StrokeComparison {
        window: StrokeWindow { direction, command_s, until_s: command_s + window_s },
        levels: vec![level],
    }
}

/// What to call a group: the lines of its rows.
fn lines(data: &Dataset, group: &TimingGroup) -> String {
    let numbers: Vec<usize> = group.rows.iter().map(|row| data.timing_rows[*row].line).collect();
    match (numbers.first(), numbers.last()) {
        (Some(first), Some(last)) if first == last => format!("stroke times, line {first}"),
        (Some(first), Some(last)) => format!("stroke times, lines {first} to {last}"),
        _ => "stroke times".to_owned(),
    }
}
