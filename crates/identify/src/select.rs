//! Which effects a model needs: a search over sets of candidates, every set judged by its evidence.
//!
//! The search goes forward and, at every step, back (sequential floating selection: Pudil, Novovičová and Kittler,
//! Pattern Recognition Letters 15(11), 1994), and in the end exchanges one effect for another. Sets race one
//! another: all get a little work, the better half more, the best are fitted to the end (successive halving: Jamieson
//! and Talwalkar, AISTATS 2016). Each starts cold, at the prior means, and warm, from the set it grew out of, because a
//! calibrated fit has buried what is missing in its parameters.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::fit::{Fit, FitOptions, fit};
use crate::held_out::{HeldOut, folds, held_out};
use crate::noise::{GroupNoise, Noise};
use crate::normal::{Linearised, Posterior, prior_cost};
use crate::problem::{Linear, Problem};
use crate::stop::Stop;
use crate::variance::{Effort, GroupPrior, components, evidence, log_prior};

/// A set of candidates by index, rising.
pub type Set = Vec<usize>;

/// How exactly a set is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Level {
    /// A few of the records, cheaply: for a first look at many sets.
    Screen,
    /// Cheaply, for the way.
    Low,
    /// As it is reported.
    High,
}

/// A family of problems: one for every set of candidates.
pub trait Family: Sync {
    /// A problem of the family.
    type Member: Problem + Send;

    /// How many candidates there are.
    fn candidates(&self) -> usize;

    /// The problem of a set; nothing where its effects exclude one another.
    fn member(&self, set: &[usize], level: Level) -> Option<Self::Member>;

    /// A point of a problem at one level as one of the same set at another; coordinates that only the other has are
    /// at their prior means.
    fn carried(&self, from: &Self::Member, u: &[f64], to: &Self::Member) -> Vec<f64>;

    /// Where fits of a set start that know nothing; the best of them is taken.
    fn cold(&self, member: &Self::Member) -> Vec<Vec<f64>>;

    /// Where fits of a set start from the optimum of another; the best of them is taken.
    fn warm(&self, member: &Self::Member, from: &Self::Member, u: &[f64]) -> Vec<Vec<f64>>;

    /// For each coordinate of a problem, which coordinate of another one of the same level, or of a wider one, it is. Of
    /// those that are new, the first is the size of an effect that is off at zero.
    fn shared(&self, from: &Self::Member, to: &Self::Member) -> Vec<Option<usize>>;

    /// What is known of the errors, and how a fit goes on.
    fn options(&self) -> FitOptions;

    /// Called as a set has been fitted.
    fn tell(&self, news: News<'_>);

    /// Whether somebody asked to stop.
    fn stop(&self) -> &Stop;
}

/// What a search tells.
#[derive(Debug, Clone, Copy)]
pub enum News<'a> {
    /// A set has been fitted; how many of how many in this round.
    Fitted {
        /// The set.
        set: &'a [usize],
        /// Its logarithm of the evidence, nats.
        log_evidence: f64,
        /// Root mean square of what it leaves, in units of the noise as the fit found it.
        rms: f64,
        /// Sets in this round.
        of: usize,
    },
    /// The search goes on from a set.
    Reached {
        /// The set.
        set: &'a [usize],
        /// Its gain of evidence over the empty set, nats.
        gain: f64,
    },
}

/// Numbers that steer a search.
#[derive(Debug, Clone)]
pub struct SelectOptions {
    /// An effect is accepted from this gain of evidence, nats. Fits of one model from different starts end within 5 to
    /// 10 nats of each other, and chance alone gains less than 8.
    pub accept: f64,
    /// And when the error on what was held out falls by this share without noise.
    pub held_out_fall: f64,
    /// A companion of other effects must take at least this share of the calibrated model's error that was held out, or
    /// else leave nothing to be explained: what takes a little of what is left may imitate what is really there.
    pub companion: f64,
    /// Effects at most.
    pub most: usize,
    /// Derivatives in the first round of a race, and in the second.
    pub rounds: [usize; 2],
    /// The share of a round that goes on.
    pub kept: f64,
    /// Sets that are fitted to the end, at least.
    pub finalists: usize,
    /// Sets this far behind are not followed, nats, and by so much more as the best one leaves to be explained.
    pub hopeless: f64,
    /// Sets that are followed to the end, at most.
    pub followed: usize,
    /// Where a fit may have ended in a false valley, so many of all starts are followed to the end.
    pub restarts: usize,
    /// What is left counts as nothing where its evidence is below this, nats.
    pub nothing_left: f64,
    /// A model error larger than this is more than instruments and small laws explain (in the units of the rows'
    /// activity): the fit may have ended in a false valley, or something else is missing. Common position sensors are
    /// linear to half a percent of their span.
    pub large: f64,
    /// What is left is given up once the error that was held out is below this (in the units of the rows' noise);
    /// zero for never.
    pub good_enough: f64,
}

