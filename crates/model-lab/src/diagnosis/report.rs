//! The answer, put together from what a search found.

use identify::left::{excess, left_nats, normalised_rms};
use identify::select::{BY_CHANCE, Level, Model, Selection};
use identify::special::t_quantile_95;
use identify::{FitOptions, Problem, Scope, Smoothness, fit};
use rayon::prelude::*;
use valve_model::EffectKind;
use valve_model::effects::Search;

use super::answer::{
    Alternative, CandidateReport, Explanation, Indistinguishable, MovedParameter, NuisanceReport, Remainder, Verdict,
};
use super::discrepancy::{ModelDiscrepancy, model_discrepancy, without_effects};
use super::experiment::{Hypothesis, best_experiment};
use super::uncertainty::{Certainty, effect_parameters, is_of_datasheet, is_told, moved_parameters, stands_for};
use super::{DiagnoseOptions, Formula, Progress};
use crate::errors::{self, CALIBRATED, StepReport};
use crate::identification::setup::{Kind, Recording};
use crate::identification::{Catalogue, Known, ValveProblem};

/// A group of indistinguishable alternatives larger than this names nothing.
const LARGEST_GROUP: usize = 4;

/// Models this far behind are judged again under a smoother model error, nats.
const JUDGED_AGAIN: f64 = 100.0;

/// So many of them.
const JUDGED_AT_MOST: usize = 4;

/// Effects that leave more than this share of the calibrated model's error on what was held out, noise aside, explain a
/// part of it.
const LARGEST_SHARE: f64 = 0.3;

/// Effects that leave more than this share of the calibrated model's error on what was held out, noise aside, do not explain most
/// of it, and are not named where what they leave is large as well.
const NAMED_SHARE: f64 = 0.5;

type Fitted<'a> = Model<ValveProblem<'a>>;

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
    }
    if let Some((base, alone, words)) =
        discrepancy.as_ref().and_then(|formula| enough_alone(catalogue, found, best, formula, options))
    {
        notes.push(words);
        (best, recommended, discrepancy) = (base, Vec::new(), Some(alone));
        left = remainder(best, &fit_options);
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
    let pulled = moved_parameters(&best.problem, &best.fit, &certainty);
    Explanation {
        verdict,
        parameters: effect_parameters(&best.problem, &best.fit, &certainty, &recommended, !stop.is_asked()),
        nuisances: nuisance_reports(best, &certainty, &pulled),
        moved: pulled,
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

/// The calibrated model with a formula that was found beside some effects, where these take less than half of the error and are
/// needed no more beside the formula: they stood in for what it describes. With the words that say so. Of effects that take
/// more, a formula is a longer name.
fn enough_alone<'f, 'a>(
    catalogue: &Catalogue<'a>,
    found: &'f Selection<ValveProblem<'a>>,
    best: &Fitted<'a>,
    formula: &ModelDiscrepancy,
    options: &DiagnoseOptions,
) -> Option<(&'f Fitted<'a>, ModelDiscrepancy, String)> {
    let base = found.model(&[]).filter(|_| share_left(found, best).is_some_and(|share| share > NAMED_SHARE))?;
    let alone = without_effects(catalogue, base, formula, options)?;
    let needed = (best.fit.log_evidence + formula.gain) - (base.fit.log_evidence + alone.gain);
    let ids: Vec<&str> = catalogue.kinds_of(&best.set).into_iter().map(EffectKind::id).collect();
    let words = format!(
        "{} would leave less than the calibrated model, and is not named: beside the formula it is not needed (log evidence \
         {needed:+.1})",
        ids.join(" with ")
    );
    // What was cut short decides nothing.
    (needed < options.select.accept && !catalogue.stop.is_asked()).then_some((base, alone, words))
}

/// Whether the noise of the pressures that drive a model makes as large a model error as it leaves.
fn is_noise_of_driving(model: &Fitted<'_>) -> bool {
    let left = model.fit.noise.groups[0].discrepancy;
    errors::by_driving(model).is_some_and(|driven| makes_as_much(driven.share, left))
}

/// Whether what noise makes of an error is all of it; one draw of the noise tells the variance within a factor of two.
fn makes_as_much(by_noise: f64, left: f64) -> bool {
    left * left < 2.0 * by_noise * by_noise
}

/// A fitted model with what the data leave open about it.
fn hypothesis<'a>(model: &'a Fitted<'_>, certainty: &'a Certainty) -> Hypothesis<'a> {
    Hypothesis { space: &model.problem.space, u: &model.fit.u, covariance: certainty.covariance() }
}

