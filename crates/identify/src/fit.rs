//! Least squares in a problem with priors, bounds and errors of unknown size.
//!
//! A fit goes through two phases. First the model error is taken for a few times the error at hand, without memory,
//! and only shrinks: an annealed fit, which does not stop where a few rows shout loudest. Then its size and
//! correlation time come from the restricted likelihood, anew at every step, until nothing more is to be gained.

use crate::horizon::stages;
use crate::noise::{GroupNoise, Noise, Smoothness, Whitener};
use crate::normal::{Linearised, Normal, Posterior, Step, Whitened, prior_cost};
use crate::problem::{Coordinate, Difference, Problem, predict_all, residuals};
use crate::soft::refined;
use crate::variance::{Effort, GroupPrior, components, evidence};

/// How a fit goes on and when it ends.
#[derive(Debug, Clone)]
pub struct FitOptions {
    /// Most derivatives of the annealed phase.
    pub annealed: usize,
    /// Most derivatives of the second phase.
    pub settled: usize,
    /// The error without memory, in errors at hand. These last for a whole motion: told as if every one of its rows had an error of
    /// its own, they would outweigh what is known of instruments and conditions, and a fit would begin by bending these.
    pub share: f64,
    /// Whether what comes before the first turn is fitted first, then what comes after it.
    pub by_turns: bool,
    /// It goes over to the second phase where a step promises to take less than this share of chi-squared away.
    pub annealed_tolerance: f64,
    /// Steps for which derivatives are used again, kept up to date by what the steps show (Broyden 1965).
    pub steps_a_derivative: usize,
    /// Dampings tried first, as factors on the damping at hand, and those tried beside them where these disappoint.
    pub dampings: [Vec<f64>; 2],
    /// It has ended where a step promises less than this, nats.
    pub tolerance: f64,
    /// The same as a share of what the model error costs: where a lot is left to be explained, a little more or less
    /// decides nothing.
    pub tolerance_of_left: f64,
    /// What is known of the errors of each group.
    pub groups: Vec<GroupPrior>,
    /// The kind of the model error.
    pub smoothness: Smoothness,
    /// Errors to start the second phase from, where a fit close by has found them.
    pub known: Option<Noise>,
    /// Most steps of a third phase, along the directions that data hardly pin; 0 where the fit is not to be told.
    pub followed: usize,
}

/// About how many rows a motion has, one after the other.
const ROWS_OF_A_MOTION: f64 = 30.0;

/// Steps along soft directions of a fit that is told: most that were looked at end after one to four, and where a model is
/// rough they wander.
pub const FOLLOWED: usize = 8;

impl FitOptions {
    /// The usual way for groups of errors.
    pub fn new(groups: Vec<GroupPrior>) -> Self {
        Self {
            annealed: 12,
            settled: 8,
            share: ROWS_OF_A_MOTION.sqrt(),
            by_turns: false,
            annealed_tolerance: 0.005,
            steps_a_derivative: 4,
            dampings: [vec![0.1, 1.0], vec![0.003, 30.0]],
            tolerance: 0.5,
            tolerance_of_left: 0.005,
            groups,
            smoothness: Smoothness::Rough,
            known: None,
            followed: 0,
        }
    }

    /// For a fit from where none has been before.
    #[must_use]
    pub fn from_nowhere(self) -> Self {
        Self { by_turns: true, ..self }
    }

    /// For a fit whose values are told, or that decides.
    #[must_use]
    pub fn exact(self) -> Self {
        Self { followed: FOLLOWED, ..self }
    }
}

/// The result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The best point found.
    pub u: Vec<f64>,
    /// The errors that it was judged with.
    pub noise: Noise,
    /// Logarithm of the evidence, nats.
    pub log_evidence: f64,
    /// The problem linear about the point.
    pub linear: Linearised,
    /// Which coordinates ended at a bound.
    pub held: Vec<bool>,
    /// What further derivatives can be expected to bring, nats: what a step with the last ones promises, times what those
    /// before kept of their promise.
    pub predicted_gain: f64,
    /// What further derivatives would have to promise for the fit to go on, nats.
    pub tolerance: f64,
    /// Whether they promise less.
    pub converged: bool,
    /// Points at which the derivatives were taken.
    pub derivatives: usize,
    /// Points at which the rows were predicted beside that.
    pub predictions: usize,
}