impl Default for SelectOptions {
    fn default() -> Self {
        Self {
            accept: 10.0,
            held_out_fall: 0.1,
            companion: 0.05,
            most: 2,
            rounds: [2, 3],
            kept: 0.4,
            finalists: 3,
            hopeless: 60.0,
            followed: 5,
            restarts: 2,
            nothing_left: 3.0,
            large: 0.005,
            good_enough: 0.0,
        }
    }
}

/// A set that was fitted.
#[derive(Debug)]
pub struct Model<P> {
    /// The set.
    pub set: Set,
    /// How exactly.
    pub level: Level,
    /// Its problem.
    pub problem: P,
    /// Its fit.
    pub fit: Fit,
    /// What it predicts of records that were held out; nothing where it was fitted cheaply, or to a single record.
    pub held_out: Option<HeldOut>,
}

/// What a search found.
#[derive(Debug)]
pub struct Selection<P> {
    /// From the empty set to the accepted one, step by step.
    pub steps: Vec<Set>,
    /// All sets that were fitted.
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
/// reported; nothing where it cannot be fitted.
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
        None => family.cold(&problem),
    };
    let mut options = family.options();
    if level == Level::High {
        options.tolerance = options.tolerance.min(TOLD_TOLERANCE);
    }
    let fits: Vec<Fit> = starts.par_iter().filter_map(|start| fit(&problem, start, &options)).collect();
    let fit = fits.into_iter().max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
    let held_out = (level == Level::High).then(|| held_out(&problem, &fit, &folds(&problem))).flatten();
    Some(Model { set: Vec::new(), level, problem, fit, held_out })
}

