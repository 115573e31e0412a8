//! Which effects a model needs: a search over sets of candidates, every set judged by its evidence.
//!
//! The search goes forward and, at every step, back (sequential floating selection: Pudil, Novovičová and Kittler,
//! Pattern Recognition Letters 15(11), 1994), and in the end exchanges one effect for another. Sets race one
//! another: all get a little work, the better half more, the best are fitted to the end (successive halving: Jamieson
//! and Talwalkar, AISTATS 2016). Each starts cold, at the prior means, and warm, from the set it grew out of, because a
//! calibrated fit has buried what is missing in its parameters.

mod family;
mod foreseen;
mod options;
mod race;
mod rivals;

use std::collections::BTreeMap;

use rayon::prelude::*;

pub use family::{Family, Level, Model, News, Set};
pub use options::{BY_CHANCE, SelectOptions};

use self::race::{best_start, settling};
use crate::fit::{Fit, FitOptions, fit};
use crate::held_out::{OwnFits, folds, held_out};
use crate::left::{excess, left_nats, left_to_explain, normalised_rms};
use crate::noise::Noise;
use crate::problem::{Problem, Scope};

/// What a search found.
#[derive(Debug)]
pub struct Selection<P> {
    /// From the empty set to the accepted one, step by step.
    pub steps: Vec<Set>,
    /// All sets that were fitted, in the order of the sets.
    pub models: Vec<Model<P>>,
    /// Whether it was cut short.
    pub interrupted: bool,
}

impl<P: Problem> Selection<P> {
    /// A set that was fitted, as exactly as it was.
    pub fn model(&self, set: &[usize]) -> Option<&Model<P>> {
        let of_set = || self.models.iter().filter(|model| model.set == set);
        let at = |level: Level| of_set().find(|model| model.level == level);
        at(Level::High).or_else(|| at(Level::Low)).or_else(|| at(Level::Screen))
    }

    /// The set that was accepted.
    pub fn accepted(&self) -> &[usize] {
        self.steps.last().map_or(&[], |set| set.as_slice())
    }

    /// Gain of evidence of a set over the empty one at the same level, nats.
    pub fn gain(&self, model: &Model<P>) -> f64 {
        let base = self.models.iter().find(|one| one.set.is_empty() && one.level == model.level);
        base.map_or(f64::NAN, |base| model.fit.log_evidence - base.fit.log_evidence)
    }
}

/// The empty set as every search begins with it: cheaply, from where fits start that know nothing, and from there as it is
/// reported; nothing where it cannot be fitted, or where somebody asked to stop before it was.
pub fn base<F: Family>(family: &F) -> Option<[Model<F::Member>; 2]> {
    let low = base_at(family, Level::Low, None)?;
    let high = base_at(family, Level::High, Some(&low))?;
    Some([low, high])
}

/// The values of the empty set are told to people: half a nat short of the optimum is one standard deviation beside it.
const TOLD_TOLERANCE: f64 = 0.02;

fn base_at<F: Family>(family: &F, level: Level, from: Option<&Model<F::Member>>) -> Option<Model<F::Member>> {
    let problem = family.member(&[], level)?;
    let starts = match from {
        Some(from) => vec![family.carried(&from.problem, &from.fit.u, &problem)],
        None => promising(family, &[], &problem)?,
    };
    let mut options = if from.is_none() { family.options().from_nowhere() } else { family.options() };
    if level == Level::High {
        options = FitOptions { tolerance: options.tolerance.min(TOLD_TOLERANCE), ..options.exact() };
    }
    let fits: Vec<Fit> = starts.par_iter().filter_map(|start| fit(&problem, start, &options)).collect();
    // The first start is the one that everybody expects: another is taken where that one is stuck.
    let most = fits.iter().map(|fit| fit.log_evidence).fold(f64::NEG_INFINITY, f64::max);
    let fit = fits.into_iter().find(|fit| fit.log_evidence > most - BY_CHANCE)?;
    let fit = if level == Level::Low { freed(&problem, fit, &options) } else { fit };
    let hold_out = || held_out(&problem, &fit, &folds(&problem), &options, OwnFits::WhereShort);
    let held_out = (level == Level::High).then(hold_out).flatten();
    Some(Model { set: Vec::new(), level, problem, fit, held_out })
}

