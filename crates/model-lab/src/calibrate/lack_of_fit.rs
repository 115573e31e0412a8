//! Lack of fit against pure error: whether a model is off by more than replicated strokes differ.

use identify::Problem;
use identify::select::Model;
use valve_model::CommandEdge;

use crate::identification::ValveProblem;
use crate::identification::setup::{Kind, Recording};

/// Sums of squares of replicated readings: of their means, each as often as it was replicated, and of what they differ by,
/// for each degree of freedom. Where noise is all there is both are expected to be the same.
#[derive(Debug, Clone, Copy, Default)]
struct Squares {
    lack_of_fit: f64,
    pure_error: f64,
}

impl Squares {
    fn add(&mut self, replicated: &[f64]) {
        if replicated.len() < 2 {
            return;
        }
        let count = replicated.len() as f64;
        let mean = replicated.iter().sum::<f64>() / count;
        self.lack_of_fit += count * mean * mean;
        self.pure_error += replicated.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    }
}

/// The lack-of-fit statistic: the mean square of what replicated strokes have in common of a model's residuals over that of what they differ by (Fisher's
/// F); nothing where no stroke was replicated.
pub fn lack_of_fit(model: &Model<ValveProblem<'_>>) -> Option<f64> {
    let records = model.problem.records();
    let recordings = &model.problem.setup().recordings;
    let residual = &model.fit.linear.residual;
    let mut squares = Squares::default();
    let mut seen: Vec<usize> = Vec::new();
    for (index, recording) in recordings.iter().enumerate() {
        match &recording.kind {
            Kind::Times(times) => {
                for closes in [true, false] {
                    let of = times.closing.iter().zip(&residual[index]).filter(|(closing, _)| **closing == closes);
                    squares.add(&of.map(|(_, residual)| *residual).collect::<Vec<f64>>());
                }
            }
            Kind::Trace(_) if !seen.contains(&records[index].condition) => {
                seen.push(records[index].condition);
                let alike: Vec<usize> = (index..recordings.len())
                    .filter(|other| records[*other].condition == records[index].condition)
                    .filter(|other| matches!(recordings[*other].kind, Kind::Trace(_)))
                    .filter(|other| is_same_pattern(recording, &recordings[*other]))
                    .collect();
                let curves: Vec<Vec<(f64, f64)>> = alike
                    .iter()
                    .map(|other| {
                        let zero_s = first_command_s(&recordings[*other]);
                        let rows = records[*other].series.first().map_or(&[][..], |series| &series.rows);
                        rows.iter().zip(&residual[*other]).map(|(row, left)| (row.time_s - zero_s, *left)).collect()
                    })
                    .collect();
                for (time_s, _) in &curves[0] {
                    let beside: Option<Vec<f64>> = curves.iter().map(|curve| between(curve, *time_s)).collect();
                    squares.add(&beside.unwrap_or_default());
                }
            }
            Kind::Trace(_) => {}
        }
    }
    (squares.pure_error > 0.0).then(|| squares.lack_of_fit / squares.pure_error)
}

fn first_command_s(recording: &Recording) -> f64 {
    recording.origin_s + recording.run.commands.first().map_or(0.0, |edge| edge.time_s)
}

/// Commands that come this close to the same time after the first are the same, s.
const SAME_COMMAND_S: f64 = 0.02;

/// Whether two records have the same commands, from the first one on.
fn is_same_pattern(one: &Recording, other: &Recording) -> bool {
    let (a, b) = (&one.run.commands, &other.run.commands);
    let since = |all: &[CommandEdge], index: usize| all[index].time_s - all[0].time_s;
    a.len() == b.len()
        && (0..a.len()).all(|i| a[i].closes() == b[i].closes() && (since(a, i) - since(b, i)).abs() < SAME_COMMAND_S)
}

/// A curve at a time, by a straight line; nothing outside of it.
fn between(curve: &[(f64, f64)], time_s: f64) -> Option<f64> {
    let right = curve.partition_point(|(time, _)| *time < time_s);
    let after = curve.get(right)?;
    if after.0 == time_s {
        return Some(after.1);
    }
    let before = curve.get(right.checked_sub(1)?)?;
    let share = (time_s - before.0) / (after.0 - before.0);
    Some(before.1 + share * (after.1 - before.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_replicates_have_in_common_is_lack_of_fit() {
        let mut squares = Squares::default();
        squares.add(&[1.0, -1.0]);
        squares.add(&[5.0]);
        assert_eq!((squares.lack_of_fit, squares.pure_error), (0.0, 2.0));
        squares.add(&[2.0, 2.0, 2.0]);
        assert_eq!((squares.lack_of_fit, squares.pure_error), (12.0, 2.0));
        assert_eq!(between(&[(0.0, 1.0), (2.0, 3.0)], 0.5), Some(1.5));
        assert_eq!(between(&[(0.0, 1.0), (2.0, 3.0)], 2.5), None);
    }
}