/// Searches a family for the effects that records need; nothing where not even the empty set can be fitted.
pub fn select<F: Family>(family: &F, options: &SelectOptions) -> Option<Selection<F::Member>> {
    let mut search = Search { family, options, models: HashMap::new(), reduced: Vec::new() };
    for model in base(family)? {
        search.models.insert((Vec::new(), model.level), model);
    }
    if !search.is_explained(&[]) {
        let screen = base_at(family, Level::Screen, search.models.get(&(Vec::new(), Level::Low)))?;
        search.models.insert((Vec::new(), Level::Screen), screen);
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
    let accepted = search.judged(steps[steps.len() - 1].clone());
    let accepted = if family.stop().is_asked() { accepted } else { search.exchanged(accepted) };
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
    models: HashMap<(Set, Level), Model<F::Member>>,
    /// Sets whose smaller ones were fitted from their optimum.
    reduced: Vec<Set>,
}

/// A set in a race.
struct Runner<P> {
    set: Set,
    problem: P,
    fit: Fit,
    /// Whether it began where a smaller set ended, so that it needs no annealing.
    is_warm: bool,
}

/// How a fit goes on whose way an annealed phase, or a fit close by, has shown.
fn settling(settled: usize, options: FitOptions) -> FitOptions {
    FitOptions { annealed: 0, settled, ..options }
}

impl<F: Family> Search<'_, F> {
    fn keep(&mut self, set: Set, level: Level, problem: F::Member, fit: Fit) {
        let better =
            self.models.get(&(set.clone(), level)).is_none_or(|known| known.fit.log_evidence < fit.log_evidence);
        if better {
            let is_wanted = level == Level::High;
            let held_out = is_wanted.then(|| held_out(&problem, &fit, &folds(&problem))).flatten();
            self.models.insert((set.clone(), level), Model { set, level, problem, fit, held_out });
        }
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
        Some([&held.own, &held.at_mean].map(|residual| rms_in_noise(&model.problem, noise, residual)))
    }

    /// Whether nothing is left that another effect could explain.
    fn is_explained(&self, set: &[usize]) -> bool {
        let Some(model) = self.models.get(&(set.to_vec(), Level::High)) else { return true };
        let enough = self.held_out(set, &model.fit.noise).is_some_and(|[own, _]| own < self.options.good_enough);
        enough || left_to_explain(&model.problem, &model.fit, &self.family.options()) < self.options.nothing_left
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

    /// Races sets that grew out of `from`, or were exchanged in it; the one with the most evidence.
    fn race(&mut self, sets: Vec<Set>, from: &[usize]) -> Option<Set> {
        let known: Vec<Set> =
            sets.iter().filter(|set| self.models.contains_key(&((*set).clone(), Level::High))).cloned().collect();
        let fresh: Vec<Set> = sets.into_iter().filter(|set| !known.contains(set)).collect();
        let mut runners = self.first_round(&fresh, from);
        let best_known =
            known.iter().filter_map(|set| self.evidence(set, Level::Low)).fold(f64::NEG_INFINITY, f64::max);
        for (round, derivatives) in [self.options.rounds[1], usize::MAX].into_iter().enumerate() {
            runners.sort_by(|a, b| b.fit.log_evidence.total_cmp(&a.fit.log_evidence));
            // The cold and the warm fit of a set are one runner once the race is past its first round.
            if round > 0 {
                let mut seen: Vec<Set> = Vec::new();
                runners.retain(|runner| {
                    let is_new = !seen.contains(&runner.set);
                    seen.push(runner.set.clone());
                    is_new
                });
            }
            let best = runners.first().map_or(f64::NEG_INFINITY, |runner| runner.fit.log_evidence);
            // What the best leaves to be explained is what another can still gain on it.
            let left = runners
                .first()
                .map_or(0.0, |runner| left_nats(&runner.problem, &runner.fit, &self.family.options()).max(0.0));
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a few runners")]
            let share = (self.options.kept * runners.len() as f64).ceil() as usize;
            let most = if round == 0 { share } else { self.options.followed };
            let (kept, behind): (Vec<_>, Vec<_>) = runners.into_iter().enumerate().partition(|(place, runner)| {
                *place < self.options.finalists
                    || (*place < most && runner.fit.log_evidence > best - self.options.hopeless - left)
            });
            for (_, runner) in behind {
                self.keep(runner.set, Level::Screen, runner.problem, runner.fit);
            }
            let mut kept: Vec<Runner<F::Member>> = kept.into_iter().map(|(_, runner)| runner).collect();
            if derivatives == usize::MAX {
                kept = self.with_all_records(kept);
            }
            runners = self.carried_on(kept, derivatives);
        }
        runners.sort_by(|a, b| b.fit.log_evidence.total_cmp(&a.fit.log_evidence));
        runners = self.started_again(runners);
        runners.sort_by(|a, b| b.fit.log_evidence.total_cmp(&a.fit.log_evidence));
        let best = runners.first().map_or(best_known, |runner| runner.fit.log_evidence.max(best_known));
        let mut finalists = known;
        for (place, runner) in runners.into_iter().enumerate() {
            if place < self.options.finalists && runner.fit.log_evidence > best - self.options.hopeless {
                finalists.push(runner.set.clone());
            }
            self.keep(runner.set, Level::Low, runner.problem, runner.fit);
        }
        self.finely(&finalists);
        let of = |set: &Set| self.evidence(set, Level::High);
        finalists
            .into_iter()
            .filter(|set| of(set).is_some())
            .max_by(|a, b| of(a).partial_cmp(&of(b)).unwrap_or(std::cmp::Ordering::Equal))
    }

    fn first_round(&self, sets: &[Set], from: &[usize]) -> Vec<Runner<F::Member>> {
        let family = self.family;
        let tasks: Vec<(&Set, bool)> = sets.iter().flat_map(|set| [(set, false), (set, true)]).collect();
        let little = FitOptions { annealed: self.options.rounds[0], settled: 0, ..family.options() };
        let of = tasks.len();
        tasks
            .par_iter()
            .filter_map(|(set, is_warm)| {
                let problem = family.member(set, Level::Screen)?;
                let fit = if *is_warm {
                    let (of_all, u, noise) = self.foreseen(set, from)?;
                    let options = FitOptions { known: Some(noise), ..settling(self.options.rounds[0], little.clone()) };
                    fit(&problem, &family.carried(&of_all, &u, &problem), &options)?
                } else {
                    fit(&problem, &best_start(&problem, family.cold(&problem))?, &little)?
                };
                family.tell(fitted_news(set, &problem, &fit, of));
                Some(Runner { set: (*set).clone(), problem, fit, is_warm: *is_warm })
            })
            .collect()
    }

    /// Where a set with one effect more is likely to be best, and with which errors: from the optimum of the smaller set, by
    /// the derivatives there and what the effect does at each of several sizes. At a single, very small one this would be
    /// the score test (Rao, Mathematical Proceedings of the Cambridge Philosophical Society 44(1), 1948).
    fn foreseen(&self, set: &[usize], from: &[usize]) -> Option<(F::Member, Vec<f64>, Noise)> {
        let smaller = self.smaller(set, from)?;
        let problem = self.family.member(set, Level::Low)?;
        let shared = self.family.shared(&smaller.problem, &problem);
        let size = shared.iter().position(Option::is_none)?;
        let coordinates = problem.coordinates();
        let mut points = self.family.warm(&problem, &smaller.problem, &smaller.fit.u);
        for point in &mut points {
            for (u, coordinate) in point.iter_mut().zip(coordinates) {
                *u = u.clamp(coordinate.lower, coordinate.upper);
            }
            if point[size] == 0.0 {
                point[size] = coordinates[size].step_at(0.0, f64::INFINITY);
            }
        }
        let mut off = points.first()?.clone();
        off[size] = 0.0;
        points.push(off);
        let mut predicted = crate::problem::predict_all(&problem, &points);
        let without = predicted.pop()??;
        let mut place = vec![None; smaller.problem.coordinates().len()];
        for (index, same) in shared.iter().enumerate() {
            if let Some(same) = same {
                place[*same] = Some(index);
            }
        }
        let kept = |columns: &[(usize, Vec<f64>)]| -> Vec<(usize, Vec<f64>)> {
            columns.iter().filter_map(|(index, column)| Some((place[*index]?, column.clone()))).collect()
        };
        let groups = self.family.options().groups;
        let noise = &smaller.fit.noise;
        let linear = points.into_iter().zip(predicted).filter_map(|(u, predicted)| {
            let with_effect = predicted?.into_iter().zip(&without).zip(&smaller.fit.linear.columns);
            let linear = with_effect.map(|((predicted, without), columns)| {
                let by_size = predicted.iter().zip(without).map(|(with, without)| (with - without) / u[size]);
                let mut columns = kept(columns);
                columns.push((size, by_size.collect()));
                Linear { predicted, columns }
            });
            let linear = linear.collect();
            let at = Linearised::new(&problem, u, linear);
            let likely = evidence(&problem, &at, &at.normal(&problem, noise), &groups, noise);
            likely.is_finite().then_some((likely, at))
        });
        let (_, at) = linear.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let noise = components(&problem, &at, &groups, noise, Effort::Local);
        let normal = at.normal(&problem, &noise);
        let step = Posterior::new(coordinates, &at.u, &normal).newton()?;
        Some((problem, step.to, noise))
    }

    /// The set with one effect less that a set grows out of: the one at hand, or, for a set in which one was exchanged, what
    /// both share.
    fn smaller(&self, set: &[usize], from: &[usize]) -> Option<&Model<F::Member>> {
        let smaller: Set = set.iter().copied().filter(|one| from.contains(one)).collect();
        let of = |level: Level| self.models.get(&(smaller.clone(), level));
        of(Level::Low).or_else(|| of(Level::High))
    }

    /// Runners that saw a few of the records, before all of them.
    fn with_all_records(&self, runners: Vec<Runner<F::Member>>) -> Vec<Runner<F::Member>> {
        let base = self.family.options();
        runners
            .into_par_iter()
            .filter_map(|runner| {
                let problem = self.family.member(&runner.set, Level::Low)?;
                let start = self.family.carried(&runner.problem, &runner.fit.u, &problem);
                let options = if runner.is_warm {
                    FitOptions { known: Some(runner.fit.noise.clone()), ..settling(1, base.clone()) }
                } else {
                    FitOptions { annealed: 1, settled: 0, ..base.clone() }
                };
                let fit = fit(&problem, &start, &options)?;
                Some(Runner { problem, fit, ..runner })
            })
            .collect()
    }

    fn carried_on(&self, runners: Vec<Runner<F::Member>>, derivatives: usize) -> Vec<Runner<F::Member>> {
        let base = self.family.options();
        let of = runners.len();
        runners
            .into_par_iter()
            .map(|mut runner| {
                let options = match (runner.is_warm, derivatives) {
                    (true, most) => FitOptions {
                        known: Some(runner.fit.noise.clone()),
                        ..settling(most.min(base.settled), base.clone())
                    },
                    (false, usize::MAX) => base.clone(),
                    (false, most) => FitOptions { annealed: most, settled: 1, ..base.clone() },
                };
                if !runner.fit.converged
                    && let Some(fit) = fit(&runner.problem, &runner.fit.u, &options)
                    && fit.log_evidence > runner.fit.log_evidence
                {
                    runner.fit = fit;
                }
                self.family.tell(fitted_news(&runner.set, &runner.problem, &runner.fit, of));
                runner
            })
            .collect()
    }

    /// Runners whose fits leave a large model error, fitted from every start that knows nothing: one of them may lead out
    /// of a false valley.
    fn started_again(&self, runners: Vec<Runner<F::Member>>) -> Vec<Runner<F::Member>> {
        let family = self.family;
        let again = |mut runner: Runner<F::Member>| {
            let is_large = runner.fit.noise.groups.iter().any(|group| group.discrepancy > self.options.large);
            if !is_large || family.stop().is_asked() {
                return runner;
            }
            runner.fit = self.best_of(&runner.problem, family.cold(&runner.problem), runner.fit);
            runner
        };
        runners.into_par_iter().map(again).collect()
    }

    /// The best of a fit and those from other starts: all get a little work, those that got farthest are fitted to the end.
    fn best_of(&self, problem: &F::Member, starts: Vec<Vec<f64>>, known: Fit) -> Fit {
        let options = self.family.options();
        let little = FitOptions { annealed: self.options.rounds[0], settled: 0, ..options.clone() };
        let mut begun: Vec<Fit> = starts.into_par_iter().filter_map(|start| fit(problem, &start, &little)).collect();
        begun.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
        begun.truncate(self.options.restarts);
        let fits = begun.into_par_iter().filter_map(|begun| fit(problem, &begun.u, &options));
        let best = fits.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence));
        best.filter(|best| best.log_evidence > known.log_evidence).unwrap_or(known)
    }

    /// Fits sets as exactly as they are reported, from where their cheap fits ended.
    fn finely(&mut self, sets: &[Set]) {
        let wanted: Vec<&Set> =
            sets.iter().filter(|set| !self.models.contains_key(&((*set).clone(), Level::High))).collect();
        let of = wanted.len();
        let options = self.family.options();
        let fits: Vec<(Set, F::Member, Fit)> = wanted
            .into_par_iter()
            .filter_map(|set| {
                let low = self.models.get(&(set.clone(), Level::Low))?;
                let problem = self.family.member(set, Level::High)?;
                let start = self.family.carried(&low.problem, &low.fit.u, &problem);
                let mut best = fit(&problem, &start, &options)?;
                // What only this level can move may have held the way there in a false valley.
                let is_wider = problem.coordinates().len() > low.problem.coordinates().len();
                if is_wider && left_nats(&problem, &best, &options) > self.options.accept {
                    best = self.best_of(&problem, self.family.cold(&problem), best);
                }
                self.family.tell(fitted_news(set, &problem, &best, of));
                Some((set.clone(), problem, best))
            })
            .collect();
        for (set, problem, fit) in fits {
            self.keep(set, Level::High, problem, fit);
        }
    }

    /// A set and those with one effect less, fitted as exactly; from its own optimum where they are new.
    fn with_smaller(&mut self, set: &[usize]) -> Vec<Set> {
        let smaller: Vec<Set> =
            set.iter().map(|one| set.iter().copied().filter(|other| other != one).collect()).collect();
        if self.reduced.iter().any(|one| one == set) {
            return smaller;
        }
        let fits: Vec<(Set, F::Member, Fit)> = {
            let Some(origin) = self.models.get(&(set.to_vec(), Level::High)) else { return smaller };
            smaller
                .par_iter()
                .filter(|set| !set.is_empty())
                .filter_map(|set| {
                    let problem = self.family.member(set, Level::High)?;
                    let mut starts = self.family.warm(&problem, &origin.problem, &origin.fit.u);
                    if let Some(low) = self.models.get(&(set.clone(), Level::Low)) {
                        starts.push(self.family.carried(&low.problem, &low.fit.u, &problem));
                    }
                    // A start that looks worse may lie in the better valley.
                    let fits = starts.into_par_iter().filter_map(|start| fit(&problem, &start, &self.family.options()));
                    let fit = fits.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))?;
                    Some((set.clone(), problem, fit))
                })
                .collect()
        };
        for (set, problem, fit) in fits {
            self.keep(set, Level::High, problem, fit);
        }
        self.reduced.push(set.to_vec());
        smaller
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

    /// The set without effects that are not worth their place: by evidence, and by what was held out.
    fn judged(&mut self, mut set: Set) -> Set {
        while !set.is_empty() {
            let smaller = self.with_smaller(&set);
            let Some(model) = self.models.get(&(set.clone(), Level::High)) else { return set };
            let (all, noise) = (model.fit.log_evidence, &model.fit.noise);
            let (base, error) = (self.held_out(&[], noise), self.held_out(&set, noise));
            let is_whole = left_nats(&model.problem, &model.fit, &self.family.options()) < self.options.accept;
            let is_needless = |smaller: &Set| -> Option<f64> {
                let gain = all - self.evidence(smaller, Level::High)?;
                let falls = match (error, self.held_out(smaller, noise)) {
                    (Some(error), Some(without)) => (0..2).any(|kind| {
                        let fall = excess(without[kind]) - excess(error[kind]);
                        let companion = set.len() < 2
                            || is_whole
                            || base.is_none_or(|base| fall >= self.options.companion * excess(base[kind]));
                        fall > 0.0 && fall >= self.options.held_out_fall * excess(without[kind]) && companion
                    }),
                    _ => true,
                };
                (gain < self.options.accept || !falls).then_some(gain)
            };
            let least = smaller
                .into_iter()
                .filter_map(|smaller| Some((is_needless(&smaller)?, smaller)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            match least {
                Some((_, smaller)) => set = smaller,
                None => break,
            }
        }
        set
    }

    /// The set with one effect exchanged where that is more likely; the neighbours are kept beside it.
    fn exchanged(&mut self, set: Set) -> Set {
        if set.len() < 2 || self.is_explained(&set) {
            return set;
        }
        let mut swapped: Vec<Set> = Vec::new();
        for one in &set {
            let rest: Set = set.iter().copied().filter(|other| other != one).collect();
            for grown in self.grown(&rest) {
                let is_known =
                    [Level::Screen, Level::Low].iter().any(|level| self.models.contains_key(&(grown.clone(), *level)));
                if grown != set && !swapped.contains(&grown) && !is_known {
                    swapped.push(grown);
                }
            }
        }
        let best = self.race(swapped, &set);
        let better = best.filter(|best| {
            let of = |set: &[usize]| self.evidence(set, Level::High).unwrap_or(f64::NEG_INFINITY);
            of(best) > of(&set)
        });
        better.unwrap_or(set)
    }
}

/// Of several starts the one with the least error, scaled by the rows' own spread.
fn best_start<P: Problem>(problem: &P, starts: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    if starts.len() < 2 {
        return starts.into_iter().next();
    }
    let coordinates = problem.coordinates();
    let starts: Vec<Vec<f64>> = starts
        .into_iter()
        .map(|start| start.iter().zip(coordinates).map(|(u, c)| u.clamp(c.lower, c.upper)).collect())
        .collect();
    let error = |predicted: Vec<Vec<f64>>| -> f64 {
        let records = problem.records().iter().zip(predicted);
        records
            .flat_map(|(record, predicted)| {
                record
                    .rows()
                    .zip(predicted)
                    .map(|(row, value)| ((row.observed - value) / row.activity).powi(2))
                    .collect::<Vec<_>>()
            })
            .sum()
    };
    let predicted = crate::problem::predict_all(problem, &starts);
    let errors = predicted.into_iter().map(|predicted| predicted.map_or(f64::INFINITY, error));
    let best = errors.zip(starts).filter(|(error, _)| error.is_finite()).min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, start)| start)
}

