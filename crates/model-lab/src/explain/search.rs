//! The search over effects: one, then pairs, then triples, with earlier picks looked at again.

use std::sync::Arc;

use rayon::prelude::*;
use valve_model::EffectKind;

use super::candidate::{Effort, Started, add_effect, carried_on, finished, hope, promised_gain, seen, start_effects};
use super::lack::lack_of_fit;
use super::model::{Model, is_practical, least_size, penalty, practical_kinds};
use super::view::{View, fits};
use super::{Progress, Watch, searched};
use crate::calibrate::{Settled, polished};
use crate::data::Dataset;
use crate::fit::Fit;
use crate::scatter::Scatter;

/// Fall of chi-squared (priors included, penalty taken off) from which an effect is believed. With
/// this, none of the empty campaigns tried beforehand raised an alarm.
pub const ACCEPT: f64 = 30.0;

/// A second or third effect has more competitors and rests on the first.
const ACCEPT_FURTHER: f64 = 40.0;

/// Share of what earlier effects have explained that a further one, or what is left, must be worth: no law
/// of the catalogue is a valve's own, and what is wrong with it by a hundredth or two must not be taken for
/// something else.
pub const INEXACT: f64 = 5e-4;

/// Student's t of the gains of single strokes from which they agree.
const AGREE: f64 = 2.5;

/// Gain beyond which they need not: while a second effect is missing, the first one may cost some of them.
const BEYOND_DOUBT: f64 = 1000.0;

/// Most effects that are ever combined.
const DEEPEST: usize = 3;

/// Candidates within this of the best in the rough simulation are simulated finely.
const NEAR: f64 = 60.0;

/// So many of the best are looked at again when the scatter of strokes is seen anew, if their cost is not
/// this many times that of the best.
const CONTENDERS: usize = 6;
const FAR_BEHIND: f64 = 10.0;

/// Root mean square of the residuals up to which a model is worth a closer look: it shows the scatter of
/// strokes well enough, and its optimum is wanted exactly.
const NEARLY_FITS: f64 = 3.0;

/// The same up to which what is left may be scatter seen wrongly.
const ALMOST_FITS: f64 = 1.5;

/// How often the scatter of strokes is looked at again through an accepted model, the share to which the
/// lack of fit must fall for a look to have helped, and how many looks in a row may not have.
const LOOKS: usize = 6;
const LESS: f64 = 0.8;
const PATIENCE: usize = 2;

/// Standard errors from nothing within which an effect's size is in doubt.
const UNSURE: f64 = 3.0;

/// A third effect is looked for if two leave at most this share of the misfit.
const WORTH_A_THIRD: f64 = 0.5;

/// So many candidates are fitted to the end whatever they promise.
const FOREMOST: usize = 4;

/// Times the cost of a model beyond which, simulated roughly, another cannot be as good.
const NEARLY: f64 = 1.5;

/// How many fits of one depth are carried on to the next, by depth.
const BEAM: [usize; DEEPEST] = [2, 1, 1];

/// What the search found.
#[derive(Debug, Clone)]
pub struct Found {
    /// The campaign as it was seen in the end.
    pub view: View,
    /// The accepted models: calibrated alone, then with one effect, two, three; all seen in that way.
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

/// Searches for what is missing on top of a calibrated fit. `recorded` are the data as they were recorded.
pub fn search(recorded: &Dataset, view: View, base: Fit, watch: &Watch<'_>) -> Found {
    let already: Vec<EffectKind> = base.space.effects().iter().map(valve_model::Effect::kind).collect();
    let kinds = EffectKind::ALL.iter().copied().filter(|kind| !already.contains(kind)).collect();
    let steps = vec![Model { kinds: Vec::new(), fit: base, gain: 0.0 }];
    let mut search = Search { recorded, kinds, watch, view, steps, rough_base: 0.0, singles: Vec::new() };
    search.run()
}

struct Search<'a> {
    recorded: &'a Dataset,
    kinds: Vec<EffectKind>,
    watch: &'a Watch<'a>,
    view: View,
    /// Accepted so far, simulated finely.
    steps: Vec<Model>,
    /// Score of the calibrated model, simulated roughly.
    rough_base: f64,
    /// All single effects tried on the calibrated model.
    singles: Vec<Model>,
}

