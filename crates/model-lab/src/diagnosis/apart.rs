//! One run that contradicts all others: a condition of it that was written down wrongly.
//!
//! Where something is left that nothing explains, the search is made once more without the run that pulls the fit farthest away
//! from what the others say (Cook, Technometrics 19(1), 1977). If the others are explained then, and the run
//! as well as soon as one of its conditions is another, that condition is what is wrong: a pressure with its digits exchanged, a
//! leak that was not noted.

use campaign::Campaign;
use identify::normal::Posterior;
use identify::select::{Level, Model};
use identify::{FitOptions, Problem, Stop, fit};
use rayon::prelude::*;
use valve_model::Conditions;

use super::answer::{Explanation, Verdict};
use crate::errors::Errors;
use crate::identification::setup::Setup;
use crate::identification::{Entry, Subject, ValveProblem};
use crate::space::Space;

/// Fewer runs than this besides it cannot say that it is the one that is wrong.
const FEWEST_OTHERS: usize = 3;

/// With the right condition a run is explained to no more than this many times the error that is held out of the others.
const ALIKE: f64 = 2.0;

/// Values of a condition that are tried, and how often the best of them is refined.
const TRIED: usize = 41;
const REFINEMENTS: usize = 12;

/// How far a condition may be from what was written: a digit more or less of the gauge pressure; leaks as shares of the solenoid's orifice,
/// least and most, or none; temperatures, K.
const PRESSURES: f64 = 10.0;
const LEAKS: (f64, f64) = (0.005, 2.0);
const TEMPERATURES_K: (f64, f64) = (220.0, 340.0);

/// A pound-force a square inch, Pa.
const PSI_PA: f64 = 6894.757;

/// The golden section.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// The run that pulls the calibrated model farthest from what all others say, by its index: without it these would be explained
/// better by most, to second order. Nothing where too few others would be left to judge it.
pub(super) fn contradicting(base: &Model<ValveProblem<'_>>) -> Option<usize> {
    let recordings = &base.problem.setup().recordings;
    let runs = recordings.iter().filter(|one| one.is_trace()).map(|one| one.source + 1).max()?;
    if runs <= FEWEST_OTHERS {
        return None;
    }
    let normals = base.fit.linear.normals(&base.problem, &base.fit.noise);
    let (first, others) = normals.split_first()?;
    let mut all = first.clone();
    for normal in others {
        all.add(normal);
    }
    let freed = |run: usize| {
        let mut rest = all.clone();
        normals
            .iter()
            .zip(recordings)
            .filter(|(_, one)| one.source == run)
            .for_each(|(normal, _)| rest.subtract(normal));
        let step = Posterior::new(base.problem.coordinates(), &base.fit.u, &rest).newton()?;
        Some((run, step.predicted_gain))
    };
    (0..runs).filter_map(freed).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(run, _)| run)
}

/// A campaign without one of its runs.
pub(super) fn without(campaign: &Campaign, run: usize) -> Campaign {
    let mut rest = campaign.clone();
    rest.runs.remove(run);
    rest
}

/// A condition of a run that can be written down wrongly.
struct Condition {
    name: &'static str,
    stated: f64,
    values: Vec<f64>,
    set: fn(&mut Conditions, f64),
    shown: Box<dyn Fn(f64) -> String + Sync>,
}

/// What one of a run's conditions would have to be, in words, for the model that explains all other runs to explain it too;
/// nothing where no one condition does.
pub(super) fn mistyped(
    subject: &Subject,
    campaign: &Campaign,
    run: usize,
    others: &Explanation,
    stop: &Stop,
) -> Option<String> {
    let explained = matches!(others.verdict, Verdict::Adequate | Verdict::EffectFound);
    let last = others.steps.last().filter(|_| explained)?;
    let usual = last.held_out.as_ref().unwrap_or(&last.errors).rmse_m?;
    let recordings = &subject.setup(Level::Low).recordings;
    let of_run: Vec<usize> = (0..recordings.len())
        .filter(|index| recordings[*index].is_trace() && recordings[*index].source == run)
        .collect();
    let stated = recordings[*of_run.first()?].run.conditions;
    let (setup, entries, _) = subject.part(subject.setup(Level::Low), &of_run);
    let space = Space::new(&others.valve, &[]);
    let tried = |condition: &Condition| -> Option<(f64, f64)> {
        let error = |value: f64| {
            let setup = under(&setup, condition, value);
            let problem = ValveProblem::new(&setup, space.clone(), &entries, stop);
            errors_at(&problem)
        };
        let best = least(&condition.values, error)?;
        let rmse_m = fitted(&under(&setup, condition, best), &space, &entries, stop)?;
        Some((best, rmse_m))
    };
    let as_stated = fitted(&setup, &space, &entries, stop)?;
    let conditions = conditions(&stated, subject, campaign, run);
    let found: Vec<Option<(f64, f64)>> = conditions.par_iter().map(tried).collect();
    let (condition, (value, rmse_m)) = conditions
        .iter()
        .zip(found)
        .filter_map(|(condition, found)| Some((condition, found?)))
        .min_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
    let explains = rmse_m < ALIKE * usual && rmse_m < as_stated / ALIKE;
    explains.then(|| {
        format!(
            "{}: under the {} that was written down ({}) an error of {:.3} mm is left, where the other runs leave {:.3} mm; \
             under about {} it would be explained as well, to {:.3} mm. Is it mistyped?",
            campaign.runs[run].file,
            condition.name,
            (condition.shown)(condition.stated),
            1e3 * as_stated,
            1e3 * usual,
            (condition.shown)(value),
            1e3 * rmse_m,
        )
    })
}