/// What another effect could gain at most, nats: what a model error explains, and what coordinates and noise had to leave
/// their prior means for beyond what they do by chance.
pub fn left_to_explain<P: Problem>(problem: &P, fit: &Fit, options: &FitOptions) -> f64 {
    let coordinates = problem.coordinates();
    let strain = 0.5 * (prior_cost(coordinates, &fit.u) - coordinates.len() as f64);
    left_nats(problem, fit, options).max(0.0) + strain.max(0.0) - log_prior(&options.groups, &fit.noise)
}

/// What is told of a set that was fitted.
fn fitted_news<'a, P: Problem>(set: &'a [usize], problem: &P, fit: &Fit, of: usize) -> News<'a> {
    let rms = rms_in_noise(problem, &fit.noise, &fit.linear.residual);
    News::Fitted { set, log_evidence: fit.log_evidence, rms, of }
}

/// What an error in units of the noise is beyond that noise.
pub fn excess(error: f64) -> f64 {
    (error * error - 1.0).max(0.0).sqrt()
}

/// Root mean square of residuals in units of the rows' noise with its multiplier.
pub fn rms_in_noise<P: Problem>(problem: &P, noise: &Noise, residual: &[Vec<f64>]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (record, residual) in problem.records().iter().zip(residual) {
        let mut rest = residual.as_slice();
        for series in &record.series {
            let Some(stretch) = rest.split_off(..series.rows.len()) else { continue };
            let multiplier = noise.groups[series.group].multiplier;
            for (row, residual) in series.rows.iter().zip(stretch) {
                sum += (residual / (multiplier * row.sigma)).powi(2);
                count += 1.0;
            }
        }
    }
    (sum / f64::max(count, 1.0)).sqrt()
}

