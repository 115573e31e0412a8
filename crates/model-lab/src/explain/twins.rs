//! Effects that the data cannot tell from a recommended one.

use rayon::prelude::*;
use valve_model::EffectKind;

use super::Watch;
use super::candidate::{Effort, finished, hope, start_effects};
use super::model::Model;
use super::search::{Found, built};

/// Candidates whose cost is within this of the best (in chi-squared) cannot be told from it.
pub const TWIN: f64 = 10.0;

/// An effect in place of a recommended one, with everything refitted.
#[derive(Debug, Clone)]
pub struct Twin {
    /// The effect in its place.
    pub kind: EffectKind,
    /// How much worse the data are explained (chi-squared, priors and penalty included).
    pub behind: f64,
    /// The model with it.
    pub model: Model,
}

/// For each recommended effect the ones that could stand in its place, best first.
pub fn twins(found: &Found, watch: &Watch<'_>) -> Vec<Vec<Twin>> {
    let best = &found.steps[found.steps.len() - 1];
    best.kinds.iter().map(|kind| stand_ins(found, best, *kind, watch)).collect()
}

fn stand_ins(found: &Found, best: &Model, replaced: EffectKind, watch: &Watch<'_>) -> Vec<Twin> {
    let others: Vec<EffectKind> = best.kinds.iter().copied().filter(|kind| *kind != replaced).collect();
    // The last effect was found among others beside the same ones.
    let beside_the_same = |model: &&Model| model.kinds.split_last().is_some_and(|(_, rest)| rest == others);
    let tried: Vec<Model> = if others.is_empty() {
        found.singles.clone()
    } else if found.alternatives.iter().filter(beside_the_same).count() > 1 {
        found.alternatives.iter().filter(beside_the_same).cloned().collect()
    } else {
        let view = &found.view;
        let rough = view.roughly(&best.fit);
        let roughly_best = best.score() - best.fit.cost + rough.cost;
        let off = 30.0 + (rough.cost - best.fit.cost).abs();
        let calibrated = &found.steps[0].fit;
        let Some(rest) = built(view, calibrated, &found.singles, &others, watch) else { return Vec::new() };
        let already: Vec<EffectKind> = rest.space.effects().iter().map(valve_model::Effect::kind).collect();
        let bar = roughly_best + TWIN + 2.0 * off;
        let elsewhere = view.impression.least_elsewhere(&view.rough, &rough);
        let kinds: Vec<EffectKind> =
            EffectKind::ALL.iter().copied().filter(|kind| *kind != replaced && !already.contains(kind)).collect();
        let start = |kinds: &[EffectKind], effort| {
            let jobs: Vec<_> = kinds.iter().map(|kind| (&rest, *kind)).collect();
            let started = start_effects(view, &jobs, effort, watch);
            kinds.iter().copied().zip(started).filter_map(|(kind, started)| Some((kind, started?))).collect::<Vec<_>>()
        };
        let glances = start(&kinds, Effort::GLANCE);
        let hopeful: Vec<EffectKind> =
            glances.iter().filter(|(_, glance)| hope(&glance.fit) + elsewhere < bar).map(|(kind, _)| *kind).collect();
        let started = start(&hopeful, Effort::STAND_IN);
        let fits = finished(view, started.iter().map(|(_, started)| started), Effort::STAND_IN);
        started
            .par_iter()
            .zip(fits)
            .filter_map(|((kind, _), fit)| {
                let kinds = others.iter().copied().chain([*kind]).collect();
                Some(Model { kinds, fit: fit?, gain: 0.0 })
            })
            // Only those that come close need to be simulated finely.
            .filter(|model| model.score() < bar)
            .map(|model| Model { fit: view.finely(&model.fit), ..model })
            .collect()
    };
    let mut twins: Vec<Twin> = tried
        .into_iter()
        .filter(|model| !model.kinds.contains(&replaced))
        .filter_map(|model| {
            let kind = *model.kinds.last()?;
            let behind = model.score() - best.score();
            (behind < TWIN).then_some(Twin { kind, behind, model })
        })
        .collect();
    twins.sort_by(|a, b| a.behind.total_cmp(&b.behind));
    twins
}
