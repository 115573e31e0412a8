//! Errors summed up: of a run, and of all runs.

use super::phases::{Direction, Phase};
use super::runs::StrokeComparison;

/// Sums of squared errors by phase and by channel.
#[derive(Debug, Clone, Default)]
pub(super) struct Squares {
    /// Squared position error, m², and samples, by direction and phase.
    phases: [[(f64, f64); 4]; 2],
    /// Squared error of all channels in units of the noise, and samples.
    all: (f64, f64),
    /// Squared position error, m², and samples.
    position: (f64, f64),
}

impl Squares {
    pub(super) fn add(&mut self, direction: Direction, phase: Phase, error_m: f64) {
        let cell = &mut self.phases[direction as usize][phase as usize];
        cell.0 += error_m * error_m;
        cell.1 += 1.0;
        self.position.0 += error_m * error_m;
        self.position.1 += 1.0;
    }

    pub(super) fn add_channel(&mut self, normalised: f64, count: f64) {
        self.all.0 += normalised;
        self.all.1 += count;
    }
}

/// The error of a model in one phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseScore {
    /// Which way the stroke goes.
    pub direction: Direction,
    /// The phase.
    pub phase: Phase,
    /// Root mean square of the position error in it, m; nothing for stroke times.
    pub rmse_m: Option<f64>,
    /// The same in units of the noise.
    pub normalised_rms: Option<f64>,
    /// Its share of the sum of squared position errors.
    pub share: Option<f64>,
    /// By how much longer the phase takes in the simulation than in the record, s, the mean over strokes.
    pub time_error_s: Option<f64>,
    /// One standard deviation of that mean from the sensor's noise, s.
    pub time_standard_error_s: Option<f64>,
}

/// The errors of a run, or of all.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    /// Root mean square of the position error, m; nothing for stroke times.
    pub rmse_m: Option<f64>,
    /// Root mean square of the errors of all channels in units of their noise.
    pub normalised_rms: f64,
    /// Readings that went into it.
    pub readings: f64,
    /// Simulated minus measured closing time, s, the mean over strokes.
    pub close_time_error_s: Option<f64>,
    /// Simulated minus measured opening time, s, the mean over strokes.
    pub open_time_error_s: Option<f64>,
    /// Closing and opening phases; empty for stroke times.
    pub phases: Vec<PhaseScore>,
    squares: [[(f64, f64); 4]; 2],
}

impl Score {
    pub(super) fn new(squares: &Squares, noise_m: f64, rmse_m: Option<f64>, strokes: &[StrokeComparison]) -> Self {
        Self {
            rmse_m,
            normalised_rms: (squares.all.0 / squares.all.1.max(1.0)).sqrt(),
            readings: squares.all.1,
            close_time_error_s: mean_time_error(strokes, Direction::Closing),
            open_time_error_s: mean_time_error(strokes, Direction::Opening),
            phases: phases(&squares.phases, noise_m, strokes),
            squares: squares.phases,
        }
    }

    /// The score of stroke times without traces.
    pub(super) fn of_times(normalised_rms: f64, readings: f64, strokes: &[StrokeComparison]) -> Self {
        Self {
            rmse_m: None,
            normalised_rms,
            readings,
            close_time_error_s: mean_time_error(strokes, Direction::Closing),
            open_time_error_s: mean_time_error(strokes, Direction::Opening),
            phases: Vec::new(),
            squares: Default::default(),
        }
    }

    /// All runs together.
    pub(super) fn overall<'a>(
        scores: impl Iterator<Item = &'a Self> + Clone,
        strokes: &[StrokeComparison],
        noise_m: f64,
    ) -> Self {
        let mut cells = [[(0.0, 0.0); 4]; 2];
        let (mut sum, mut readings) = (0.0, 0.0);
        let (mut squared_m, mut traces) = (0.0, 0.0);
        for score in scores {
            for (total, part) in cells.iter_mut().flatten().zip(score.squares.iter().flatten()) {
                total.0 += part.0;
                total.1 += part.1;
            }
            sum += score.normalised_rms.powi(2) * score.readings;
            readings += score.readings;
            if let Some(rmse) = score.rmse_m {
                squared_m += rmse * rmse;
                traces += 1.0;
            }
        }
        Self {
            rmse_m: (traces > 0.0).then(|| (squared_m / traces).sqrt()),
            normalised_rms: (sum / f64::max(readings, 1.0)).sqrt(),
            readings,
            close_time_error_s: mean_time_error(strokes, Direction::Closing),
            open_time_error_s: mean_time_error(strokes, Direction::Opening),
            phases: if traces > 0.0 { phases(&cells, noise_m, strokes) } else { Vec::new() },
            squares: cells,
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

fn phases(cells: &[[(f64, f64); 4]; 2], noise_m: f64, strokes: &[StrokeComparison]) -> Vec<PhaseScore> {
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
            let rmse_m = (count > 0.0).then(|| (sum / count).sqrt());
            scores.push(PhaseScore {
                direction,
                phase,
                rmse_m,
                normalised_rms: rmse_m.map(|rmse| rmse / noise_m),
                share: (total > 0.0).then(|| sum / total),
                time_error_s: (!times.is_empty()).then(|| times.iter().map(|(error, _)| error).sum::<f64>() / strokes),
                time_standard_error_s: (!times.is_empty())
                    .then(|| times.iter().map(|(_, error)| error * error).sum::<f64>().sqrt() / strokes),
            });
        }
    }
    scores
}
