//! One run that contradicts all others: a condition of it that was written down wrongly.
//!
//! Where something is left that nothing explains, the search is made once more without the run that pulls the fit farthest away
//! from what the others say (Cook, Technometrics 19(1), 1977), and without the one that is by far the farthest off. If the others
//! are explained then, and the run as well as soon as one of its conditions is another, that condition is what is wrong: a
//! pressure with its digits exchanged, a leak that was not noted, or noted as the other kind. If no condition explains it, the run
//! is named all the same where it is far off: its clock jumped, or it is of another valve. Not so where all runs are explained after
//! all, once they are fitted from where the search of the others ended: the first search was in a valley beside it.

use campaign::Campaign;
use identify::normal::Posterior;
use identify::problem::predict_all;
use identify::select::{Level, Model};
use identify::{FitOptions, Problem, Stop, fit};
use rayon::prelude::*;
use valve_model::Conditions;

use super::answer::{Condition, Explanation, LeftOut, Repair, Verdict};
use crate::data::conditions;
use crate::errors::Errors;
use crate::identification::setup::Setup;
use crate::identification::{Entry, Nuisance, Subject, ValveProblem};
use crate::space::Space;

/// Fewer runs than this besides it cannot say that it is the one that is wrong.
const FEWEST_OTHERS: usize = 2;

/// Without a run that contradicts all others the fit of these improves by more than so many times what it does without the run in
/// the midst of all: of 94 drawn slips four did by less (of the 37 drawn after it was chosen two), of 17 campaigns with physics
/// missing in all runs 16 (ten of ten).
const STANDS_OUT: f64 = 2.0;

/// So few others are explained by much that is not true: the right condition must be the one that both of them have, to this
/// share of what it was written down wrongly by.
const FEW_OTHERS: usize = 2;
const AS_OTHERS: f64 = 0.25;

/// With the right condition a run is explained to no more than this many times the error that is held out of the others.
const ALIKE: f64 = 2.0;

/// A run that is so many times farther off than the one in the midst of all contradicts these, though it may pull nothing: where
/// a valve does not stroke by what was written down, no parameter moves its error.
const FAR_OFF: f64 = 4.0;

/// A run that no condition explains is named where the model of the others leaves so many times their error of it.
const AT_ODDS: f64 = 5.0;

/// Values of a condition that are tried, and how often the best of them is refined.
const TRIED: usize = 41;
const REFINEMENTS: usize = 12;

/// Of the values tried so many on each side of the best one are tried again with what the run's instruments may be off by.
const NEAR: usize = 4;

/// How far a condition may be from what was written: a digit more or less of the gauge pressure; leaks as shares of the solenoid's orifice,
/// least and most, or none; temperatures, K.
const PRESSURES: f64 = 10.0;
const LEAKS: (f64, f64) = (0.005, 2.0);
const TEMPERATURES_K: (f64, f64) = (220.0, 340.0);

/// The golden section.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// The run that pulls a model farthest from what all others say, by its index: without it these would be explained better by
/// most, to second order. Nothing where too few others would be left to judge it, or where others pull about as far: what is
/// missing then is missing in all of them.
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
        for (normal, _) in normals.iter().zip(recordings).filter(|(_, one)| one.source == run) {
            rest.subtract(normal);
        }
        let step = Posterior::new(base.problem.coordinates(), &base.fit.u, &rest).newton()?;
        Some((run, step.predicted_gain))
    };
    let mut freed: Vec<(usize, f64)> = (0..runs).filter_map(freed).collect();
    freed.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (_, in_their_midst) = *freed.get(freed.len() / 2)?;
    freed.first().filter(|(_, most)| *most > STANDS_OUT * in_their_midst).map(|(run, _)| *run)
}

