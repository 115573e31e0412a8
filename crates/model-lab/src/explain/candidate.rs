//! One candidate: an effect added to a fitted model and everything refitted.
//!
//! A fit that got stuck is the commonest cause of a wrong answer. The starts follow the profile of the
//! fit at hand: for sizes and shapes of the effect all over its range, the parameters fitted so far are
//! moved to where they would absorb most of it (to first order), all these points are simulated side by
//! side, and the most promising ones are refined.

use nalgebra::{DMatrix, DVector};
use valve_model::{EffectKind, Valve};

use super::impression::Impression;
use super::view::View;
use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, fit, fit_near, prior_cost};
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
pub fn add_effect(view: &View, base: &Fit, kind: EffectKind, effort: Effort) -> Option<Fit> {
    start_effect(view, base, kind, effort)?.finished(view, effort)
}

/// A candidate fitted to the first impression.
#[derive(Debug, Clone)]
pub struct Started {
    /// The fit to the impression.
    fit: Fit,
}

/// Starts an effect on top of a model fitted roughly; nothing if no start could be simulated.
pub fn start_effect(view: &View, base: &Fit, kind: EffectKind, effort: Effort) -> Option<Started> {
    let space = &base.space.with_effect(kind);
    let Impression { data, scatter, .. } = &view.impression;
    let base = view.impression.shown(&view.rough, base);
    let points = profile_points(scatter, &base, space, data);
    let usable: Vec<(Vec<f64>, Valve)> =
        points.into_iter().filter_map(|u| space.valve(&u).map(|valve| (u, valve))).collect();
    let valves: Vec<Valve> = usable.iter().map(|(_, valve)| valve.clone()).collect();
    let mut ranked: Vec<(f64, &Vec<f64>)> = residuals(data, &valves)
        .iter()
        .zip(&usable)
        .map(|(residual, (u, _))| (scatter.dot(residual, residual) + prior_cost(space, u), u))
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    // The better half of the starts goes on, then the best.
    let starts = spread(&ranked, effort.starts, base.u.len());
    let fits = best_first(starts.iter().filter_map(|u| fit_near(data, scatter, space, &base, u, FIRST)));
    let better = fits.into_iter().take(effort.starts.div_ceil(2));
    let goes_on = FitOptions { steps: 2, ..FIRST };
    let mut best =
        best_first(better.filter_map(|from| fit(data, scatter, space, &from.u, goes_on))).into_iter().next()?;
    if !best.converged {
        best = fit(data, scatter, space, &best.u, to_the_end(effort))?;
    }
    Some(Started { fit: best })
}

/// One Jacobian for each start.
const FIRST: FitOptions = FitOptions { steps: 1, tolerance: 0.5, stall: 3e-3 };

fn to_the_end(effort: Effort) -> FitOptions {
    FitOptions { steps: effort.steps, tolerance: 0.1, stall: 3e-3 }
}

impl Started {
    /// The cost that it may come down to on the impression, and so the least it can have on all the data.
    pub fn hope(&self) -> f64 {
        self.fit.cost - BELIEVED * self.fit.promised
    }

    /// As all the data see it, not refined any further; its Jacobian is left out.
    pub fn seen(self, view: &View) -> Option<Fit> {
        let residual = residuals(&view.rough, &[self.fit.space.valve(&self.fit.u)?]).remove(0);
        let chi2 = view.scatter.dot(&residual, &residual);
        let cost = chi2 + prior_cost(&self.fit.space, &self.fit.u);
        Some(Fit { residual, chi2, cost, jacobian: Vec::new(), ..self.fit })
    }

    /// Fitted to the end with all the data.
    pub fn finished(&self, view: &View, effort: Effort) -> Option<Fit> {
        fit(&view.rough, &view.scatter, &self.fit.space, &self.fit.u, to_the_end(effort))
    }
}

fn best_first(fits: impl Iterator<Item = Fit>) -> Vec<Fit> {
    let mut fits: Vec<Fit> = fits.collect();
    fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    fits
}

/// The best points, but no two of the same shape and sign next to each other.
fn spread(ranked: &[(f64, &Vec<f64>)], count: usize, old: usize) -> Vec<Vec<f64>> {
    let mut chosen: Vec<Vec<f64>> = Vec::new();
    for (_, u) in ranked {
        let near = |other: &Vec<f64>| {
            let same_shape = u[old + 1..].iter().zip(&other[old + 1..]).all(|(a, b)| (a - b).abs() < 1e-9);
            let ratio = u[old] / other[old];
            same_shape && ratio > 0.0 && (0.2..5.0).contains(&ratio)
        };
        if chosen.len() < count && !chosen.iter().any(near) {
            chosen.push((*u).clone());
        }
    }
    chosen
}

/// Points along the profiles of the new coordinates.
fn profile_points(scatter: &Scatter, base: &Fit, space: &Space, data: &Dataset) -> Vec<Vec<f64>> {
    let old = base.u.len();
    let mut points = Vec::new();
    let probes = probes(space, old);
    // The change of the residuals for a small size of every shape.
    let small: Vec<Vec<f64>> = probes.iter().map(|probe| full(base, &probe.small)).collect();
    let usable: Vec<Option<Valve>> = small.iter().map(|u| space.valve(u)).collect();
    let valves: Vec<Valve> = usable.iter().flatten().cloned().collect();
    let mut changed = residuals(data, &valves).into_iter();
    let Some(cholesky) = normal_matrix(scatter, base).cholesky() else { return small };
    for (probe, valve) in probes.iter().zip(&usable) {
        let Some(changed) = valve.as_ref().and_then(|_| changed.next()) else { continue };
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
        points.push(small_point(base, probe));
    }
    points
}

fn small_point(base: &Fit, probe: &Probe) -> Vec<f64> {
    full(base, &probe.small)
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
