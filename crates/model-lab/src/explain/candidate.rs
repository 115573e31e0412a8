//! One candidate: an effect added to a fitted model and everything refitted.
//!
//! A fit that got stuck is the commonest cause of a wrong answer. The starts follow the profile of the
//! fit at hand: for sizes and shapes of the effect all over its range, the parameters fitted so far are
//! moved to where they would absorb most of it (to first order), all these points are simulated side by
//! side, and the most promising ones are refined.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use valve_model::{EffectKind, Valve};

use super::Watch;
use super::impression::Impression;
use super::view::View;
use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, MOST_MEMORY, Task, fit_all, prior_cost};
use crate::forward::residuals;
use crate::scatter::Scatter;
use crate::space::{Space, Target};

/// Sizes of an effect at which the profile is looked at, in typical sizes.
const SIZES: [f64; 5] = [0.04, 0.25, 1.0, 3.0, 10.0];

/// The size at which the direction of an effect is taken, in typical sizes.
const SMALL: f64 = 0.02;

/// Share of what an effect changes that must be left when everything else took its part; less than that
/// is what the simulation is not linear in.
const SEEN: f64 = 2e-3;

/// How thoroughly a candidate is fitted.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Starts that are refined at all; half of them are refined further.
    pub starts: usize,
    /// Jacobians spent on the best.
    pub steps: usize,
}

impl Effort {
    /// For the first effect.
    pub const THOROUGH: Self = Self { starts: 4, steps: 10 };
    /// For pairs and triples, which start from a good fit.
    pub const QUICK: Self = Self { starts: 2, steps: 8 };
    /// For pairs with the second best, and for effects in place of one that was found.
    pub const STAND_IN: Self = Self { starts: 2, steps: 8 };
    /// To see whether it could come near one that fits.
    pub const GLANCE: Self = Self { starts: 1, steps: 8 };
}

/// How many times what the starts promise to first order a candidate is believed to gain at most.
const BELIEVED: f64 = 5.0;

/// Adds an effect to a model fitted roughly and refits everything; nothing if no start could be simulated.
pub fn add_effect(view: &View, base: &Fit, kind: EffectKind, effort: Effort, watch: &Watch<'_>) -> Option<Fit> {
    let started = start_effects(view, &[(base, kind)], effort, watch).pop()?;
    finished(view, started.iter(), effort).pop()?
}

/// A candidate fitted to the first impression.
#[derive(Debug, Clone)]
pub struct Started {
    /// The fit to the impression.
    pub fit: Fit,
}

/// Starts effects, each on top of a model fitted roughly, side by side; nothing where no start could be
/// simulated, or where the search is stopped before they are.
pub fn start_effects(
    view: &View,
    jobs: &[(&Fit, EffectKind)],
    effort: Effort,
    watch: &Watch<'_>,
) -> Vec<Option<Started>> {
    let none = vec![None; jobs.len()];
    if watch.is_stopped() {
        return none;
    }
    let Impression { data, scatter, .. } = &view.impression;
    let jobs: Vec<Job> = jobs
        .par_iter()
        .map(|(base, kind)| Job {
            base: view.impression.shown(&view.rough, base),
            space: base.space.with_effect(*kind),
        })
        .collect();
    let starts = promising(data, scatter, &jobs, effort.starts);
    // The better half of the starts goes on, then the best.
    let first = starts.iter().enumerate().flat_map(|(index, starts)| {
        let Job { base, space } = &jobs[index];
        starts
            .iter()
            .map(move |u| (index, Task { space, start: u.clone(), known: base.jacobian.to_vec(), options: FIRST }))
    });
    let first = best_first(data, scatter, jobs.len(), first);
    if watch.is_stopped() {
        return none;
    }
    let goes_on = FitOptions { steps: 2, ..FIRST };
    let better = first.iter().enumerate().flat_map(|(index, fits)| {
        fits.iter().take(effort.starts.div_ceil(2)).map(move |from| (index, Task::from(from, goes_on)))
    });
    let better = best_first(data, scatter, jobs.len(), better);
    if watch.is_stopped() {
        return none;
    }
    let best: Vec<Option<Fit>> = better.into_iter().map(|fits| fits.into_iter().next()).collect();
    let goes_on = best.iter().flatten().filter(|fit| !fit.converged);
    let mut last =
        fit_all(data, scatter, goes_on.map(|from| Task::from(from, to_the_end(effort))).collect()).into_iter();
    best.iter()
        .map(|best| match best {
            Some(best) if !best.converged => last.next()?,
            best => best.clone(),
        })
        .map(|fit| fit.map(|fit| Started { fit }))
        .collect()
}

