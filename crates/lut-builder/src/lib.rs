//! Sweeps what wears through the model and builds its tables.
//!
//! For each [`Wear`] (the two leaks, and on request friction, the spring, clogged paths or whatever else is
//! described) the builder simulates the valve's cycle, repeated until periodic, at chosen
//! severities. It finds
//!
//! 1. the range: from a sound valve to the severity at which it no longer gets there within the cycle
//!    ([`StrokeInfo::stall_severity`](leak_table::StrokeInfo)),
//! 2. the severities at which a stroke time crosses its limit, by sectioning on the simulation itself,
//! 3. the points of the table: more of them where the curve bends, until every simulation between two
//!    points is met by the interpolation within the [`Options`].
//!
//! The severities simulated follow from the model alone and the lanes of the integrator do not depend on
//! each other, so that the same input gives the same bytes whatever the number of threads.
//!
//! Units: inside this crate severities are whole numbers of 1e-9 of their file's unit (1e-9 mm2 for a
//! leak), the last digit of a table's file; at its edges they are SI. Times are s.

mod error;
mod limit;
mod model;
mod progress;
mod range;
mod refine;
mod sweep;
mod ticks;
mod wear;
mod wears;

pub use error::{BuildError, Notice};
pub use model::{Options, TableModel, model_hash};
pub use progress::{Progress, Stage};
pub use wear::{Wear, Worn};

use leak_table::{BundleInfo, BundlePart, Conditions, CycleSchedule, FaultInfo, Limits, SeverityTable, TableBundle};
use rayon::prelude::*;

use crate::sweep::Sweep;

/// What the builder made.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// The tables with their manifest, which holds the measured interpolation error.
    pub bundle: TableBundle,
    /// What the user should know about them.
    pub notices: Vec<Notice>,
    /// How many severities were simulated for all tables.
    pub simulated: usize,
}

/// Builds the tables of both leaks.
///
/// Runs on the current rayon pool. `progress` is called from its threads after every batch of
/// simulations, for all degradations in turn or mixed.
///
/// # Errors
/// If the healthy valve does not stroke within its cycle or its limits, a leak never takes it to a
/// limit, or a stroke time is no monotone function of the leak up to the limit; see [`BuildError`].
pub fn build(
    model: &TableModel<'_>,
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Built, BuildError> {
    build_wears(model, &Wear::leaks(), options, progress)
}

/// Builds the tables of whatever wears, the two leaks first.
///
/// As [`build`]. What else than a leak can have no table is left out, with a notice.
pub fn build_wears(
    model: &TableModel<'_>,
    wears: &[Wear],
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Built, BuildError> {
    options.check()?;
    model.schedule.check()?;
    model.limits.check()?;
    let table = |wear| table(Sweep::new(model, options, wear, progress));
    let tables: Vec<Result<FaultTable, BuildError>> = wears.par_iter().enumerate().map(table).collect();
    let mut parts = Vec::new();
    let mut notices = Vec::new();
    let mut simulated = 0;
    for (place, (table, wear)) in tables.into_iter().zip(wears).enumerate() {
        let table = match table {
            Err(error) if place >= LEAKS => {
                notices.push(Notice::Omitted { fault: wear.degradation.id.to_string(), reason: error.to_string() });
                continue;
            }
            table => table?,
        };
        parts.push(BundlePart { table: table.table, info: table.info, over_conditions: None });
        notices.extend(table.notices);
        simulated += table.simulated;
    }
    let parameters = model.valve.parameters();
    let info = BundleInfo {
        valve: model.name.to_owned(),
        model_hash: model_hash(model.canonical_text, &model.limits),
        schedule: CycleSchedule {
            close_at_s: model.schedule.close_at_s,
            open_at_s: model.schedule.open_at_s,
            end_s: model.schedule.end_s,
        },
        limits: Limits { close_within_s: model.limits.close_within_s, open_within_s: model.limits.open_within_s },
        reference: Some(Conditions {
            supply_pressure_pa: parameters.supply_pressure_pa,
            temperature_k: parameters.temperature_k,
        }),
    };
    Ok(Built { bundle: TableBundle::new(info, &parts)?, notices, simulated })
}

/// The first two, which a bundle must have.
const LEAKS: usize = 2;

/// The table of one degradation and what is known about it.
struct FaultTable {
    table: SeverityTable,
    info: FaultInfo,
    notices: Vec<Notice>,
    simulated: usize,
}

/// Range, limits, points.
fn table(mut sweep: Sweep<'_>) -> Result<FaultTable, BuildError> {
    let mut notices = Vec::new();
    let range = range::find(&mut sweep)?;
    let limits = limit::find(&mut sweep, &range, &mut notices)?;
    refine::refine(sweep, range, limits, notices)
}
