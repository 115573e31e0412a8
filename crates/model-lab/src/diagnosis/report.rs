//! The answer, put together from what a search found.

use identify::left::left_nats;
use identify::select::{BY_CHANCE, Level, Model, Selection};
use identify::{FitOptions, Scope};
use valve_model::EffectKind;

use super::alternatives::{hypothesis, indistinguishable, noise_m};
use super::answer::{Explanation, MovedParameter, NuisanceReport, Remainder, Verdict};
use super::candidates::{candidates, inclusion};
use super::discrepancy::model_discrepancy;
use super::naming::{NAMED_SHARE, enough_alone, is_noise_of_driving, named, share_left};
use super::uncertainty::{Certainty, deviation, effect_parameters, is_told, moved_parameters, stands_for};
use super::{DiagnoseOptions, Fitted, Formula, Progress};
use crate::errors::{self, CALIBRATED, StepReport};
use crate::identification::setup::{Kind, Recording};
use crate::identification::{Catalogue, Known, Nuisance, ValveProblem};

/// A group of indistinguishable alternatives larger than this names nothing.
const LARGEST_GROUP: usize = 4;

/// Effects that leave more than this share of the calibrated model's error on what was held out, noise aside, explain a
/// part of it.
const LARGEST_SHARE: f64 = 0.3;

pub(super) fn assemble<'a>(
    catalogue: &Catalogue<'a>,
    found: &Selection<ValveProblem<'a>>,
    options: &DiagnoseOptions,
    tell: &(dyn Fn(Progress) + Sync),
    formula: Formula,
) -> Explanation {
    let stop = catalogue.stop;
    let fit_options = FitOptions::new(catalogue.subject.setup(Level::High).groups.clone());
    let is_good_enough = |model: &Fitted<'_>| (catalogue.enough)(model);
    let is_large = |model: &Fitted<'_>| errors::is_large(model, options.select.large);
    let leaves_something = |model: &Fitted<'_>| {
        let is_half_way = share_left(found, model).is_some_and(|share| share > LARGEST_SHARE);
        (is_large(model) || is_half_way)
            && remainder(model, &fit_options).nats > options.select.accept
            && !is_good_enough(model)
            && !is_noise_of_driving(model)
    };
    let mut notes = notes(catalogue);
    notes.extend(ruled_out(options));
    notes.extend(unseen(catalogue, options));
    let mut best = named(catalogue, found, &leaves_something, &mut notes);
    let mut recommended = in_order(catalogue, found, &best.set);
    let mut left = remainder(best, &fit_options);
    let mut is_unnamed = false;
    if let (Some(share), Some(calibrated)) = (share_left(found, best), found.model(&[]))
        && share > NAMED_SHARE
        && is_large(best)
        && left.nats > options.select.accept
        && !is_good_enough(best)
    {
        // What does less than half of what is large stands in for something else more often than not.
        let ids: Vec<&str> = recommended.iter().map(|kind| kind.id()).collect();
        notes.push(format!(
            "{} would take away {:.0} % of the error on what was held out, noise aside: too little to be named",
            ids.join(" with "),
            1e2 * (1.0 - share).max(0.0)
        ));
        (best, recommended, is_unnamed) = (calibrated, Vec::new(), true);
        left = remainder(best, &fit_options);
    }
    let something_is_left = is_unnamed || leaves_something(best);
    let mut discrepancy = None;
    if something_is_left && formula == Formula::WhereSomethingIsLeft && !stop.is_asked() {
        tell(Progress::Doing("forces and flows without a law"));
        discrepancy = model_discrepancy(catalogue, best, options);
        if let Some((base, alone, words)) = enough_alone(catalogue, found, best, discrepancy.as_ref(), options) {
            notes.push(words);
            (best, recommended, discrepancy) = (base, Vec::new(), Some(alone));
            left = remainder(best, &fit_options);
        }
    }
    let remainder = left;
    let certainty = Certainty::new(&best.problem, &best.fit);
    tell(Progress::Doing("what cannot be told apart"));
    let indistinguishable = indistinguishable(catalogue, found, best, &recommended, &certainty, options);
    let interrupted = found.interrupted || stop.is_asked();
    let group = indistinguishable.iter().map(|group| 1 + group.with.len()).max().unwrap_or(1);
    let strange: Vec<EffectKind> =
        recommended.iter().copied().filter(|kind| best.problem.space.has_strange_shape(&best.fit.u, *kind)).collect();
    notes.extend(doubts(best, &recommended, &strange));
    let verdict = match (recommended.is_empty(), something_is_left || !strange.is_empty()) {
        (true, _) if interrupted => Verdict::NotEnoughData,
        (true, true) => Verdict::OutsideCatalogue,
        (true, false) => Verdict::Adequate,
        (false, _) if group > LARGEST_GROUP => Verdict::NotEnoughData,
        (false, true) => Verdict::PartlyExplained,
        (false, false) => Verdict::EffectFound,
    };
    if interrupted {
        notes.push("the search was cut short; this is what was known by then".into());
    }
    let certainty = Certainty::of_model(best);
    // Without the formula, instruments and parameters make up for what it describes.
    let (moved, nuisances, pressures) = if let Some(formula) = &discrepancy {
        (formula.moved.clone(), formula.nuisances.clone(), formula.pressures_left)
    } else {
        let moved = moved_parameters(&best.problem, &best.fit, &certainty);
        let nuisances = nuisance_reports(best, &certainty, &moved);
        (moved, nuisances, errors::pressures_left(best, options.select.large))
    };
    notes.extend(pressures.map(pressures_words));
    Explanation {
        verdict,
        parameters: effect_parameters(&best.problem, &best.fit, &certainty, &recommended, !stop.is_asked()),
        nuisances,
        moved,
        indistinguishable,
        candidates: candidates(catalogue, found, &best.set, options),
        steps: steps(catalogue, found, &best.set, &recommended),
        inclusion: inclusion(catalogue, found),
        remainder,
        discrepancy,
        valve: best.problem.space.valve(&best.fit.u).unwrap_or_else(|| unreachable!("a fit visits possible valves")),
        spread: hypothesis(best, &certainty).spread(),
        noise_m: noise_m(best),
        recommended,
        left_out: None,
        exchanged: None,
        known: Known::new(&best.problem, &best.fit.u),
        notes,
        interrupted,
    }
}

