//! Least squares in a problem with priors, bounds and errors of unknown size.
//!
//! A fit goes through two phases. First the model error is taken for a share of the error at hand, without memory,
//! and only shrinks: an annealed fit, which does not stop where a few rows shout loudest. Then its size and
//! correlation time come from the restricted likelihood, anew at every step, until nothing more is to be gained.

use crate::noise::{GroupNoise, Noise, Smoothness, Whitener};
use crate::normal::{Linearised, Posterior, Step, dot, prior_cost};
use crate::problem::{Problem, predict_all, residuals};
use crate::variance::{Effort, GroupPrior, components, evidence};

/// How a fit goes on and when it ends.
#[derive(Debug, Clone)]
pub struct FitOptions {
    /// Most derivatives of the annealed phase.
    pub annealed: usize,
    /// Most derivatives of the second phase.
    pub settled: usize,
    /// The error without memory, as a share of the error at hand.
    pub share: f64,
    /// Dampings tried side by side, as factors on the damping at hand.
    pub dampings: Vec<f64>,
    /// It has ended where a step promises less than this, nats.
    pub tolerance: f64,
    /// What is known of the errors of each group.
    pub groups: Vec<GroupPrior>,
    /// The kind of the model error.
    pub smoothness: Smoothness,
    /// Errors to start the second phase from, where a fit close by has found them.
    pub known: Option<Noise>,
}

impl FitOptions {
    /// The usual way for groups of errors.
    pub fn new(groups: Vec<GroupPrior>) -> Self {
        Self {
            annealed: 12,
            settled: 8,
            share: 0.3,
            dampings: vec![0.0, 0.03, 1.0, 30.0],
            tolerance: 0.5,
            groups,
            smoothness: Smoothness::Rough,
            known: None,
        }
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
    /// What a further step promises, nats.
    pub promised: f64,
    /// Whether that is less than what was asked for.
    pub converged: bool,
    /// Points at which the derivatives were taken.
    pub derivatives: usize,
    /// Points at which the rows were predicted beside that.
    pub predictions: usize,
}

impl Fit {
    /// Whitened residuals of a record.
    pub fn whitened<P: Problem + ?Sized>(&self, problem: &P, record: usize) -> Vec<f64> {
        Whitener::new(&problem.records()[record], &self.noise).whitened(&self.linear.residual[record])
    }
}

/// A fit under way.
struct Fitting<'a, P: Problem + ?Sized> {
    problem: &'a P,
    options: &'a FitOptions,
    derivatives: usize,
    predictions: usize,
    damping: f64,
}

/// Fits a problem from a starting point; nothing where that is impossible.
pub fn fit<P: Problem + ?Sized>(problem: &P, start: &[f64], options: &FitOptions) -> Option<Fit> {
    let mut fitting = Fitting { problem, options, derivatives: 0, predictions: 0, damping: 1e-2 };
    let start =
        problem.coordinates().iter().zip(start).map(|(coordinate, u)| u.clamp(coordinate.lower, coordinate.upper));
    let at = fitting.linearised(start.collect())?;
    let at = fitting.anneal(at);
    fitting.settle(at)
}