/// From more starts than these a set is looked at on a few of the records, and fitted to all from the best.
const FEW_STARTS: usize = 3;

/// Derivatives of such a look, before and after the errors' sizes are free.
const LOOKED_AT: [usize; 2] = [6, 4];

/// Where fits of a set start that know nothing.
fn promising<F: Family>(family: &F, set: &[usize], problem: &F::Member) -> Option<Vec<Vec<f64>>> {
    let starts = family.cold(problem);
    if starts.len() <= FEW_STARTS {
        return Some(starts);
    }
    let screen = family.member(set, Level::Screen)?;
    let best = look(family, &screen)?;
    Some(vec![family.carried(&screen, &best.u, problem)])
}

/// A first look at a set: a short fit from each start that knows nothing, the best of which is freed.
pub fn look<F: Family>(family: &F, screen: &F::Member) -> Option<Fit> {
    let options = FitOptions { annealed: LOOKED_AT[0], settled: LOOKED_AT[1], ..family.options().from_nowhere() };
    let fits = family.cold(screen).into_par_iter().filter_map(|start| fit(screen, &start, &options));
    let best = fits.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
    Some(freed(screen, best, &options))
}

/// So often a fit is begun again whose records hold their own coordinates at bounds.
const FREED: usize = 3;

/// A fit, begun again with what belongs to single records at the prior means while some of that ended at its bounds: on the way
/// there it had made up for parameters that have become right since, and holds them where it is.
fn freed(problem: &dyn Problem, mut best: Fit, options: &FitOptions) -> Fit {
    let is_own = |index: usize| problem.coordinates()[index].scope != Scope::Shared;
    for _ in 0..FREED {
        if !(0..best.u.len()).any(|index| is_own(index) && best.held[index]) || problem.stop().is_asked() {
            break;
        }
        let coordinates = problem.coordinates().iter().zip(&best.u);
        let start: Vec<f64> = coordinates.map(|(c, u)| if c.scope == Scope::Shared { *u } else { c.mean }).collect();
        let options = FitOptions { known: None, ..settling(options.settled, options.clone()) };
        match fit(problem, &start, &options) {
            Some(again) if again.log_evidence > best.log_evidence => best = again,
            _ => break,
        }
    }
    best
}

/// Fits a set from the empty set's optimum, and knowing nothing; the better one. The way of a search may end in a valley beside the
/// best one, and what is told must not depend on it.
pub fn afresh<F: Family>(family: &F, set: &[usize], base: &Model<F::Member>) -> Option<(F::Member, Fit)> {
    ended_afresh(family, &begun_afresh(family, set, base, true)?)
}

/// The better one of both starts, cheaply. What knows nothing starts where a first look from everywhere ends, or from the likeliest
/// of its starts.
fn begun_afresh<F: Family>(
    family: &F,
    set: &[usize],
    base: &Model<F::Member>,
    from_everywhere: bool,
) -> Option<Model<F::Member>> {
    let (set, level) = (set.to_vec(), Level::Low);
    let problem = family.member(&set, level)?;
    let warm = best_start(&problem, family.warm(&problem, &base.problem, &base.fit.u));
    let cold = if from_everywhere {
        promising(family, &set, &problem)?
    } else {
        best_start(&problem, family.cold(&problem)).into_iter().collect()
    };
    let warm = warm.map(|start| (start, family.options()));
    let cold = cold.into_iter().map(|start| (start, family.options().from_nowhere()));
    let starts: Vec<(Vec<f64>, FitOptions)> = warm.into_iter().chain(cold).collect();
    let fits = starts.par_iter().filter_map(|(start, options)| fit(&problem, start, options));
    let fit = fits.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
    Some(Model { set, level, problem, fit, held_out: None })
}