/// What makes an answer doubtful though it fits, in words.
fn doubts(best: &Fitted<'_>, recommended: &[EffectKind], strange: &[EffectKind]) -> Vec<String> {
    let mut doubts = Vec::new();
    doubts.extend(strange.iter().map(|kind| {
        format!(
            "{} fits with shapes that it hardly ever has: it may stand in for something that no effect here describes",
            kind.id()
        )
    }));
    doubts.extend(short_of(best.fit.predicted_gain, best.fit.tolerance));
    if !recommended.is_empty() && best.problem.setup().noise_m.is_none() {
        doubts.push(
            "two times a stroke show how much is lost, hardly to what: something that no effect here describes can look \
             like this; the position recorded over one closing and opening would tell"
                .to_owned(),
        );
    }
    if let Some(driven) = errors::by_driving(best).filter(|_| is_noise_of_driving(best)) {
        doubts.push(format!(
            "the noise of the recorded pressures that drive the model makes an error of about {:.3} mm by itself: less noise, \
             or the pressures simulated, would tell more",
            1e3 * driven.rmse_m
        ));
    }
    doubts
}

/// What is said of recorded pressures that are off by so much, Pa, and so many times their noise.
fn pressures_words((left_pa, in_noise): (f64, f64)) -> String {
    format!(
        "the recorded pressures are off by {:.2} kPa, {in_noise:.1} times their noise: what moves them is not explained, \
         whatever is said of the motion",
        1e-3 * left_pa
    )
}

