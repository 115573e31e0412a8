//! What could stand in for an effect that is named, and the experiment that would tell.

use identify::select::{Level, Selection};
use identify::{FitOptions, Smoothness, fit};
use rayon::prelude::*;
use valve_model::EffectKind;

use super::answer::{Alternative, Indistinguishable};
use super::experiment::{Hypothesis, best_experiment};
use super::uncertainty::{Certainty, effect_parameters};
use super::{DiagnoseOptions, Fitted};
use crate::identification::{Catalogue, ValveProblem};

/// Models this far behind are judged again under a smoother model error, nats.
const JUDGED_AGAIN: f64 = 100.0;

/// So many of them.
const JUDGED_AT_MOST: usize = 4;

/// For each recommended effect, what could stand in for it: sets with it exchanged that are as likely, under one model
/// error or the other.
pub(super) fn indistinguishable(
    catalogue: &Catalogue<'_>,
    found: &Selection<ValveProblem<'_>>,
    best: &Fitted<'_>,
    recommended: &[EffectKind],
    certainty: &Certainty,
    options: &DiagnoseOptions,
) -> Vec<Indistinguishable> {
    let behind = |model: &Fitted<'_>| best.fit.log_evidence - model.fit.log_evidence;
    let exact: Vec<&Fitted<'_>> = found.models.iter().filter(|model| model.level == Level::High).collect();
    let sets: Vec<(&[usize], f64)> = exact.iter().map(|model| (&model.set[..], model.fit.log_evidence)).collect();
    let instead = in_doing_without((&best.set, best.fit.log_evidence), &sets, options.select.accept);
    let is_rival = |place: &usize| {
        let model = exact[*place];
        model.set != best.set && model.set.len() == best.set.len() && behind(model) < JUDGED_AGAIN
    };
    let mut rivals: Vec<(&Fitted<'_>, f64)> = (0..exact.len())
        .filter(|place| is_rival(place) && instead != Some(*place))
        .map(|place| (exact[place], behind(exact[place])))
        .collect();
    rivals.sort_by(|a, b| a.1.total_cmp(&b.1));
    rivals.truncate(JUDGED_AT_MOST);
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
        .chain(instead.map(|place| (exact[place], behind(exact[place]))))
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

/// A fitted model with what the data leave open about it.
pub(super) fn hypothesis<'a>(model: &'a Fitted<'_>, certainty: &'a Certainty) -> Hypothesis<'a> {
    Hypothesis { space: &model.problem.space, u: &model.fit.u, covariance: certainty.covariance() }
}

pub(super) fn noise_m(best: &Fitted<'_>) -> Option<f64> {
    best.problem.setup().noise_m.map(|noise| best.fit.noise.groups[0].multiplier * noise)
}

#[cfg(test)]
mod tests {
    use super::in_doing_without;

    #[test]
    fn a_likelier_pair_without_what_is_named_says_what_may_be_there_instead() {
        let sets: [(&[usize], f64); 5] =
            [(&[7], 300.0), (&[1], 2172.0), (&[2], 2590.0), (&[1, 7], 3246.0), (&[2, 7], 3198.0)];
        assert_eq!(in_doing_without((&[2], 2590.0), &sets, 10.0), Some(1));
        // Where the likeliest pair has it, or is no likelier, nothing speaks against it.
        assert_eq!(in_doing_without((&[1], 2172.0), &sets, 10.0), None);
        assert_eq!(in_doing_without((&[2], 3240.0), &sets, 10.0), None);
    }
}