/// The conditions of a run that can be wrong, with values to try: neither one that was recorded nor one that does not act.
fn conditions(stated: &Conditions, subject: &Subject, campaign: &Campaign, run: usize) -> Vec<Condition> {
    let setup = subject.setup(Level::High);
    let steps = || (0..TRIED).map(|step| step as f64 / (TRIED - 1) as f64);
    let leak = |name, stated, set| {
        let orifice_m2 = subject.space.parameters().solenoid_orifice_area_m2;
        let areas = steps().map(|step| orifice_m2 * LEAKS.0 * (LEAKS.1 / LEAKS.0).powf(step));
        let shown = |area: f64| if area == 0.0 { "none".to_owned() } else { format!("{:.3} mm2", 1e6 * area) };
        Condition { name, stated, values: std::iter::once(0.0).chain(areas).collect(), set, shown: Box::new(shown) }
    };
    let mut all = vec![Condition {
        name: "temperature",
        stated: stated.temperature_k,
        values: steps().map(|step| TEMPERATURES_K.0 + step * (TEMPERATURES_K.1 - TEMPERATURES_K.0)).collect(),
        set: |conditions, value| conditions.temperature_k = value,
        shown: Box::new(|value| format!("{value:.1} K")),
    }];
    if !setup.is_prescribed {
        all.push(leak("leak to atmosphere", stated.leak_to_atmosphere_m2, |conditions, value| {
            conditions.leak_to_atmosphere_m2 = value;
        }));
        all.push(leak("leak from the supply", stated.leak_from_supply_m2, |conditions, value| {
            conditions.leak_from_supply_m2 = value;
        }));
        if campaign.runs[run].trace.supply_pressure_pa.is_none() {
            let (ambient_pa, gauge_pa) = (setup.ambient_pa, stated.supply_pressure_pa - setup.ambient_pa);
            let factors = steps().map(|step| PRESSURES.powf(2.0 * step - 1.0));
            all.push(Condition {
                name: "supply pressure",
                stated: stated.supply_pressure_pa,
                values: factors.map(|factor| ambient_pa + factor * gauge_pa).collect(),
                set: |conditions, value| conditions.supply_pressure_pa = value,
                shown: Box::new(move |value| {
                    format!("{:.1} psig, {:.1} kPa absolute", (value - ambient_pa) / PSI_PA, 1e-3 * value)
                }),
            });
        }
    }
    all
}

/// Recordings as they would be under another value of a condition.
fn under(setup: &Setup, condition: &Condition, value: f64) -> Setup {
    let mut setup = setup.clone();
    setup.recordings.iter_mut().for_each(|recording| (condition.set)(&mut recording.run.conditions, value));
    setup
}

/// Sum of the squared errors at the prior means, in units of the rows' activity; infinite where the valve does not stroke.
fn errors_at(problem: &ValveProblem<'_>) -> f64 {
    let predicted = identify::problem::predict_all(problem, &[problem.start()]).pop().flatten();
    predicted.map_or(f64::INFINITY, |predicted| {
        let of = problem.records().iter().zip(&predicted);
        of.map(|(record, predicted)| record.error_in_activity(predicted)).sum()
    })
}

/// The value with the least error: the best of those given, refined between its neighbours.
fn least(values: &[f64], error: impl Fn(f64) -> f64 + Sync) -> Option<f64> {
    let errors: Vec<f64> = values.par_iter().map(|value| error(*value)).collect();
    let best = (0..values.len()).min_by(|a, b| errors[*a].total_cmp(&errors[*b]))?;
    let (mut low, mut high) = (values[best.saturating_sub(1)], values[(best + 1).min(values.len() - 1)]);
    let mut found = (values[best], errors[best]);
    for _ in 0..REFINEMENTS {
        let [left, right] = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
        let [of_left, of_right] = [error(left), error(right)];
        if of_left < of_right {
            high = right;
        } else {
            low = left;
        }
        for (value, of_value) in [(left, of_left), (right, of_right)] {
            if of_value < found.1 {
                found = (value, of_value);
            }
        }
    }
    found.1.is_finite().then_some(found.0)
}

/// The error of a run's positions once what its instruments are off by is fitted to it, m.
fn fitted(setup: &Setup, space: &Space, entries: &[Entry], stop: &Stop) -> Option<f64> {
    let problem = ValveProblem::new(setup, space.clone(), entries, stop);
    let fit = fit(&problem, &problem.start(), &FitOptions::new(setup.groups.clone()))?;
    Errors::of(&problem, &fit.linear.residual).rmse_m
}