/// The share of the calibrated model's error on what was held out that the accepted effects leave, noise aside; nothing
/// without effects, or where nothing was held out.
fn share_left(found: &Selection<ValveProblem<'_>>, best: &Fitted<'_>) -> Option<f64> {
    share_of(found.model(&[]).filter(|_| !best.set.is_empty())?, best)
}

/// The share of one model's error on what was held out that another one leaves, noise aside.
fn share_of(of: &Fitted<'_>, left_by: &Fitted<'_>) -> Option<f64> {
    let [of, left] = held_out_errors([of, left_by], left_by)?;
    Some(left / of.max(f64::MIN_POSITIVE))
}

/// The errors of models on what was held out, noise aside, in units of the noise as one of them finds it.
fn held_out_errors<const N: usize>(models: [&Fitted<'_>; N], noise_of: &Fitted<'_>) -> Option<[f64; N]> {
    let mut errors = [0.0; N];
    for (error, model) in errors.iter_mut().zip(models) {
        let held = model.held_out.as_ref()?;
        *error = excess(normalised_rms(&model.problem, &noise_of.fit.noise, &held.own));
    }
    Some(errors)
}

/// Whether a model takes away most of an error beyond the noise that another one leaves on records that were held out.
fn takes_most(without: &Fitted<'_>, with: &Fitted<'_>) -> bool {
    held_out_errors([without, with], with).is_some_and(is_most_gone)
}

/// Whether most of an error beyond the noise is gone, with both in units of the noise.
fn is_most_gone([without, with]: [f64; 2]) -> bool {
    without > 1.0 && with < NAMED_SHARE * without
}

/// The model whose effects are named: the accepted one, but for effects that the evidence has for reasons that it does not
/// know of.
fn named<'f, 'a>(
    catalogue: &Catalogue<'a>,
    found: &'f Selection<ValveProblem<'a>>,
    leaves_something: &dyn Fn(&Fitted<'_>) -> bool,
    notes: &mut Vec<String>,
) -> &'f Fitted<'a> {
    let mut sure = without_unsure(catalogue, found, notes);
    // Two effects that leave something each take what suits them of a third: in 14 of 17 drawn campaigns one was wrong. Where
    // neither does most of it alone, there is no third that one of them stands in for.
    if sure.set.len() > 1 && leaves_something(sure) {
        let does_most = |alone: &&Fitted<'_>| {
            alone.level == Level::High && share_left(found, alone).is_none_or(|share| share <= NAMED_SHARE)
        };
        let alone = sure.set.iter().filter_map(|one| found.model(&[*one]).filter(does_most));
        if let Some(alone) = alone.max_by(|a, b| a.fit.log_evidence.total_cmp(&b.fit.log_evidence)) {
            let others = sure.set.iter().filter(|one| !alone.set.contains(one)).copied().collect::<Vec<_>>();
            let ids: Vec<&str> = catalogue.kinds_of(&others).into_iter().map(EffectKind::id).collect();
            notes.push(format!(
                "{} beside it would take more, and leave something as well: it is not named, since two effects that do so are \
                 seldom both there",
                ids.join(" with ")
            ));
            sure = alone;
        }
    }
    // That noise differs from stroke to stroke: what takes most of an error away where it was held out is no answer to it.
    let is_noise = |base: &&Fitted<'_>| is_noise_of_driving(base) && !takes_most(base, sure);
    let Some(base) = found.model(&[]).filter(|_| !sure.set.is_empty()).filter(is_noise) else {
        return sure;
    };
    let ids: Vec<&str> = catalogue.kinds_of(&sure.set).into_iter().map(EffectKind::id).collect();
    notes.push(format!(
        "{} would fit better, but the noise of the recorded pressures that drive the model leaves as much without it: it is not \
         named",
        ids.join(" with ")
    ));
    base
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

/// The accepted model without effects whose size cannot be told from none: what records disagree by can be more than the
/// evidence knows of, and shapes that fit where the size does not are of something else. An effect that takes most of an error
/// beyond the noise on records that were held out is there, however much its size differs from one to the other. A factor that
/// is nearer to one than the datasheet may be off is a matter of the datasheet, and no missing physics.
fn without_unsure<'f, 'a>(
    catalogue: &Catalogue<'a>,
    found: &'f Selection<ValveProblem<'a>>,
    notes: &mut Vec<String>,
) -> &'f Fitted<'a> {
    let Some(mut model) = found.model(found.accepted()) else { unreachable!("the accepted set was fitted") };
    while !model.set.is_empty() {
        let certainty = Certainty::new(&model.problem, &model.fit);
        let unsure = model.set.iter().filter_map(|one| {
            let kind = catalogue.kinds_of(&[*one])[0];
            let deviations = deviations_from_none(model, &certainty, kind);
            let rest: Vec<usize> = model.set.iter().copied().filter(|other| other != one).collect();
            let smaller = found.model(&rest).filter(|smaller| smaller.level == Level::High)?;
            let is_unsure = deviations < t_quantile_95(f64::INFINITY) && !takes_most(smaller, model);
            (is_unsure || is_of_datasheet(kind, &values_of(model, kind))).then_some((deviations, kind, smaller))
        });
        let Some((_, kind, smaller)) = unsure.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        let beside = if smaller.set.is_empty() { "" } else { " beside it" };
        notes.push(format!(
            "{}{beside} would fit better, with a size that cannot be told from {}: it is not named",
            kind.id(),
            if is_of_datasheet(kind, &values_of(model, kind)) { "what the datasheet may be off by" } else { "none" }
        ));
        model = smaller;
    }
    model
}

fn values_of(model: &Fitted<'_>, kind: EffectKind) -> Vec<f64> {
    model.problem.space.effect_values(kind, &model.fit.u).unwrap_or_default()
}

/// By how many of its standard deviations the size of an effect differs from none, the one that differs most where it has
/// several; infinite where none is no value of it. What the datasheet may be off by makes a size another, not none.
fn deviations_from_none(model: &Fitted<'_>, certainty: &Certainty, kind: EffectKind) -> f64 {
    let (problem, u) = (&model.problem, &model.fit.u);
    let sizes = kind.parameters().iter().enumerate().filter(|(_, parameter)| parameter.is_size());
    let deviations = sizes.map(|(index, parameter)| {
        // None of an effect that is absent at infinity is as far as its inverse is from nothing.
        let from = if parameter.search == Search::InverseSize { 0.0 } else { kind.info().neutral };
        let of = |u: &[f64]| problem.space.effect_values(kind, u).map_or(from, |values| values[index]);
        let (off, sigma) = ((of(u) - from).abs(), certainty.sigma(problem, u, of));
        if off == 0.0 {
            0.0
        } else if off.is_nan() || sigma == 0.0 {
            f64::INFINITY
        } else {
            off / sigma
        }
    });
    deviations.fold(0.0, f64::max)
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

fn noise_m(best: &Fitted<'_>) -> Option<f64> {
    best.problem.setup().noise_m.map(|noise| best.fit.noise.groups[0].multiplier * noise)
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
            if !is_told(entry, best.fit.u[index]) || stands_for(entry.nuisance, parameters) {
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
                value: entry.size * best.fit.u[index],
                // However much records disagree by, no less is known than before them.
                sigma: entry.size * certainty.sigma(problem, &best.fit.u, |u| u[index]).min(entry.coordinate.sigma),
                prior: entry.size * entry.coordinate.sigma,
                unit,
                is_at_bound: best.fit.held[index],
            })
        })
        .collect()
}