impl Search<'_> {
    fn run(&mut self) -> Found {
        let mut alternatives = Vec::new();
        let mut beam = vec![self.last().clone()];
        let mut kinds = self.kinds.clone();
        let mut interrupted = false;
        let mut depth = 0;
        while let Some(carried) = BEAM.get(depth).copied() {
            let (first, others) = beam.split_at(1);
            let effort = if depth == 0 { Effort::THOROUGH } else { Effort::QUICK };
            let total = beam.len() * kinds.len();
            let needed = if depth == 0 { ACCEPT } else { ACCEPT_FURTHER.max(INEXACT * self.last().gain) };
            let first = self.tried(first, &kinds, effort, total);
            let explained = if others.is_empty() { None } else { self.explained(&first, needed) };
            let (tried, found) = explained.unwrap_or_else(|| {
                let others = self.tried(others, &kinds, Effort::STAND_IN, total);
                let mut tried = [first, others].concat();
                tried.sort_by(|a, b| b.gain.total_cmp(&a.gain));
                let found = self.found(&mut tried, needed);
                (tried, found)
            });
            interrupted |= self.watch.is_stopped();
            if depth == 0 {
                self.singles.clone_from(&tried);
            }
            alternatives.clone_from(&tried);
            if let Some(further_down) = self.further_down(&tried, found.as_ref()) {
                self.accept(further_down);
                alternatives.clone_from(&self.singles);
                let lack = self.lack(&self.last().fit);
                self.watch.tell(Progress::Accepted { kinds: self.last().kinds.clone(), lack });
                if lack < fits(&self.view.scatter) {
                    kinds = self.hints_at(self.last());
                }
                if interrupted || kinds.is_empty() {
                    break;
                }
                // What is tried on top of it is tried anew.
                beam = vec![self.last().clone()];
                continue;
            }
            let Some(best) = found else { break };
            let mut best = self.settled(&best);
            let mut lack = self.lack(&best.fit);
            if lack > fits(&self.view.scatter) && self.shows_scatter(&best, ALMOST_FITS) && !self.watch.is_stopped() {
                // What is left may be scatter that was seen through a worse model.
                let clearest = self.clearest(&best.fit, lack);
                self.look(clearest);
                best = self.settled(&best);
                lack = self.lack(&best.fit);
            }
            self.watch.tell(Progress::Accepted { kinds: best.kinds.clone(), lack });
            self.accept(best.clone());
            if let Some(found) = self.if_strokes_scatter(lack) {
                return found;
            }
            if interrupted || depth > 0 && !self.leads_somewhere(&best) {
                break;
            }
            let others: Vec<Model> = tried.into_iter().filter(|model| model.kinds != best.kinds).collect();
            if excess(&self.view.scatter, &best.fit) < ACCEPT_FURTHER.max(INEXACT * best.gain) {
                // No further effect could explain enough.
                break;
            }
            if lack < fits(&self.view.scatter) {
                kinds = self.hints_at(&best);
                beam = vec![best];
            } else {
                beam = std::iter::once(best).chain(others).take(carried).collect();
            }
            if kinds.is_empty() {
                break;
            }
            depth += 1;
        }
        let lack = self.lack(&self.last().fit);
        if self.steps.len() == 1
            && let Some(found) = self.if_strokes_scatter(lack)
        {
            return found;
        }
        Found {
            view: self.view.clone(),
            steps: self.steps.clone(),
            singles: self.singles.clone(),
            alternatives,
            lack,
            interrupted,
        }
    }

    /// What is found if strokes of which none was repeated scatter, where that explains what the calibrated model
    /// or the last accepted one leaves.
    fn if_strokes_scatter(&self, lack: f64) -> Option<Found> {
        if lack < fits(&self.view.scatter) || self.watch.is_stopped() {
            return None;
        }
        // The calibrated model is asked once, beside the first that is accepted.
        let asked = if self.steps.len() <= 2 { &self.steps[..] } else { core::slice::from_ref(self.last()) };
        let mut supposed: Vec<(&Model, Settled)> = asked
            .iter()
            .filter_map(|model| Some((model, Settled::supposed(self.recorded, &self.view.scatter, &model.fit)?)))
            .collect();
        // The likelier first: more scatter, or an effect and less of it.
        let unlikely = |(_, settled): &(&Model, Settled)| {
            settled.fit.cost + penalty(&settled.fit) + settled.scatter.ln_determinant()
        };
        supposed.sort_by(|a, b| unlikely(a).total_cmp(&unlikely(b)));
        supposed.into_iter().find_map(|(model, Settled { fit, scatter, data })| {
            self.watch.tell(Progress::Doing("what is missing if strokes differ though none was repeated"));
            let view = View::new(data, scatter);
            let base = if model.kinds.is_empty() { fit } else { view.finely(&self.steps[0].fit) };
            let found = searched(self.recorded, view, base, self.watch);
            let last = &found.steps[found.steps.len() - 1];
            (found.view.explains(&last.fit) && !found.interrupted).then_some(found)
        })
    }

    /// Puts a model behind those with fewer effects, in place of any other.
    fn accept(&mut self, model: Model) {
        if let Some(single) = self.singles.iter_mut().find(|single| single.kinds == model.kinds) {
            *single = model.clone();
        }
        self.steps.retain(|step| step.kinds.len() < model.kinds.len());
        self.steps.push(model);
    }

    /// The last accepted model from where a larger one stands whose last effect is of no use, if that leads far
    /// below both it and what was found: it was stuck.
    fn further_down(&self, tried: &[Model], found: Option<&Model>) -> Option<Model> {
        let last = self.last();
        let is_larger = |model: &&Model| {
            model.kinds.split_last().is_some_and(|(_, kinds)| !kinds.is_empty() && kinds == last.kinds)
        };
        let larger = tried.iter().filter(is_larger).find(|model| !is_practical(model, &self.view.scatter))?;
        let above = found.map_or(last.score() - ACCEPT_FURTHER, |found| found.score() + ACCEPT);
        if larger.fit.cost > above.min(last.score() - ACCEPT_FURTHER) || self.watch.is_stopped() {
            return None;
        }
        let mut start = last.fit.clone();
        start.u.copy_from_slice(&larger.fit.u[..last.fit.u.len()]);
        let fit = self.polished(self.view.finely(&start));
        let gain = self.steps[0].score() - fit.cost - penalty(&fit);
        let model = Model { kinds: last.kinds.clone(), fit, gain };
        (model.score() < above).then_some(model)
    }

    fn last(&self) -> &Model {
        &self.steps[self.steps.len() - 1]
    }

    fn lack(&self, fine: &Fit) -> f64 {
        lack_of_fit(&self.view.fine, &self.view.scatter.without_scatter(&fine.residual))
    }

    /// The best of what was tried if it is better than the last accepted model by enough; puts what was tried in
    /// order.
    fn found(&mut self, tried: &mut Vec<Model>, needed: f64) -> Option<Model> {
        self.judge(tried);
        self.without_useless(tried);
        let best = self.better(tried, needed)?;
        if !self.shows_scatter(&best, NEARLY_FITS) || self.watch.is_stopped() {
            return Some(best);
        }
        // The scatter of strokes seen through a model that fits badly is seen wrongly: seen through the better
        // one, everything is looked at again.
        self.watch.tell(Progress::Doing("the scatter of strokes seen through the better model"));
        self.look_through(&best.fit);
        self.again(tried);
        self.judge(tried);
        self.better(tried, needed)
    }

    /// The same, if that model explains the data down to the noise; otherwise nothing is changed.
    fn explained(&mut self, tried: &[Model], needed: f64) -> Option<(Vec<Model>, Option<Model>)> {
        let bound = if self.view.scatter.is_known() { ALMOST_FITS } else { NEARLY_FITS };
        tried.first().filter(|best| best.fit.normalised_rms(&self.view.scatter) < bound)?;
        let (view, steps) = (self.view.clone(), self.steps.clone());
        let mut tried = tried.to_vec();
        let found = self.found(&mut tried, needed);
        if let Some(found) = found.filter(|best| self.lack(&best.fit) < fits(&self.view.scatter)) {
            return Some((tried, Some(found)));
        }
        (self.view, self.steps) = (view, steps);
        None
    }

    /// Every effect added to every model of the beam, simulated roughly, best first; `total` are to be tried at
    /// this depth.
    fn tried(&mut self, beam: &[Model], kinds: &[EffectKind], effort: Effort, total: usize) -> Vec<Model> {
        if beam.is_empty() {
            return Vec::new();
        }
        let view = &self.view;
        let base = view.roughly(&self.steps[0].fit);
        self.rough_base = base.cost + penalty(&base);
        let rough: Vec<Model> = beam.iter().map(|model| model.with(view.roughly(&model.fit))).collect();
        let jobs: Vec<(usize, EffectKind)> = (0..rough.len())
            .flat_map(|model| kinds.iter().map(move |kind| (model, *kind)))
            .filter(|(model, kind)| !rough[*model].kinds.contains(kind))
            .collect();
        let starts: Vec<(&Fit, EffectKind)> = jobs.iter().map(|(model, kind)| (&rough[*model].fit, *kind)).collect();
        let started = start_effects(view, &starts, effort, self.watch);
        let mut started: Vec<((usize, EffectKind), Started)> =
            jobs.into_iter().zip(started).filter_map(|(job, started)| Some((job, started?))).collect();
        // Those that promise most are fitted to the end with all the data, the others with one Jacobian, and
        // from there to the end if they could still come near.
        started.sort_by(|a, b| hope(&a.1.fit).total_cmp(&hope(&b.1.fit)));
        let others = started.split_off(FOREMOST.min(started.len()));
        let mut tried = Vec::new();
        let mut add = |started: Vec<(usize, EffectKind)>, fits: Vec<Option<Fit>>| {
            for ((model, kind), fit) in started.into_iter().zip(fits) {
                let Some(fit) = fit else { continue };
                let kinds: Vec<EffectKind> = rough[model].kinds.iter().copied().chain([kind]).collect();
                self.watch.tell(Progress::Tried { depth: kinds.len(), total, kind, cost: fit.cost });
                let gain = self.rough_base - fit.cost - penalty(&fit);
                tried.push(Model { kinds, fit, gain });
            }
        };
        let foremost = finished(view, started.iter().map(|(_, started)| started), effort);
        let least = foremost.iter().flatten().map(|fit| fit.cost).fold(f64::INFINITY, f64::min);
        add(started.iter().map(|(job, _)| *job).collect(), foremost);
        let beside: Vec<_> = others.iter().map(|((model, _), started)| (&rough[*model].fit, started)).collect();
        let seen = seen(view, &beside);
        let (hopeful, behind): (Vec<_>, Vec<_>) = others
            .iter()
            .zip(seen)
            .filter_map(|((job, _), fit)| Some((*job, fit?)))
            .partition(|(_, fit)| hope(fit) < NEAR + least && !self.watch.is_stopped());
        let (jobs, fits): (Vec<_>, Vec<Fit>) = hopeful.into_iter().unzip();
        add(jobs, carried_on(view, &fits, effort));
        // Of those that stay behind, only where they came to is wanted.
        let place = |fit: Fit| Fit { jacobian: Arc::default(), ..fit };
        let (jobs, fits): (Vec<_>, Vec<Option<Fit>>) =
            behind.into_iter().map(|(job, fit)| (job, Some(place(fit)))).unzip();
        add(jobs, fits);
        tried.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        tried
    }

    /// Simulates the best ones finely and puts them in order; the others stay behind them.
    fn judge(&self, tried: &mut [Model]) {
        let Some(best) = tried.first() else { return };
        let base = self.steps[0].score();
        let finely = |model: &Model| {
            let fit = self.view.finely(&model.fit);
            let gain = base - fit.cost - penalty(&fit);
            Model { kinds: model.kinds.clone(), fit, gain }
        };
        let fine = finely(best);
        // The rough simulation may be off by as much for the others.
        let off = (fine.gain - best.gain).abs();
        let near = tried.iter().take_while(|model| best.gain - model.gain < NEAR + 2.0 * off).count();
        let rest: Vec<Model> = tried[1..near].par_iter().map(finely).collect();
        tried[0] = fine;
        tried[1..near].clone_from_slice(&rest);
        tried[..near].sort_by(|a, b| b.gain.total_cmp(&a.gain));
        prefer_special_case(tried);
    }

    /// Where the best model has an effect of no use beside others, tries those others alone: what was found
    /// first may have led to them.
    fn without_useless(&self, tried: &mut Vec<Model>) {
        let Some(best) = tried.first() else { return };
        let kinds = practical_kinds(best, &self.view.scatter);
        let known = tried.iter().chain(&self.steps).any(|model| model.kinds == kinds);
        if kinds.len() < 2 || kinds.len() == best.kinds.len() || known || self.watch.is_stopped() {
            return;
        }
        let built = built(&self.view, &self.steps[0].fit, &self.singles, &kinds, self.watch);
        if let Some(fit) = built.map(|fit| self.view.finely(&fit)) {
            let gain = self.steps[0].score() - fit.cost - penalty(&fit);
            tried.push(Model { kinds, fit, gain });
            tried.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        }
    }

    /// The best model if it is better than the last accepted one by enough.
    fn better(&self, tried: &[Model], needed: f64) -> Option<Model> {
        let best = tried.iter().find(|model| is_practical(model, &self.view.scatter))?;
        let gain = self.last().score() - best.score();
        let agreed = gain > BEYOND_DOUBT || self.agreement(best) >= AGREE;
        (gain >= needed && agreed).then(|| best.clone())
    }

    /// Student's t of the gains of the single strokes over the last accepted model: a few strokes that
    /// were odd in themselves gain much, and the others nothing.
    fn agreement(&self, model: &Model) -> f64 {
        let View { fine, scatter, .. } = &self.view;
        let before = scatter.dot_by_unit(fine, &self.last().fit.residual);
        let after = scatter.dot_by_unit(fine, &model.fit.residual);
        let gains: Vec<f64> = before.iter().zip(&after).map(|(before, after)| before - after).collect();
        let count = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / count;
        let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        mean / (variance / count).sqrt().max(1e-12)
    }

    /// Whether strokes are repeated and a model is near enough to them to show how they scatter.
    fn shows_scatter(&self, model: &Model, rms: f64) -> bool {
        self.view.scatter.is_known() && model.fit.normalised_rms(&self.view.scatter) < rms
    }

    /// Sees the scatter through a better model, and the accepted models with that scatter.
    fn look_through(&mut self, model: &Fit) {
        self.look(self.view.through(self.recorded, model));
    }

    /// Looks again and again through a model that leaves this lack of fit; the view that leaves least. Where
    /// strokes are sensitive to what scatters, a look can be worse than the one before and lead to a better one.
    fn clearest(&self, model: &Fit, mut least: f64) -> View {
        let mut clearest = self.view.clone();
        // Anew: nothing of what worse models made of the strokes.
        let mut view = View::new(self.recorded.clone(), self.view.scatter.seen_through(self.recorded, model));
        let mut fit = model.clone();
        let mut in_vain = 0;
        for _ in 0..LOOKS {
            view = view.through(self.recorded, &fit);
            fit = view.finely(&fit);
            let lack = lack_of_fit(&view.fine, &view.scatter.without_scatter(&fit.residual));
            in_vain = if lack > LESS * least { in_vain + 1 } else { 0 };
            if lack < least {
                (least, clearest) = (lack, view.clone());
            }
            if lack < fits(&view.scatter) || in_vain > PATIENCE || self.watch.is_stopped() {
                break;
            }
        }
        clearest
    }

    /// Sees the accepted models in another way.
    fn look(&mut self, view: View) {
        self.view = view;
        for step in &mut self.steps {
            step.fit = self.view.finely(&step.fit);
        }
        let base = self.steps[0].score();
        for step in &mut self.steps {
            step.gain = base - step.score();
        }
    }

    /// Carries the best models on with the scatter as it is seen now.
    fn again(&mut self, tried: &mut [Model]) {
        let view = &self.view;
        let base = view.roughly(&self.steps[0].fit);
        self.rough_base = base.cost + penalty(&base);
        let least = tried.iter().map(|model| model.fit.cost).fold(f64::INFINITY, f64::min);
        let contends = |model: &Model| model.fit.cost < FAR_BEHIND * least;
        let count = tried.iter().take(CONTENDERS).take_while(|model| contends(model)).count();
        tried[..count].par_iter_mut().for_each(|model| {
            model.fit = view.roughly(&model.fit);
            model.gain = self.rough_base - model.score();
        });
        tried.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    }

    /// A model at its optimum, without what its last effect has made needless, with the earlier ones found
    /// anew.
    fn settled(&self, model: &Model) -> Model {
        let mut best = model.with(self.polished(model.fit.clone()));
        for dropped in 0..best.kinds.len().saturating_sub(1) {
            if self.watch.is_stopped() || dropped + 1 >= best.kinds.len() {
                break;
            }
            let mut kinds = best.kinds.clone();
            let kind = kinds.remove(dropped);
            let Some(without) = built(&self.view, &self.steps[0].fit, &self.singles, &kinds, self.watch) else {
                continue;
            };
            // Only one that comes near has to be simulated finely.
            let near = (without.cost < NEARLY * best.fit.cost).then(|| self.view.finely(&without));
            for fit in near.into_iter().chain(self.where_it_stands(&best, kind, &without)) {
                let smaller = Model { kinds: kinds.clone(), fit, gain: 0.0 };
                if smaller.score() < best.score() + ACCEPT {
                    return self.settled(&smaller);
                }
            }
            if self.lack(&best.fit) > fits(&self.view.scatter) {
                let anew = add_effect(&self.view, &without, kind, Effort::THOROUGH, self.watch)
                    .map(|fit| self.polished(self.view.finely(&fit)));
                if let Some(anew) = anew.filter(|anew| anew.cost < best.fit.cost) {
                    kinds.push(kind);
                    best = Model { kinds, fit: anew, gain: 0.0 };
                }
            }
        }
        best.gain = self.steps[0].score() - best.score();
        best
    }

    /// The fit without one of the effects of a model from where that model stands, if it is not sure of that
    /// effect: the others alone may have been stuck. `without` has the space of such a fit.
    fn where_it_stands(&self, model: &Model, dropped: EffectKind, without: &Fit) -> Option<Fit> {
        let size = model.fit.space.effect_coordinates(dropped)[0];
        if model.fit.u[size].abs() > UNSURE * model.fit.sigma(size) {
            return None;
        }
        let mut start = without.clone();
        let base = self.steps[0].fit.u.len();
        start.u[..base].copy_from_slice(&model.fit.u[..base]);
        for kind in model.kinds.iter().filter(|kind| **kind != dropped) {
            let (to, from) = (start.space.effect_coordinates(*kind), model.fit.space.effect_coordinates(*kind));
            for (to, from) in to.into_iter().zip(from) {
                start.u[to] = model.fit.u[from];
            }
        }
        Some(self.view.finely(&start))
    }

    /// A fit with its optimum made exact, if it is worth it.
    fn polished(&self, fit: Fit) -> Fit {
        let View { fine, scatter, .. } = &self.view;
        if fit.normalised_rms(scatter) < NEARLY_FITS { polished(fine, scatter, fit) } else { fit }
    }

    /// Whether a model with several effects explains a good part of what the calibrated one does not.
    fn leads_somewhere(&self, model: &Model) -> bool {
        let above_noise = |model: &Model| model.fit.cost - model.fit.residual.len() as f64;
        above_noise(model) < WORTH_A_THIRD * above_noise(&self.steps[0])
    }

    /// The effects of which a first-order look promises a believable gain on top of a model that fits.
    fn hints_at(&self, model: &Model) -> Vec<EffectKind> {
        let View { fine, scatter, .. } = &self.view;
        let promised = |kind: EffectKind| promised_gain(fine, scatter, &model.fit, kind, least_size(kind));
        let others = self.kinds.par_iter().copied().filter(|kind| !model.kinds.contains(kind));
        others.filter(|kind| promised(*kind) > ACCEPT_FURTHER).collect()
    }
}

