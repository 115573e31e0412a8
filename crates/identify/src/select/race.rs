//! Sets race one another: all get a little work, the better ones more, the best are fitted to the end.

use rayon::prelude::*;

use super::{Family, Level, News, Search, Set, continued, late_shapes};
use crate::fit::{Fit, FitOptions, fit, go_on};
use crate::left::{left_nats, normalised_rms};
use crate::problem::{Problem, error_in_activity, predict_all};

/// A set in a race.
struct Runner<P> {
    set: Set,
    problem: P,
    fit: Fit,
    /// Whether it began where a smaller set ended, so that it needs no annealing.
    is_warm: bool,
}

/// How a fit goes on whose way an annealed phase, or a fit close by, has shown.
pub(super) fn settling(settled: usize, options: FitOptions) -> FitOptions {
    FitOptions { annealed: 0, settled, ..options }
}

impl<F: Family> Search<'_, F> {
    /// Races sets that grew out of `from`, or were exchanged in it; the one with the most evidence.
    pub(super) fn race(&mut self, sets: Vec<Set>, from: &[usize]) -> Option<Set> {
        let known: Vec<Set> =
            sets.iter().filter(|set| self.models.contains_key(&((*set).clone(), Level::High))).cloned().collect();
        let fresh: Vec<Set> = sets.into_iter().filter(|set| !known.contains(set)).collect();
        let mut runners = self.first_round(&fresh, from);
        let is_exchange = fresh.iter().any(|set| set.len() == from.len());
        let best_known =
            known.iter().filter_map(|set| self.evidence(set, Level::Low)).fold(f64::NEG_INFINITY, f64::max);
        for (round, derivatives) in [self.options.rounds[1], usize::MAX].into_iter().enumerate() {
            runners.sort_by(|a, b| b.fit.log_evidence.total_cmp(&a.fit.log_evidence));
            // What the best leaves to be explained is what another can still gain on it.
            let left = runners
                .first()
                .map_or(0.0, |runner| left_nats(&runner.problem, &runner.fit, &self.family.options()).max(0.0));
            let best = runners.first().map_or(f64::NEG_INFINITY, |runner| runner.fit.log_evidence);
            // A fit that is on its way is worth what its next step promises as well; but a promise is not yet kept, and far from
            // an optimum it is boundless. So the places are shared: by what is promised, and by what has been reached.
            let prospect = |runner: &Runner<F::Member>| runner.fit.log_evidence + left.min(runner.fit.predicted_gain);
            runners = alternating(runners, prospect);
            // The cold and the warm fit of a set are one runner once the race is past its first round.
            if round > 0 {
                let mut seen: Vec<Set> = Vec::new();
                runners.retain(|runner| {
                    let is_new = !seen.contains(&runner.set);
                    seen.push(runner.set.clone());
                    is_new
                });
            }
            // What was exchanged in a set must be able to win against it.
            let to_beat = if is_exchange { self.screened.get(from).copied() } else { None };
            let best = to_beat.map_or(best, |of_set| best.max(of_set));
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a few runners")]
            let share = (self.options.kept * runners.len() as f64).ceil() as usize;
            let most = if round == 0 { share.max(self.options.finalists) } else { self.options.followed };
            let may_win = |fit: &Fit| {
                let may_gain = left.min(self.options.optimism * fit.predicted_gain);
                fit.log_evidence + may_gain > best - self.options.margin
            };
            let (kept, behind): (Vec<_>, Vec<_>) = runners.into_iter().enumerate().partition(|(place, runner)| {
                (*place == 0 && to_beat.is_none()) || (*place < most && may_win(&runner.fit))
            });
            for (_, runner) in behind {
                self.keep(runner.set, Level::Screen, runner.problem, runner.fit);
            }
            for (_, runner) in &kept {
                let known = self.screened.entry(runner.set.clone()).or_insert(f64::NEG_INFINITY);
                *known = known.max(runner.fit.log_evidence);
            }
            let mut kept: Vec<Runner<F::Member>> = kept.into_iter().map(|(_, runner)| runner).collect();
            if derivatives == usize::MAX {
                kept = self.with_all_records(kept);
            }
            runners = self.carried_on(kept, derivatives);
        }
        if !is_exchange {
            let ended = runners.iter().map(|runner| (&runner.set, runner.fit.log_evidence));
            for (set, problem, fit) in self.led_out(ended, from, Level::Low) {
                let stuck = runners.iter_mut().find(|runner| runner.set == set);
                if let Some(stuck) = stuck.filter(|stuck| stuck.fit.log_evidence < fit.log_evidence) {
                    (stuck.problem, stuck.fit) = (problem, fit);
                }
            }
        }
        runners.sort_by(|a, b| b.fit.log_evidence.total_cmp(&a.fit.log_evidence));
        let best = runners.first().map_or(best_known, |runner| runner.fit.log_evidence.max(best_known));
        let mut finalists = known;
        // What grew out of a set and has no more evidence than that, both fitted cheaply, is not accepted in its place.
        let of_grown = if is_exchange { None } else { self.evidence(from, Level::Low) };
        for (place, runner) in runners.into_iter().enumerate() {
            let is_near = runner.fit.log_evidence > best - self.options.margin || self.has_late_shapes(&runner.set);
            let optimism = if runner.fit.converged { 1.0 } else { self.options.optimism };
            let prospect = runner.fit.log_evidence + optimism * runner.fit.predicted_gain;
            let may_win = of_grown.is_none_or(|of| prospect > of)
                || late_shapes(self.family, &runner.set) > late_shapes(self.family, from);
            if place < self.options.finalists && is_near && may_win {
                finalists.push(runner.set.clone());
            }
            self.keep(runner.set, Level::Low, runner.problem, runner.fit);
        }
        self.finely(&finalists);
        if !is_exchange {
            let ended = finalists.iter().filter_map(|set| Some((set, self.evidence(set, Level::High)?)));
            for (set, problem, fit) in self.led_out(ended, from, Level::High) {
                self.keep(set, Level::High, problem, fit);
            }
        }
        let of = |set: &Set| self.evidence(set, Level::High);
        finalists
            .into_iter()
            .filter(|set| of(set).is_some())
            .max_by(|a, b| of(a).partial_cmp(&of(b)).unwrap_or(std::cmp::Ordering::Equal))
    }

    /// Fits those sets once more from the optimum of one they all contain whose evidence is behind that one's by more than chance
    /// has it: a set can do whatever a smaller one does, so that these have ended in another valley.
    fn led_out<'s>(
        &self,
        ended: impl Iterator<Item = (&'s Set, f64)>,
        from: &[usize],
        level: Level,
    ) -> Vec<(Set, F::Member, Fit)> {
        let Some(of_smaller) = self.evidence(from, level) else { return Vec::new() };
        let behind = ended.filter(|(_, evidence)| evidence + self.options.accept < of_smaller);
        let behind: Vec<Set> = behind.map(|(set, _)| set.clone()).collect();
        let options = self.family.options();
        self.begun_from(from, &behind, level, if level == Level::High { options.exact() } else { options })
    }

    fn first_round(&mut self, sets: &[Set], from: &[usize]) -> Vec<Runner<F::Member>> {
        self.look_at_smaller(sets, from);
        let family = self.family;
        let tasks: Vec<(&Set, bool)> = sets.iter().flat_map(|set| [(set, false), (set, true)]).collect();
        let little = FitOptions { annealed: self.options.rounds[0], settled: 0, ..family.options() };
        let of = tasks.len();
        tasks
            .par_iter()
            .filter_map(|(set, is_warm)| {
                let problem = family.member(set, Level::Screen)?;
                let fit = if *is_warm {
                    let (start, noise) = self.foreseen(&problem, set, from)?;
                    let options = FitOptions { known: Some(noise), ..settling(self.options.rounds[0], little.clone()) };
                    fit(&problem, &start, &options)?
                } else {
                    fit(&problem, &best_start(&problem, family.cold(&problem))?, &little.clone().from_nowhere())?
                };
                family.tell(fitted_news(set, &problem, &fit, of));
                Some(Runner { set: (*set).clone(), problem, fit, is_warm: *is_warm })
            })
            .collect()
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
                    && let Some(fit) = go_on(&runner.problem, &runner.fit, &options)
                    && fit.log_evidence > runner.fit.log_evidence
                {
                    runner.fit = fit;
                }
                self.family.tell(fitted_news(&runner.set, &runner.problem, &runner.fit, of));
                runner
            })
            .collect()
    }

    /// Fits sets as exactly as they are reported, from where their cheap fits ended.
    fn finely(&mut self, sets: &[Set]) {
        let wanted: Vec<&Set> =
            sets.iter().filter(|set| !self.models.contains_key(&((*set).clone(), Level::High))).collect();
        let of = wanted.len();
        let options = self.family.options().exact();
        let fits: Vec<(Set, F::Member, Fit)> = wanted
            .into_par_iter()
            .filter_map(|set| {
                let low = self.models.get(&(set.clone(), Level::Low))?;
                let problem = self.family.member(set, Level::High)?;
                let start = self.refined(&problem, low);
                let fit = fit(&problem, &start, &continued(self.family, low, options.clone()))?;
                self.family.tell(fitted_news(set, &problem, &fit, of));
                Some((set.clone(), problem, fit))
            })
            .collect();
        for (set, problem, fit) in fits {
            self.keep(set, Level::High, problem, fit);
        }
    }
}