/// An effect to start, as the impression shows it.
struct Job {
    base: Fit,
    space: Space,
}

/// One Jacobian for each start.
const FIRST: FitOptions = FitOptions { steps: 1, tolerance: 0.5, stall: 3e-3 };

fn to_the_end(effort: Effort) -> FitOptions {
    FitOptions { steps: effort.steps, tolerance: 0.1, stall: 3e-3 }
}

/// The cost that a fit may come down to, as far as its last Jacobian tells.
pub fn hope(fit: &Fit) -> f64 {
    fit.cost - BELIEVED * fit.promised
}

/// Candidates fitted to the end with all the data.
pub fn finished<'a>(view: &View, started: impl Iterator<Item = &'a Started>, effort: Effort) -> Vec<Option<Fit>> {
    let tasks = started.map(|started| Task::from(&started.fit, to_the_end(effort)));
    fit_all(&view.rough, &view.scatter, tasks.collect())
}

/// Candidates that were seen with all the data fitted to the end.
pub fn carried_on(view: &View, seen: &[Fit], effort: Effort) -> Vec<Option<Fit>> {
    let known = |fit: &Fit| fit.jacobian.to_vec();
    let tasks = seen.iter().map(|fit| Task { known: known(fit), ..Task::from(fit, to_the_end(effort)) });
    fit_all(&view.rough, &view.scatter, tasks.collect())
}

