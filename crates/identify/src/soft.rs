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
use crate::problem::{Coordinate, Problem, Scope, predict_all};

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

/// A direction in which data pin coordinates softly.
struct Soft {
    /// All coordinates.
    direction: Vec<f64>,
    /// The coordinates whose derivatives are mended by what is measured along it, and each one's share.
    mends: Vec<(usize, f64)>,
    /// The record that it moves; nothing where it moves all of them.
    record: Option<usize>,
    /// One standard deviation along it, in prior ones.
    sigma: f64,
}

/// Directions that are measured together: no two of them move the same record.
type Together = Vec<Soft>;

/// A linearised problem with its derivatives measured along soft directions: of each record's own coordinates first, then of
/// those that all have in common.
pub fn refined(problem: &dyn Problem, mut at: Linearised, noise: &Noise) -> Linearised {
    let coordinates = problem.coordinates();
    let is_free = |index: &usize| !coordinates[*index].is_at_bound(at.u[*index]);
    let free: Vec<usize> = (0..coordinates.len()).filter(is_free).collect();
    let (common, own): (Vec<usize>, Vec<usize>) =
        free.into_iter().partition(|index| coordinates[*index].scope == Scope::Shared);
    let of_records = own_directions(problem, &at, noise, &own);
    measure(problem, &mut at, &of_records);
    let mut softest = 0.0;
    for _ in 0..ROUNDS {
        if problem.stop().is_asked() {
            break;
        }
        let Some(soft) = directions(problem, &at, noise, (&common, &own)) else { break };
        let now: f64 = soft.iter().flatten().map(|one| one.sigma.ln()).sum();
        if softest != 0.0 && now - softest < SOFTER.ln() {
            break;
        }
        softest = now;
        measure(problem, &mut at, &soft);
    }
    at
}

/// A block of the precision, in prior deviations.
fn block(coordinates: &[Coordinate], precision: &DMatrix<f64>, rows: &[usize], columns: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
        let (i, j) = (rows[i], columns[j]);
        coordinates[i].sigma * precision[(i, j)] * coordinates[j].sigma
    })
}

/// The soft directions of a block of the precision, of length one in prior deviations, with one standard deviation along each.
fn soft_ones(block: DMatrix<f64>) -> Vec<(DVector<f64>, f64)> {
    let eigen = block.symmetric_eigen();
    let all = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    let all = all.map(|(value, vector)| (vector.into_owned(), value.max(1.0).sqrt().recip()));
    all.filter(|(_, sigma)| *sigma > SHARP).collect()
}

/// The directions in which each record's own coordinates are soft, all common ones known: the softest of all records together,
/// then the next ones.
fn own_directions(problem: &dyn Problem, at: &Linearised, noise: &Noise, own: &[usize]) -> Vec<Together> {
    let coordinates = problem.coordinates();
    let normal = at.normal(problem, noise);
    let precision = Posterior::new(coordinates, &at.u, &normal).precision;
    let mut batches: Vec<Together> = Vec::new();
    for record in 0..problem.records().len() {
        let of_record = |index: &usize| coordinates[*index].scope == Scope::Record(record);
        let own: Vec<usize> = own.iter().copied().filter(of_record).collect();
        let of_own = block(coordinates, &precision, &own, &own);
        if own.is_empty() || of_own.iter().any(|value| !value.is_finite()) {
            continue;
        }
        let mut soft = soft_ones(of_own);
        soft.sort_by(|a, b| b.1.total_cmp(&a.1));
        for (place, (vector, sigma)) in soft.into_iter().enumerate() {
            let mut direction = vec![0.0; coordinates.len()];
            for (index, part) in own.iter().zip(vector.iter()) {
                direction[*index] = coordinates[*index].sigma * part;
            }
            let mends = own.iter().zip(vector.iter()).map(|(index, part)| (*index, part / coordinates[*index].sigma));
            let soft = Soft { direction, mends: mends.collect(), record: Some(record), sigma };
            match batches.get_mut(place) {
                Some(batch) => batch.push(soft),
                None => batches.push(vec![soft]),
            }
        }
    }
    batches
}