/// A solenoid that is late by the same time in either direction does what a clock does that is off, with
/// two parameters more; they need as much evidence as an effect.
fn prefer_special_case(tried: &mut [Model]) {
    let Some((EffectKind::SolenoidLag, rest)) =
        tried.first().and_then(|best| best.kinds.split_last()).map(|(k, r)| (*k, r))
    else {
        return;
    };
    let enough = tried[0].gain - ACCEPT;
    let is_special = |model: &Model| {
        model.gain > enough
            && model.kinds.split_last().is_some_and(|(kind, others)| *kind == EffectKind::ClockOffset && others == rest)
    };
    if let Some(index) = tried.iter().position(is_special) {
        tried[..=index].rotate_right(1);
    }
}

/// Excess of chi-squared over its expectation, scatter of strokes taken out.
pub fn excess(scatter: &Scatter, fit: &Fit) -> f64 {
    scatter.without_scatter(&fit.residual).iter().map(|value| value * value - 1.0).sum()
}

/// The calibrated model with some effects, simulated roughly: one alone as it was found, more are added one
/// after the other.
pub fn built(view: &View, calibrated: &Fit, singles: &[Model], kinds: &[EffectKind], watch: &Watch<'_>) -> Option<Fit> {
    let (first, others) = kinds.split_first()?;
    let single = singles.iter().find(|model| model.kinds == [*first]);
    let mut fit = match single {
        Some(single) => view.roughly(&single.fit),
        None => add_effect(view, &view.roughly(calibrated), *first, Effort::QUICK, watch)?,
    };
    for kind in others {
        fit = add_effect(view, &fit, *kind, Effort::QUICK, watch)?;
    }
    Some(fit)
}
