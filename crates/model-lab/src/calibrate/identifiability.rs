//! Which parameters, or combinations of them, a campaign does not fix.

use nalgebra::DMatrix;
use valve_model::ParameterId;

use crate::space::{Space, Target};

/// A combination is not fixed where the data tell less about it than its tolerance does.
const LEAST_INFORMATION: f64 = 1.0;

/// Components of a direction below this share of its largest are left out of its words.
const NAMED: f64 = 0.2;

/// Two changes whose sizes differ by less than this factor's logarithm are told as a ratio or a product.
const ALIKE: f64 = 0.25;

/// A practically non-identifiable combination of parameters: it can change without the data noticing.
#[derive(Debug, Clone, PartialEq)]
pub struct NonIdentifiable {
    /// What the data tell about it, relative to what the tolerances tell: below 1, less.
    pub information: f64,
    /// By which shares the parameters change together, largest first.
    pub changes: Vec<(ParameterId, f64)>,
    /// The direction in words.
    pub words: String,
}

/// What counts as known of a parameter that ended at its bound.
const HELD: f64 = 1e12;

/// The combinations that the data fix no better than the tolerances, the least known first.
/// `covariance` is that of the coordinates, in units of the tolerances; what the tolerances tell is taken out of it.
pub fn non_identifiable(space: &Space, covariance: &DMatrix<f64>) -> Vec<NonIdentifiable> {
    let free: Vec<usize> = (0..covariance.nrows()).filter(|index| covariance[(*index, *index)] > 0.0).collect();
    let block = DMatrix::from_fn(free.len(), free.len(), |i, j| covariance[(free[i], free[j])]);
    let mut information = DMatrix::from_diagonal_element(covariance.nrows(), covariance.ncols(), HELD);
    if let Some(inverse) = block.try_inverse() {
        for (i, row) in free.iter().enumerate() {
            for (j, column) in free.iter().enumerate() {
                information[(*row, *column)] = inverse[(i, j)] - f64::from(u8::from(i == j));
            }
        }
    }
    let eigen = information.symmetric_eigen();
    let mut directions: Vec<NonIdentifiable> = (0..covariance.nrows())
        .filter(|index| eigen.eigenvalues[*index] < LEAST_INFORMATION)
        .map(|index| {
            let vector = eigen.eigenvectors.column(index);
            let largest = vector.amax();
            let mut changes: Vec<(ParameterId, f64)> = space
                .coordinates
                .iter()
                .zip(vector.iter())
                .filter(|(_, component)| component.abs() > NAMED * largest)
                .filter_map(|(coordinate, component)| match coordinate.target {
                    Target::Base(id) => Some((id, (coordinate.value(*component) / coordinate.value(0.0)).ln())),
                    _ => None,
                })
                .collect();
            changes.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
            // A direction has no sign; its largest change is told as a rise.
            if changes.first().is_some_and(|(_, change)| *change < 0.0) {
                for (_, change) in &mut changes {
                    *change = -*change;
                }
            }
            let words = words(&changes);
            NonIdentifiable { information: eigen.eigenvalues[index].max(0.0), changes, words }
        })
        .collect();
    directions.sort_by(|a, b| a.information.total_cmp(&b.information));
    directions
}

fn words(changes: &[(ParameterId, f64)]) -> String {
    let name = |id: ParameterId| id.name().replace('_', " ");
    match changes {
        [] => "a combination outside the tolerated parameters".to_owned(),
        [(id, _)] => format!("{} hardly shows in these data: its tolerance decides its value", name(*id)),
        [(a, change_a), (b, change_b)] if (change_a.abs() / change_b.abs()).ln().abs() < ALIKE => {
            let how = if change_a * change_b > 0.0 { "ratio" } else { "product" };
            format!("{} and {} only act through their {how}", name(*a), name(*b))
        }
        _ => {
            let parts: Vec<String> =
                changes.iter().map(|(id, change)| format!("{} by {:+.1} %", name(*id), change * 100.0)).collect();
            format!("these change together without a trace in the data: {}", parts.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_changes_are_a_ratio_and_opposite_ones_a_product() {
        let (area, volume) = (ParameterId::SolenoidOrificeArea, ParameterId::DeadVolume);
        assert_eq!(
            words(&[(area, 0.05), (volume, 0.048)]),
            "solenoid orifice area and dead volume only act through their ratio"
        );
        assert!(words(&[(area, 0.05), (volume, -0.05)]).ends_with("only act through their product"));
        assert!(words(&[(area, 0.05)]).starts_with("solenoid orifice area hardly shows"));
        assert!(words(&[(area, 0.05), (volume, 0.01)]).contains("dead volume by +1.0 %"));
    }
}