/// What is said of a fit that ended where its derivatives still promise so many nats: no step has kept that, so that one or the
/// other is wrong there.
fn short_of(promised_nats: f64, tolerated_nats: f64) -> Option<String> {
    (promised_nats > BY_CHANCE.max(tolerated_nats)).then(|| {
        format!(
            "the fit ended where its derivatives still promise {promised_nats:.0} nats that no step keeps: what is rough about \
             the motion, such as a piston that sticks and slips, hides where it is best, and values may be off by more than they \
             are said to be"
        )
    })
}

/// The accepted effects, the one first without which most evidence is lost.
fn in_order(catalogue: &Catalogue<'_>, found: &Selection<ValveProblem<'_>>, accepted: &[usize]) -> Vec<EffectKind> {
    let lost = |one: usize| {
        let rest: Vec<usize> = accepted.iter().copied().filter(|other| *other != one).collect();
        found.model(&rest).map_or(f64::INFINITY, |model| -found.gain(model))
    };
    let mut order = accepted.to_vec();
    order.sort_by(|a, b| lost(*b).total_cmp(&lost(*a)));
    catalogue.kinds_of(&order)
}

fn remainder(best: &Fitted<'_>, options: &FitOptions) -> Remainder {
    let group = best.fit.noise.groups[0];
    Remainder {
        discrepancy: group.discrepancy,
        time_s: group.time_s,
        nats: left_nats(&best.problem, &best.fit, options),
        multiplier: group.multiplier,
    }
}

fn notes(catalogue: &Catalogue<'_>) -> Vec<String> {
    let mut notes = Vec::new();
    if catalogue.subject.tolerances_are_assumed {
        notes.push(
            "the valve file has no [tolerance]: friction 50 %, flow areas and volumes 20 % and the spring 5 % were \
             assumed; state what the datasheet says for a surer answer"
                .to_owned(),
        );
    }
    let setup = catalogue.subject.setup(Level::High);
    if setup.cycles_left_out > 0 {
        let used = setup.recordings.iter().filter(|recording| recording.is_trace()).count();
        notes.push(format!(
            "of {} recorded cycles {used} were looked at, spread evenly over their records",
            used + setup.cycles_left_out
        ));
    }
    let recorded = |(recording, record): (&Recording, &identify::Record)| {
        let strokes = match &recording.kind {
            Kind::Trace(_) => 1,
            Kind::Times(times) => {
                let closing = times.closing.iter().filter(|closes| **closes).count();
                closing.max(times.closing.len() - closing)
            }
        };
        std::iter::repeat_n(record.condition, strokes)
    };
    let conditions: Vec<usize> = setup.recordings.iter().zip(setup.records.iter()).flat_map(recorded).collect();
    let mut distinct = conditions.clone();
    distinct.sort_unstable();
    distinct.dedup();
    if distinct.len() == conditions.len() && conditions.len() > 1 {
        notes.push(
            "no condition was repeated, so that what differs from stroke to stroke is supposed from what instruments \
             and conditions usually do; three repeats of one stroke would show it"
                .to_owned(),
        );
    }
    if distinct.len() == 1 && conditions.len() > 1 {
        notes.push("all strokes were made under one condition; other supply pressures would tell far more".to_owned());
    }
    notes
}

/// Which effects of the catalogue were not looked for because nobody wanted them to be.
fn ruled_out(options: &DiagnoseOptions) -> Option<String> {
    let left_out = EffectKind::ALL.iter().filter(|kind| !options.effects.contains(kind));
    let ids: Vec<&str> = left_out.map(|kind| kind.id()).collect();
    (!ids.is_empty()).then(|| format!("not looked for: {}", ids.join(", ")))
}

