//! Where fits begin beside the values of the valve file: scattered over what these may be off by. A piston that swings on its gas, or is
//! thrown back, makes valleys that no fit leaves, and a datasheet's value may lie in the wrong one.

use identify::Problem;
use identify::problem::{error_in_activity, predict_all};

use super::nuisance::Nuisance;
use super::problem::ValveProblem;

/// A tolerance from which a parameter's value says hardly more than its order.
const WIDE: f64 = 0.3;

/// How far points lie from the values of the valve file, in prior deviations: at most one, and for wide tolerances over what may be.
const REACH: f64 = 1.0;
const WIDE_REACH: f64 = 2.5;

/// Points that are looked at, and those of them that are tried.
const LOOKED_AT: usize = 64;
const TRIED: usize = 2;

/// The damping of stops from which nothing bounces, in prior deviations.
const DEAD_STOP: f64 = 2.0;

/// Where fits may start beside the values of the valve file.
#[derive(Debug, Clone, Default)]
pub(super) struct Scattered {
    /// The tolerated parameters, and the damping of the stops, in prior deviations.
    points: Vec<(Vec<f64>, f64)>,
    /// How many of them are tolerated parameters.
    tolerated: usize,
}

impl Scattered {
    /// The best of many points, by what is predicted at each, for a problem without any effect but its own.
    pub(super) fn find(problem: &ValveProblem<'_>) -> Self {
        let of_space = &problem.space.coordinates;
        let reach = |index: usize| {
            let tolerance = of_space[index].tolerance()?;
            Some((index, if tolerance >= WIDE { WIDE_REACH } else { REACH }))
        };
        let tolerated: Vec<(usize, f64)> = (0..of_space.len()).filter_map(reach).collect();
        if tolerated.is_empty() && !problem.setup().is_prescribed {
            return Self::default();
        }
        let start = problem.start();
        let damping = problem.place_of(Nuisance::StopDamping);
        let points: Vec<Vec<f64>> = (0..LOOKED_AT)
            .map(|index| {
                let mut u = start.clone();
                for (place, (coordinate, reach)) in tolerated.iter().enumerate() {
                    u[*coordinate] += reach * (2.0 * evenly(index / 2, place, tolerated.len()) - 1.0);
                }
                if let Some(damping) = damping {
                    u[damping] = if index % 2 == 0 { 0.0 } else { DEAD_STOP };
                }
                u
            })
            .collect();
        let error = |predicted: Option<Vec<Vec<f64>>>| {
            predicted.map_or(f64::INFINITY, |predicted| error_in_activity(problem.records(), &predicted))
        };
        let errors = predict_all(problem, &points).into_iter().map(error);
        let mut ranked: Vec<(f64, Vec<f64>)> = errors.zip(points).filter(|(error, _)| error.is_finite()).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let point = |u: Vec<f64>| (u[..of_space.len()].to_vec(), damping.map_or(0.0, |damping| u[damping]));
        Self { points: ranked.into_iter().take(TRIED).map(|(_, u)| point(u)).collect(), tolerated: tolerated.len() }
    }

    /// The same points in a problem that may have effects beside: all else as at `start`; none where the parameters are held at the
    /// values of the valve file.
    pub(super) fn starts(&self, problem: &ValveProblem<'_>, start: &[f64]) -> Vec<Vec<f64>> {
        let damping = problem.place_of(Nuisance::StopDamping);
        let tolerated = problem.space.coordinates.iter().filter(|coordinate| coordinate.tolerance().is_some());
        let are_free = tolerated.count() == self.tolerated;
        let of_point = |(parameters, size): &(Vec<f64>, f64)| {
            let mut u = start.to_vec();
            u[..parameters.len()].copy_from_slice(parameters);
            if let Some(damping) = damping {
                u[damping] = *size;
            }
            u
        };
        self.points.iter().filter(|_| are_free).map(of_point).collect()
    }
}

/// Number `index` of a sequence that fills a cube of so many dimensions evenly: multiples of powers of the root of
/// x^(d+1) = x + 1 (Roberts, The unreasonable effectiveness of quasirandom sequences, 2018).
fn evenly(index: usize, dimension: usize, dimensions: usize) -> f64 {
    let mut root: f64 = 1.5;
    for _ in 0..30 {
        root = (1.0 + root).powf(1.0 / (dimensions as f64 + 1.0));
    }
    (0.5 + (index + 1) as f64 * root.powf(-(dimension as f64 + 1.0))).fract()
}

#[cfg(test)]
mod tests {
    use super::{LOOKED_AT, evenly};

    #[test]
    fn no_corner_is_left_out() {
        for dimensions in 1..=4 {
            let corner = |index: usize| -> Vec<bool> {
                (0..dimensions).map(|dimension| evenly(index, dimension, dimensions) >= 0.5).collect()
            };
            let mut corners: Vec<Vec<bool>> = (0..LOOKED_AT / 2).map(corner).collect();
            corners.sort();
            corners.dedup();
            assert_eq!(corners.len(), 1 << dimensions);
        }
    }
}