/// The models that were fitted to the end, with their probabilities among each other.
fn probabilities<'f, 'a>(found: &'f Selection<ValveProblem<'a>>) -> Vec<(&'f Fitted<'a>, f64)> {
    let high: Vec<&Fitted<'a>> = found.models.iter().filter(|model| model.level == Level::High).collect();
    let most = high.iter().map(|model| model.fit.log_evidence).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = high.iter().map(|model| (model.fit.log_evidence - most).exp()).collect();
    let sum: f64 = weights.iter().sum();
    high.into_iter().zip(weights).map(|(model, weight)| (model, weight / sum)).collect()
}

fn inclusion(catalogue: &Catalogue<'_>, found: &Selection<ValveProblem<'_>>) -> Vec<(EffectKind, f64)> {
    let all = probabilities(found);
    let mut inclusion: Vec<(EffectKind, f64)> = catalogue
        .kinds
        .iter()
        .enumerate()
        .map(|(index, kind)| {
            (*kind, all.iter().filter(|(model, _)| model.set.contains(&index)).map(|(_, share)| share).sum())
        })
        .collect();
    inclusion.sort_by(|a, b| b.1.total_cmp(&a.1));
    inclusion
}

fn candidates(
    catalogue: &Catalogue<'_>,
    found: &Selection<ValveProblem<'_>>,
    accepted: &[usize],
    options: &DiagnoseOptions,
) -> Vec<CandidateReport> {
    let all = probabilities(found);
    let accepted_gain = found.model(accepted).map_or(0.0, |model| found.gain(model));
    let held_out_m = |model: &Fitted<'_>| errors::held_out(model).and_then(|errors| errors.rmse_m);
    let of_accepted_m = found.model(accepted).and_then(held_out_m);
    // Likelier than what is named, and not named.
    let refused = |model: &Fitted<'_>| {
        let is_better = of_accepted_m
            .zip(held_out_m(model))
            .is_some_and(|(accepted_m, own_m)| own_m < (1.0 - options.select.held_out_fall) * accepted_m);
        if is_better { "more, but leaves too much" } else { "more, but no better held out" }
    };
    let is_most_exact = |model: &&Fitted<'_>| found.model(&model.set).is_some_and(|exact| std::ptr::eq(exact, *model));
    let sets: Vec<&Fitted<'_>> =
        found.models.iter().filter(|model| !model.set.is_empty()).filter(is_most_exact).collect();
    let mut reports: Vec<CandidateReport> = sets
        .into_par_iter()
        .map(|model| {
            let gain = found.gain(model);
            // Few records are looked at first: what those say is held against what the same records say without effects.
            let base = found.models.iter().find(|base| base.set.is_empty() && base.level == model.level);
            let kinds = catalogue.kinds_of(&model.set);
            let certainty = Certainty::new(&model.problem, &model.fit);
            let rows: usize = model.problem.records().iter().map(identify::Record::row_count).sum();
            let added = base.map_or(0, |base| model.fit.u.len() - base.fit.u.len());
            let whitened = |fitted: &Fitted<'_>| -> f64 {
                let records = 0..fitted.problem.records().len();
                records.flat_map(|record| fitted.fit.whitened(&fitted.problem, record)).map(|value| value * value).sum()
            };
            let delta_bic =
                base.map_or(0.0, |base| whitened(model) - whitened(base)) + added as f64 * (rows as f64).ln();
            let rejected = if model.set == accepted {
                None
            } else if model.level == Level::Screen {
                Some("explains less at a first look".to_owned())
            } else if model.set == found.accepted() {
                Some("likeliest, not named: see the notes".to_owned())
            } else if accepted.is_empty() {
                Some(
                    if gain > options.select.accept { "no better held out" } else { "explains hardly more" }.to_owned(),
                )
            } else if accepted.iter().all(|one| model.set.contains(one)) {
                Some(if gain - accepted_gain < options.select.accept {
                    "adds too little".to_owned()
                } else {
                    refused(model).to_owned()
                })
            } else if gain - accepted_gain >= options.select.accept {
                Some(refused(model).to_owned())
            } else if model.set.iter().all(|one| accepted.contains(one)) {
                Some("more with another beside it".to_owned())
            } else if accepted_gain - gain < options.select.accept {
                Some("cannot be told apart".to_owned())
            } else {
                Some("explains less".to_owned())
            };
            let fitted = match (base, found.model(&[])) {
                (Some(base), Some(calibrated)) if model.level != Level::High => {
                    errors::as_on_all(errors::fitted(model), errors::fitted(base), errors::fitted(calibrated))
                }
                _ => errors::fitted(model),
            };
            CandidateReport {
                parameters: effect_parameters(&model.problem, &model.fit, &certainty, &kinds, false),
                kinds,
                gain,
                probability: all.iter().find(|(one, _)| std::ptr::eq(*one, model)).map(|(_, share)| *share),
                errors: fitted,
                held_out: errors::held_out(model),
                delta_bic,
                rejected,
            }
        })
        .collect();
    reports.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    reports
}

