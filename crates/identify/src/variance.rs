//! Variance components: how large noise and model error are, by restricted likelihood.
//!
//! About a point the evidence is that of a linear model with normal errors; as a function of the errors' sizes it is
//! the restricted likelihood (Patterson and Thompson, Biometrika 58(3), 1971) with the priors of the coordinates. It has
//! more than one summit, so a grid is looked at first and the best of it refined.

use crate::noise::{GroupNoise, Noise, Whitener};
use crate::normal::{Linearised, Normal, Posterior};
use crate::problem::Problem;

/// What is known of a group's errors beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupPrior {
    /// Standard deviation of the logarithm of the noise multiplier.
    pub multiplier_sigma: f64,
    /// Least and largest noise multiplier.
    pub multiplier: (f64, f64),
    /// Least and largest discrepancy that is looked at; the largest also ends where the residuals do.
    pub discrepancy: (f64, f64),
    /// Shortest and longest correlation time, s.
    pub time_s: (f64, f64),
}

/// How thoroughly sizes are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// A grid over discrepancy and time, then refined.
    Global,
    /// Refined from where they are.
    Local,
}

/// Points of the grid: discrepancies and times.
const GRID: (usize, usize) = (10, 5);

/// Points of the grid that are looked at with what the coordinates may take; all others only with the residuals.
const LOOKED_AT: usize = 5;

/// First and last factor by which sizes are moved in the refinement.
const MOVES: (f64, f64) = (2.0, 1.05);

/// The powers of that factor by which multiplier, discrepancy and correlation time are moved together: each alone, and
/// where one stands in for another.
const DIRECTIONS: [[i32; 3]; 5] = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]];

/// A gain of evidence below this is none, nats.
const LEAST_GAIN: f64 = 0.05;

/// The sizes that make what is left about a linearised problem most likely.
pub fn components<P: Problem + ?Sized>(
    problem: &P,
    at: &Linearised,
    priors: &[GroupPrior],
    from: &Noise,
    effort: Effort,
) -> Noise {
    let score = |noise: &Noise| -> f64 { evidence(problem, at, &at.normal(problem, noise), priors, noise) };
    let mut best = from.clone();
    let mut best_score = score(&best);
    let mut consider = |noise: Noise, best: &mut Noise| -> bool {
        let value = score(&noise);
        let better = value > best_score + LEAST_GAIN;
        if better {
            best_score = value;
            *best = noise;
        }
        better
    };
    for (group, prior) in priors.iter().enumerate().take(from.groups.len()) {
        let has_process = problem
            .records()
            .iter()
            .flat_map(|record| &record.series)
            .any(|series| series.group == group && series.is_process && !series.rows.is_empty());
        if effort == Effort::Global && has_process {
            let none = GroupNoise { discrepancy: 0.0, ..best.groups[group] };
            consider(replaced(&best, group, none), &mut best);
            let ((least, most), times) = (prior.discrepancy, prior.time_s);
            let mut grid: Vec<(f64, Noise)> = (0..GRID.0 * GRID.1)
                .map(|point| GroupNoise {
                    discrepancy: between(least, most, point / GRID.1, GRID.0),
                    time_s: between(times.0, times.1, point % GRID.1, GRID.1),
                    ..best.groups[group]
                })
                .map(|one| replaced(&best, group, one))
                .map(|noise| (log_likelihood(problem, at, &noise), noise))
                .collect();
            grid.sort_by(|a, b| b.0.total_cmp(&a.0));
            for (_, noise) in grid.into_iter().take(LOOKED_AT) {
                consider(noise, &mut best);
            }
        }
        let mut factor = MOVES.0;
        while factor > MOVES.1 {
            let mut moved = false;
            for powers in DIRECTIONS {
                if powers[1..] != [0, 0] && (!has_process || best.groups[group].discrepancy == 0.0) {
                    continue;
                }
                for factor in [factor, 1.0 / factor] {
                    while consider(
                        replaced(&best, group, scaled(best.groups[group], *prior, powers, factor)),
                        &mut best,
                    ) {
                        moved = true;
                    }
                }
            }
            if !moved {
                factor = factor.sqrt();
            }
        }
        if has_process && best.groups[group].discrepancy > 0.0 {
            consider(replaced(&best, group, GroupNoise { discrepancy: 0.0, ..best.groups[group] }), &mut best);
        }
    }
    best
}

/// The logarithm of the likelihood of the residuals alone, up to a constant, nats.
fn log_likelihood<P: Problem + ?Sized>(problem: &P, at: &Linearised, noise: &Noise) -> f64 {
    let records = problem.records().iter().zip(&at.residual);
    let of_record = |(record, residual): (_, &Vec<f64>)| {
        let whitener = Whitener::new(record, noise);
        let chi2: f64 = whitener.whitened(residual).iter().map(|value| value * value).sum();
        chi2 + whitener.log_determinant
    };
    -0.5 * records.map(of_record).sum::<f64>()
}

/// The evidence of a linearised problem with what is known of the errors' sizes, nats.
pub fn evidence<P: Problem + ?Sized>(
    problem: &P,
    at: &Linearised,
    normal: &Normal,
    priors: &[GroupPrior],
    noise: &Noise,
) -> f64 {
    let posterior = Posterior::new(problem.coordinates(), &at.u, normal);
    posterior.log_evidence().unwrap_or(f64::NEG_INFINITY) + log_prior(priors, noise)
}

/// The logarithm of the prior density of the errors' sizes, up to a constant.
pub fn log_prior(priors: &[GroupPrior], noise: &Noise) -> f64 {
    priors
        .iter()
        .zip(&noise.groups)
        .map(|(prior, group)| -0.5 * (group.multiplier.ln() / prior.multiplier_sigma).powi(2))
        .sum()
}

fn replaced(noise: &Noise, group: usize, by: GroupNoise) -> Noise {
    let mut noise = noise.clone();
    noise.groups[group] = by;
    noise
}

fn scaled(group: GroupNoise, prior: GroupPrior, powers: [i32; 3], factor: f64) -> GroupNoise {
    let moved = |value: f64, power: i32, (least, most): (f64, f64)| {
        if power == 0 { value } else { (value * factor.powi(power)).clamp(least, most) }
    };
    GroupNoise {
        multiplier: moved(group.multiplier, powers[0], prior.multiplier),
        discrepancy: moved(group.discrepancy, powers[1], prior.discrepancy),
        time_s: moved(group.time_s, powers[2], prior.time_s),
    }
}

/// Point `index` of `count` between two positive ends, in equal ratios.
fn between(least: f64, most: f64, index: usize, count: usize) -> f64 {
    let share = index as f64 / (count - 1).max(1) as f64;
    least * (most / least).powf(share)
}
