//! Effects that the data cannot tell from a recommended one.

use rayon::prelude::*;
use valve_model::EffectKind;

use super::Watch;
use super::candidate::{Effort, add_effect};
use super::search::{Found, Model, build};
use crate::data::Dataset;
use crate::scatter::Scatter;

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
pub fn twins(data: &Dataset, scatter: &Scatter, found: &Found, watch: &Watch<'_>) -> Vec<Vec<Twin>> {
    let best = &found.steps[found.steps.len() - 1];
    best.kinds.iter().map(|kind| stand_ins(data, scatter, found, best, *kind, watch)).collect()
}

fn stand_ins(
    data: &Dataset,
    scatter: &Scatter,
    found: &Found,
    best: &Model,
    replaced: EffectKind,
    watch: &Watch<'_>,
) -> Vec<Twin> {
    let others: Vec<EffectKind> = best.kinds.iter().copied().filter(|kind| *kind != replaced).collect();
    let tried: Vec<Model> = if others.is_empty() {
        found.singles.clone()
    } else {
        let Some(rest) = build(data, scatter, &found.steps[0], &others) else { return Vec::new() };
        let already: Vec<EffectKind> = rest.space.effects().iter().map(valve_model::Effect::kind).collect();
        EffectKind::ALL
            .par_iter()
            .filter(|kind| **kind != replaced && !already.contains(kind) && !watch.is_stopped())
            .filter_map(|kind| {
                let fit = add_effect(data, scatter, &rest, *kind, Effort::QUICK)?;
                let kinds = others.iter().copied().chain([*kind]).collect();
                Some(Model { kinds, fit })
            })
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