/// Which of some sets, by its place, may be there in place of what is named by the likeliest of those with one effect more, where that
/// does without one that is named and was refused only for what it leaves: what it says of the named one counts all the same. Of
/// those that it holds the likeliest. Sets go with their evidence.
fn in_doing_without(named: (&[usize], f64), sets: &[(&[usize], f64)], accept: f64) -> Option<usize> {
    let holds = |larger: &[usize], set: &[usize]| set.iter().all(|one| larger.contains(one));
    let larger = sets.iter().filter(|(set, _)| set.len() == named.0.len() + 1);
    let likeliest = larger.max_by(|a, b| a.1.total_cmp(&b.1));
    let contrary = likeliest.filter(|(set, evidence)| *evidence >= named.1 + accept && !holds(set, named.0));
    let (contrary, _) = contrary?;
    let is_in = |(set, _): &(&[usize], f64)| set.len() == named.0.len() && holds(contrary, set);
    (0..sets.len()).filter(|place| is_in(&sets[*place])).max_by(|a, b| sets[*a].1.total_cmp(&sets[*b].1))
}

/// For each recommended effect, what could stand in for it: sets with it exchanged that are as likely, under one model
/// error or the other.
fn indistinguishable(
    catalogue: &Catalogue<'_>,
    found: &Selection<ValveProblem<'_>>,
    best: &Fitted<'_>,
    recommended: &[EffectKind],
    certainty: &Certainty,
    options: &DiagnoseOptions,
) -> Vec<Indistinguishable> {
    let mut rivals: Vec<(&Fitted<'_>, f64)> = found
        .models
        .iter()
        .filter(|model| model.level == Level::High && model.set != best.set && model.set.len() == best.set.len())
        .map(|model| (model, best.fit.log_evidence - model.fit.log_evidence))
        .filter(|(_, behind)| *behind < JUDGED_AGAIN)
        .collect();
    rivals.sort_by(|a, b| a.1.total_cmp(&b.1));
    rivals.truncate(JUDGED_AT_MOST);
    let exact: Vec<&Fitted<'_>> = found.models.iter().filter(|model| model.level == Level::High).collect();
    let sets: Vec<(&[usize], f64)> = exact.iter().map(|model| (&model.set[..], model.fit.log_evidence)).collect();
    let instead = in_doing_without((&best.set, best.fit.log_evidence), &sets, options.select.accept);
    let behind = |model: &Fitted<'_>| best.fit.log_evidence - model.fit.log_evidence;
    let doing_without: Vec<(&Fitted<'_>, f64)> =
        instead.into_iter().map(|place| (exact[place], behind(exact[place]))).collect();
    rivals.retain(|(model, _)| !doing_without.iter().any(|(other, _)| std::ptr::eq(*model, *other)));
    let smooth = |model: &Fitted<'_>| -> Option<f64> {
        let options = FitOptions {
            annealed: 0,
            settled: 3,
            smoothness: Smoothness::Smooth,
            ..FitOptions::new(model.problem.setup().groups.clone())
        };
        fit(&model.problem, &model.fit.u, &options).map(|fit| fit.log_evidence)
    };
    let of_best = if rivals.is_empty() { None } else { smooth(best) };
    let judged: Vec<(&Fitted<'_>, f64)> = rivals
        .into_par_iter()
        .filter_map(|(model, behind)| {
            if behind < options.select.accept {
                return Some((model, behind));
            }
            let again = || Some(of_best? - smooth(model)?);
            // What nobody could judge any more has not been told apart.
            let is_alike = again().map_or(catalogue.stop.is_asked(), |again| again < options.select.accept);
            is_alike.then_some((model, behind))
        })
        .chain(doing_without)
        .collect();
    let mut reports = Vec::new();
    for kind in recommended {
        let with: Vec<Alternative> = judged
            .iter()
            .filter_map(|(model, behind)| {
                let kinds = catalogue.kinds_of(&model.set);
                let new: Vec<EffectKind> = kinds.iter().copied().filter(|one| !recommended.contains(one)).collect();
                if kinds.contains(kind) || new.len() != 1 {
                    return None;
                }
                let other = Certainty::new(&model.problem, &model.fit);
                Some(Alternative {
                    kind: new[0],
                    parameters: effect_parameters(&model.problem, &model.fit, &other, &new, false),
                    kinds,
                    behind: *behind,
                    valve: model.problem.space.valve(&model.fit.u)?,
                    spread: hypothesis(model, &other).spread(),
                })
            })
            .collect();
        let experiment = with.first().and_then(|closest| {
            let (model, _) = judged.iter().find(|(model, _)| catalogue.kinds_of(&model.set) == closest.kinds)?;
            let one = hypothesis(best, certainty);
            let certainty = Certainty::new(&model.problem, &model.fit);
            best_experiment(catalogue.subject.setup(Level::High), &one, &hypothesis(model, &certainty), noise_m(best))
        });
        reports.push(Indistinguishable { kind: *kind, with, experiment });
    }
    reports
}

#[cfg(test)]
mod tests {
    use super::{in_doing_without, is_most_gone, makes_as_much, short_of};

    #[test]
    fn a_likelier_pair_without_what_is_named_says_what_may_be_there_instead() {
        let sets: [(&[usize], f64); 5] =
            [(&[7], 300.0), (&[1], 2172.0), (&[2], 2590.0), (&[1, 7], 3246.0), (&[2, 7], 3198.0)];
        assert_eq!(in_doing_without((&[2], 2590.0), &sets, 10.0), Some(1));
        // Where the likeliest pair has it, or is no likelier, nothing speaks against it.
        assert_eq!(in_doing_without((&[1], 2172.0), &sets, 10.0), None);
        assert_eq!(in_doing_without((&[2], 3240.0), &sets, 10.0), None);
    }

    #[test]
    fn noise_answers_for_what_it_makes_and_not_for_what_goes_where_it_was_held_out() {
        // As much as was drawn of it, and half as much again.
        assert!(makes_as_much(0.010, 0.010) && makes_as_much(0.010, 0.014) && !makes_as_much(0.010, 0.015));
        assert!(!makes_as_much(0.0, 0.001));
        // An error that is of the same noise in all strokes stays where it was held out.
        assert!(!is_most_gone([1.4, 1.0]) && !is_most_gone([96.0, 60.0]) && is_most_gone([96.0, 5.3]));
        // Below the noise there is nothing to take.
        assert!(!is_most_gone([0.8, 0.1]));
    }

    #[test]
    fn a_fit_that_is_done_is_not_doubted() {
        assert_eq!([short_of(0.02, 0.1), short_of(9.0, 0.1), short_of(11.0, 12.0)], [None, None, None]);
        let doubt = short_of(384.6, 2.3).expect("a doubt");
        assert!(doubt.contains(" 385 nats"), "{doubt}");
    }
}
