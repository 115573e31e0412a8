//! Variance components: how large noise and model error are, by restricted likelihood.
//!
//! About a point the evidence is that of a linear model with normal errors; as a function of the errors' sizes it is
//! the restricted likelihood (Patterson and Thompson, Biometrika 58(3), 1971) with the priors of the coordinates. It has
//! more than one summit, so a grid is looked at first and the best of it refined.

use std::sync::Arc;

use rayon::prelude::*;

use crate::noise::{GroupNoise, Noise, log_likelihood};
use crate::normal::{GroupRows, Linearised, Normal, Posterior};
use crate::problem::{Coordinate, Problem};

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

/// Shares of the noise at hand that the grid goes through: what was taken for noise may be model error, and then there is less.
const QUIETER: [f64; 3] = [1.0, 0.5, 0.25];

/// Points of the grid that are looked at with what the coordinates may take; all others only with the residuals.
const LOOKED_AT: usize = 5;

/// First and last factor by which sizes are moved in the refinement.
const MOVES: (f64, f64) = (2.0, 1.05);

/// The powers of that factor by which multiplier, discrepancy and correlation time are moved together: each alone, and
/// where one stands in for another.
const DIRECTIONS: [[i32; 3]; 5] = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]];

/// A gain of evidence below this is none, nats.
const LEAST_GAIN: f64 = 0.05;

/// A refinement goes over what the coordinates make of the sizes at most so often.
const ROUNDS: usize = 4;

/// No size moves by more than this factor in one of them.
const REACH: f64 = 8.0;

/// The factor by which a size is moved to see what the coordinates make of it.
const DIFFERENCE: f64 = 1.2;

/// Sizes with what they make of the records: how likely they are, and where the coordinates are best under them.
struct Judged {
    noise: Noise,
    log_evidence: f64,
    to: Vec<f64>,
    /// The normal equations of each group's rows.
    normals: Vec<Arc<Normal>>,
}

/// A linearised problem whose errors' sizes are looked for.
struct Sizing<'a> {
    coordinates: &'a [Coordinate],
    u: &'a [f64],
    /// Its rows by group: errors of different groups are independent, so that only a part changes with the sizes of one.
    groups: Vec<GroupRows>,
    priors: &'a [GroupPrior],
}

/// The sizes that make what is left about a linearised problem most likely.
pub fn components(
    problem: &dyn Problem,
    at: &Linearised,
    priors: &[GroupPrior],
    from: &Noise,
    effort: Effort,
) -> Noise {
    let groups = (0..from.groups.len()).map(|group| at.rows_of_group(problem, group)).collect();
    let sizing = Sizing { coordinates: problem.coordinates(), u: &at.u, groups, priors };
    let Some(mut best) = sizing.judged(from.clone(), None) else { return from.clone() };
    for (group, prior) in priors.iter().enumerate().take(from.groups.len()) {
        let rows = &sizing.groups[group];
        let mut series = rows.records.iter().flat_map(|record| &record.series).peekable();
        if series.peek().is_none() {
            continue;
        }
        let has_process = series.any(|series| series.is_process);
        if effort == Effort::Global && has_process {
            let none = GroupNoise { discrepancy: 0.0, ..best.noise.groups[group] };
            sizing.consider(group, none, &mut best);
            let ((least, most), times) = (prior.discrepancy, prior.time_s);
            let about = best.noise.groups[group].multiplier;
            let multipliers = QUIETER.map(|share| (share * about).max(prior.multiplier.0));
            let mut grid: Vec<(f64, GroupNoise)> = (0..GRID.0 * GRID.1)
                .flat_map(|point| {
                    multipliers.map(|multiplier| GroupNoise {
                        discrepancy: between(least, most, point / GRID.1, GRID.0),
                        time_s: between(times.0, times.1, point % GRID.1, GRID.1),
                        multiplier,
                    })
                })
                .map(|one| {
                    let noise = replaced(&best.noise, group, one);
                    (log_likelihood(&rows.records, &rows.linear.residual, &noise), one)
                })
                .collect();
            grid.sort_by(|a, b| b.0.total_cmp(&a.0));
            for (_, one) in grid.into_iter().take(LOOKED_AT) {
                sizing.consider(group, one, &mut best);
            }
        }
        for _ in 0..ROUNDS {
            let refined = sizing.refined(&best, group, has_process);
            if !sizing.consider(group, refined, &mut best) {
                break;
            }
        }
        if has_process && best.noise.groups[group].discrepancy > 0.0 {
            let none = GroupNoise { discrepancy: 0.0, ..best.noise.groups[group] };
            sizing.consider(group, none, &mut best);
        }
    }
    best.noise
}

