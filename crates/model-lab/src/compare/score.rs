//! Errors summed up: of a run, and of all runs.

use super::phases::Phase;
use super::runs::StrokeComparison;
use crate::crossing::Direction;
use crate::errors::Errors;

/// Sums of squared position residuals, m², and rows, by direction and phase.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PhaseSquares([[(f64, f64); 4]; 2]);

impl PhaseSquares {
    pub(super) fn add(&mut self, direction: Direction, phase: Phase, residual_m: f64) {
        let cell = &mut self.0[direction as usize][phase as usize];
        cell.0 += residual_m * residual_m;
        cell.1 += 1.0;
    }

    pub(super) fn add_all(&mut self, other: &Self) {
        for (sum, part) in self.0.iter_mut().flatten().zip(other.0.iter().flatten()) {
            sum.0 += part.0;
            sum.1 += part.1;
        }
    }
}

/// The error of a model in one phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseScore {
    /// Which way the stroke goes.
    pub direction: Direction,
    /// The phase.
    pub phase: Phase,
    /// Root mean square of the position error in it, m.
    pub rmse_m: Option<f64>,
    /// Its share of the sum of squared position errors.
    pub share: Option<f64>,
    /// By how much longer the phase takes in the record than in the simulation, s, the mean over strokes.
    pub time_error_s: Option<f64>,
    /// One standard deviation of that mean from the sensor's noise, s.
    pub time_standard_error_s: Option<f64>,
}

/// The errors of a run, or of all.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    /// The error.
    pub errors: Errors,
    /// Measured minus simulated closing time, s, the mean over strokes.
    pub close_time_error_s: Option<f64>,
    /// Measured minus simulated opening time, s, the mean over strokes.
    pub open_time_error_s: Option<f64>,
    /// Closing and opening phases; empty for stroke times.
    pub phases: Vec<PhaseScore>,
}

impl Score {
    pub(super) fn new(errors: Errors, squares: Option<&PhaseSquares>, strokes: &[StrokeComparison]) -> Self {
        Self {
            errors,
            close_time_error_s: mean_time_error(strokes, Direction::Closing),
            open_time_error_s: mean_time_error(strokes, Direction::Opening),
            phases: squares.map_or_else(Vec::new, |squares| phases(squares, strokes)),
        }
    }
}

fn mean_time_error(strokes: &[StrokeComparison], direction: Direction) -> Option<f64> {
    let errors: Vec<f64> = strokes
        .iter()
        .filter(|stroke| stroke.window.direction == direction)
        .filter_map(StrokeComparison::time_error_s)
        .collect();
    (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
}

fn phases(PhaseSquares(cells): &PhaseSquares, strokes: &[StrokeComparison]) -> Vec<PhaseScore> {
    let total: f64 = cells.iter().flatten().map(|cell| cell.0).sum();
    let mut scores = Vec::with_capacity(8);
    for direction in Direction::ALL {
        for phase in Phase::ALL {
            let (sum, count) = cells[direction as usize][phase as usize];
            let times: Vec<(f64, f64)> = strokes
                .iter()
                .filter(|stroke| stroke.window.direction == direction)
                .filter_map(|stroke| stroke.phase_time_error(phase))
                .collect();
            let strokes = times.len() as f64;
            scores.push(PhaseScore {
                direction,
                phase,
                rmse_m: (count > 0.0).then(|| (sum / count).sqrt()),
                share: (total > 0.0).then(|| sum / total),
                time_error_s: (!times.is_empty()).then(|| times.iter().map(|(error, _)| error).sum::<f64>() / strokes),
                time_standard_error_s: (!times.is_empty())
                    .then(|| times.iter().map(|(_, error)| error * error).sum::<f64>().sqrt() / strokes),
            });
        }
    }
    scores
}
