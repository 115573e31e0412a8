//! How closely a valve is simulated for its tables: with steps that its strokes take, if its times allow it.
//!
//! A stroke of the reference valve is followed in a thousand steps of a millisecond. A stroke of a minute need not be followed
//! in sixty thousand: steps as long as a two-thousandth of the quicker healthy stroke are tried, held against the usual ones on
//! severities up to the limit, and taken if no time there moves by more than half of what the table may be off by.

use leak_table::{SeverityPoint, Stroke};
use valve_model::cycle::cycles;
use valve_model::{Conditions, Fidelity};

use crate::error::{BuildError, Notice};
use crate::limit::{self, LimitTicks};
use crate::model::{Options, TableModel};
use crate::range::{self, Range};
use crate::sweep::Sweep;
use crate::ticks::Ticks;

/// Steps that the quicker healthy stroke is followed in at least.
const STEPS_A_STROKE: f64 = 2000.0;
/// Strokes up to this time have the tolerances as they are stated; those of slower ones grow in proportion, s.
const SLOW_FROM_S: f64 = 2.0;
/// Cycles after which the sound valve repeats itself closely enough for that.
const FEW_CYCLES: usize = 2;
/// Steps tried, as parts of the longest.
const PARTS: [f64; 2] = [1.0, 3.0];
/// The inertia of a stroke that takes its time evenly may be this share of what the supply can push with: half of what fits to
/// records lend, which moved times of a minute by a millisecond.
const INERTIA_SHARE: f64 = 5e-5;
/// Severities held against the usual steps, as shares of that at the limit.
const HELD_AT: [f64; 5] = [0.0, 0.4, 0.75, 0.95, 1.0];
/// Of the tolerance of a table, what longer steps may take; points are placed to the other half.
const SHARE: f64 = 0.5;

/// As closely as the options say.
pub(crate) fn fine(options: &Options) -> Fidelity {
    Fidelity::with_step(options.step_s)
}

/// The time of the quicker stroke of the sound valve, s; 0 where one is not finished.
pub(crate) fn quicker_s(model: &TableModel<'_>, options: &Options) -> f64 {
    let sound = [(model.valve, Conditions::nominal(model.valve.parameters()))];
    let times = cycles(&sound, &model.schedule, FEW_CYCLES, options.step_s);
    let last = times[0].last().copied();
    last.and_then(|times| Some(times.close_time_s?.min(times.open_time_s?))).unwrap_or(0.0)
}

/// The options of a valve whose quicker stroke takes so long: nobody needs a stroke of a minute to a fifth of a millisecond.
pub(crate) fn of_strokes(options: &Options, quicker_s: f64) -> Options {
    let factor = (quicker_s / SLOW_FROM_S).max(1.0);
    Options {
        tolerance_up_to_limit_s: factor * options.tolerance_up_to_limit_s,
        tolerance_beyond_s: factor * options.tolerance_beyond_s,
        tolerance_over_conditions_s: factor * options.tolerance_over_conditions_s,
        tolerance_over_conditions_beyond_s: factor * options.tolerance_over_conditions_beyond_s,
        ..*options
    }
}

/// Fidelities to try, the longest steps first and those of the options last.
pub(crate) fn candidates(model: &TableModel<'_>, options: &Options, quicker_s: f64) -> Vec<Fidelity> {
    let parameters = model.valve.parameters();
    let push_n = parameters.supply_pressure_pa * parameters.piston_area_m2;
    let most_inert_kg = INERTIA_SHARE * push_n * quicker_s * quicker_s / parameters.stroke_m;
    let steps = PARTS.map(|part| quicker_s / STEPS_A_STROKE / part).into_iter();
    let longer = steps.filter(|step_s| *step_s > 1.5 * options.step_s);
    let mut all: Vec<Fidelity> =
        longer.map(|step_s| Fidelity { most_inert_kg, ..Fidelity::with_step(step_s) }).collect();
    all.push(fine(options));
    all
}

/// A table whose range and limits are known.
pub(crate) struct Begun<'a> {
    pub sweep: Sweep<'a>,
    pub range: Range,
    pub limits: LimitTicks,
    pub notices: Vec<Notice>,
}

/// Finds range and limits with the longest steps that no time feels.
pub(crate) fn begin<'a>(
    start: &dyn Fn(Fidelity) -> Sweep<'a>,
    fidelities: &[Fidelity],
) -> Result<Begun<'a>, BuildError> {
    let with = |fidelity: Fidelity| -> Result<Begun<'a>, BuildError> {
        let (mut sweep, mut notices) = (start(fidelity), Vec::new());
        let range = range::find(&mut sweep)?;
        let limits = limit::find(&mut sweep, &range, &mut notices)?;
        Ok(Begun { sweep, range, limits, notices })
    };
    let usual = fidelities[fidelities.len() - 1];
    for fidelity in &fidelities[..fidelities.len() - 1] {
        if let Ok(begun) = with(*fidelity)
            && is_exact(&begun, &start(usual))?
        {
            return Ok(begun);
        }
    }
    with(usual)
}

/// Whether the times up to the limit are those of the usual steps.
fn is_exact(begun: &Begun<'_>, usual: &Sweep<'_>) -> Result<bool, BuildError> {
    let Some(limit) = begun.limits.first() else { return Ok(false) };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
    let severities = HELD_AT.map(|share| (share * limit as f64) as Ticks);
    let conditions = Conditions::nominal(usual.simulation.model.valve.parameters());
    let wanted = severities.map(|ticks| (conditions, ticks));
    let (rough, exact) = (begun.sweep.simulation.points(&wanted)?, usual.simulation.points(&wanted)?);
    let tolerance_s = SHARE * usual.simulation.options.tolerance_up_to_limit_s;
    let same = |a: &SeverityPoint, b: &SeverityPoint, stroke: Stroke| match (a.time_s(stroke), b.time_s(stroke)) {
        (Some(a), Some(b)) => (a - b).abs() <= tolerance_s,
        (a, b) => a.is_none() && b.is_none(),
    };
    Ok(rough.iter().zip(&exact).all(|(a, b)| Stroke::ALL.into_iter().all(|stroke| same(a, b, stroke))))
}