/// As exactly as it is reported, from there.
fn ended_afresh<F: Family>(family: &F, begun: &Model<F::Member>) -> Option<(F::Member, Fit)> {
    let problem = family.member(&begun.set, Level::High)?;
    let start = family.carried(&begun.problem, &begun.fit.u, &problem);
    let options = continued(family, begun, family.options().exact());
    let fit = fit(&problem, &start, &options)?;
    Some(finer_until_it_ends(family, (problem, fit)))
}

/// Goes on more exactly while a fit has ended that still promises more: what is rough about a prediction, such as a piston that
/// sticks and slips, hides which way a valley goes, and with it the bounds of what is known.
fn finer_until_it_ends<F: Family>(family: &F, mut at: (F::Member, Fit)) -> (F::Member, Fit) {
    while let Some(next) = finer(family, &at.0, &at.1) {
        at = next;
    }
    at
}

/// A fit that ended before it was done goes on with the same problem predicted more exactly; nothing where it was done, or is
/// as exact as it can be.
fn finer<F: Family>(family: &F, problem: &F::Member, found: &Fit) -> Option<(F::Member, Fit)> {
    if found.predicted_gain <= found.tolerance {
        return None;
    }
    let problem = family.finer(problem)?;
    let base = family.options().exact();
    let options = FitOptions { known: Some(found.noise.clone()), ..settling(base.settled, base) };
    let fit = fit(&problem, &found.u, &options)?;
    Some((problem, fit))
}

/// How a fit goes on as exactly as those that decide from where a cheap one ended: what is free in the end only needs a phase
/// that is annealed.
fn continued<F: Family>(family: &F, cheap: &Model<F::Member>, options: FitOptions) -> FitOptions {
    if cheap.fit.converged && late_shapes(family, &cheap.set) == 0 {
        FitOptions { known: Some(cheap.fit.noise.clone()), ..settling(options.settled, options) }
    } else {
        options
    }
}

/// How many shapes of a set are free only in a fit as exact as those that decide.
fn late_shapes<F: Family>(family: &F, set: &[usize]) -> usize {
    let free = |level| family.member(set, level).map_or(0, |member| member.coordinates().len());
    free(Level::High).saturating_sub(free(Level::Low))
}

/// Searches a family for the effects that records need; nothing where not even the empty set can be fitted, or where somebody
/// asked to stop before it was.
pub fn select<F: Family>(family: &F, options: &SelectOptions) -> Option<Selection<F::Member>> {
    let mut search = Search {
        family,
        options,
        models: BTreeMap::new(),
        begun: f64::NAN,
        looked_at: Vec::new(),
        screened: BTreeMap::new(),
        reduced: BTreeMap::new(),
        afresh: Vec::new(),
    };
    for model in base(family)? {
        if model.level == Level::Low {
            search.begun = model.fit.log_evidence;
        }
        search.models.insert((Vec::new(), model.level), model);
    }
    let mut steps: Vec<Set> = vec![Vec::new()];
    loop {
        let at = steps[steps.len() - 1].clone();
        if at.len() >= options.most || family.stop().is_asked() || search.is_explained(&at) {
            break;
        }
        let grown = search.grown(&at);
        let best = search.race(grown, &at);
        let Some(best) = best else { break };
        let gain = search.evidence(&best, Level::High)? - search.evidence(&at, Level::High)?;
        if gain < options.accept {
            break;
        }
        let best = search.floated(best);
        if steps.contains(&best) {
            break;
        }
        family.tell(News::Reached { set: &best, gain: search.gain(&best) });
        steps.push(best);
    }
    let mut accepted = steps[steps.len() - 1].clone();
    if !family.stop().is_asked() {
        // Before anything is judged: a pair that the evidence has and that does not predict what was held out may stand for another
        // pair none of whose effects does anything alone.
        accepted = search.exchanged(accepted);
    }
    let reached = accepted.clone();
    accepted = search.judged(accepted);
    if accepted.len() < reached.len() && !family.stop().is_asked() {
        accepted = search.best_rival(accepted);
        accepted = search.judged(accepted);
        accepted = search.judged_next(accepted, &reached);
    }
    search.end_smaller(&accepted);
    steps.retain(|set| set.iter().all(|one| accepted.contains(one)) && *set != accepted);
    if !accepted.is_empty() || steps.is_empty() {
        steps.push(accepted);
    }
    let interrupted = family.stop().is_asked();
    Some(Selection { steps, models: search.models.into_values().collect(), interrupted })
}