impl Fit {
    /// Whitened residuals of a record.
    pub fn whitened(&self, problem: &dyn Problem, record: usize) -> Vec<f64> {
        Whitener::new(&problem.records()[record], &self.noise).whitened(&self.linear.residual[record])
    }
}

/// Share of what a step promised that it must have brought for no other to be tried, and for its derivatives to be used
/// again.
const TRUSTED: f64 = 0.3;

/// So often in a row no step may be better, each time with more damping and less reach, before a phase is over.
const FAILURES: usize = 3;

/// Factor on the damping after a failure, least damping then, and least and most in all, in units of the precision's diagonal.
const MORE_DAMPING: f64 = 30.0;
const LEAST_AFTER_FAILURE: f64 = 1e-2;
const DAMPINGS: (f64, f64) = (1e-6, 1e4);

/// Factors on the longest move of a step, for the reach of the next one: where it disappointed, and where not.
const SHORTER: f64 = 0.3;
const LONGER: f64 = 3.0;

/// Share of the least that a step must promise from which a more damped one is tried beside it.
const LEAST_SHARE: f64 = 0.1;

/// So many of the steps tried are corrected for what they showed.
const CORRECTED: usize = 2;

/// Reaches, in prior deviations, of the steps that are tried along soft directions, and how often each is led back to the floor
/// of a valley that it left because the valley bends.
const REACHES: [f64; 4] = [1.0, 0.3, 0.1, 0.03];
const LED_BACK: usize = 3;

/// Such a step must bring this share of what would end the fit.
const WORTHWHILE: f64 = 0.3;

/// A step that was tried.
struct Trial {
    u: Vec<f64>,
    residual: Vec<Vec<f64>>,
    /// Normal equations there, with the derivatives of where it came from.
    normal: Normal,
    cost: f64,
    factor: f64,
    predicted_gain: f64,
}

/// A step that was taken.
struct Taken {
    u: Vec<f64>,
    residual: Vec<Vec<f64>>,
    /// Fall of the cost, nats.
    gain: f64,
    /// Fall of the cost as a share of what was promised.
    share: f64,
    /// Precision of each coordinate, the metric of updates.
    weights: Vec<f64>,
}

/// Steps taken since something was done last.
#[derive(Debug, Clone, Copy, Default)]
struct Since {
    /// Steps since the derivatives were taken.
    derivatives: usize,
    /// Failures since a step was better.
    success: usize,
    /// What all steps with the same derivatives have brought, nats.
    brought: f64,
}

/// Where a phase stands.
enum Advance {
    To(Linearised),
    End(Linearised),
}

/// A fit under way.
struct Fitting<'a> {
    problem: &'a dyn Problem,
    options: &'a FitOptions,
    derivatives: usize,
    predictions: usize,
    damping: f64,
    /// No coordinate moves by more than this in a step, in prior deviations.
    reach: f64,
    /// The deviation of each coordinate, all others known, as it was seen last.
    sigmas: Vec<f64>,
    /// The most that a step with the derivatives at hand promised, nats, and what they must bring for others to be taken.
    promised: f64,
    least: f64,
    /// The share of their promise that the last derivatives kept.
    kept: f64,
}

/// Fits a problem from a starting point; nothing where that is impossible, or was stopped on the way.
pub fn fit(problem: &dyn Problem, start: &[f64], options: &FitOptions) -> Option<Fit> {
    let start =
        problem.coordinates().iter().zip(start).map(|(coordinate, u)| u.clamp(coordinate.lower, coordinate.upper));
    let mut start: Vec<f64> = start.collect();
    if options.by_turns {
        for until in stages(problem) {
            let mut fitting = Fitting::new(&until, options);
            let at = fitting.linearised(start)?;
            start = fitting.anneal(at)?.u;
        }
    }
    let mut fitting = Fitting::new(problem, options);
    let at = fitting.linearised(start)?;
    fitting.ended(at)
}

