//! Where a set with one effect more begins, by what the smaller set's fit knows.

use rayon::prelude::*;

use super::race::settling;
use super::{Family, Level, Search, Set};
use crate::Problem;
use crate::fit::{Fit, FitOptions, fit};
use crate::noise::Noise;
use crate::normal::{Linearised, Posterior};
use crate::problem::{Linear, predict_all};
use crate::variance::{Effort, components, evidence};

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
                point[size] = coordinates[size].step_at(0.0, f64::INFINITY);
            }
        }
        let mut off = points.first()?.clone();
        off[size] = 0.0;
        points.push(off);
        let mut predicted = predict_all(problem, &points);
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
            let at = Linearised::new(problem, u, linear);
            let likely = evidence(problem, &at, &at.normal(problem, noise), &groups, noise);
            likely.is_finite().then_some((likely, at))
        });
        let (_, at) = linear.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let noise = components(problem, &at, &groups, noise, Effort::Local);
        let normal = at.normal(problem, &noise);
        let step = Posterior::new(coordinates, &at.u, &normal).newton()?;
        Some((step.to, noise))
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
                let options =
                    FitOptions { known: Some(known.fit.noise.clone()), ..settling(base.settled, base.clone()) };
                let fit = fit(&problem, &start, &options)?;
                Some((set.clone(), problem, fit))
            })
            .collect();
        for (set, problem, fit) in fits {
            self.keep(set, Level::Screen, problem, fit);
        }
        self.looked_at.extend(wanted);
    }
}

/// The set that another grows out of: the one at hand, or, for one in which an effect was exchanged, what both share.
fn shared_by(set: &[usize], from: &[usize]) -> Set {
    set.iter().copied().filter(|one| from.contains(one)).collect()
}