struct Search<'a, F: Family> {
    family: &'a F,
    options: &'a SelectOptions,
    models: BTreeMap<(Set, Level), Model<F::Member>>,
    /// Evidence of the cheap fit that the empty set was fitted from.
    begun: f64,
    /// Sets that were fitted to a few of the records, for larger ones to begin from.
    looked_at: Vec<Set>,
    /// The best evidence of sets that went on from a first look, on the few records of it.
    screened: BTreeMap<Set, f64>,
    /// Sets whose smaller ones were fitted from their optimum, with its evidence.
    reduced: BTreeMap<Set, f64>,
    /// Sets that were fitted from where no search led.
    afresh: Vec<Set>,
}

impl<F: Family> Search<'_, F> {
    fn keep(&mut self, set: Set, level: Level, problem: F::Member, fit: Fit) {
        // The empty set is told as every other verb fits it, unless that was stuck.
        let least_gain = if set.is_empty() { self.options.accept } else { 0.0 };
        let better = self
            .models
            .get(&(set.clone(), level))
            .is_none_or(|known| known.fit.log_evidence + least_gain < fit.log_evidence);
        if better {
            let options = self.family.options();
            let hold_out = || held_out(&problem, &fit, &folds(&problem), &options, OwnFits::None);
            let held_out = (level == Level::High).then(hold_out).flatten();
            self.models.insert((set.clone(), level), Model { set, level, problem, fit, held_out });
        }
    }

    /// Whether a set has shapes that are free in the end only: a cheap fit does not say how far such a set may get.
    fn has_late_shapes(&self, set: &[usize]) -> bool {
        late_shapes(self.family, set) > 0
    }

    fn evidence(&self, set: &[usize], level: Level) -> Option<f64> {
        self.models.get(&(set.to_vec(), level)).map(|model| model.fit.log_evidence)
    }

    fn gain(&self, set: &[usize]) -> f64 {
        let of = |set: &[usize]| self.evidence(set, Level::High).unwrap_or(f64::NAN);
        of(set) - of(&[])
    }

    /// The errors on what was held out, with own coordinates fitted and at their means, in units of the rows' noise as
    /// another set found it: of two sets both must be measured by one.
    fn held_out(&self, set: &[usize], noise: &Noise) -> Option<[f64; 2]> {
        let model = self.models.get(&(set.to_vec(), Level::High))?;
        let held = model.held_out.as_ref()?;
        Some([&held.own, &held.at_mean].map(|residual| normalised_rms(&model.problem, noise, residual)))
    }

    /// Whether a set leaves nothing that one more effect could explain. Of the empty set that is never said: what an effect does
    /// within a few readings of each stroke is taken by the noise for a little more noise, and no statistic of the residual told
    /// it from that (five effects of 17 to 193 nats in some 270 simulated campaigns).
    fn is_explained(&self, set: &[usize]) -> bool {
        let Some(model) = self.models.get(&(set.to_vec(), Level::High)) else { return true };
        let left = || left_to_explain(&model.problem, &model.fit, &self.family.options());
        self.family.is_enough(model) || !set.is_empty() && left() < self.options.nothing_left
    }

    /// All sets with one effect more that have not been fitted.
    fn grown(&self, set: &[usize]) -> Vec<Set> {
        (0..self.family.candidates())
            .filter(|one| !set.contains(one))
            .map(|one| {
                let mut grown = set.to_vec();
                grown.push(one);
                grown.sort_unstable();
                grown
            })
            .collect()
    }

    /// The sets with one effect less, fitted from the optimum of all.
    fn with_smaller(&mut self, set: &[usize]) -> Vec<Set> {
        let smaller: Vec<Set> =
            set.iter().map(|one| set.iter().copied().filter(|other| other != one).collect()).collect();
        // A better optimum of all is a better start for each of them.
        let known = self.reduced.get(set).copied().unwrap_or(f64::NEG_INFINITY);
        let evidence = self.evidence(set, Level::High).unwrap_or(f64::NEG_INFINITY);
        if evidence > known + self.options.accept {
            self.fit_from(set, &smaller);
            self.reduced.insert(set.to_vec(), evidence);
        }
        smaller
    }

    /// Fits to the end what a set is told beside: the sets with one effect less, which are so far behind that a little more
    /// or less decides nothing.
    fn end_smaller(&mut self, set: &[usize]) {
        let smaller = set.iter().map(|one| set.iter().copied().filter(|other| other != one).collect());
        let is_ended = |set: &Set| self.models.contains_key(&(set.clone(), Level::High));
        let missing: Vec<Set> = smaller.filter(|set| !is_ended(set)).collect();
        for (set, problem, fit) in self.ended_from(set, &missing, &self.family.options()) {
            self.keep(set, Level::High, problem, fit);
        }
    }

    /// Fits sets from the optimum of another. At first a little and cheaply: one that is then far less likely is not
    /// worth a fit as exact as those that decide.
    fn fit_from(&mut self, origin: &[usize], sets: &[Set]) {
        let a_little = settling(self.options.rounds[1], self.family.options());
        let begun = self.begun_from(origin, sets, Level::Low, a_little);
        let of_origin = self.evidence(origin, Level::Low);
        let is_near =
            |fit: &Fit| of_origin.is_none_or(|of| fit.log_evidence + fit.predicted_gain > of - self.options.margin);
        // What all gains are counted from is worth a fit that ends: where it is stuck, anything that is not looks like an effect.
        let is_worth = |set: &[usize]| set.is_empty() || self.has_late_shapes(set);
        let near = begun.iter().filter(|(set, _, fit)| is_near(fit) || is_worth(set));
        let near: Vec<Set> = near.map(|(set, ..)| set.clone()).collect();
        for (set, problem, fit) in begun {
            self.keep(set, Level::Low, problem, fit);
        }
        for (set, problem, fit) in self.ended_from(origin, &near, &self.family.options().exact()) {
            self.keep(set, Level::High, problem, fit);
        }
    }

    /// Sets fitted from the optimum of another, with the errors that it found, and no farther than `options` let them.
    fn begun_from(
        &self,
        origin: &[usize],
        sets: &[Set],
        level: Level,
        options: FitOptions,
    ) -> Vec<(Set, F::Member, Fit)> {
        let Some(origin) = self.models.get(&(origin.to_vec(), Level::High)) else { return Vec::new() };
        let options = FitOptions { known: Some(origin.fit.noise.clone()), ..settling(options.settled, options) };
        let fitted = |set: &Set| {
            let problem = self.family.member(set, level)?;
            let start = best_start(&problem, self.family.warm(&problem, &origin.problem, &origin.fit.u))?;
            let fit = fit(&problem, &start, &options)?;
            Some((set.clone(), problem, fit))
        };
        sets.par_iter().filter_map(fitted).collect()
    }

    /// Sets fitted to the end: from the optimum of another, and from where they are known to be best.
    fn ended_from(&self, origin: &[usize], sets: &[Set], options: &FitOptions) -> Vec<(Set, F::Member, Fit)> {
        let Some(origin) = self.models.get(&(origin.to_vec(), Level::High)) else { return Vec::new() };
        let fitted = |set: &Set| {
            let problem = self.family.member(set, Level::High)?;
            let warm = best_start(&problem, self.family.warm(&problem, &origin.problem, &origin.fit.u))?;
            let mut starts = vec![warm];
            // The empty set has been fitted from its cheap optimum.
            let cheap = self.models.get(&(set.clone(), Level::Low));
            if let Some(low) = cheap.filter(|low| !set.is_empty() || low.fit.log_evidence != self.begun) {
                starts.push(self.refined(&problem, low));
            }
            // A start that looks worse may lie in the better valley, and a set that lacks something gets stuck: both are annealed.
            let fits = starts.into_par_iter().filter_map(|start| fit(&problem, &start, options));
            let fit = fits.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
            Some((set.clone(), problem, fit))
        };
        sets.par_iter().filter_map(fitted).collect()
    }

    /// The set without effects that it does not need any more.
    fn floated(&mut self, mut set: Set) -> Set {
        while set.len() > 1 && !self.family.stop().is_asked() {
            let smaller = self.with_smaller(&set);
            let Some(all) = self.evidence(&set, Level::High) else { return set };
            let needless = smaller
                .into_iter()
                .filter_map(|set| Some((self.evidence(&set, Level::High)?, set)))
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .filter(|(evidence, _)| all - evidence < self.options.accept);
            match needless {
                Some((_, smaller)) => set = smaller,
                None => break,
            }
        }
        set
    }

    /// Fits a set that may be told from where no search led.
    fn fit_afresh(&mut self, set: &[usize]) {
        let Some(base) = self.models.get(&(Vec::new(), Level::High)) else { return };
        if self.afresh.iter().any(|other| other == set) || self.family.stop().is_asked() {
            return;
        }
        // What leaves nothing is in no wrong valley.
        let begun = begun_afresh(self.family, set, base, !self.is_explained(set));
        // Where the search led is known as cheaply: what is no likelier is no other valley.
        let known = self.evidence(set, Level::Low).unwrap_or(f64::NEG_INFINITY);
        let better = begun.filter(|begun| begun.fit.log_evidence > known + self.options.nothing_left);
        let afresh = better.and_then(|begun| ended_afresh(self.family, &begun));
        let gone_on = || {
            let model = self.models.get(&(set.to_vec(), Level::High))?;
            finer(self.family, &model.problem, &model.fit).map(|next| finer_until_it_ends(self.family, next))
        };
        if let Some((problem, fit)) = afresh.or_else(gone_on) {
            self.keep(set.to_vec(), Level::High, problem, fit);
        }
        self.afresh.push(set.to_vec());
    }

    /// The set without effects that are not worth their place: by evidence, and by what was held out. A companion of another effect
    /// must leave nothing, or hardly anything: two effects that together leave a good part of the error each take what suits them
    /// of a third that is not there (of eleven such pairs in drawn campaigns ten held a wrong one, of seventeen single effects that
    /// left something three). Not so where neither does anything alone: the pair would be given up for nothing at all.
    fn judged(&mut self, mut set: Set) -> Set {
        while !set.is_empty() {
            self.fit_afresh(&set);
            let smaller = self.with_smaller(&set);
            self.end_likeliest(&smaller);
            self.hold_out_fairly(&set, &smaller);
            let Some(model) = self.models.get(&(set.clone(), Level::High)) else { return set };
            let (all, noise) = (model.fit.log_evidence, &model.fit.noise);
            let (base, error) = (self.held_out(&[], noise), self.held_out(&set, noise));
            let is_whole = left_nats(&model.problem, &model.fit, &self.family.options()) < self.options.accept;
            // Where neither effect does anything for what was held out by itself, there is no better one to leave alone.
            let helps_alone = |smaller: &Set| {
                self.held_out(smaller, noise).zip(base).is_some_and(|(own, base)| {
                    (0..2).any(|kind| excess(own[kind]) <= (1.0 - self.options.held_out_fall) * excess(base[kind]))
                })
            };
            let only_together = base.is_some() && !smaller.iter().any(helps_alone);
            let rows: usize = model.problem.records().iter().map(crate::Record::row_count).sum();
            // What rows that were held out say for an effect, as if their errors were independent.
            let told = |without: f64, with: f64| 0.5 * rows as f64 * (without * without - with * with);
            let is_needless = |smaller: &Set| -> Option<f64> {
                let gain = all - self.evidence(smaller, Level::High)?;
                let falls = match (error, self.held_out(smaller, noise)) {
                    (Some(error), Some(without)) => (0..2).any(|kind| {
                        let (before, after) = (excess(without[kind]), excess(error[kind]));
                        let of_base = base.map_or(0.0, |base| excess(base[kind]));
                        let completes = is_whole || after <= self.options.nearly_whole * of_base;
                        let is_told = told(without[kind], error[kind]) >= self.options.accept;
                        let has_place = set.len() < 2 || (only_together || completes) && is_told;
                        // Where no error stands out of the noise there is none to fall, and what the rows say is independent.
                        let falls =
                            if before > 0.0 { before - after >= self.options.held_out_fall * before } else { is_told };
                        falls && has_place
                    }),
                    // Where nothing can be held out evidence alone decides; what was stopped before it was held out is not known
                    // to predict anything.
                    _ => !self.family.stop().is_asked() || folds(&model.problem).is_empty(),
                };
                (gain < self.options.accept || !falls).then_some(gain)
            };
            // What the evidence has is refused for what was held out only after fits of their own.
            let least = smaller
                .into_iter()
                .filter_map(|smaller| Some((is_needless(&smaller)?, smaller)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            match least {
                Some((gain, smaller))
                    if gain >= self.options.accept && self.hold_out([&set, &smaller].into_iter(), OwnFits::All) => {}
                Some((_, smaller)) => set = smaller,
                None => break,
            }
        }
        set
    }

    /// Judges the sets that came next to one that was refused, while the evidence has them above what took its place: the likeliest may
    /// not predict what was held out because of an effect that another one does without.
    fn judged_next(&mut self, accepted: Set, refused: &Set) -> Set {
        let Some(of_accepted) = self.evidence(&accepted, Level::High) else { return accepted };
        let is_next = |model: &&Model<F::Member>| {
            model.level == Level::High
                && model.set.len() == refused.len()
                && model.set != *refused
                && model.fit.log_evidence >= of_accepted + self.options.accept
        };
        let next = self.models.values().filter(is_next);
        let mut next: Vec<(f64, Set)> = next.map(|model| (model.fit.log_evidence, model.set.clone())).collect();
        next.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, set) in next.into_iter().take(self.options.exchanged) {
            let judged = self.judged(set);
            if judged.len() == refused.len() {
                return judged;
            }
        }
        accepted
    }

    /// Fits the likeliest of the sets that a companion is judged against as exactly as the one with it, where its fit ended before it
    /// was done: what the larger one gained by going on alone would count as the companion's doing. (Where a piston sticks and slips
    /// that was 100 nats for a companion that was not there, and 330 for the lone effect once it had gone on as well.)
    fn end_likeliest(&mut self, smaller: &[Set]) {
        let ends = smaller.iter().filter_map(|set| self.models.get(&(set.clone(), Level::High)));
        let likeliest = ends.max_by(|a, b| a.fit.log_evidence.total_cmp(&b.fit.log_evidence));
        let is_unfinished = |model: &&Model<_>| !model.set.is_empty() && model.fit.predicted_gain > model.fit.tolerance;
        if let Some(set) = likeliest.filter(is_unfinished).map(|model| model.set.clone()) {
            self.fit_afresh(&set);
        }
    }

    /// Holds out from a set and smaller ones what is about to decide between them. Where the evidence does not decide alone about a
    /// companion, that must be right.
    fn hold_out_fairly(&mut self, set: &Set, smaller: &[Set]) {
        let all = self.evidence(set, Level::High).unwrap_or(f64::NEG_INFINITY);
        let is_close =
            |smaller: &&Set| self.evidence(smaller, Level::High).is_some_and(|of| all - of < self.options.margin);
        let close: Vec<&Set> = smaller.iter().filter(|_| set.len() > 1).filter(is_close).collect();
        if !close.is_empty() {
            self.hold_out(close.into_iter().chain([set]), OwnFits::All);
        }
        self.hold_out(smaller.iter().chain([set, &Set::new()]), OwnFits::WhereShort);
    }

    /// Holds out once more from sets what decides between them, with fits of their own; whether that had not been done.
    fn hold_out<'s>(&mut self, sets: impl Iterator<Item = &'s Set>, own_fits: OwnFits) -> bool {
        let options = self.family.options();
        let mut is_new = false;
        for set in sets {
            let Some(model) = self.models.get_mut(&(set.clone(), Level::High)) else { continue };
            if model.held_out.as_ref().is_some_and(|held| held.own_fits < own_fits)
                && let Some(found) = held_out(&model.problem, &model.fit, &folds(&model.problem), &options, own_fits)
            {
                model.held_out = Some(found);
                is_new = true;
            }
        }
        is_new
    }

    /// The set with one effect exchanged where that is more likely; the neighbours are kept beside it. Where another set is
    /// nearly as likely, its neighbours are looked at as well: of two effects that both stand in for a third the better
    /// one may be the one that its companion does not go with.
    fn exchanged(&mut self, set: Set) -> Set {
        if set.len() < 2 {
            return self.best_rival(set);
        }
        let mut best = set;
        let mut done: Vec<Set> = Vec::new();
        let mut next = Some(best.clone());
        while let Some(set) = next
            && done.len() < self.options.exchanged
            && !self.family.stop().is_asked()
        {
            let swapped = self.neighbours(&set);
            let _ = self.race(swapped, &set);
            done.push(set);
            let mut alike: Vec<(f64, Set)> = self
                .models
                .values()
                .filter(|model| model.level == Level::High && model.set.len() == best.len())
                .map(|model| (model.fit.log_evidence, model.set.clone()))
                .collect();
            alike.sort_by(|a, b| b.0.total_cmp(&a.0));
            let most = alike.first().map_or(f64::NEG_INFINITY, |(evidence, _)| *evidence);
            if let Some((evidence, set)) = alike.first()
                && self.evidence(&best, Level::High).is_none_or(|of_best| *evidence > of_best)
            {
                best.clone_from(set);
            }
            let is_near = |evidence: f64| evidence > most - self.options.margin;
            next = alike.into_iter().find(|(evidence, set)| is_near(*evidence) && !done.contains(set)).map(|one| one.1);
        }
        self.best_rival(best)
    }

    /// The sets with one effect exchanged that have not been fitted.
    fn neighbours(&self, set: &[usize]) -> Vec<Set> {
        let mut swapped: Vec<Set> = Vec::new();
        for one in set {
            let rest: Set = set.iter().copied().filter(|other| other != one).collect();
            for grown in self.grown(&rest) {
                let is_known =
                    [Level::Screen, Level::Low].iter().any(|level| self.models.contains_key(&(grown.clone(), *level)));
                if grown != set && !swapped.contains(&grown) && !is_known {
                    swapped.push(grown);
                }
            }
        }
        swapped
    }
}
