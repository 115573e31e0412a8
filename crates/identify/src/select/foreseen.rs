//! Where a set with one effect more begins, by what the smaller set's fit knows.

use rayon::prelude::*;

use super::race::settling;
use super::{Family, Level, Model, Search, Set};
use crate::Problem;
use crate::fit::{Fit, fit};
use crate::noise::{Noise, Whitener};
use crate::normal::{Linearised, Posterior, prior_cost};
use crate::problem::{Linear, Record, predict_all, residuals};
use crate::variance::{Effort, components, evidence};

/// So many of the likeliest beginnings are looked at where their derivatives lead: far from where these were taken they promise
/// too much.
const LIKELIEST: usize = 3;

/// How far shapes that hardly anybody knows are varied, in prior deviations.
const VARIED: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];

impl<F: Family> Search<'_, F> {
    /// Where a set with one effect more is likely to be best, and with which errors: from the optimum of the smaller set, by
    /// the derivatives there and what the effect does at each of several sizes. At a single, very small one this would be
    /// the score test (Rao, Mathematical Proceedings of the Cambridge Philosophical Society 44(1), 1948).
    pub(super) fn foreseen(&self, problem: &F::Member, set: &[usize], from: &[usize]) -> Option<(Vec<f64>, Noise)> {
        let smaller = self.models.get(&(shared_by(set, from), Level::Screen))?;
        let shared = self.family.shared(&smaller.problem, problem);
        let size = shared.iter().position(Option::is_none)?;
        let coordinates = problem.coordinates();
        let mut points = self.family.warm(problem, &smaller.problem, &smaller.fit.u);
        for point in &mut points {
            for (u, coordinate) in point.iter_mut().zip(coordinates) {
                *u = u.clamp(coordinate.lower, coordinate.upper);
            }
            if point[size] == 0.0 {
                point[size] = coordinates[size].step_at(0.0, f64::INFINITY).ahead;
            }
        }
        // What the size is counted from, with the shapes of each point.
        let off = |point: &Vec<f64>| {
            let mut off = point.clone();
            off[size] = 0.0;
            off
        };
        let mut counted_from: Vec<Vec<f64>> = Vec::new();
        for from in points.iter().map(off) {
            if !counted_from.contains(&from) {
                counted_from.push(from);
            }
        }
        let of_point: Vec<Option<usize>> =
            points.iter().map(|point| counted_from.iter().position(|from| *from == off(point))).collect();
        let predicted = predict_all(problem, &[points.as_slice(), &counted_from].concat());
        let (predicted, without) = predicted.split_at(points.len());
        let columns = columns_of(&smaller.fit, &shared);
        let linear = points.into_iter().zip(predicted).zip(of_point).filter_map(|((u, predicted), off)| {
            let (predicted, without) = (predicted.as_ref()?, without[off?].as_ref()?);
            let linear = predicted.iter().zip(without).zip(&columns).map(|((predicted, without), columns)| {
                let by_size = predicted.iter().zip(without).map(|(with, without)| (with - without) / u[size]);
                let mut columns = columns.clone();
                columns.push((size, by_size.collect()));
                Linear { predicted: predicted.clone(), columns }
            });
            let linear = linear.collect();
            Some(Linearised::new(problem, u, linear))
        });
        let is_held = |index: usize| shared[index].is_none() && index != size;
        self.best_end(problem, linear.collect(), is_held, &smaller.fit.noise)
    }

    /// Where a set is likely to be best as exactly as it is reported, by its cheap fit: from there, and with each coordinate that is
    /// free in the end only (a shape that hardly anybody knows) varied over its prior. Such shapes have valleys of their own.
    pub(super) fn refined(&self, problem: &F::Member, cheap: &Model<F::Member>) -> Vec<f64> {
        let start = self.family.carried(&cheap.problem, &cheap.fit.u, problem);
        let shared = self.family.shared(&cheap.problem, problem);
        let is_held = |index: usize| shared[index].is_none();
        let coordinates = problem.coordinates();
        let mut points = vec![start.clone()];
        for index in (0..coordinates.len()).filter(|index| is_held(*index)) {
            points.extend(VARIED.map(|by| {
                let mut point = start.clone();
                let to = point[index] + by * coordinates[index].sigma;
                point[index] = to.clamp(coordinates[index].lower, coordinates[index].upper);
                point
            }));
        }
        if points.len() == 1 {
            return start;
        }
        let columns = columns_of(&cheap.fit, &shared);
        let linear = predict_all(problem, &points).into_iter().zip(points).filter_map(|(predicted, u)| {
            let of_record = predicted?.into_iter().zip(&columns);
            let linear = of_record.map(|(predicted, columns)| Linear { predicted, columns: columns.clone() }).collect();
            Some(Linearised::new(problem, u, linear))
        });
        let best = self.best_end(problem, linear.collect(), is_held, &cheap.fit.noise);
        best.map_or(start, |(point, _)| point)
    }

    /// Of several points, with the derivatives of a fit close by, the one whose step ends best, as it ends, and the errors that are
    /// foreseen there. Coordinates for which no derivative speaks are held: the prior alone would draw them to its mean.
    fn best_end(
        &self,
        problem: &F::Member,
        linear: Vec<Linearised>,
        is_held: impl Fn(usize) -> bool,
        noise: &Noise,
    ) -> Option<(Vec<f64>, Noise)> {
        let groups = self.family.options().groups;
        let coordinates = problem.coordinates();
        let likely = linear.into_iter().map(|at| {
            let likely = evidence(problem, &at, &at.normal(problem, noise), &groups, noise);
            (likely, at)
        });
        let mut linear: Vec<(f64, Linearised)> = likely.filter(|(likely, _)| likely.is_finite()).collect();
        linear.sort_by(|a, b| b.0.total_cmp(&a.0));
        let chi2 = |residuals: &[Vec<f64>]| -> f64 {
            let whitened = |(record, residual): (&Record, &Vec<f64>)| Whitener::new(record, noise).whitened(residual);
            problem.records().iter().zip(residuals).flat_map(whitened).map(|value| value * value).sum()
        };
        // The one that is best as it stands is hardly worse than the fit close by, wherever the others lead.
        let cost = |at: &Linearised| chi2(&at.residual) + prior_cost(coordinates, &at.u);
        let costs = linear.iter().map(|(_, at)| cost(at)).enumerate();
        let nearest = costs.min_by(|a, b| a.1.total_cmp(&b.1))?.0;
        let chosen = linear.into_iter().enumerate().filter(|(place, _)| *place < LIKELIEST || *place == nearest);
        let stepped = chosen.filter_map(|(_, (_, at))| {
            let noise = components(problem, &at, &groups, noise, Effort::Local);
            let mut to = Posterior::new(coordinates, &at.u, &at.normal(problem, &noise)).newton()?.to;
            (0..to.len()).filter(|index| is_held(*index)).for_each(|index| to[index] = at.u[index]);
            Some((to, noise))
        });
        let stepped: Vec<(Vec<f64>, Noise)> = stepped.collect();
        let ends: Vec<Vec<f64>> = stepped.iter().map(|(to, _)| to.clone()).collect();
        let costs = predict_all(problem, &ends)
            .into_iter()
            .zip(&ends)
            .map(|(predicted, to)| Some(chi2(&residuals(problem, &predicted?)) + prior_cost(coordinates, to)));
        let costs: Vec<Option<f64>> = costs.collect();
        let best = stepped.into_iter().zip(costs).filter_map(|(start, cost)| Some((start, cost?)));
        best.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(start, _)| start)
    }

    /// Fits the sets that others grow out of, as these are first looked at.
    pub(super) fn look_at_smaller(&mut self, sets: &[Set], from: &[usize]) {
        let mut wanted: Vec<Set> = Vec::new();
        for set in sets {
            let smaller = shared_by(set, from);
            if !wanted.contains(&smaller) && !self.looked_at.contains(&smaller) {
                wanted.push(smaller);
            }
        }
        let base = self.family.options();
        let fits: Vec<(Set, F::Member, Fit)> = wanted
            .par_iter()
            .filter_map(|set| {
                let of = |level: Level| self.models.get(&(set.clone(), level));
                let known = of(Level::Low).or_else(|| of(Level::High))?;
                let problem = self.family.member(set, Level::Screen)?;
                let start = self.family.carried(&known.problem, &known.fit.u, &problem);
                // Without the errors of all records: those of a few may be other ones.
                let fit = fit(&problem, &start, &settling(base.settled, base.clone()))?;
                Some((set.clone(), problem, fit))
            })
            .collect();
        for (set, problem, fit) in fits {
            self.keep(set, Level::Screen, problem, fit);
        }
        self.looked_at.extend(wanted);
    }
}

/// Derivatives of a fit, by record, as those of a problem that shares coordinates with it.
fn columns_of(fit: &Fit, shared: &[Option<usize>]) -> Vec<Vec<(usize, Vec<f64>)>> {
    let place = |theirs: usize| shared.iter().position(|same| *same == Some(theirs));
    let of_record = |columns: &Vec<(usize, Vec<f64>)>| {
        columns.iter().filter_map(|(theirs, column)| Some((place(*theirs)?, column.clone()))).collect()
    };
    fit.linear.columns.iter().map(of_record).collect()
}

/// The set that another grows out of: the one at hand, or, for one in which an effect was exchanged, what both share.
fn shared_by(set: &[usize], from: &[usize]) -> Set {
    set.iter().copied().filter(|one| from.contains(one)).collect()
}
