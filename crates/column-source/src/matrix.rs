//! A matrix of MATLAB as columns.

use crate::Heading;
use crate::table::Values;

/// The columns of a matrix whose values stand column after column: itself if it is a vector, lying or standing, else one
/// for each of its own, or for each of its rows where those are the signals.
pub(crate) fn columns(name: &str, rows: usize, values: Vec<f64>) -> Vec<(Heading, Values)> {
    let count = values.len() / rows.max(1);
    if rows <= 1 || count <= 1 {
        return vec![(Heading::new(name), Values::Numbers(values))];
    }
    let numbered =
        |(index, signal): (usize, Vec<f64>)| (Heading::new(&format!("{name}_{}", index + 1)), Values::Numbers(signal));
    let row = |row: usize| values.iter().skip(row).step_by(rows).copied().collect::<Vec<_>>();
    // Simulink's "To File" lays signals down as rows, the time first.
    if rows < count && row(0).windows(2).all(|pair| pair[1] > pair[0]) {
        return (0..rows).map(row).enumerate().map(numbered).collect();
    }
    values.chunks(rows).map(<[f64]>::to_vec).enumerate().map(numbered).collect()
}