/// The run that the datasheet's values are by far the farthest off from, by its index.
pub(super) fn farthest(base: &Model<ValveProblem<'_>>) -> Option<usize> {
    let problem = &base.problem;
    let recordings = &problem.setup().recordings;
    let runs = recordings.iter().filter(|one| one.is_trace()).map(|one| one.source + 1).max()?;
    if runs <= FEWEST_OTHERS {
        return None;
    }
    let predicted = predict_all(problem, &[problem.at_their_word()]).pop().flatten()?;
    let mut sums = vec![(0.0, 0usize); runs];
    for ((record, predicted), one) in problem.records().iter().zip(&predicted).zip(recordings) {
        if let Some((sum, rows)) = sums.get_mut(one.source) {
            *sum += record.error_in_activity(predicted);
            *rows += record.row_count();
        }
    }
    let mut errors: Vec<(usize, f64)> =
        sums.iter().enumerate().map(|(run, (sum, rows))| (run, (sum / (*rows).max(1) as f64).sqrt())).collect();
    errors.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (_, in_their_midst) = errors[errors.len() / 2];
    errors.first().filter(|(_, most)| *most > FAR_OFF * in_their_midst).map(|(run, _)| *run)
}

/// A campaign without one of its runs.
pub(super) fn without(campaign: &Campaign, run: usize) -> Campaign {
    let mut rest = campaign.clone();
    rest.runs.remove(run);
    rest
}

/// A condition of a run with values that it may have in place of the one written down.
struct Tried {
    condition: Condition,
    /// The leak that is none then.
    in_place_of: Option<Condition>,
    values: Vec<f64>,
}

impl Tried {
    /// Recordings as they would be under another value.
    fn under(&self, setup: &Setup, value: f64) -> Setup {
        let mut setup = setup.clone();
        for recording in &mut setup.recordings {
            let conditions = &mut recording.run.conditions;
            if let Some(other) = self.in_place_of {
                other.set(conditions, 0.0);
            }
            self.condition.set(conditions, value);
        }
        setup
    }
}

impl Condition {
    fn of(self, conditions: &Conditions) -> f64 {
        match self {
            Self::SupplyPressure => conditions.supply_pressure_pa,
            Self::Temperature => conditions.temperature_k,
            Self::LeakToAtmosphere => conditions.leak_to_atmosphere_m2,
            Self::LeakFromSupply => conditions.leak_from_supply_m2,
        }
    }

    fn set(self, conditions: &mut Conditions, value: f64) {
        *match self {
            Self::SupplyPressure => &mut conditions.supply_pressure_pa,
            Self::Temperature => &mut conditions.temperature_k,
            Self::LeakToAtmosphere => &mut conditions.leak_to_atmosphere_m2,
            Self::LeakFromSupply => &mut conditions.leak_from_supply_m2,
        } = value;
    }
}