/// Which effects were not looked for because they would change nothing that was recorded: that none of them is named says nothing.
fn unseen(catalogue: &Catalogue<'_>, options: &DiagnoseOptions) -> Option<String> {
    let is_in_file = |kind: EffectKind| catalogue.subject.space.effects().iter().any(|effect| effect.kind() == kind);
    let is_unseen = |kind: &&EffectKind| !catalogue.kinds.contains(kind) && !is_in_file(**kind);
    let ids: Vec<&str> = options.effects.iter().filter(is_unseen).map(|kind| kind.id()).collect();
    let setup = catalogue.subject.setup(Level::High);
    let is_driven = setup.is_prescribed;
    let why = if is_driven { "the recorded pressure drives the model, so that " } else { "" };
    (!ids.is_empty()).then(|| {
        format!("{why}nothing recorded would change with {}: whether there is any is not known", ids.join(", "))
    })
}

/// The model sequence from the datasheet to the effects of `set`, by the steps of the search that lead there.
fn steps(
    catalogue: &Catalogue<'_>,
    found: &Selection<ValveProblem<'_>>,
    set: &[usize],
    recommended: &[EffectKind],
) -> Vec<StepReport> {
    let mut steps = Vec::new();
    let Some(base) = found.model(&[]) else { return steps };
    steps.extend(
        errors::at(&base.problem, &base.problem.at_their_word())
            .map(|errors| StepReport::as_stated(catalogue.subject, errors)),
    );
    let leads_there = |step: &&[usize]| step.iter().all(|one| set.contains(one)) && *step != set;
    let before = found.steps.iter().map(Vec::as_slice).filter(leads_there);
    let mut shown: Vec<EffectKind> = Vec::new();
    for set in before.chain([set]) {
        let Some(model) = found.model(set) else { continue };
        let kinds = catalogue.kinds_of(set);
        let new: Vec<&str> = recommended
            .iter()
            .filter(|kind| kinds.contains(kind) && !shown.contains(kind))
            .map(|kind| kind.id())
            .collect();
        let name = if set.is_empty() { CALIBRATED.to_owned() } else { new.join(" + ") };
        shown.extend(kinds);
        steps.push(StepReport::new(name, model));
    }
    steps
}

/// What instruments and conditions were found to be off by, where that is far; not what is told as one of these parameters of the
/// valve.
pub fn nuisance_reports(
    best: &Model<ValveProblem<'_>>,
    certainty: &Certainty,
    parameters: &[MovedParameter],
) -> Vec<NuisanceReport> {
    let problem = &best.problem;
    let first = problem.space.coordinates.len();
    problem
        .nuisances
        .iter()
        .enumerate()
        .filter_map(|(place, entry)| {
            let index = first + place;
            let off = |u: &[f64]| deviation(problem, u, place);
            // However much records disagree by, no less is known than before them.
            let standard_error = certainty.sigma(problem, &best.fit.u, off).min(1.0);
            let is_told = is_told(problem, &best.fit, place, (off(&best.fit.u), standard_error));
            if !is_told || stands_for(entry.nuisance, parameters) {
                return None;
            }
            let (what, unit) = entry.nuisance.words();
            let record = match entry.nuisance.scope() {
                Scope::Record(record) => Some(problem.setup().recordings[record].name.clone()),
                Scope::Shared => None,
            };
            Some(NuisanceReport {
                what,
                record,
                value: if entry.nuisance == Nuisance::Clock {
                    entry.size * off(&best.fit.u)
                } else {
                    entry.size * best.fit.u[index]
                },
                sigma: entry.size * entry.coordinate.sigma * standard_error,
                prior: entry.size * entry.coordinate.sigma,
                unit,
                is_at_bound: best.fit.held[index],
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::short_of;

    #[test]
    fn a_fit_that_is_done_is_not_doubted() {
        assert_eq!([short_of(0.02, 0.1), short_of(9.0, 0.1), short_of(11.0, 12.0)], [None, None, None]);
        let doubt = short_of(384.6, 2.3).expect("a doubt");
        assert!(doubt.contains(" 385 nats"), "{doubt}");
    }
}
