//! All sets of effects that were looked at, with why each but one is not named.

use identify::Problem;
use identify::select::{Level, Selection};
use rayon::prelude::*;
use valve_model::EffectKind;

use super::answer::CandidateReport;
use super::uncertainty::{Certainty, effect_parameters};
use super::{DiagnoseOptions, Fitted};
use crate::errors;
use crate::identification::{Catalogue, ValveProblem};

pub(super) fn candidates(
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

/// The models that were fitted to the end, with their probabilities among each other.
fn probabilities<'f, 'a>(found: &'f Selection<ValveProblem<'a>>) -> Vec<(&'f Fitted<'a>, f64)> {
    let high: Vec<&Fitted<'a>> = found.models.iter().filter(|model| model.level == Level::High).collect();
    let most = high.iter().map(|model| model.fit.log_evidence).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = high.iter().map(|model| (model.fit.log_evidence - most).exp()).collect();
    let sum: f64 = weights.iter().sum();
    high.into_iter().zip(weights).map(|(model, weight)| (model, weight / sum)).collect()
}

pub(super) fn inclusion(catalogue: &Catalogue<'_>, found: &Selection<ValveProblem<'_>>) -> Vec<(EffectKind, f64)> {
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