/// A run beside the model that explains all others: what one of its conditions would have to be for that model to explain it too, or
/// only how far off it is where that is far; nothing where the others are not explained without it.
pub(super) fn left_out(
    subject: &Subject,
    campaign: &Campaign,
    run: usize,
    others: &Explanation,
    stop: &Stop,
) -> Option<LeftOut> {
    let explained = matches!(others.verdict, Verdict::Adequate | Verdict::EffectFound);
    let last = others.steps.last().filter(|_| explained)?;
    let others_rmse_m = last.held_out.as_ref().unwrap_or(&last.errors).rmse_m?;
    let all = subject.setup(Level::Low);
    let of_run = |index: &usize| all.recordings[*index].is_trace() && all.recordings[*index].source == run;
    let of_run: Vec<usize> = (0..all.recordings.len()).filter(of_run).collect();
    let stated = all.recordings[*of_run.first()?].run.conditions;
    let (setup, mut entries, _) = subject.part(all, &of_run);
    // What the other runs say of instruments and conditions that all share stays as they say it.
    for entry in &mut entries {
        if let Some(u) = others.known.shared(entry.nuisance) {
            let coordinate = &mut entry.coordinate;
            (coordinate.mean, coordinate.lower, coordinate.upper) = (u, u, u);
        }
    }
    let space = Space::new(&others.valve, &[]);
    let stated_rmse_m = fitted(&setup, &space, &entries, stop)?;
    let best = |tried: &Tried| -> Option<Repair> {
        let mut entries = entries.clone();
        if tried.condition == Condition::SupplyPressure {
            // What the run's pressure may be off by is what is looked for.
            entries.retain(|entry| !matches!(entry.nuisance, Nuisance::Supply(_)));
        }
        let at_means =
            |value: f64| errors_at(&ValveProblem::new(&tried.under(&setup, value), space.clone(), &entries, stop));
        let fitted = |value: f64| fitted(&tried.under(&setup, value), &space, &entries, stop).unwrap_or(f64::INFINITY);
        // What the run's instruments are off by moves the least by a little.
        let best = least(&tried.values, at_means)?;
        let near = &tried.values[best.saturating_sub(NEAR)..(best + NEAR + 1).min(tried.values.len())];
        let best = least(near, fitted)?;
        let about = [best.saturating_sub(1), best, (best + 1).min(near.len() - 1)].map(|index| near[index]);
        let (right, right_rmse_m) = refined(about, fitted);
        let stated_of = |condition: Condition| condition.of(&stated);
        Some(Repair {
            condition: tried.condition,
            stated: stated_of(tried.condition),
            right,
            in_place_of: tried.in_place_of.map(|other| (other, stated_of(other))),
            right_rmse_m,
        })
    };
    let found: Vec<Repair> = tried(&stated, subject, campaign, run).par_iter().filter_map(best).collect();
    let others_count = campaign.runs.len() - 1;
    // A run that what was written down explains, by the measure by which a right condition would, needs no other.
    let is_worse = stated_rmse_m > ALIKE * others_rmse_m;
    let explains = |one: &Repair| {
        is_worse
            && one.right_rmse_m < ALIKE * others_rmse_m
            && one.right_rmse_m < stated_rmse_m / ALIKE
            && (others_count > FEW_OTHERS || is_as_others(one, campaign, run))
    };
    let repair = found.into_iter().min_by(|a, b| a.right_rmse_m.total_cmp(&b.right_rmse_m)).filter(explains);
    let is_at_odds = others_count > FEW_OTHERS && stated_rmse_m > AT_ODDS * others_rmse_m;
    (repair.is_some() || is_at_odds).then(|| LeftOut {
        run: campaign.runs[run].file.clone(),
        repair,
        ambient_pa: setup.ambient_pa,
        stated_rmse_m,
        others_rmse_m,
    })
}

/// Whether all runs are explained as well as the others without one of them, once fitted from where the search of these ended.
pub(super) fn is_explained_with_all(subject: &Subject, others: &Explanation, stop: &Stop) -> bool {
    let problem = subject.problem(others.known.space.clone(), Level::High, stop);
    let Some(start) = others.known.start(&problem) else { return false };
    let fitted = fit(&problem, &start, &FitOptions::new(problem.setup().groups.clone()).exact());
    let rmse_m = fitted.and_then(|fitted| Errors::of(&problem, &fitted.linear.residual).rmse_m);
    let of_others_m = others.steps.last().and_then(|last| last.held_out.as_ref().unwrap_or(&last.errors).rmse_m);
    rmse_m.zip(of_others_m).is_some_and(|(rmse_m, of_others_m)| rmse_m < ALIKE * of_others_m)
}

/// Whether the right value is the one that all other runs have.
fn is_as_others(one: &Repair, campaign: &Campaign, run: usize) -> bool {
    let others = campaign.runs.iter().enumerate().filter(|(index, _)| *index != run);
    others
        .map(|(_, other)| one.condition.of(&conditions(&other.conditions)))
        .all(|theirs| (one.right - theirs).abs() < AS_OTHERS * (one.stated - theirs).abs())
}

