//! The phases of a stroke, and the error of a model in each.

use crate::crossing::{Crossing, Direction, Smoothed};

/// A part of a stroke.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// From the command until 2 % of the stroke are travelled.
    DeadTime,
    /// From 2 % to 10 %.
    Breakaway,
    /// From 10 % to 90 %.
    Travel,
    /// From 90 % to the limit switch, and the rest that follows.
    Seating,
}

impl Phase {
    /// All, in their order.
    pub const ALL: [Self; 4] = [Self::DeadTime, Self::Breakaway, Self::Travel, Self::Seating];

    /// Its name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::DeadTime => "dead_time",
            Self::Breakaway => "breakaway",
            Self::Travel => "travel",
            Self::Seating => "seating",
        }
    }

    /// Indices into [`LEVELS`] at which it begins and ends; dead time begins at the command.
    fn levels(self) -> (Option<usize>, usize) {
        match self {
            Self::DeadTime => (None, 0),
            Self::Breakaway => (Some(0), 2),
            Self::Travel => (Some(2), 10),
            Self::Seating => (Some(10), 12),
        }
    }
}

/// Shares of the stroke travelled at which the motions are timed; the last one stands for the limit switch.
pub const LEVELS: [f64; 13] = [0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0];

/// A stroke to be timed.
#[derive(Debug, Clone, Copy)]
pub struct StrokeWindow {
    /// Its direction.
    pub direction: Direction,
    /// Its command, s.
    pub command_s: f64,
    /// The next command or the end of the run, s.
    pub until_s: f64,
}

/// A level that a measured and a simulated stroke pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelTimes {
    /// Share of the stroke travelled.
    pub travelled: f64,
    /// Time from the command in the record, s.
    pub measured_s: Option<f64>,
    /// Time from the command in the simulation, s.
    pub simulated_s: Option<f64>,
    /// One standard deviation of the measured time from the sensor's noise, s.
    pub standard_error_s: f64,
}

impl LevelTimes {
    /// Measured minus simulated, s.
    pub fn error_s(&self) -> Option<f64> {
        Some(self.measured_s? - self.simulated_s?)
    }
}

/// Times both motions of a stroke at all levels. `limit_m` is the level of the limit switch.
pub fn level_times(
    window: &StrokeWindow,
    (measured, simulated): (&Smoothed, &Smoothed),
    (stroke_m, limit_m): (f64, f64),
    noise_m: f64,
) -> Vec<LevelTimes> {
    let closing = window.direction == Direction::Closing;
    LEVELS
        .iter()
        .enumerate()
        .map(|(index, travelled)| {
            let level = match (index + 1 == LEVELS.len(), closing) {
                (true, _) => limit_m,
                (false, true) => stroke_m * (1.0 - travelled),
                (false, false) => stroke_m * travelled,
            };
            let cross = |trace: &Smoothed| trace.crossing(window.command_s, window.until_s, level, closing);
            let (measured, simulated) = (cross(measured), cross(simulated));
            let since = |crossing: Crossing| crossing.time_s - window.command_s;
            LevelTimes {
                travelled: *travelled,
                measured_s: measured.map(since),
                simulated_s: simulated.map(since),
                standard_error_s: measured.map_or(f64::INFINITY, |crossing| crossing.standard_error_s(noise_m)),
            }
        })
        .collect()
}

/// By how much longer a phase takes in the record than in the simulation, and one standard deviation
/// of that, s.
pub fn phase_time_error(levels: &[LevelTimes], phase: Phase) -> Option<(f64, f64)> {
    // Stroke times alone know no phases.
    if levels.len() != LEVELS.len() {
        return None;
    }
    let (from, to) = phase.levels();
    let end = &levels[to];
    let (before, variance) = match from {
        Some(from) => (levels[from].error_s()?, levels[from].standard_error_s.powi(2)),
        None => (0.0, 0.0),
    };
    Some((end.error_s()? - before, (variance + end.standard_error_s.powi(2)).sqrt()))
}

/// Ends of dead time, breakaway and travel in a record, s from the command: what happens between the
/// first and the later of both motions counts to the phase that it begins or ends.
pub fn boundaries(levels: &[LevelTimes], length_s: f64) -> [f64; 3] {
    let pick = |index: usize, later: bool| {
        let level = &levels[index];
        let of = |time: Option<f64>| time.unwrap_or(length_s);
        let (a, b) = (of(level.measured_s), of(level.simulated_s));
        if later { a.max(b) } else { a.min(b) }
    };
    let dead = pick(0, false);
    let breakaway = pick(2, true).max(dead);
    let travel = pick(10, false).max(breakaway);
    [dead, breakaway, travel]
}

/// The phase of an instant.
pub fn phase_at(boundaries: &[f64; 3], since_command_s: f64) -> Phase {
    let passed = boundaries.iter().filter(|end| since_command_s >= **end).count();
    Phase::ALL[passed]
}
