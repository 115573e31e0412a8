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

mod chebyshev;
mod ends;
mod error;
mod fidelity;
mod leak_pair;
mod levelled;
mod limit;
mod model;
mod over_conditions;
mod progress;
mod range;
mod refine;
mod simulation;
mod sweep;
mod ticks;
mod wear;
mod wears;

pub use error::{BuildError, Notice};
pub use model::{Options, TableModel, model_hash};
pub use progress::{Progress, Stage};
pub use wear::{Wear, Worn};

use leak_table::{
    BundleInfo, BundlePart, ConditionRange, ConditionTable, Conditions, CycleSchedule, FaultInfo, Limits,
    SeverityTable, TableBundle,
};
use rayon::prelude::*;
use valve_model::Fidelity;

use crate::fidelity::Begun;
use crate::simulation::Simulation;
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
    build_request(model, &Request::default(), options, progress)
}

/// What is to be built.
#[derive(Debug, Clone)]
pub struct Request {
    /// What wears, the two leaks first.
    pub wears: Vec<Wear>,
    /// Over which conditions beyond the valve's own, if any. Where a range has no width its condition is not varied.
    pub conditions: Option<ConditionRange>,
    /// Whether a table of both leaks at once is built as well.
    pub both_leaks: bool,
}

impl Default for Request {
    /// The two leaks at the valve's own conditions.
    fn default() -> Self {
        Self { wears: Wear::leaks(), conditions: None, both_leaks: false }
    }
}

/// Builds the tables of whatever wears, and over conditions if that is asked for.
///
/// As [`build`]. What else than a leak can have no table is left out, with a notice, or has none over the conditions.
pub fn build_request(
    model: &TableModel<'_>,
    request: &Request,
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Built, BuildError> {
    options.check()?;
    model.schedule.check()?;
    model.limits.check()?;
    if let Some(range) = &request.conditions {
        range.check_ends()?;
    }
    let quicker_s = fidelity::quicker_s(model, options);
    let options = &fidelity::of_strokes(options, quicker_s);
    let fidelities = fidelity::candidates(model, options, quicker_s);
    let table = |(place, wear)| {
        let start = |fidelity| Sweep::new(Simulation::new(model, options, wear, fidelity), place, progress);
        table(&start, &fidelities, request.conditions.as_ref(), place < LEAKS)
    };
    let tables: Vec<Result<FaultTable, BuildError>> = request.wears.par_iter().enumerate().map(table).collect();
    let mut parts = Vec::new();
    let mut notices = Vec::new();
    let mut simulated = 0;
    // As closely as that of the two leaks that asks for more.
    let leaks = tables.iter().take(LEAKS).flatten().map(|table| table.fidelity);
    let pair_fidelity = leaks.min_by(|a, b| a.step_s.total_cmp(&b.step_s)).unwrap_or(fidelity::fine(options));
    for (place, (table, wear)) in tables.into_iter().zip(&request.wears).enumerate() {
        let table = match table {
            Err(error) if place >= LEAKS => {
                notices.push(Notice::Omitted { fault: wear.degradation.id.to_string(), reason: error.to_string() });
                continue;
            }
            table => table?,
        };
        parts.push(BundlePart { table: table.table, info: table.info, over_conditions: table.over_conditions });
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
    let mut bundle = TableBundle::new(info, &parts)?;
    if request.both_leaks {
        match leak_pair::build(model, options, pair_fidelity, &request.wears, &bundle) {
            Ok(both) => {
                bundle = bundle.with_both_leaks(&both.table)?;
                simulated += both.simulated;
            }
            Err(error) => {
                notices.push(Notice::Omitted { fault: leak_pair::NAME.to_owned(), reason: error.to_string() });
            }
        }
    }
    Ok(Built { bundle, notices, simulated })
}

/// The first two, which a bundle must have.
const LEAKS: usize = 2;

/// The table of one degradation and what is known about it.
struct FaultTable {
    table: SeverityTable,
    info: FaultInfo,
    over_conditions: Option<ConditionTable>,
    notices: Vec<Notice>,
    simulated: usize,
    /// How closely it was simulated.
    fidelity: Fidelity,
}

/// Range, limits, points; then the same over conditions.
fn table<'a>(
    start: &dyn Fn(Fidelity) -> Sweep<'a>,
    fidelities: &[Fidelity],
    conditions: Option<&ConditionRange>,
    is_leak: bool,
) -> Result<FaultTable, BuildError> {
    let Begun { sweep, range, limits, notices } = fidelity::begin(start, fidelities)?;
    let (mut table, mut sweep) = refine::refine(sweep, range, limits, notices)?;
    if let Some(range) = conditions {
        match over_conditions::build(&sweep.simulation, &table.table, range) {
            Ok(over_conditions) => {
                if over_conditions.is_rough {
                    let by_s = over_conditions.table.info().interpolation_error.up_to_limit_s;
                    table.notices.push(Notice::RoughOverConditions { fault: sweep.simulation.id(), by_s });
                }
                table.over_conditions = Some(over_conditions.table);
                table.simulated += over_conditions.simulated;
            }
            Err(error) if !is_leak && error.is_of_conditions() => {
                let (fault, reason) = (sweep.simulation.id(), error.to_string());
                table.notices.push(Notice::NotOverConditions { fault, reason });
            }
            Err(error) => return Err(error),
        }
    }
    sweep.simulate(&[], Stage::Points, 1.0)?;
    Ok(table)
}
