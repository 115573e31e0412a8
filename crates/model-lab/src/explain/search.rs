//! The search over effects: one, then pairs, then triples, with earlier picks looked at again.

use rayon::prelude::*;
use valve_model::EffectKind;
use valve_model::effects::ActsOn;

use super::candidate::{Effort, add_effect};
use super::lack::lack_of_fit;
use super::{Progress, Watch};
use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, fit};
use crate::scatter::Scatter;
use crate::space::Target;

/// Fall of chi-squared (priors included, penalty taken off) from which an effect is believed. With
/// this, none of the empty campaigns tried beforehand raised an alarm.
pub const ACCEPT: f64 = 30.0;

/// A second or third effect has more competitors and rests on the first.
const ACCEPT_FURTHER: f64 = 40.0;

/// Penalty for each free parameter beyond an effect's first; shape parameters have priors of their own.
const PENALTY: f64 = 6.0;

/// Lack of fit, in standard deviations of noise, below which nothing more is looked for.
pub const FITS: f64 = 5.0;

/// The same where strokes scatter: what the scatter's few directions leave is not quite noise.
const FITS_SCATTERED: f64 = 12.0;

/// Lack of fit below which nothing more is looked for.
pub fn fits(scatter: &Scatter) -> f64 {
    if scatter.is_known { FITS_SCATTERED } else { FITS }
}

/// Most effects that are ever combined.
const DEEPEST: usize = 3;

/// How many fits of one depth are carried on to the next, by depth.
const BEAM: [usize; DEEPEST] = [2, 1, 1];

/// The least size of an effect that is of any use, in typical sizes.
const LEAST_SIZE: f64 = 0.01;

/// The same for effects that only shift a stroke in time: half a millisecond or so, below which the
/// model's own accuracy ends.
const LEAST_DELAY: f64 = 0.035;

/// A set of effects and the fit with them.
#[derive(Debug, Clone)]
pub struct Model {
    /// The effects added, in the order they were found.
    pub kinds: Vec<EffectKind>,
    /// Everything refitted with them.
    pub fit: Fit,
}

impl Model {
    /// The cost with the penalty for its parameters.
    pub fn score(&self) -> f64 {
        self.fit.cost + penalty(&self.fit)
    }
}

/// Whether every effect of a model is large enough to be of use.
fn is_practical(model: &Model) -> bool {
    model.kinds.iter().all(|kind| {
        let timing = matches!(kind.info().acts_on, ActsOn::Solenoid | ActsOn::Measurement);
        let coordinates = model.fit.space.effect_coordinates(*kind);
        let sizes = if *kind == EffectKind::SolenoidLag { &coordinates[..] } else { &coordinates[..1] };
        let size = sizes.iter().map(|index| model.fit.u[*index].abs()).fold(0.0, f64::max);
        *kind == EffectKind::OrificeLaw || size > if timing { LEAST_DELAY } else { LEAST_SIZE }
    })
}

/// The penalty for the parameters of the effects in a fit.
fn penalty(fit: &Fit) -> f64 {
    let free = fit
        .space
        .coordinates
        .iter()
        .filter(|coordinate| !matches!(coordinate.target, Target::Base(_)))
        .map(|coordinate| if coordinate.prior.is_some() { 0.5 } else { 1.0 });
    PENALTY * (free.sum::<f64>() - added(fit) as f64)
}

fn added(fit: &Fit) -> usize {
    let moves =
        |slot: usize| fit.space.coordinates.iter().any(|c| matches!(c.target, Target::Effect(s, _) if s == slot));
    (0..fit.space.effects().len()).filter(|slot| moves(*slot)).count()
}

/// What the search found.
#[derive(Debug, Clone)]
pub struct Found {
    /// The accepted models: calibrated alone, then with one effect, two, three.
    pub steps: Vec<Model>,
    /// All single effects tried on the calibrated model.
    pub singles: Vec<Model>,
    /// All effects tried on top of the accepted ones but the last.
    pub alternatives: Vec<Model>,
    /// Lack of fit of the last accepted model.
    pub lack: f64,
    /// Whether the search was cut short.
    pub interrupted: bool,
}

impl Found {
    /// The single effects that came closest.
    pub fn contenders(&self, count: usize) -> Vec<EffectKind> {
        self.singles.iter().take(count).flat_map(|model| &model.kinds).copied().collect()
    }
}

/// What a search looks at.
#[derive(Debug, Clone, Copy)]
pub struct Scope<'a> {
    /// The effects tried as the first one.
    pub first: &'a [EffectKind],
    /// Most effects that are combined.
    pub deepest: usize,
}

impl Scope<'_> {
    /// The whole catalogue, up to three effects.
    pub const ALL: Self = Self { first: EffectKind::ALL, deepest: DEEPEST };
}

