//! Tables from leak area to stroke times, and back.
//!
//! A pneumatic valve that leaks strokes at another pace. For each [`Fault`] a
//! [`LeakTable`] holds, over the leak area, the closing and the opening time of
//! the valve in a repeated cycle. Both are monotone, so that a measured time
//! can be inverted to a leak area. A [`TableBundle`] is the table of both
//! faults together with a [`Manifest`] that says which valve, cycle and limits
//! they were computed for and how accurate they are.
//!
//! This crate knows no valve model: it interpolates, checks and stores.
//!
//! # Units
//! Areas are geometric orifice areas in m2 and times are in s everywhere in
//! memory. Files carry areas in mm2; [`mm2_from_m2`] and [`m2_from_mm2`] are
//! the only place of the conversion.

mod atomic;
mod bundle;
mod csv_file;
mod curve;
mod error;
mod fault;
mod manifest;
mod manifest_file;
mod table;
mod timing;

pub use bundle::{BundleInfo, TableBundle};
pub use curve::{CurveError, MonotoneCubic};
pub use error::{RowError, TableError};
pub use fault::{Direction, Fault, Stroke};
pub use manifest::{CycleSchedule, FaultInfo, FileInfo, InterpolationError, Limits, Manifest, StrokeInfo};
pub use manifest_file::{FORMAT_VERSION, MANIFEST_FILE};
pub use table::{LeakPoint, LeakTable};
pub use timing::{AreaAt, TimeAt, TimingCurve};

/// Square millimetres of an area in m2.
#[must_use]
pub fn mm2_from_m2(area_m2: f64) -> f64 {
    area_m2 * 1e6
}

/// Square metres of an area in mm2.
#[must_use]
pub fn m2_from_mm2(area_mm2: f64) -> f64 {
    area_mm2 / 1e6
}
