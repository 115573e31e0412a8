//! What is known about a bundle of tables besides their rows.

use crate::conditions::{ConditionRange, Conditions};
use crate::degradation::Degradation;
use crate::fault::Fault;
use crate::stroke::Stroke;
use crate::table::SeverityTable;
use crate::timing::SeverityAt;

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

/// What is known about one stroke of one degradation. Severities are SI.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StrokeInfo {
    /// Severity at which the time crosses its limit; none if nothing inside the
    /// table makes it do so.
    pub limit_severity: Option<f64>,
    /// Severity from which on the stroke is not finished within the cycle;
    /// none if it is up to the table's end.
    pub stall_severity: Option<f64>,
}

/// Largest difference between interpolated and directly simulated times,
/// measured between the points, in s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InterpolationError {
    /// Up to the severity at which a limit is crossed.
    pub up_to_limit_s: f64,
    /// From there to the last severity at which the stroke is finished.
    pub beyond_limit_s: f64,
}

/// What is known about the table of one degradation.
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
    /// The limits read off a table by inversion, the stalls from its
    /// first rows without a time, and no measured interpolation error. A
    /// builder that can simulate knows better; this is for tables made
    /// otherwise.
    pub fn from_table(table: &SeverityTable, limits: &Limits) -> Self {
        let stroke_info = |stroke| {
            let curve = table.curve(stroke);
            let limit_severity = match curve.severity_at(limits.within_s(stroke)) {
                SeverityAt::Within(severity) => Some(severity),
                SeverityAt::BelowRange | SeverityAt::AboveRange | SeverityAt::Untold => None,
            };
            StrokeInfo { limit_severity, stall_severity: curve.not_reached_from() }
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

    /// The smallest severity at which a limit is crossed: end of life.
    pub fn limit_severity(&self) -> Option<f64> {
        let (a, b) = (self.close.limit_severity, self.open.limit_severity);
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

/// What is known about a table over conditions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ConditionInfo {
    /// How far it is from direct simulation, at worst.
    pub interpolation_error: InterpolationError,
    /// At how many places that was measured.
    pub checked: usize,
    /// The severity at which a stroke is no longer finished within the cycle, as a share of the table's end
    /// (1 or a little more) under all conditions alike; none if the end is no such severity.
    pub stall_share: Option<f64>,
}

/// What the manifest says about a table over conditions.
#[derive(Clone, Debug, PartialEq)]
pub struct ConditionFile {
    /// Its file.
    pub file: FileInfo,
    /// What is known about it.
    pub info: ConditionInfo,
}

/// What the manifest says about one degradation.
#[derive(Clone, Debug, PartialEq)]
pub struct ManifestEntry {
    /// What wears.
    pub degradation: Degradation,
    /// About its table.
    pub info: FaultInfo,
    /// The table's file.
    pub file: FileInfo,
    /// About its table over conditions, if there is one.
    pub over_conditions: Option<ConditionFile>,
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
    /// The conditions of the tables over the severity alone, where they are stated.
    pub reference: Option<Conditions>,
    /// The conditions that the tables over conditions cover, if there are any.
    pub conditions: Option<ConditionRange>,
    /// About each degradation, the two leaks first.
    pub entries: Vec<ManifestEntry>,
    /// About the table of both leaks at once, if there is one; stalls have no part in it.
    pub both_leaks: Option<ConditionFile>,
}

impl Manifest {
    /// What is known about the table of one leak.
    pub fn fault(&self, fault: Fault) -> &FaultInfo {
        &self.entries[fault as usize].info
    }
}