/// Candidates fitted with one Jacobian with all the data, each beside the fit that it was added to: they stay
/// behind, and this says how far.
pub fn seen(view: &View, started: &[(&Fit, &Started)]) -> Vec<Option<Fit>> {
    let tasks = started.iter().map(|(_, started)| Task::from(&started.fit, FIRST));
    let mut fits = fit_all(&view.rough, &view.scatter, tasks.collect());
    // Where the first impression led astray, next to no effect at all is better.
    let (astray, next): (Vec<&mut Option<Fit>>, Vec<Task<'_>>) = fits
        .iter_mut()
        .zip(started)
        .filter(|(fit, (base, _))| fit.as_ref().is_none_or(|fit| fit.cost > base.cost))
        .map(|(fit, (base, Started { fit: at }))| {
            let small = probes(&at.space, base.u.len()).swap_remove(0).small;
            let task = Task { space: &at.space, start: full(base, &small), known: Vec::new(), options: FIRST };
            (fit, task)
        })
        .unzip();
    for (fit, again) in astray.into_iter().zip(fit_all(&view.rough, &view.scatter, next)) {
        if again.as_ref().is_some_and(|again| fit.as_ref().is_none_or(|fit| again.cost < fit.cost)) {
            *fit = again;
        }
    }
    fits
}

/// Makes fits, each for the job of its index; those of each job, the best first.
fn best_first<'a>(
    data: &Dataset,
    scatter: &Scatter,
    jobs: usize,
    tasks: impl Iterator<Item = (usize, Task<'a>)>,
) -> Vec<Vec<Fit>> {
    let (indices, tasks): (Vec<usize>, Vec<Task<'_>>) = tasks.unzip();
    let mut fits: Vec<Vec<Fit>> = vec![Vec::new(); jobs];
    for (index, fit) in indices.into_iter().zip(fit_all(data, scatter, tasks)) {
        fits[index].extend(fit);
    }
    for fits in &mut fits {
        fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    }
    fits
}

/// Points that a profile has, more or less.
const PROFILE_POINTS: usize = 64;

/// Most promising points of each job, along the profiles of its new coordinates.
fn promising(data: &Dataset, scatter: &Scatter, jobs: &[Job], count: usize) -> Vec<Vec<Vec<f64>>> {
    let each = PROFILE_POINTS * data.residual_count() * size_of::<f64>();
    let together = (MOST_MEMORY / each.max(1)).max(1);
    jobs.chunks(together).flat_map(|jobs| promising_together(data, scatter, jobs, count)).collect()
}

fn promising_together(data: &Dataset, scatter: &Scatter, jobs: &[Job], count: usize) -> Vec<Vec<Vec<f64>>> {
    let probes: Vec<Vec<Probe>> = jobs.iter().map(|job| probes(&job.space, job.base.u.len())).collect();
    let small =
        jobs.iter().zip(&probes).map(|(job, probes)| probes.iter().map(|p| full(&job.base, &p.small)).collect());
    let changed = simulated(data, jobs, &small.collect::<Vec<_>>());
    let points: Vec<Vec<Vec<f64>>> = (jobs, probes, changed)
        .into_par_iter()
        .map(|(job, probes, changed)| profile_points(scatter, job, &probes, &changed))
        .collect();
    let seen = simulated(data, jobs, &points);
    (jobs, points, seen)
        .into_par_iter()
        .map(|(job, points, seen)| {
            let cost = |(u, residual): (Vec<f64>, Option<Vec<f64>>)| {
                let residual = residual?;
                Some((scatter.dot(&residual, &residual) + prior_cost(&job.space, &u), u))
            };
            let mut ranked: Vec<(f64, Vec<f64>)> = points.into_iter().zip(seen).filter_map(cost).collect();
            ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
            spread(&ranked, count, job.base.u.len())
        })
        .collect()
}

/// The residuals at points of each job, all simulated side by side; nothing where one is no possible valve.
fn simulated(data: &Dataset, jobs: &[Job], points: &[Vec<Vec<f64>>]) -> Vec<Vec<Option<Vec<f64>>>> {
    let valves: Vec<Vec<Option<Valve>>> =
        jobs.iter().zip(points).map(|(job, points)| points.iter().map(|u| job.space.valve(u)).collect()).collect();
    let possible: Vec<Valve> = valves.iter().flatten().flatten().cloned().collect();
    let mut residuals = residuals(data, &possible).into_iter();
    valves
        .iter()
        .map(|valves| valves.iter().map(|valve| valve.as_ref().and_then(|_| residuals.next())).collect())
        .collect()
}

/// The best points, but no two of the same shape and sign next to each other.
fn spread(ranked: &[(f64, Vec<f64>)], count: usize, old: usize) -> Vec<Vec<f64>> {
    let mut chosen: Vec<Vec<f64>> = Vec::new();
    for (_, u) in ranked {
        let near = |other: &Vec<f64>| {
            let same_shape = u[old + 1..].iter().zip(&other[old + 1..]).all(|(a, b)| (a - b).abs() < 1e-9);
            let ratio = u[old] / other[old];
            same_shape && ratio > 0.0 && (0.2..5.0).contains(&ratio)
        };
        if chosen.len() < count && !chosen.iter().any(near) {
            chosen.push(u.clone());
        }
    }
    chosen
}

/// Points along the profiles of the new coordinates; `changed` are the residuals for a small size of every
/// shape.
fn profile_points(scatter: &Scatter, job: &Job, probes: &[Probe], changed: &[Option<Vec<f64>>]) -> Vec<Vec<f64>> {
    let Job { base, space } = job;
    let old = base.u.len();
    let mut points = Vec::new();
    let Some(cholesky) = normal_matrix(scatter, base).cholesky() else {
        return probes.iter().map(|probe| full(base, &probe.small)).collect();
    };
    for (probe, changed) in probes.iter().zip(changed) {
        let Some(changed) = changed else { continue };
        let change: Vec<f64> = changed.iter().zip(&base.residual).map(|(a, b)| a - b).collect();
        let projection = DVector::from_iterator(old, base.jacobian.iter().map(|column| scatter.dot(column, &change)));
        let answer = -cholesky.solve(&projection);
        for large in &probe.sizes {
            let ratio = large.1;
            let mut u = full(base, &large.0);
            for (index, value) in u.iter_mut().enumerate().take(old) {
                *value += (answer[index] * ratio).clamp(-3.0, 3.0);
            }
            points.push(space.clamped(&u));
            // A calibration without the effect may have gone far astray: start from the datasheet too.
            let datasheet: Vec<f64> = base.space.start().into_iter().take(old).chain(large.0.iter().copied()).collect();
            points.push(space.clamped(&datasheet));
        }
        points.push(full(base, &probe.small));
    }
    points
}

fn full(base: &Fit, new: &[f64]) -> Vec<f64> {
    base.u.iter().chain(new).copied().collect()
}

/// The normal matrix of a fit with its priors, made regular.
fn normal_matrix(scatter: &Scatter, fit: &Fit) -> DMatrix<f64> {
    let (mut matrix, _) = fit.space.with_priors(&fit.u, scatter.normal_equations(&fit.jacobian, &fit.residual));
    for index in 0..fit.u.len() {
        matrix[(index, index)] += 1e-6;
    }
    matrix
}

/// A shape of the new effect: its new coordinates at a small size, and at larger ones with their
/// ratio to the small one.
struct Probe {
    small: Vec<f64>,
    sizes: Vec<(Vec<f64>, f64)>,
}

fn probes(space: &Space, old: usize) -> Vec<Probe> {
    let new = &space.coordinates[old..];
    let start: Vec<f64> = new.iter().map(|coordinate| coordinate.start).collect();
    let kind = match new[0].target {
        Target::Effect(slot, _) => Some(space.effects()[slot].kind()),
        _ => None,
    };
    let mut shapes: Vec<Vec<f64>> = vec![start.clone()];
    let vary = |shapes: &mut Vec<Vec<f64>>, index: usize, values: &[f64]| {
        let with = |value: f64| {
            let mut shape = start.clone();
            shape[index] = value;
            shape
        };
        shapes.extend(values.iter().map(|value| with(*value)));
    };
    match kind {
        Some(EffectKind::OrificeLaw) => {
            // The nozzle's own critical ratio is 0.528, that is 1.78 in this coordinate.
            let sizes = [1.5, 1.0, 0.0, -1.0, -2.0, -3.0].map(|u| (vec![u], (1.78 - u) / 0.1));
            return vec![Probe { small: vec![1.68], sizes: sizes.to_vec() }];
        }
        Some(EffectKind::SolenoidLag) => {
            let shapes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.3], [0.3, 0.3, 1.0]];
            return shapes.iter().map(|shape| scaled(shape, &SIZES, space, old)).collect();
        }
        Some(EffectKind::DryFriction) => {
            vary(&mut shapes, 1, &[0.0, 1.0]);
            vary(&mut shapes, 2, &[-1.5, 1.0]);
        }
        Some(EffectKind::ClosingCushion | EffectKind::OpeningCushion | EffectKind::SeatAdhesion) => {
            vary(&mut shapes, 1, &[-1.2, 0.8]);
        }
        Some(EffectKind::ProcessForce) => vary(&mut shapes, 1, &[0.6, 1.2]),
        _ => {}
    }
    shapes.iter().map(|shape| sized(shape, space, old)).collect()
}