impl Sizing<'_> {
    /// What sizes make of the records; of those that were judged before only the ones of a group differ.
    fn judged(&self, noise: Noise, before: Option<(&Judged, usize)>) -> Option<Judged> {
        let of_group =
            |group: usize| Arc::new(self.groups[group].linear.normal_of(&self.groups[group].records, &noise));
        let normals: Vec<Arc<Normal>> = match before {
            Some((judged, group)) => {
                let mut normals = judged.normals.clone();
                normals[group] = of_group(group);
                normals
            }
            None => (0..self.groups.len()).map(of_group).collect(),
        };
        let mut normal = Normal::empty(self.u.len());
        for of_group in &normals {
            normal.add(of_group);
        }
        let (step, log_evidence) = Posterior::new(self.coordinates, self.u, &normal).least()?;
        let log_evidence = log_evidence + log_prior(self.priors, &noise);
        log_evidence.is_finite().then_some(Judged { noise, log_evidence, to: step.to, normals })
    }

    /// Takes sizes of a group that are more likely; whether they are.
    fn consider(&self, group: usize, sizes: GroupNoise, best: &mut Judged) -> bool {
        let judged = self.judged(replaced(&best.noise, group, sizes), Some((best, group)));
        let better = judged.filter(|one| one.log_evidence > best.log_evidence + LEAST_GAIN);
        let is_better = better.is_some();
        if let Some(better) = better {
            *best = better;
        }
        is_better
    }

    /// The likely sizes of a group, from others close by. What the rows left say of them is taken as it is, with the
    /// coordinates where they are best under the sizes at hand; how much of it is owed to the freedom of the coordinates, the
    /// part that is costly to compute, as linear in the logarithms of the sizes.
    fn refined(&self, from: &Judged, group: usize, has_process: bool) -> GroupNoise {
        let start = from.noise.groups[group];
        let prior = narrowed(self.priors[group], start);
        let rows = &self.groups[group];
        let left = rows.linear.foreseen(&from.to);
        let of_rows = |noise: &Noise| log_likelihood(&rows.records, &left, noise) + log_prior(self.priors, noise);
        let of_freedom = |judged: &Judged| judged.log_evidence - of_rows(&judged.noise);
        let moves_process = has_process && start.discrepancy > 0.0;
        let known = of_freedom(from);
        let slopes: Vec<f64> = DIRECTIONS[..if moves_process { 3 } else { 1 }]
            .par_iter()
            .map(|powers| {
                let moved = [DIFFERENCE, DIFFERENCE.recip()].map(|factor| scaled(start, prior, *powers, factor));
                let by = |moved: &GroupNoise| logarithms(*moved, start).into_iter().sum::<f64>();
                let farthest = moved.into_iter().max_by(|a, b| by(a).abs().total_cmp(&by(b).abs()));
                let Some(moved) = farthest.filter(|moved| by(moved) != 0.0) else { return 0.0 };
                let judged = self.judged(replaced(&from.noise, group, moved), Some((from, group)));
                judged.map_or(0.0, |judged| (of_freedom(&judged) - known) / by(&moved))
            })
            .collect();
        let score = |noise: &Noise| {
            let logarithms = logarithms(noise.groups[group], start);
            of_rows(noise) + slopes.iter().zip(logarithms).map(|(slope, by)| slope * by).sum::<f64>()
        };
        let mut best = (score(&from.noise), from.noise.clone());
        let mut factor = MOVES.0;
        while factor > MOVES.1 {
            let mut moved = false;
            for powers in DIRECTIONS {
                if powers[1..] != [0, 0] && !moves_process {
                    continue;
                }
                for factor in [factor, 1.0 / factor] {
                    loop {
                        let noise = replaced(&best.1, group, scaled(best.1.groups[group], prior, powers, factor));
                        let value = score(&noise);
                        if value <= best.0 + LEAST_GAIN {
                            break;
                        }
                        best = (value, noise);
                        moved = true;
                    }
                }
            }
            if !moved {
                factor = factor.sqrt();
            }
        }
        best.1.groups[group]
    }
}

/// The range of sizes that a refinement goes through at once.
fn narrowed(prior: GroupPrior, about: GroupNoise) -> GroupPrior {
    let within =
        |(least, most): (f64, f64), value: f64| (f64::max(least, value / REACH), f64::min(most, value * REACH));
    GroupPrior {
        multiplier: within(prior.multiplier, about.multiplier),
        discrepancy: within(prior.discrepancy, about.discrepancy),
        time_s: within(prior.time_s, about.time_s),
        ..prior
    }
}

/// The logarithms by which multiplier, discrepancy and correlation time differ; nothing where one is zero.
fn logarithms(one: GroupNoise, other: GroupNoise) -> [f64; 3] {
    let by = |one: f64, other: f64| if one > 0.0 && other > 0.0 { (one / other).ln() } else { 0.0 };
    [by(one.multiplier, other.multiplier), by(one.discrepancy, other.discrepancy), by(one.time_s, other.time_s)]
}

/// The evidence of a linearised problem with what is known of the errors' sizes, nats.
pub fn evidence(problem: &dyn Problem, at: &Linearised, normal: &Normal, priors: &[GroupPrior], noise: &Noise) -> f64 {
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
