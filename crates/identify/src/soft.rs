//! Derivatives along the directions that data hardly pin.
//!
//! Rows of precise instruments move by thousands of their deviations where a parameter moves by its tolerance, and one
//! parameter makes up for another: along some directions, soft ones (Waterfall et al., Physical Review Letters 97(15), 2006),
//! hardly anything moves. Differences along single coordinates have errors of a few deviations there, from what curves and
//! from what a simulation cuts short, and these look like knowledge: bounds far too narrow, and a fit that stays where it is.
//! So the directions themselves are measured, with differences as long as what is known along each.

use nalgebra::{DMatrix, DVector};

use crate::noise::Noise;
use crate::normal::{Linearised, Posterior};
use crate::problem::{Problem, Scope, predict_all};

/// Directions known more sharply than this share of the prior need no better derivatives.
const SHARP: f64 = 0.02;

/// Length of a difference in standard deviations of its direction, and at most in prior ones.
const STEP: f64 = 1.0;
const LONGEST: f64 = 0.5;

/// So often directions are looked for anew, where knowledge that was none goes: at most, and while one of them becomes softer
/// by this factor.
const ROUNDS: usize = 3;
const SOFTER: f64 = 1.3;

/// A difference that bounds leave less than this share of on one side is taken to the other.
const ONE_SIDED: f64 = 0.3;

/// A direction in which data pin all records' common coordinates softly, the others following.
struct Soft {
    /// The common coordinates' part, of length one in prior deviations.
    common: DVector<f64>,
    /// All coordinates.
    direction: Vec<f64>,
    /// One standard deviation along it, in prior ones.
    sigma: f64,
}

/// A linearised problem with its derivatives measured along soft directions.
pub fn refined(problem: &dyn Problem, mut at: Linearised, noise: &Noise) -> Linearised {
    let coordinates = problem.coordinates();
    let is_free = |index: &usize| !coordinates[*index].is_at_bound(at.u[*index]);
    let free: Vec<usize> = (0..coordinates.len()).filter(is_free).collect();
    let (common, own): (Vec<usize>, Vec<usize>) =
        free.into_iter().partition(|index| coordinates[*index].scope == Scope::Shared);
    let mut softest = 0.0;
    for _ in 0..ROUNDS {
        let Some(soft) = directions(problem, &at, noise, (&common, &own)) else { break };
        let now: f64 = soft.iter().map(|one| one.sigma.ln()).sum();
        if softest != 0.0 && now - softest < SOFTER.ln() {
            break;
        }
        softest = now;
        measure(problem, &mut at, &soft, &common);
        if problem.stop().is_asked() {
            break;
        }
    }
    at
}

/// The soft directions at a point; nothing where there are none.
fn directions(
    problem: &dyn Problem,
    at: &Linearised,
    noise: &Noise,
    (common, own): (&[usize], &[usize]),
) -> Option<Vec<Soft>> {
    let coordinates = problem.coordinates();
    let normal = at.normal(problem, noise);
    let precision = Posterior::new(coordinates, &at.u, &normal).precision;
    let block = |rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
            let (i, j) = (rows[i], columns[j]);
            coordinates[i].sigma * precision[(i, j)] * coordinates[j].sigma
        })
    };
    let mut of_common = block(common, common);
    let mut following = DMatrix::zeros(0, common.len());
    if !own.is_empty() {
        let across = block(own, common);
        following = block(own, own).cholesky()?.solve(&across);
        of_common -= across.transpose() * &following;
    }
    // Nothing is common where everything is held, and nothing is known where a derivative is no number.
    if common.is_empty() || of_common.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let eigen = of_common.symmetric_eigen();
    let soft = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()).filter_map(|(value, vector)| {
        let sigma = value.max(1.0).sqrt().recip();
        (sigma > SHARP).then(|| {
            let vector = vector.into_owned();
            let mut direction = vec![0.0; coordinates.len()];
            for (index, part) in common.iter().zip(vector.iter()) {
                direction[*index] = coordinates[*index].sigma * part;
            }
            if !own.is_empty() {
                for (index, part) in own.iter().zip((&following * &vector).iter()) {
                    direction[*index] = -coordinates[*index].sigma * part;
                }
            }
            Soft { common: vector, direction, sigma }
        })
    });
    let soft: Vec<Soft> = soft.collect();
    (!soft.is_empty()).then_some(soft)
}

/// Measures the derivatives along directions and mends those of the common coordinates by what they were wrong.
fn measure(problem: &dyn Problem, at: &mut Linearised, soft: &[Soft], common: &[usize]) {
    let coordinates = problem.coordinates();
    let room = |direction: &[f64], sign: f64| {
        let of = |index: usize| {
            let by = sign * direction[index];
            let bound = if by > 0.0 { coordinates[index].upper } else { coordinates[index].lower };
            if by == 0.0 { f64::INFINITY } else { (bound - at.u[index]) / by }
        };
        (0..direction.len()).map(of).fold(f64::INFINITY, f64::min)
    };
    let ends: Vec<(f64, f64)> = soft
        .iter()
        .map(|one| {
            let step = (STEP * one.sigma).min(LONGEST);
            let (ahead, back) = (room(&one.direction, 1.0).min(step), room(&one.direction, -1.0).min(step));
            let both = ahead.min(back);
            if both >= ONE_SIDED * step {
                (both, -both)
            } else if ahead > back {
                (ahead, 0.0)
            } else {
                (0.0, -back)
            }
        })
        .collect();
    let points: Vec<Vec<f64>> = soft
        .iter()
        .zip(&ends)
        .flat_map(|(one, (ahead, back))| {
            let moved = |by: f64| at.u.iter().zip(&one.direction).map(|(u, d)| u + by * d).collect();
            [moved(*ahead), moved(*back)]
        })
        .collect();
    let predicted = predict_all(problem, &points);
    for ((one, (ahead, back)), ends) in soft.iter().zip(&ends).zip(predicted.chunks_exact(2)) {
        let [Some(to), Some(from)] = ends else { continue };
        if ahead - back <= 0.0 {
            continue;
        }
        for (columns, (to, from)) in at.columns.iter_mut().zip(to.iter().zip(from)) {
            let mut wrong: Vec<f64> = to.iter().zip(from).map(|(to, from)| (to - from) / (ahead - back)).collect();
            for (index, column) in columns.iter() {
                let by = one.direction[*index];
                wrong.iter_mut().zip(column).for_each(|(wrong, slope)| *wrong -= by * slope);
            }
            for (index, column) in columns.iter_mut() {
                let Some(place) = common.iter().position(|one| one == index) else { continue };
                let by = one.common[place] / coordinates[*index].sigma;
                column.iter_mut().zip(&wrong).for_each(|(slope, wrong)| *slope += by * wrong);
            }
        }
    }
}
