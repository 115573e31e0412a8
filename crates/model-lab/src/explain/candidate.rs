//! One candidate: an effect added to a fitted model and everything refitted.
//!
//! A fit that got stuck is the commonest cause of a wrong answer. The starts follow the profile of the
//! fit at hand: for sizes and shapes of the effect all over its range, the parameters fitted so far are
//! moved to where they would absorb most of it (to first order), all these points are simulated side by
//! side, and the most promising ones are refined.

use nalgebra::{DMatrix, DVector};
use valve_model::{EffectKind, Valve};

use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, fit, prior_cost};
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

/// Adds an effect to a fitted model and refits everything; nothing if no start could be simulated.
pub fn add_effect(data: &Dataset, scatter: &Scatter, base: &Fit, kind: EffectKind, effort: Effort) -> Option<Fit> {
    refit(data, scatter, base, &base.space.with_effect(kind), effort)
}

/// Refits a space that has more coordinates than the fit at hand (its first ones are the same).
pub fn refit(data: &Dataset, scatter: &Scatter, base: &Fit, space: &Space, effort: Effort) -> Option<Fit> {
    started(data, scatter, base, space, effort)?.finished(data, scatter, effort)
}

/// A candidate of which several starts were refined by one Jacobian each.
#[derive(Debug, Clone)]
pub struct Started {
    /// The fits, best first.
    fits: Vec<Fit>,
}

/// Starts an effect on top of a fitted model; nothing if no start could be simulated.
pub fn start_effect(
    data: &Dataset,
    scatter: &Scatter,
    base: &Fit,
    kind: EffectKind,
    effort: Effort,
) -> Option<Started> {
    started(data, scatter, base, &base.space.with_effect(kind), effort)
}

fn started(data: &Dataset, scatter: &Scatter, base: &Fit, space: &Space, effort: Effort) -> Option<Started> {
    let points = profile_points(scatter, base, space, data);
    let usable: Vec<(Vec<f64>, Valve)> =
        points.into_iter().filter_map(|u| space.valve(&u).map(|valve| (u, valve))).collect();
    let valves: Vec<Valve> = usable.iter().map(|(_, valve)| valve.clone()).collect();
    let mut ranked: Vec<(f64, &Vec<f64>)> = residuals(data, &valves)
        .iter()
        .zip(&usable)
        .map(|(residual, (u, _))| (scatter.dot(residual, residual) + prior_cost(space, u), u))
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let starts = spread(&ranked, effort.starts, base.u.len());
    let fits = carried_on(data, scatter, space, &starts, 1);
    (!fits.is_empty()).then_some(Started { fits })
}

/// How many times what the starts promise to first order a candidate is believed to gain at most.
const BELIEVED: f64 = 5.0;

impl Started {
    /// The best of the starts as it is.
    pub fn best(&self) -> &Fit {
        &self.fits[0]
    }

    /// The cost that it may come down to, if every start gains several times what it promises.
    pub fn hope(&self) -> f64 {
        self.fits.iter().map(|fit| fit.cost - BELIEVED * fit.promised).fold(f64::INFINITY, f64::min)
    }

    /// The better half of the starts goes on, then the best.
    pub fn finished(self, data: &Dataset, scatter: &Scatter, effort: Effort) -> Option<Fit> {
        let space = &self.fits[0].space;
        let half = effort.starts.div_ceil(2);
        let better: Vec<Vec<f64>> = self.fits.iter().take(half).map(|fit| fit.u.clone()).collect();
        let best = carried_on(data, scatter, space, &better, 2).into_iter().next()?;
        if best.converged {
            return Some(best);
        }
        fit(data, scatter, space, &best.u, FitOptions { steps: effort.steps, tolerance: 0.1, stall: 3e-3 })
    }
}

/// Fits from several points, best first.
fn carried_on(data: &Dataset, scatter: &Scatter, space: &Space, points: &[Vec<f64>], steps: usize) -> Vec<Fit> {
    let options = FitOptions { steps, tolerance: 0.5, stall: 0.0 };
    let mut fits: Vec<Fit> = points.iter().filter_map(|u| fit(data, scatter, space, u, options)).collect();
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
    let (normal, _) = scatter.normal_equations(&base.jacobian, &base.residual);
    let normal = with_priors(normal, &base.space);
    let Some(cholesky) = normal.cholesky() else { return small };
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

fn with_priors(mut normal: DMatrix<f64>, space: &Space) -> DMatrix<f64> {
    for (index, coordinate) in space.coordinates.iter().enumerate() {
        normal[(index, index)] += coordinate.prior.map_or(1e-6, |(_, sigma)| 1.0 / (sigma * sigma));
    }
    normal
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
    let Some(cholesky) =
        with_priors(scatter.normal_equations(&base.jacobian, &base.residual).0, &base.space).cholesky()
    else {
        return 0.0;
    };
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