/// How much more likely a model error makes the rows than noise alone does, nats: what is left to explain. Single readings
/// have no model error; of them it is what a larger noise than stated makes more likely.
pub fn left_nats<P: Problem>(problem: &P, fit: &Fit, options: &FitOptions) -> f64 {
    let is_process = |group: usize| {
        let mut series = problem.records().iter().flat_map(|record| &record.series);
        series.any(|series| series.group == group && series.is_process)
    };
    let none = fit.noise.groups.iter().enumerate().map(|(index, group)| {
        let multiplier = if is_process(index) { group.multiplier } else { group.multiplier.min(1.0) };
        GroupNoise { multiplier, discrepancy: 0.0, ..*group }
    });
    let none = Noise { groups: none.collect(), smoothness: fit.noise.smoothness };
    // Only multipliers of processes are refined: the discrepancy of nothing stays nothing.
    let priors: Vec<GroupPrior> = options
        .groups
        .iter()
        .enumerate()
        .map(|(index, prior)| {
            if is_process(index) {
                return *prior;
            }
            let kept = none.groups[index].multiplier;
            GroupPrior { multiplier: (kept, kept), ..*prior }
        })
        .collect();
    let none = components(problem, &fit.linear, &priors, &none, Effort::Local);
    let normal = fit.linear.normal(problem, &none);
    fit.log_evidence - evidence(problem, &fit.linear, &normal, &options.groups, &none)
}
