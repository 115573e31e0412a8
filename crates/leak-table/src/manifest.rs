//! What is known about a bundle of tables besides their rows.

use crate::fault::{Fault, Stroke};
use crate::table::LeakTable;
use crate::timing::AreaAt;

/// The cycle that was repeated until periodic, times from its start in s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CycleSchedule {
    /// The close command.
    pub close_at_s: f64,
    /// The open command.
    pub open_at_s: f64,
    /// The end of the cycle.
    pub end_s: f64,
}

impl CycleSchedule {
    /// The time within which a stroke counts as finished, in s.
    pub fn window_s(&self, stroke: Stroke) -> f64 {
        match stroke {
            Stroke::Close => self.open_at_s - self.close_at_s,
            Stroke::Open => self.end_s - self.open_at_s,
        }
    }
}

/// The times above which a stroke counts as failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Limit of the closing time in s.
    pub close_within_s: f64,
    /// Limit of the opening time in s.
    pub open_within_s: f64,
}

impl Limits {
    /// The limit of one stroke in s.
    pub fn within_s(&self, stroke: Stroke) -> f64 {
        match stroke {
            Stroke::Close => self.close_within_s,
            Stroke::Open => self.open_within_s,
        }
    }
}

/// What is known about one stroke of one fault.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StrokeInfo {
    /// Leak area at which the time crosses its limit, in m2; none if no leak
    /// of this kind makes it do so inside the table.
    pub limit_area_m2: Option<f64>,
    /// Leak area from which on the stroke is not finished within the cycle, in
    /// m2; none if it is up to the table's end.
    pub stall_area_m2: Option<f64>,
}

/// Largest difference between interpolated and directly simulated times,
/// measured between the points, in s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InterpolationError {
    /// Up to the leak area at which a limit is crossed.
    pub up_to_limit_s: f64,
    /// From there to the last area at which the stroke is finished.
    pub beyond_limit_s: f64,
}

/// What is known about the table of one fault.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaultInfo {
    /// About the closing stroke.
    pub close: StrokeInfo,
    /// About the opening stroke.
    pub open: StrokeInfo,
    /// How well the table interpolates.
    pub interpolation_error: InterpolationError,
}

impl FaultInfo {
    /// The limit areas read off a table by inversion, the stall areas from its
    /// first rows without a time, and no measured interpolation error. A
    /// builder that can simulate knows better; this is for tables made
    /// otherwise.
    pub fn from_table(table: &LeakTable, limits: &Limits) -> Self {
        let stroke_info = |stroke| {
            let curve = table.curve(stroke);
            let limit_area_m2 = match curve.area_at(limits.within_s(stroke)) {
                AreaAt::Within(area_m2) => Some(area_m2),
                AreaAt::BelowRange | AreaAt::AboveRange => None,
            };
            StrokeInfo { limit_area_m2, stall_area_m2: curve.not_reached_from_m2() }
        };
        Self {
            close: stroke_info(Stroke::Close),
            open: stroke_info(Stroke::Open),
            interpolation_error: InterpolationError::default(),
        }
    }

    /// What is known about one stroke.
    pub fn stroke(&self, stroke: Stroke) -> &StrokeInfo {
        match stroke {
            Stroke::Close => &self.close,
            Stroke::Open => &self.open,
        }
    }

    /// The smallest leak area at which a limit is crossed, in m2: end of life.
    pub fn limit_area_m2(&self) -> Option<f64> {
        let (a, b) = (self.close.limit_area_m2, self.open.limit_area_m2);
        a.into_iter().chain(b).reduce(f64::min)
    }
}

/// The file of one table, as the manifest records it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileInfo {
    /// Name inside the bundle's directory.
    pub name: String,
    /// blake3 hash of its bytes, in hexadecimal.
    pub blake3: String,
    /// Its length in bytes.
    pub bytes: u64,
    /// Number of rows, the header left out.
    pub rows: usize,
}

/// The manifest of a bundle.
#[derive(Clone, Debug, PartialEq)]
pub struct Manifest {
    /// The valve's name.
    pub valve: String,
    /// Hash of the model and of everything else that the rows depend on.
    pub model_hash: String,
    /// The cycle.
    pub schedule: CycleSchedule,
    /// The limits.
    pub limits: Limits,
    /// About each fault, in the order of [`Fault::ALL`].
    pub faults: [FaultInfo; 2],
    /// The file of each fault, in the order of [`Fault::ALL`].
    pub files: [FileInfo; 2],
}

impl Manifest {
    /// What is known about one fault.
    pub fn fault(&self, fault: Fault) -> &FaultInfo {
        &self.faults[fault as usize]
    }

    /// The file of one fault.
    pub fn file(&self, fault: Fault) -> &FileInfo {
        &self.files[fault as usize]
    }
}
