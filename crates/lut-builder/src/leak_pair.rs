//! The table of both leaks at once: a grid of simulations, held against others in between.

use leak_table::{ConditionInfo, Equivalent, Fault, InterpolationError, LeakPairTable, Stroke, TableBundle};
use rayon::prelude::*;
use valve_model::cycle::cycles;
use valve_model::simulate::ABREAST;
use valve_model::{Conditions, Fidelity};

use crate::error::BuildError;
use crate::model::{Options, TableModel};
use crate::simulation::stored;
use crate::ticks;
use crate::wear::Wear;

/// Its name in messages.
pub(crate) const NAME: &str = "both-leaks";
/// Largest severity of either leak, in severities at which it alone ends a life: leaks of both kinds hide each other.
const REACH: f64 = 2.5;
/// Places along each severity.
const PLACES: usize = 21;
/// Every so many places the table is held against a simulation in the middle between four of them.
const CHECK_EVERY: usize = 2;

/// What was built.
pub(crate) struct BothLeaks {
    pub table: LeakPairTable,
    pub simulated: usize,
}

/// Closing and opening time, s, where both strokes are finished.
type Times = Option<[f64; 2]>;

pub(crate) fn build(
    model: &TableModel<'_>,
    options: &Options,
    fidelity: Fidelity,
    wears: &[Wear],
    bundle: &TableBundle,
) -> Result<BothLeaks, BuildError> {
    let areas = Fault::ALL.map(|fault| {
        let severity = &fault.degradation().severity;
        let area = |i: usize| REACH * bundle.limit_area_m2(fault) * i as f64 / (PLACES - 1) as f64;
        (0..PLACES).map(|i| ticks::si(severity, ticks::nearest(severity, area(i)))).collect::<Vec<f64>>()
    });
    let middle = |two: &[f64]| f64::midpoint(two[0], two[1]);
    let simulate = |pairs: &[[f64; 2]]| simulate(model, options, fidelity, wears, pairs);
    let (times, mut simulated) = flooded(&areas, simulate)?;
    // In between where one of the places around is finished.
    let finished = |i: usize, j: usize| {
        let around = [(i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1)];
        around.iter().any(|(i, j)| times[i * PLACES + j].is_some())
    };
    let cells = (0..PLACES - 1).step_by(CHECK_EVERY);
    let cells = cells.clone().flat_map(|i| cells.clone().map(move |j| (i, j))).filter(|(i, j)| finished(*i, *j));
    let between: Vec<[f64; 2]> =
        cells.map(|(i, j)| [middle(&areas[0][i..i + 2]), middle(&areas[1][j..j + 2])]).collect();
    let truth = simulate(&between)?;
    simulated += truth.len();
    let table = LeakPairTable::new(areas, times, bundle.leak_tables(), ConditionInfo::default());
    let table = table.map_err(|source| BuildError::Grid { fault: NAME.to_owned(), source: Box::new(source) })?;
    let info = measured(&table, bundle, &between, &truth);
    Ok(BothLeaks { table: table.with_info(info), simulated })
}

/// How far the table is from simulations between its places.
fn measured(table: &LeakPairTable, bundle: &TableBundle, pairs: &[[f64; 2]], truth: &[Times]) -> ConditionInfo {
    let mut error = InterpolationError::default();
    let tables = bundle.leak_tables();
    let finished = pairs.iter().zip(truth).filter_map(|(areas, times)| times.map(|times| (*areas, times)));
    let mut checked = 0;
    for (areas, times) in finished {
        checked += 1;
        let limits = &bundle.manifest().limits;
        let within = Stroke::ALL.into_iter().zip(times).all(|(stroke, time)| time <= limits.within_s(stroke));
        for (stroke, equivalent) in Stroke::ALL.into_iter().zip(table.equivalents(areas)) {
            let Equivalent { fault, area_m2, .. } = equivalent;
            let told_s = tables[fault as usize].curve(stroke).extrapolated_time_and_slope(area_m2).0;
            let off_s = (told_s - times[stroke as usize]).abs();
            let worst = if within { &mut error.up_to_limit_s } else { &mut error.beyond_limit_s };
            *worst = worst.max(off_s);
        }
    }
    ConditionInfo { interpolation_error: error, checked, stall_share: None }
}

/// The times over the grid, from the sound valve on to all places with a neighbour at which both strokes are finished: what lies
/// beyond, where a stroke stalls, is not simulated, which would take longest. And how many were.
fn flooded(
    areas_m2: &[Vec<f64>; 2],
    simulate: impl Fn(&[[f64; 2]]) -> Result<Vec<Times>, BuildError>,
) -> Result<(Vec<Times>, usize), BuildError> {
    let mut times: Vec<Times> = vec![None; PLACES * PLACES];
    let mut asked = vec![false; PLACES * PLACES];
    let mut next = vec![0];
    asked[0] = true;
    let mut simulated = 0;
    while !next.is_empty() {
        let pairs: Vec<[f64; 2]> =
            next.iter().map(|place| [areas_m2[0][place / PLACES], areas_m2[1][place % PLACES]]).collect();
        let found = simulate(&pairs)?;
        simulated += next.len();
        let finished: Vec<usize> =
            next.iter().zip(&found).filter(|(_, times)| times.is_some()).map(|(p, _)| *p).collect();
        for (place, found) in next.iter().zip(found) {
            times[*place] = found;
        }
        next.clear();
        for place in finished {
            let around = |at: usize| at.saturating_sub(1)..=(at + 1).min(PLACES - 1);
            for i in around(place / PLACES) {
                for other in around(place % PLACES).map(|j| i * PLACES + j) {
                    if !std::mem::replace(&mut asked[other], true) {
                        next.push(other);
                    }
                }
            }
        }
        next.sort_unstable();
    }
    Ok((times, simulated))
}

/// The times of a periodic cycle at pairs of severities.
fn simulate(
    model: &TableModel<'_>,
    options: &Options,
    fidelity: Fidelity,
    wears: &[Wear],
    pairs: &[[f64; 2]],
) -> Result<Vec<Times>, BuildError> {
    let batch = |pairs: &[[f64; 2]]| -> Result<Vec<Times>, BuildError> {
        let worn = |areas: &[f64; 2]| {
            let mut worn = (model.valve.clone(), Conditions::nominal(model.valve.parameters()));
            for (wear, area) in wears.iter().zip(areas) {
                worn = wear.worn(&worn.0, worn.1, *area)?;
            }
            Ok(worn)
        };
        let worn = pairs.iter().map(worn).collect::<Result<Vec<_>, _>>();
        let worn = worn.map_err(|source| BuildError::Worn {
            fault: NAME.to_owned(),
            at: "leaks of both kinds".to_owned(),
            source: Box::new(source),
        })?;
        let runs: Vec<_> = worn.iter().map(|(valve, conditions)| (valve, *conditions)).collect();
        let simulated = cycles(&runs, &model.schedule, options.most_cycles, fidelity);
        let last = simulated.iter().map(|times| {
            let last = times[times.len() - 1];
            let both = [last.close_time_s?, last.open_time_s?].map(stored);
            both.iter().all(|time| *time > 0.0).then_some(both)
        });
        Ok(last.collect())
    };
    let batches: Vec<Vec<Times>> = pairs.par_chunks(ABREAST).map(batch).collect::<Result<_, _>>()?;
    Ok(batches.into_iter().flatten().collect())
}
