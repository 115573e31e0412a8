//! Sweeps the leak area through the model and builds leak tables.
//!
//! For each kind of leak the builder simulates the valve's cycle, repeated until periodic, at chosen
//! leak areas. It finds
//!
//! 1. the range: from no leak to the area at which the valve no longer gets there within the cycle
//!    ([`StrokeInfo::stall_area_m2`](leak_table::StrokeInfo)),
//! 2. the areas at which a stroke time crosses its limit, by sectioning on the simulation itself,
//! 3. the points of the table: more of them where the curve bends, until every simulation between two
//!    points is met by the interpolation within the [`Options`].
//!
//! The areas simulated follow from the model alone and the lanes of the integrator do not depend on
//! each other, so that the same input gives the same bytes whatever the number of threads.
//!
//! Units: inside this crate areas are whole numbers of 1e-9 mm2, the last digit of a table's file;
//! at its edges they are m2. Times are s.

mod area;
mod error;
mod limit;
mod model;
mod progress;
mod range;
mod refine;
mod sweep;

pub use error::{BuildError, Notice};
pub use model::{Options, TableModel, model_hash};
pub use progress::{Progress, Stage};

use leak_table::{BundleInfo, CycleSchedule, Fault, FaultInfo, LeakTable, Limits, TableBundle};

use crate::sweep::Sweep;

/// What the builder made.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// Both tables with their manifest, which holds the measured interpolation error.
    pub bundle: TableBundle,
    /// What the user should know about them.
    pub notices: Vec<Notice>,
    /// How many leak areas were simulated for both tables.
    pub simulated_areas: usize,
}

/// Builds the tables of both faults.
///
/// Runs on the current rayon pool. `progress` is called from its threads after every batch of
/// simulations, for both faults in turn or mixed.
///
/// # Errors
/// If the healthy valve does not stroke within its cycle or its limits, a leak never takes it to a
/// limit, or a stroke time is no monotone function of the leak up to the limit; see [`BuildError`].
pub fn build(
    model: &TableModel<'_>,
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Built, BuildError> {
    options.check()?;
    model.schedule.check()?;
    model.limits.check()?;
    let table = |fault| table(Sweep::new(model, options, fault, progress));
    let (atmosphere, supply) = rayon::join(|| table(Fault::Atmosphere), || table(Fault::Supply));
    let (atmosphere, supply) = (atmosphere?, supply?);
    let info = BundleInfo {
        valve: model.name.to_owned(),
        model_hash: model_hash(model.canonical_text, &model.limits),
        schedule: CycleSchedule {
            close_at_s: model.schedule.close_at_s,
            open_at_s: model.schedule.open_at_s,
            end_s: model.schedule.end_s,
        },
        limits: Limits { close_within_s: model.limits.close_within_s, open_within_s: model.limits.open_within_s },
        atmosphere: atmosphere.info,
        supply: supply.info,
    };
    let bundle = TableBundle::new(info, &atmosphere.table, &supply.table)?;
    let simulated_areas = atmosphere.simulated_areas + supply.simulated_areas;
    let notices = atmosphere.notices.into_iter().chain(supply.notices).collect();
    Ok(Built { bundle, notices, simulated_areas })
}

/// The table of one fault and what is known about it.
struct FaultTable {
    table: LeakTable,
    info: FaultInfo,
    notices: Vec<Notice>,
    simulated_areas: usize,
}

/// Range, limits, points.
fn table(mut sweep: Sweep<'_>) -> Result<FaultTable, BuildError> {
    let mut notices = Vec::new();
    let range = range::find(&mut sweep)?;
    let limits = limit::find(&mut sweep, &range, &mut notices)?;
    refine::refine(sweep, range, limits, notices)
}