/// Goes on from where a fit of the same problem ended; nothing where it was stopped on the way.
pub fn go_on(problem: &dyn Problem, from: &Fit, options: &FitOptions) -> Option<Fit> {
    let mut fitting = Fitting::new(problem, options);
    fitting.derivatives = 1;
    fitting.ended(from.linear.clone())
}

impl<'a> Fitting<'a> {
    fn new(problem: &'a dyn Problem, options: &'a FitOptions) -> Self {
        Self {
            problem,
            options,
            derivatives: 0,
            predictions: 0,
            damping: 1e-2,
            reach: 1.0,
            sigmas: vec![f64::INFINITY; problem.coordinates().len()],
            promised: 0.0,
            least: 0.0,
            kept: 1.0,
        }
    }

    /// The fit from its first derivatives.
    fn ended(mut self, at: Linearised) -> Option<Fit> {
        let at = self.anneal(at)?;
        self.settle(at)
    }
}

impl Fitting<'_> {
    fn linearised(&mut self, u: Vec<f64>) -> Option<Linearised> {
        self.derivatives += 1;
        let coordinates = self.problem.coordinates().iter().zip(u.iter().zip(&self.sigmas));
        let is_told = self.options.followed > 0;
        let step = |(coordinate, (u, sigma)): (&Coordinate, (&f64, &f64))| {
            if is_told { coordinate.exact_step_at(*u, *sigma) } else { coordinate.step_at(*u, *sigma) }
        };
        let steps: Vec<Difference> = coordinates.map(step).collect();
        let linear = self.problem.linearise(&u, &steps)?;
        // What was stopped among the moved points has no derivative, and would count as moving nothing.
        if self.problem.stop().is_asked() {
            return None;
        }
        Some(Linearised::new(self.problem, u, linear))
    }

    /// The best of several damped steps, by what is predicted there; nothing where none is better, or where none
    /// promises `least` nats.
    fn stepped(&mut self, at: &Linearised, whitened: &Whitened, least: f64) -> Option<Taken> {
        let coordinates = self.problem.coordinates();
        let posterior = Posterior::new(coordinates, &at.u, &whitened.normal);
        self.sigmas = posterior.precision.diagonal().iter().map(|precision| precision.sqrt().recip()).collect();
        let newton = posterior.newton().filter(|step| step.predicted_gain >= 2.0 * least)?;
        (self.promised, self.least) = (self.promised.max(0.5 * newton.predicted_gain), least);
        let worthwhile = |step: &Step| step.predicted_gain > 2.0 * LEAST_SHARE * least;
        let mut tried = Vec::new();
        for factors in &self.options.dampings {
            let steps = factors.iter().filter_map(|factor| {
                let step = posterior.step(factor * self.damping, self.reach).filter(worthwhile)?;
                Some((step.to, *factor, step.predicted_gain))
            });
            let steps = steps.collect();
            self.try_all(whitened, steps, &mut tried);
            let enough = |trial: &Trial| posterior.cost - trial.cost > TRUSTED * trial.predicted_gain;
            if tried.iter().any(enough) {
                break;
            }
            // Along a curved valley a step ends beside its floor: the same derivatives lead back down.
            tried.sort_by(|a, b| a.cost.total_cmp(&b.cost));
            let seconds = tried.iter().take(CORRECTED).filter_map(|trial: &Trial| {
                let posterior = Posterior::new(coordinates, &trial.u, &trial.normal);
                let step = posterior.step(trial.factor * self.damping, self.reach).filter(worthwhile)?;
                Some((step.to, trial.factor, trial.predicted_gain))
            });
            let seconds = seconds.collect();
            self.try_all(whitened, seconds, &mut tried);
            if tried.iter().any(enough) {
                break;
            }
        }
        let best = tried.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        let Trial { u, residual, cost, factor, predicted_gain, .. } = best;
        let gain = 0.5 * (posterior.cost - cost);
        if gain <= 0.0 {
            self.reach *= SHORTER;
            self.damping = (MORE_DAMPING * self.damping).clamp(LEAST_AFTER_FAILURE, DAMPINGS.1);
            return None;
        }
        // Damping and reach follow what worked.
        let moves = u.iter().zip(&at.u).zip(coordinates).map(|((to, from), c)| (to - from).abs() / c.sigma);
        let moved = moves.fold(0.0, f64::max);
        self.reach =
            if 2.0 * gain < TRUSTED * predicted_gain { SHORTER * moved } else { self.reach.max(LONGER * moved) };
        self.damping = (factor * self.damping).clamp(DAMPINGS.0, DAMPINGS.1);
        let weights = posterior.precision.diagonal().iter().copied().collect();
        Some(Taken { u, residual, gain, share: 2.0 * gain / predicted_gain, weights })
    }

    /// Predicts at points and adds what came out.
    fn try_all(&mut self, whitened: &Whitened, points: Vec<(Vec<f64>, f64, f64)>, tried: &mut Vec<Trial>) {
        self.predictions += points.len();
        let wanted: Vec<Vec<f64>> = points.iter().map(|(u, ..)| u.clone()).collect();
        for (predicted, (u, factor, predicted_gain)) in predict_all(self.problem, &wanted).into_iter().zip(points) {
            let Some(predicted) = predicted else { continue };
            let residual = residuals(self.problem, &predicted);
            let normal = whitened.with_residuals(&residual);
            let cost = normal.chi2 + normal.log_determinant + prior_cost(self.problem.coordinates(), &u);
            if cost.is_finite() {
                tried.push(Trial { u, residual, normal, cost, factor, predicted_gain });
            }
        }
    }

    /// Goes where a step led: with derivatives kept up to date by what it showed while they hold, else anew. Where no step
    /// was better, first with derivatives of this very point, then a few times more; nothing to go on to ends the phase. So
    /// do derivatives that brought less than is worth the next ones: where a model is rough, steps keep little of their
    /// promise, and a fit that creeps along has ended.
    fn advanced(&mut self, at: Linearised, taken: Option<Taken>, since: &mut Since) -> Option<Advance> {
        let Some(taken) = taken else {
            if since.derivatives > 0 {
                return self.anew(at.u, since);
            }
            since.success += 1;
            return Some(if since.success > FAILURES { Advance::End(at) } else { Advance::To(at) });
        };
        since.success = 0;
        since.brought += taken.gain;
        if since.derivatives < self.options.steps_a_derivative && taken.share > TRUSTED {
            since.derivatives += 1;
            return Some(Advance::To(at.updated(taken.u, taken.residual, &taken.weights)));
        }
        self.anew(taken.u, since)
    }

    /// New derivatives, and the end of the phase where the last ones brought too little.
    fn anew(&mut self, u: Vec<f64>, since: &mut Since) -> Option<Advance> {
        let at = self.linearised(u)?;
        let brought = std::mem::take(since).brought;
        self.kept = (brought / self.promised).clamp(0.0, 1.0);
        self.promised = 0.0;
        Some(if brought < self.least { Advance::End(at) } else { Advance::To(at) })
    }

    /// The annealed phase: the error at hand, without memory and only shrinking, decides how much a row counts.
    fn anneal(&mut self, mut at: Linearised) -> Option<Linearised> {
        let mut sizes = vec![f64::INFINITY; self.options.groups.len()];
        let mut since = Since::default();
        while self.derivatives < self.options.annealed && !self.problem.stop().is_asked() {
            let now = error_sizes(self.problem, &at);
            for (size, now) in sizes.iter_mut().zip(&now) {
                *size = size.min(self.options.share * now);
            }
            let noise = self.memoryless(&sizes);
            let whitened = Whitened::new(self.problem, &at, &noise);
            let least = 0.5 * self.options.annealed_tolerance * whitened.normal.chi2;
            let taken = self.stepped(&at, &whitened, least);
            match self.advanced(at, taken, &mut since)? {
                Advance::To(next) => at = next,
                Advance::End(last) => return Some(last),
            }
        }
        if since.derivatives > 0 { self.linearised(at.u) } else { Some(at) }
    }

    fn memoryless(&self, sizes: &[f64]) -> Noise {
        let groups = sizes.iter().map(|size| GroupNoise { multiplier: 1.0, discrepancy: *size, time_s: 0.0 });
        Noise { groups: groups.collect(), smoothness: self.options.smoothness }
    }

    /// The second phase: the errors' sizes from what is left, a step, and again.
    fn settle(mut self, mut at: Linearised) -> Option<Fit> {
        let sizes = error_sizes(self.problem, &at);
        let mut effort = Effort::Global;
        let mut noise = self.options.known.clone().unwrap_or_else(|| self.starting_noise(&sizes));
        let mut predicted_gain = f64::INFINITY;
        let most = self.derivatives + self.options.settled;
        let mut since = Since::default();
        let mut has_ended = false;
        while !self.problem.stop().is_asked() {
            if since.derivatives == 0 {
                noise = components(self.problem, &at, &self.options.groups, &noise, effort);
                effort = Effort::Local;
            }
            let whitened = Whitened::new(self.problem, &at, &noise);
            let posterior = Posterior::new(self.problem.coordinates(), &at.u, &whitened.normal);
            let promised = posterior.newton().map_or(f64::INFINITY, |step| 0.5 * step.predicted_gain);
            predicted_gain = self.kept * promised;
            let tolerance = self.tolerance(&noise, &whitened.normal);
            let has_converged = promised < tolerance;
            if since.derivatives == 0 && (has_converged || has_ended || self.derivatives >= most) {
                break;
            }
            let taken = if has_converged { None } else { self.stepped(&at, &whitened, tolerance) };
            match self.advanced(at, taken, &mut since)? {
                Advance::To(next) => at = next,
                Advance::End(last) => (at, has_ended) = (last, true),
            }
        }
        if self.options.followed > 0 {
            (at, noise, predicted_gain) = self.follow(at, noise)?;
            has_ended = true;
        }
        let normal = at.normal(self.problem, &noise);
        let log_evidence = evidence(self.problem, &at, &normal, &self.options.groups, &noise);
        let tolerance = self.tolerance(&noise, &normal);
        let converged = has_ended || predicted_gain < tolerance;
        let coordinates = self.problem.coordinates();
        let held = coordinates.iter().zip(&at.u).map(|(coordinate, u)| coordinate.is_at_bound(*u)).collect();
        Some(Fit {
            u: at.u.clone(),
            noise,
            log_evidence,
            linear: at,
            held,
            predicted_gain,
            tolerance,
            converged,
            derivatives: self.derivatives,
            predictions: self.predictions,
        })
    }

    /// The third phase: steps along directions that data hardly pin, with derivatives measured along these. Such valleys are
    /// narrow and bend: a step leaves them, and the same derivatives lead back to their floor. Where nothing is gained that way, all
    /// derivatives are taken anew once. Ends at derivatives that were measured where it is; nothing where it was stopped.
    fn follow(&mut self, mut at: Linearised, mut noise: Noise) -> Option<(Linearised, Noise, f64)> {
        let mut are_new = false;
        for round in 0.. {
            at = refined(self.problem, at, &noise);
            noise = components(self.problem, &at, &self.options.groups, &noise, Effort::Local);
            let whitened = Whitened::new(self.problem, &at, &noise);
            let posterior = Posterior::new(self.problem.coordinates(), &at.u, &whitened.normal);
            let promised = posterior.newton().map_or(0.0, |step| 0.5 * step.predicted_gain);
            let tolerance = self.tolerance(&noise, &whitened.normal);
            if promised < tolerance || round >= self.options.followed || self.problem.stop().is_asked() {
                return Some((at, noise, promised));
            }
            let best = self.along_valley(&whitened, &posterior);
            match best.filter(|best| 0.5 * (posterior.cost - best.cost) > WORTHWHILE * tolerance) {
                Some(best) => {
                    let weights: Vec<f64> = posterior.precision.diagonal().iter().copied().collect();
                    at = at.updated(best.u, best.residual, &weights);
                    are_new = false;
                }
                None if are_new => return Some((at, noise, promised)),
                None => {
                    at = self.linearised(at.u)?;
                    are_new = true;
                }
            }
        }
        unreachable!("the loop ends")
    }

    /// The best of several points on the way to where the least is expected, each led back to the floor of its valley.
    fn along_valley(&mut self, whitened: &Whitened, posterior: &Posterior<'_>) -> Option<Trial> {
        let coordinates = self.problem.coordinates();
        let newton = posterior.newton()?;
        let moves =
            newton.to.iter().zip(posterior.u()).zip(coordinates).map(|((to, from), c)| (to - from).abs() / c.sigma);
        let longest = moves.fold(0.0, f64::max);
        let on_the_way = |share: f64| newton.to.iter().zip(posterior.u()).map(|(to, u)| u + share * (to - u)).collect();
        let mut shares = REACHES.map(|reach| (reach / longest).min(1.0)).to_vec();
        shares.dedup();
        let first = shares.iter().map(|share| (on_the_way(*share), *share, 0.0)).collect();
        let mut tried = Vec::new();
        self.try_all(whitened, first, &mut tried);
        let mut at = 0;
        for _ in 0..LED_BACK {
            let back = tried[at..].iter().filter_map(|trial: &Trial| {
                let there = Posterior::new(coordinates, &trial.u, &trial.normal);
                Some((there.led_back(posterior, 1.0 - trial.factor, &newton.held)?, trial.factor, 0.0))
            });
            let back = back.collect();
            at = tried.len();
            self.try_all(whitened, back, &mut tried);
        }
        tried.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// What a step may promise at the end, nats.
    fn tolerance(&self, noise: &Noise, normal: &Normal) -> f64 {
        let groups = noise.groups.iter().map(|group| GroupNoise { discrepancy: 0.0, ..*group });
        let white = Noise { groups: groups.collect(), smoothness: noise.smoothness };
        let of_record = |record| Whitener::new(record, &white).log_determinant;
        let without: f64 = self.problem.records().iter().map(of_record).sum();
        let left = 0.5 * (normal.log_determinant - without);
        self.options.tolerance.max(self.options.tolerance_of_left * left)
    }

    fn starting_noise(&self, sizes: &[f64]) -> Noise {
        let groups = self.options.groups.iter().enumerate().map(|(group, prior)| GroupNoise {
            multiplier: 1.0,
            // A group that no series has is there all the same.
            discrepancy: sizes.get(group).map_or(0.0, |size| size.clamp(prior.discrepancy.0, prior.discrepancy.1)),
            time_s: (prior.time_s.0 * prior.time_s.1).sqrt(),
        });
        Noise { groups: groups.collect(), smoothness: self.options.smoothness }
    }
}

/// How large the error beyond the noise is in each group, in units of the activity (for single readings, none).
pub fn error_sizes(problem: &dyn Problem, at: &Linearised) -> Vec<f64> {
    let groups = problem.records().iter().flat_map(|record| &record.series).map(|series| series.group + 1).max();
    let mut sums = vec![(0.0, 0.0); groups.unwrap_or(0)];
    for (record, residual) in problem.records().iter().zip(&at.residual) {
        let mut rest = residual.as_slice();
        for series in &record.series {
            let Some(stretch) = rest.split_off(..series.rows.len()) else { continue };
            let sum = &mut sums[series.group];
            for (row, residual) in series.rows.iter().zip(stretch) {
                sum.0 += residual * residual - row.sigma * row.sigma;
                sum.1 += row.activity * row.activity;
            }
        }
    }
    sums.into_iter()
        .map(|(error, activity)| if activity > 0.0 { (error.max(0.0) / activity).sqrt() } else { 0.0 })
        .collect()
}
