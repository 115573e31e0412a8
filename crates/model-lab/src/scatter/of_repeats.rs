//! The scatter that repeated strokes show, whatever the model.

use nalgebra::{DMatrix, DVector};
use valve_model::Valve;

use super::directions::{directions, layout};
use super::{EM_ROUNDS, FLOWS, Origin, SOURCES, Scatter, Source};
use crate::data::Dataset;
use crate::forward::residuals;
use crate::repeats::{Repeats, repeats};

impl Scatter {
    /// Estimates the scatter from the repeats of a dataset, with the directions of a valve that fits it
    /// (expectation and maximisation over the deviations from each group's mean); unknown without repeats.
    pub fn estimate(data: &Dataset, valve: &Valve) -> Self {
        let groups = repeats(data);
        if groups.is_empty() {
            return Self::unknown(data);
        }
        let layout = layout(data);
        let base = &residuals(data, core::slice::from_ref(valve))[0];
        let directions = directions(data, valve, base);
        // Deviations from the group's mean lose one degree of freedom in each group.
        let mut samples: Vec<Sample> = Vec::new();
        for Repeats { units, places } in &groups {
            let rows: Vec<Vec<usize>> = units
                .iter()
                .zip(places)
                .map(|(unit, places)| places.iter().map(|place| layout[*unit].0 + place.nearest()).collect())
                .collect();
            let repeats = units.len() as f64;
            let mean: Vec<f64> =
                (0..rows[0].len()).map(|i| rows.iter().map(|rows| base[rows[i]]).sum::<f64>() / repeats).collect();
            let share = 1.0 - 1.0 / repeats;
            for rows in &rows {
                let d = matrix(&directions, rows);
                let deviation =
                    DVector::from_iterator(rows.len(), rows.iter().zip(&mean).map(|(row, m)| base[*row] - m));
                samples.push(Sample { gram: d.transpose() * &d, projection: d.transpose() * deviation, share });
            }
        }
        let [solenoid, all_orifices] =
            FLOWS.map(|flow| likeliest(&samples, FLOWS.iter().find(|other| **other != flow)));
        let (variances, _) = if all_orifices.1 > solenoid.1 { all_orifices } else { solenoid };
        Self::assemble(&layout, &directions, variances, Origin::Repeats)
    }
}

/// One stroke of a group of repeats, as it differs from their mean.
struct Sample {
    /// D'D.
    gram: DMatrix<f64>,
    /// D' times the deviation.
    projection: DVector<f64>,
    /// Share of the variance that a deviation from the mean has.
    share: f64,
}

/// The most likely variances of all sources but one, by expectation and maximisation (Dempster, Laird and
/// Rubin 1977), and the logarithm of their likelihood up to a constant.
fn likeliest(samples: &[Sample], without: Option<&Source>) -> ([f64; SOURCES.len()], f64) {
    let used: Vec<usize> = (0..SOURCES.len()).filter(|source| Some(&SOURCES[*source].0) != without).collect();
    let n = used.len();
    let part = |sample: &Sample| {
        let gram = DMatrix::from_fn(n, n, |i, j| sample.gram[(used[i], used[j])] / sample.share);
        (gram, DVector::from_fn(n, |i, _| sample.projection[used[i]] / sample.share))
    };
    let parts: Vec<(DMatrix<f64>, DVector<f64>, f64)> = samples
        .iter()
        .map(|sample| {
            let (gram, projection) = part(sample);
            (gram, projection, sample.share)
        })
        .collect();
    let freedom: f64 = samples.iter().map(|sample| sample.share).sum();
    let mut variances = vec![1.0; n];
    // A deviation from the mean scatters less by its share, and so does its sensor noise.
    let precision = |gram: &DMatrix<f64>, variances: &[f64], share: f64| {
        let mut precision = gram.clone();
        for (index, variance) in variances.iter().enumerate() {
            precision[(index, index)] += 1.0 / (variance * share).max(1e-12);
        }
        precision
    };
    for _ in 0..EM_ROUNDS {
        let mut sums = vec![0.0; n];
        for (gram, projection, share) in &parts {
            let Some(covariance) = precision(gram, &variances, *share).try_inverse() else { continue };
            let mean = &covariance * projection;
            for (index, sum) in sums.iter_mut().enumerate() {
                *sum += mean[index] * mean[index] + covariance[(index, index)];
            }
        }
        variances = sums.iter().map(|sum| sum / freedom).collect();
    }
    let likelihood = parts
        .iter()
        .filter_map(|(gram, projection, share)| {
            let cholesky = precision(gram, &variances, *share).cholesky()?;
            let explained = projection.dot(&cholesky.solve(projection));
            let widths: f64 = variances.iter().map(|variance| (variance * share).max(1e-12).ln()).sum();
            Some(0.5 * (explained - cholesky.ln_determinant() - widths))
        })
        .sum();
    let mut all = [0.0; SOURCES.len()];
    for (index, variance) in used.into_iter().zip(variances) {
        all[index] = variance;
    }
    (all, likelihood)
}

/// Some rows of the directions.
fn matrix(directions: &[Vec<f64>], rows: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), directions.len(), |row, column| directions[column][rows[row]])
}