impl<P: Problem + ?Sized> Fitting<'_, P> {
    fn linearised(&mut self, u: Vec<f64>) -> Option<Linearised> {
        self.derivatives += 1;
        let steps: Vec<f64> =
            self.problem.coordinates().iter().zip(&u).map(|(coordinate, u)| coordinate.step_at(*u)).collect();
        let linear = self.problem.linearise(&u, &steps)?;
        Some(Linearised::new(self.problem, u, linear))
    }

    /// The best of several damped steps, by what is simulated there; nothing where none is better.
    fn stepped(&mut self, at: &Linearised, noise: &Noise, least: f64) -> Option<(Vec<f64>, f64)> {
        let normal = at.normal(self.problem, noise);
        let posterior = Posterior::new(self.problem.coordinates(), &at.u, &normal);
        let steps: Vec<(f64, Step)> = self
            .options
            .dampings
            .iter()
            .filter_map(|factor| Some((*factor, posterior.step(factor * self.damping)?)))
            .filter(|(_, step)| step.promised > 2.0 * least)
            .collect();
        if steps.is_empty() {
            return None;
        }
        let points: Vec<Vec<f64>> = steps.iter().map(|(_, step)| step.to.clone()).collect();
        self.predictions += points.len();
        let whiteners: Vec<Whitener> =
            self.problem.records().iter().map(|record| Whitener::new(record, noise)).collect();
        let cost = |point: &[f64], predicted: &[Vec<f64>]| -> f64 {
            let mut cost = prior_cost(self.problem.coordinates(), point) + normal.log_determinant;
            for (mut residual, whitener) in residuals(self.problem, predicted).into_iter().zip(&whiteners) {
                whitener.apply(&mut residual);
                cost += dot(&residual, &residual);
            }
            cost
        };
        let best = predict_all(self.problem, &points)
            .into_iter()
            .zip(&steps)
            .filter_map(|(predicted, (factor, step))| Some((cost(&step.to, &predicted?), *factor, step)))
            .filter(|(cost, ..)| cost.is_finite())
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let (cost, factor, step) = best?;
        let gain = 0.5 * (posterior.cost - cost);
        if gain <= 0.0 {
            return None;
        }
        // The damping follows what worked.
        self.damping = match factor {
            0.0 => 0.3 * self.damping,
            factor => factor * self.damping,
        }
        .clamp(1e-6, 1e4);
        Some((step.to.clone(), gain))
    }

    /// The annealed phase: the error at hand, without memory and only shrinking, decides how much a row counts.
    fn anneal(&mut self, mut at: Linearised) -> Linearised {
        let mut sizes = vec![f64::INFINITY; self.options.groups.len()];
        let mut failed = false;
        for _ in 0..self.options.annealed {
            if self.problem.stop().is_asked() {
                break;
            }
            let now = error_sizes(self.problem, &at);
            let mut shrunk = false;
            for (size, now) in sizes.iter_mut().zip(&now) {
                let wanted = self.options.share * now;
                shrunk |= wanted < 0.8 * *size;
                *size = size.min(wanted);
            }
            let noise = self.memoryless(&sizes);
            match self.stepped(&at, &noise, 2.0) {
                Some((u, _)) => {
                    failed = false;
                    match self.linearised(u) {
                        Some(next) => at = next,
                        None => break,
                    }
                }
                None if !shrunk && failed => break,
                None => {
                    failed = true;
                    self.damping = (30.0 * self.damping).min(1e4);
                    if !shrunk {
                        continue;
                    }
                }
            }
        }
        at
    }

    fn memoryless(&self, sizes: &[f64]) -> Noise {
        let groups = sizes.iter().map(|size| GroupNoise { multiplier: 1.0, discrepancy: *size, time_s: 0.0 });
        Noise { groups: groups.collect(), smoothness: self.options.smoothness }
    }

    /// The second phase: the errors' sizes from what is left, a step, and again.
    fn settle(mut self, mut at: Linearised) -> Option<Fit> {
        let sizes = error_sizes(self.problem, &at);
        let mut effort = Effort::Global;
        let mut noise = match &self.options.known {
            Some(known) => {
                effort = Effort::Local;
                known.clone()
            }
            None => self.starting_noise(&sizes),
        };
        let mut promised = f64::INFINITY;
        for _ in 0..self.options.settled.max(1) {
            noise = components(self.problem, &at, &self.options.groups, &noise, effort);
            effort = Effort::Local;
            let normal = at.normal(self.problem, &noise);
            let posterior = Posterior::new(self.problem.coordinates(), &at.u, &normal);
            promised = posterior.step(0.0).map_or(f64::INFINITY, |step| 0.5 * step.promised);
            if promised < self.options.tolerance || self.options.settled == 0 || self.problem.stop().is_asked() {
                break;
            }
            match self.stepped(&at, &noise, self.options.tolerance) {
                Some((u, gain)) => {
                    at = self.linearised(u)?;
                    if gain < self.options.tolerance {
                        break;
                    }
                }
                None if self.damping < 1.0 => self.damping = 30.0 * self.damping.max(1e-2),
                None => break,
            }
        }
        let normal = at.normal(self.problem, &noise);
        let log_evidence = evidence(self.problem, &at, &normal, &self.options.groups, &noise);
        let coordinates = self.problem.coordinates();
        let held = coordinates.iter().zip(&at.u).map(|(coordinate, u)| coordinate.is_at_bound(*u)).collect();
        Some(Fit {
            u: at.u.clone(),
            noise,
            log_evidence,
            linear: at,
            held,
            promised,
            converged: promised < self.options.tolerance,
            derivatives: self.derivatives,
            predictions: self.predictions,
        })
    }

    fn starting_noise(&self, sizes: &[f64]) -> Noise {
        let groups = sizes.iter().zip(&self.options.groups).map(|(size, prior)| GroupNoise {
            multiplier: 1.0,
            discrepancy: size.clamp(prior.discrepancy.0, prior.discrepancy.1),
            time_s: (prior.time_s.0 * prior.time_s.1).sqrt(),
        });
        Noise { groups: groups.collect(), smoothness: self.options.smoothness }
    }
}

/// How large the error beyond the noise is in each group, in units of the activity (for single readings, none).
pub fn error_sizes<P: Problem + ?Sized>(problem: &P, at: &Linearised) -> Vec<f64> {
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
    sums.into_iter().map(|(error, activity)| if activity > 0.0 { (error.max(0.0) / activity).sqrt() } else { 0.0 }).collect()
}
