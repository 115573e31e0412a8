//! Where a set with one effect more begins, by what the smaller set's fit knows.

use super::{Family, Level, Model, Search, Set};
use crate::Problem;
use crate::noise::Noise;
use crate::normal::{Linearised, Posterior};
use crate::problem::{Linear, predict_all};
use crate::variance::{Effort, components, evidence};

impl<F: Family> Search<'_, F> {
    /// Where a set with one effect more is likely to be best, and with which errors: from the optimum of the smaller set, by
    /// the derivatives there and what the effect does at each of several sizes. At a single, very small one this would be
    /// the score test (Rao, Mathematical Proceedings of the Cambridge Philosophical Society 44(1), 1948).
    pub(super) fn foreseen(&self, set: &[usize], from: &[usize]) -> Option<(F::Member, Vec<f64>, Noise)> {
        let smaller = self.smaller(set, from)?;
        let problem = self.family.member(set, Level::Low)?;
        let shared = self.family.shared(&smaller.problem, &problem);
        let size = shared.iter().position(Option::is_none)?;
        let coordinates = problem.coordinates();
        let mut points = self.family.warm(&problem, &smaller.problem, &smaller.fit.u);
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
        let mut predicted = predict_all(&problem, &points);
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
            let at = Linearised::new(&problem, u, linear);
            let likely = evidence(&problem, &at, &at.normal(&problem, noise), &groups, noise);
            likely.is_finite().then_some((likely, at))
        });
        let (_, at) = linear.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let noise = components(&problem, &at, &groups, noise, Effort::Local);
        let normal = at.normal(&problem, &noise);
        let step = Posterior::new(coordinates, &at.u, &normal).newton()?;
        Some((problem, step.to, noise))
    }

    /// The set with one effect less that a set grows out of: the one at hand, or, for a set in which one was exchanged, what
    /// both share.
    fn smaller(&self, set: &[usize], from: &[usize]) -> Option<&Model<F::Member>> {
        let smaller: Set = set.iter().copied().filter(|one| from.contains(one)).collect();
        let of = |level: Level| self.models.get(&(smaller.clone(), level));
        of(Level::Low).or_else(|| of(Level::High))
    }
}