/// The conditions of a run that can be wrong, with values to try: neither one that was recorded nor one that does not act.
fn tried(stated: &Conditions, subject: &Subject, campaign: &Campaign, run: usize) -> Vec<Tried> {
    let setup = subject.setup(Level::High);
    let steps = || (0..TRIED).map(|step| step as f64 / (TRIED - 1) as f64);
    let temperatures = steps().map(|step| TEMPERATURES_K.0 + step * (TEMPERATURES_K.1 - TEMPERATURES_K.0));
    let mut all = vec![Tried { condition: Condition::Temperature, in_place_of: None, values: temperatures.collect() }];
    if setup.is_prescribed {
        return all;
    }
    let orifice_m2 = subject.space.parameters().solenoid_orifice_area_m2;
    let areas = || steps().map(|step| orifice_m2 * LEAKS.0 * (LEAKS.1 / LEAKS.0).powf(step));
    let leaks = [Condition::LeakToAtmosphere, Condition::LeakFromSupply];
    for (condition, other) in [(leaks[0], leaks[1]), (leaks[1], leaks[0])] {
        let values: Vec<f64> = std::iter::once(0.0).chain(areas()).collect();
        // One that was noted as the other kind is none of that.
        let of_other_kind = (other.of(stated) > 0.0).then_some(Some(other));
        let of_kind = |in_place_of| Tried { condition, in_place_of, values: values.clone() };
        all.extend(std::iter::once(None).chain(of_other_kind).map(of_kind));
    }
    if campaign.runs[run].trace.supply_pressure_pa.is_none() {
        let gauge_pa = stated.supply_pressure_pa - setup.ambient_pa;
        let pressures = steps().map(|step| setup.ambient_pa + PRESSURES.powf(2.0 * step - 1.0) * gauge_pa);
        all.push(Tried { condition: Condition::SupplyPressure, in_place_of: None, values: pressures.collect() });
    }
    all
}

/// Sum of the squared errors at the prior means, in units of the rows' activity; infinite where the valve does not stroke.
fn errors_at(problem: &ValveProblem<'_>) -> f64 {
    let predicted = predict_all(problem, &[problem.start()]).pop().flatten();
    predicted.map_or(f64::INFINITY, |predicted| {
        let of = problem.records().iter().zip(&predicted);
        of.map(|(record, predicted)| record.error_in_activity(predicted)).sum()
    })
}

/// The index of the value with the least error; nothing where the valve strokes with none of them.
fn least(values: &[f64], error: impl Fn(f64) -> f64 + Sync) -> Option<usize> {
    let errors: Vec<f64> = values.par_iter().map(|value| error(*value)).collect();
    let best = (0..values.len()).min_by(|a, b| errors[*a].total_cmp(&errors[*b]))?;
    errors[best].is_finite().then_some(best)
}

/// The value with the least error between the outer two of three, and that error, by golden sections.
fn refined([mut low, about, mut high]: [f64; 3], error: impl Fn(f64) -> f64) -> (f64, f64) {
    let at = |value: f64| (value, error(value));
    let mut best = at(about);
    let [mut left, mut right] = [at(high - GOLDEN * (high - low)), at(low + GOLDEN * (high - low))];
    for _ in 0..REFINEMENTS {
        if left.1 < right.1 {
            (high, right) = (right.0, left);
            left = at(high - GOLDEN * (high - low));
        } else {
            (low, left) = (left.0, right);
            right = at(low + GOLDEN * (high - low));
        }
        best = [left, right].into_iter().fold(best, |best, one| if one.1 < best.1 { one } else { best });
    }
    best
}

/// The error of a run's positions once what its instruments are off by is fitted to it, m.
fn fitted(setup: &Setup, space: &Space, entries: &[Entry], stop: &Stop) -> Option<f64> {
    let problem = ValveProblem::new(setup, space.clone(), entries, stop);
    let fit = fit(&problem, &problem.start(), &FitOptions::new(setup.groups.clone()))?;
    Errors::of(&problem, &fit.linear.residual).rmse_m
}