/// The soft directions of the common coordinates at a point, the records' own ones following; nothing where there are none.
fn directions(
    problem: &dyn Problem,
    at: &Linearised,
    noise: &Noise,
    (common, own): (&[usize], &[usize]),
) -> Option<Vec<Together>> {
    let coordinates = problem.coordinates();
    let normal = at.normal(problem, noise);
    let precision = Posterior::new(coordinates, &at.u, &normal).precision;
    let block = |rows: &[usize], columns: &[usize]| block(coordinates, &precision, rows, columns);
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
    let soft = soft_ones(of_common).into_iter().map(|(vector, sigma)| {
        let mut direction = vec![0.0; coordinates.len()];
        for (index, part) in common.iter().zip(vector.iter()) {
            direction[*index] = coordinates[*index].sigma * part;
        }
        if !own.is_empty() {
            for (index, part) in own.iter().zip((&following * &vector).iter()) {
                direction[*index] = -coordinates[*index].sigma * part;
            }
        }
        let mends = common.iter().zip(vector.iter()).map(|(index, part)| (*index, part / coordinates[*index].sigma));
        vec![Soft { direction, mends: mends.collect(), record: None, sigma }]
    });
    let soft: Vec<Together> = soft.collect();
    (!soft.is_empty()).then_some(soft)
}

/// Where differences along a direction end, ahead and back, as factors on it.
fn ends(coordinates: &[Coordinate], u: &[f64], soft: &Soft) -> (f64, f64) {
    let room = |sign: f64| {
        let of = |index: usize| {
            let by = sign * soft.direction[index];
            let bound = if by > 0.0 { coordinates[index].upper } else { coordinates[index].lower };
            if by == 0.0 { f64::INFINITY } else { (bound - u[index]) / by }
        };
        (0..u.len()).map(of).fold(f64::INFINITY, f64::min)
    };
    let step = (STEP * soft.sigma).min(LONGEST);
    let (ahead, back) = (room(1.0).min(step), room(-1.0).min(step));
    let both = ahead.min(back);
    if both >= ONE_SIDED * step {
        (both, -both)
    } else if ahead > back {
        (ahead, 0.0)
    } else {
        (0.0, -back)
    }
}

/// Measures the derivatives along directions and mends those of the coordinates by what they were wrong.
fn measure(problem: &dyn Problem, at: &mut Linearised, batches: &[Together]) {
    let coordinates = problem.coordinates();
    let lengths: Vec<Vec<(f64, f64)>> =
        batches.iter().map(|batch| batch.iter().map(|soft| ends(coordinates, &at.u, soft)).collect()).collect();
    let mut points = Vec::with_capacity(2 * batches.len());
    for (batch, lengths) in batches.iter().zip(&lengths) {
        let (mut to, mut from) = (at.u.clone(), at.u.clone());
        for (soft, (ahead, back)) in batch.iter().zip(lengths) {
            for (index, part) in soft.direction.iter().enumerate() {
                to[index] += ahead * part;
                from[index] += back * part;
            }
        }
        points.extend([to, from]);
    }
    let predicted = predict_all(problem, &points);
    for ((batch, lengths), ends) in batches.iter().zip(&lengths).zip(predicted.chunks_exact(2)) {
        let [Some(to), Some(from)] = ends else { continue };
        for (soft, (ahead, back)) in batch.iter().zip(lengths).filter(|(_, (ahead, back))| ahead > back) {
            let records = soft.record.map_or(0..at.columns.len(), |record| record..record + 1);
            for record in records {
                mend(&mut at.columns[record], soft, &to[record], &from[record], ahead - back);
            }
        }
    }
}

/// Mends the derivatives of a record by what was predicted at both ends of a difference.
fn mend(columns: &mut [(usize, Vec<f64>)], soft: &Soft, to: &[f64], from: &[f64], length: f64) {
    let mut wrong: Vec<f64> = to.iter().zip(from).map(|(to, from)| (to - from) / length).collect();
    for (index, column) in columns.iter() {
        let by = soft.direction[*index];
        wrong.iter_mut().zip(column).for_each(|(wrong, slope)| *wrong -= by * slope);
    }
    for (index, column) in columns.iter_mut() {
        let Some((_, by)) = soft.mends.iter().find(|(one, _)| one == index) else { continue };
        // A coordinate that does not move the record at all takes no part of what others are wrong by.
        if column.iter().all(|slope| *slope == 0.0) {
            continue;
        }
        column.iter_mut().zip(&wrong).for_each(|(slope, wrong)| *slope += by * wrong);
    }
}