/// Searches for what is missing on top of a calibrated fit.
pub fn search(data: &Dataset, scatter: &Scatter, base: Fit, scope: Scope<'_>, watch: &Watch<'_>) -> Found {
    let already: Vec<EffectKind> = base.space.effects().iter().map(valve_model::Effect::kind).collect();
    let kinds: Vec<EffectKind> = EffectKind::ALL.iter().copied().filter(|kind| !already.contains(kind)).collect();
    let base = Model { kinds: Vec::new(), fit: base };
    let mut steps = vec![base.clone()];
    let mut singles = Vec::new();
    let mut alternatives = Vec::new();
    let mut beam = vec![base];
    let mut interrupted = false;
    for (depth, carried) in BEAM.into_iter().enumerate().take(scope.deepest) {
        let effort = if depth == 0 { Effort::THOROUGH } else { Effort::QUICK };
        let jobs: Vec<(usize, EffectKind)> = (0..beam.len())
            .flat_map(|model| kinds.iter().map(move |kind| (model, *kind)))
            .filter(|(model, kind)| !beam[*model].kinds.contains(kind))
            .filter(|(_, kind)| depth > 0 || scope.first.contains(kind))
            .collect();
        let total = jobs.len();
        let mut tried: Vec<Model> = jobs
            .par_iter()
            .filter_map(|(model, kind)| {
                if watch.is_stopped() {
                    return None;
                }
                let fit = add_effect(data, scatter, &beam[*model].fit, *kind, effort)?;
                let mut kinds = beam[*model].kinds.clone();
                kinds.push(*kind);
                watch.tell(Progress::Tried { depth: depth + 1, total, kind: *kind, cost: fit.cost });
                Some(Model { kinds, fit })
            })
            .collect();
        interrupted |= watch.is_stopped();
        tried.sort_by(|a, b| a.score().total_cmp(&b.score()));
        if depth == 0 {
            singles.clone_from(&tried);
        }
        let current = &steps[steps.len() - 1];
        let Some(mut best) = tried.iter().find(|model| is_practical(model)).cloned() else { break };
        let gain = current.score() - best.score();
        if gain < if depth == 0 { ACCEPT } else { ACCEPT_FURTHER } {
            alternatives.clone_from(&tried);
            break;
        }
        // Polish, and drop what the new effect has made needless.
        best = polished(data, scatter, &best);
        let count = best.kinds.len();
        best = without_needless(data, scatter, best, &steps[0]);
        if best.kinds.len() < count {
            best = polished(data, scatter, &best);
        }
        let lack = lack_of_fit(data, &scatter.without_scatter(&best.fit.residual));
        watch.tell(Progress::Accepted { kinds: best.kinds.clone(), lack });
        alternatives.clone_from(&tried);
        steps.retain(|step| step.kinds.len() < best.kinds.len());
        steps.push(best.clone());
        if interrupted || lack < fits(scatter) && !hints_at_more(data, scatter, &best, &kinds) {
            break;
        }
        let width = if lack < fits(scatter) { 1 } else { carried };
        beam = std::iter::once(best.clone())
            .chain(tried.into_iter().filter(|model| model.kinds != best.kinds))
            .take(width)
            .collect();
    }
    let last = &steps[steps.len() - 1];
    let lack = lack_of_fit(data, &scatter.without_scatter(&last.fit.residual));
    Found { steps, singles, alternatives, lack, interrupted }
}

fn polished(data: &Dataset, scatter: &Scatter, model: &Model) -> Model {
    let fit = fit(
        data,
        scatter,
        &model.fit.space,
        &model.fit.u,
        FitOptions { steps: 25, stall: 1e-3, ..FitOptions::default() },
    );
    match fit {
        Some(fit) if fit.cost < model.fit.cost => Model { kinds: model.kinds.clone(), fit },
        _ => model.clone(),
    }
}

/// Removes effects without which the fit is as good, refitting from the calibrated model.
fn without_needless(data: &Dataset, scatter: &Scatter, model: Model, base: &Model) -> Model {
    if model.kinds.len() < 2 {
        return model;
    }
    for dropped in 0..model.kinds.len() - 1 {
        let kinds: Vec<EffectKind> =
            model.kinds.iter().enumerate().filter(|(index, _)| *index != dropped).map(|(_, kind)| *kind).collect();
        if let Some(fit) = build(data, scatter, base, &kinds) {
            let smaller = Model { kinds, fit };
            if smaller.score() < model.score() + ACCEPT {
                return without_needless(data, scatter, smaller, base);
            }
        }
    }
    model
}

/// Adds effects one after the other.
pub fn build(data: &Dataset, scatter: &Scatter, base: &Model, kinds: &[EffectKind]) -> Option<Fit> {
    let mut fit = base.fit.clone();
    for kind in kinds {
        fit = add_effect(data, scatter, &fit, *kind, Effort::QUICK)?;
    }
    Some(fit)
}

/// Whether a first-order look promises a believable gain for any further effect.
fn hints_at_more(data: &Dataset, scatter: &Scatter, model: &Model, kinds: &[EffectKind]) -> bool {
    kinds
        .par_iter()
        .filter(|kind| !model.kinds.contains(kind))
        .any(|kind| super::candidate::promised_gain(data, scatter, &model.fit, *kind) > ACCEPT_FURTHER)
}