/// The first coordinate is the size, the others the shape.
fn sized(shape: &[f64], space: &Space, old: usize) -> Probe {
    let with = |size: f64| {
        let mut point = shape.to_vec();
        point[0] = size;
        point
    };
    let allowed = |size: f64| {
        let coordinate = &space.coordinates[old];
        size >= coordinate.lower && size <= coordinate.upper
    };
    let signed = SIZES.iter().flat_map(|size| [*size, -*size]).filter(|size| allowed(*size));
    Probe { small: with(SMALL), sizes: signed.map(|size| (with(size), size / SMALL)).collect() }
}

/// All coordinates scale together.
fn scaled(shape: &[f64], sizes: &[f64], space: &Space, old: usize) -> Probe {
    let at = |size: f64| -> Vec<f64> {
        let point: Vec<f64> = shape.iter().map(|value| value * size).collect();
        point.iter().zip(&space.coordinates[old..]).map(|(u, c)| u.clamp(c.lower, c.upper)).collect()
    };
    Probe { small: at(SMALL), sizes: sizes.iter().map(|size| (at(*size), size / SMALL)).collect() }
}

/// The fall of chi-squared that an effect promises to first order on top of a fit, the largest over its
/// shapes of at least `least` typical sizes. Tells whether looking further is worth it; it is no judge.
pub fn promised_gain(data: &Dataset, scatter: &Scatter, base: &Fit, kind: EffectKind, least: f64) -> f64 {
    let space = base.space.with_effect(kind);
    let old = base.u.len();
    let Some(cholesky) = normal_matrix(scatter, base).cholesky() else { return 0.0 };
    let small: Vec<Valve> =
        probes(&space, old).iter().filter_map(|probe| space.valve(&full(base, &probe.small))).collect();
    let one_sided = space.coordinates[old].lower >= 0.0 && kind != EffectKind::OrificeLaw;
    residuals(data, &small)
        .iter()
        .map(|changed| {
            let change: Vec<f64> = changed.iter().zip(&base.residual).map(|(a, b)| a - b).collect();
            let projection = DVector::from_iterator(old, base.jacobian.iter().map(|c| scatter.dot(c, &change)));
            let absorbed = projection.dot(&cholesky.solve(&projection));
            let whole = scatter.dot(&change, &change);
            let visible = whole - absorbed;
            let score = scatter.dot(&change, &base.residual);
            let size = -score / visible * SMALL;
            let possible = if one_sided { size > least } else { size.abs() > least };
            if visible > SEEN * whole && possible { score * score / visible } else { 0.0 }
        })
        .fold(0.0, f64::max)
}