/// What stands in order of one measure, in turns the best left by another and the best left by that one.
fn alternating<T>(mut left: Vec<T>, other: impl Fn(&T) -> f64) -> Vec<T> {
    let mut order = Vec::with_capacity(left.len());
    while !left.is_empty() {
        let best = (0..left.len()).max_by(|a, b| other(&left[*a]).total_cmp(&other(&left[*b])));
        order.extend(best.map(|best| left.remove(best)));
        if !left.is_empty() {
            order.push(left.remove(0));
        }
    }
    order
}

/// Of several starts the one with the least error, scaled by the rows' own spread.
pub(super) fn best_start(problem: &dyn Problem, starts: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    if starts.len() < 2 {
        return starts.into_iter().next();
    }
    let coordinates = problem.coordinates();
    let starts: Vec<Vec<f64>> = starts
        .into_iter()
        .map(|start| start.iter().zip(coordinates).map(|(u, c)| u.clamp(c.lower, c.upper)).collect())
        .collect();
    let error = |predicted: Option<Vec<Vec<f64>>>| {
        predicted.map_or(f64::INFINITY, |predicted| error_in_activity(problem.records(), &predicted))
    };
    let errors = predict_all(problem, &starts).into_iter().map(error);
    let best = errors.zip(starts).filter(|(error, _)| error.is_finite()).min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, start)| start)
}

/// What is told of a set that was fitted.
fn fitted_news<'a>(set: &'a [usize], problem: &dyn Problem, fit: &Fit, of: usize) -> News<'a> {
    let rms = normalised_rms(problem, &fit.noise, &fit.linear.residual);
    News::Fitted { set, log_evidence: fit.log_evidence, rms, of }
}

#[cfg(test)]
mod tests {
    use super::alternating;

    #[test]
    fn a_promise_takes_no_place_from_what_has_been_reached() {
        // Evidence, and what is promised beside it.
        let reached = vec![(-5938.0, 61.0), (-7004.0, 2133.0), (-7151.0, 2752.0), (-7162.0, 2373.0), (-7204.0, 2615.0)];
        let order = alternating(reached, |(evidence, promised): &(f64, f64)| evidence + promised);
        let evidence: Vec<f64> = order.into_iter().map(|(evidence, _)| evidence).collect();
        assert_eq!(evidence, [-7151.0, -5938.0, -7204.0, -7004.0, -7162.0]);
    }
}
