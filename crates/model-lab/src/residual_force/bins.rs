//! Missing force and flow against position, velocity, pressure and time, closing and opening apart.

use super::weak::Missing;
use crate::crossing::Direction;

/// What a bin counts along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Position, m.
    Position,
    /// Velocity, m/s.
    Velocity,
    /// Chamber pressure, Pa.
    ChamberPressure,
    /// Time since the command, s.
    SinceCommand,
}

impl Axis {
    /// All.
    pub const ALL: [Self; 4] = [Self::Position, Self::Velocity, Self::ChamberPressure, Self::SinceCommand];

    /// Its name in files, with its unit.
    pub fn id(self) -> &'static str {
        match self {
            Self::Position => "position_m",
            Self::Velocity => "velocity_m_per_s",
            Self::ChamberPressure => "chamber_pressure_pa",
            Self::SinceCommand => "time_since_command_s",
        }
    }

    fn of(self, window: &Missing) -> f64 {
        match self {
            Self::Position => window.position_m,
            Self::Velocity => window.velocity_m_per_s,
            Self::ChamberPressure => window.chamber_pressure_pa,
            Self::SinceCommand => window.since_command_s,
        }
    }
}

/// The mean of what is missing in a bin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Mean place on the axis, SI.
    pub at: f64,
    /// Mean force that the model lacks, N, + opens.
    pub force_n: f64,
    /// Its standard error: noise of the sensors and differences between runs, N.
    pub standard_error_n: f64,
    /// By how much the tolerances of the parameters could move it, one standard deviation, N.
    pub tolerance_error_n: f64,
    /// Mean flow that the model lacks, kg/s, + fills.
    pub flow_kg_per_s: Option<f64>,
    /// Runs with a window in the bin.
    pub runs: usize,
}

/// The bins of one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// What they count along.
    pub axis: Axis,
    /// Which way the strokes go.
    pub direction: Direction,
    /// The bins with at least one window, in order.
    pub bins: Vec<Bin>,
}

/// Bins along an axis.
const BINS: usize = 25;

/// The profile of one direction along an axis. `shifted` are the windows of a valve with one parameter
/// moved by its tolerance each, window by window.
pub fn profile(
    windows: &[Missing],
    shifted: &[Vec<Missing>],
    axis: Axis,
    direction: Direction,
    stroke_m: f64,
) -> Profile {
    let chosen: Vec<usize> = (0..windows.len()).filter(|index| windows[*index].direction == direction).collect();
    let places = || chosen.iter().map(|index| axis.of(&windows[*index]));
    let (low, high) = match axis {
        Axis::Position => (0.0, stroke_m),
        _ => places().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at))),
    };
    let width = (high - low) / BINS as f64;
    let bins = (0..BINS)
        .filter_map(|bin| {
            let from = low + bin as f64 * width;
            let to = if bin + 1 == BINS { f64::INFINITY } else { from + width };
            let inside: Vec<usize> =
                chosen.iter().copied().filter(|index| (from..to).contains(&axis.of(&windows[*index]))).collect();
            bin_of(windows, shifted, axis, &inside)
        })
        .collect();
    Profile { axis, direction, bins }
}

fn bin_of(windows: &[Missing], shifted: &[Vec<Missing>], axis: Axis, inside: &[usize]) -> Option<Bin> {
    if inside.is_empty() {
        return None;
    }
    let mut runs: Vec<usize> = inside.iter().map(|index| windows[*index].run).collect();
    runs.dedup();
    runs.sort_unstable();
    runs.dedup();
    // Windows of one run overlap; each run counts as one reading.
    let run_means: Vec<(f64, f64)> = runs
        .iter()
        .map(|run| {
            let of_run: Vec<&Missing> =
                inside.iter().map(|index| &windows[*index]).filter(|window| window.run == *run).collect();
            let count = of_run.len() as f64;
            let force = of_run.iter().map(|window| window.force_n).sum::<f64>() / count;
            (force, of_run.iter().map(|window| window.force_error_n).sum::<f64>() / count)
        })
        .collect();
    let count = runs.len() as f64;
    let force_n = run_means.iter().map(|(force, _)| force).sum::<f64>() / count;
    let noise = run_means.iter().map(|(_, error)| error * error).sum::<f64>() / (count * count);
    let spread = if runs.len() > 1 {
        run_means.iter().map(|(force, _)| (force - force_n).powi(2)).sum::<f64>() / (count * (count - 1.0))
    } else {
        0.0
    };
    let mean_of =
        |value: &dyn Fn(usize) -> f64| inside.iter().map(|index| value(*index)).sum::<f64>() / inside.len() as f64;
    let tolerance: f64 =
        shifted.iter().map(|moved| mean_of(&|index| moved[index].force_n - windows[index].force_n).powi(2)).sum();
    let flows: Vec<f64> = inside.iter().filter_map(|index| windows[*index].flow_kg_per_s).collect();
    Some(Bin {
        at: mean_of(&|index| axis.of(&windows[index])),
        force_n,
        standard_error_n: noise.max(spread).sqrt(),
        tolerance_error_n: tolerance.sqrt(),
        flow_kg_per_s: (!flows.is_empty()).then(|| flows.iter().sum::<f64>() / flows.len() as f64),
        runs: runs.len(),
    })
}
