//! Tables from what wears to stroke times, and back.
//!
//! A pneumatic valve that wears strokes at another pace. For each [`Degradation`] (a leak, friction, a
//! weakening spring, a clogged path) a [`SeverityTable`] holds, over its severity, the closing and the
//! opening time of the valve in a repeated cycle. Both are monotone, so that a measured time can be
//! inverted to a severity. A [`ConditionTable`] has the same over supply pressure and temperature, a
//! [`LeakPairTable`] with leaks of both kinds at once. A
//! [`TableBundle`] is the tables of all degradations, the two leaks ([`Fault`]) at least, together with a
//! [`Manifest`] that says which valve, cycle and limits they were computed for and how accurate they are.
//!
//! This crate knows no valve model: it interpolates, checks and stores.
//!
//! # Units
//! Severities, areas (m2), pressures (Pa, absolute), temperatures (K) and times (s) are SI everywhere in
//! memory. Files carry severities in the unit of their column, areas in mm2, and pressures in kPa;
//! [`Severity`] and the file modules are the only places of the conversion.

mod atomic;
mod bundle;
mod condition_table;
mod conditions;
mod csv_file;
mod curve;
mod cut;
mod degradation;
mod degradations;
mod error;
mod fault;
mod id;
mod lagrange;
mod leak_pair;
mod manifest;
mod manifest_file;
mod stencil;
mod stroke;
mod table;
mod timing;

pub use bundle::{BundleEntry, BundleInfo, BundlePart, TableBundle};
pub use condition_table::{ConditionTable, MOST_SHARES, NodeTimes, Slice, TimeAndSlopes, Times};
pub use conditions::{Condition, ConditionRange, Conditions, ConditionsError};
pub use curve::{CurveError, MonotoneCubic};
pub use cut::Cut;
pub use degradation::{Degradation, Moves, Severity};
pub use error::{RowError, TableError};
pub use fault::Fault;
pub use id::DegradationId;
pub use leak_pair::{Equivalent, LeakPairTable};
pub use manifest::{
    ConditionFile, ConditionInfo, CycleSchedule, FaultInfo, FileInfo, InterpolationError, Limits, Manifest,
    ManifestEntry, StrokeInfo,
};
pub use manifest_file::{FORMAT_VERSION, MANIFEST_FILE};
pub use stroke::{Monotone, Stroke};
pub use table::{SeverityPoint, SeverityTable};
pub use timing::{SeverityAt, TimeAt, TimingCurve};

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
