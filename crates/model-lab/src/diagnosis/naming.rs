//! Which effects of those that a search accepted are named.

use identify::left::{excess, normalised_rms};
use identify::select::{Level, Selection};
use identify::special::t_quantile_95;
use valve_model::EffectKind;
use valve_model::effects::Search;

use super::discrepancy::{ModelDiscrepancy, model_discrepancy, without_effects};
use super::uncertainty::{Certainty, is_of_datasheet};
use super::{DiagnoseOptions, Fitted};
use crate::errors;
use crate::identification::{Catalogue, ValveProblem};

/// Effects that leave more than this share of the calibrated model's error on what was held out, noise aside, do not explain most
/// of it, and are not named where what they leave is large as well.
pub(super) const NAMED_SHARE: f64 = 0.5;

/// The calibrated model with a formula, where effects that leave something are needed no more beside it: they stood in for what
/// it describes. With the words that say so. Where they take less than half of the error, the formula that was found beside
/// them need only do as well without them; where they take more it is a longer name, and has to be likelier.
pub(super) fn enough_alone<'f, 'a>(
    catalogue: &Catalogue<'a>,
    found: &'f Selection<ValveProblem<'a>>,
    best: &Fitted<'a>,
    beside: Option<&ModelDiscrepancy>,
    options: &DiagnoseOptions,
) -> Option<(&'f Fitted<'a>, ModelDiscrepancy, String)> {
    let base = found.model(&[]).filter(|_| !best.set.is_empty())?;
    let takes_little = share_left(found, best).is_some_and(|share| share > NAMED_SHARE);
    let same = beside.filter(|_| takes_little).and_then(|formula| without_effects(catalogue, base, formula, options));
    let own = same.is_none().then(|| model_discrepancy(catalogue, base, options)).flatten();
    let alone = same.or(own)?;
    let needed =
        (best.fit.log_evidence + beside.map_or(0.0, |formula| formula.gain)) - (base.fit.log_evidence + alone.gain);
    let ids: Vec<&str> = catalogue.kinds_of(&best.set).into_iter().map(EffectKind::id).collect();
    let words = format!(
        "{} would leave less than the calibrated model, and is not named: beside the formula it is not needed (log evidence \
         {needed:+.1})",
        ids.join(" with ")
    );
    let most = if takes_little { options.select.accept } else { 0.0 };
    // What was cut short decides nothing.
    (needed < most && !catalogue.stop.is_asked()).then_some((base, alone, words))
}

/// Whether the noise of the pressures that drive a model makes as large a model error as it leaves.
pub(super) fn is_noise_of_driving(model: &Fitted<'_>) -> bool {
    let left = model.fit.noise.groups[0].discrepancy;
    errors::by_driving(model).is_some_and(|driven| makes_as_much(driven.share, left))
}

/// Whether what noise makes of an error is all of it; one draw of the noise tells the variance within a factor of two.
fn makes_as_much(by_noise: f64, left: f64) -> bool {
    left * left < 2.0 * by_noise * by_noise
}

/// The share of the calibrated model's error on what was held out that the accepted effects leave, noise aside; nothing
/// without effects, or where nothing was held out.
pub(super) fn share_left(found: &Selection<ValveProblem<'_>>, best: &Fitted<'_>) -> Option<f64> {
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
pub(super) fn named<'f, 'a>(
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

#[cfg(test)]
mod tests {
    use super::{is_most_gone, makes_as_much};

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
}
