//! Factors of symmetric positive matrices that keep their zeros: each row from its first entry on.
//!
//! What moves one record alone meets no other record's coordinates in the normal equations. With such coordinates first,
//! record by record, and those that all records share last, the factor has entries in small blocks and in the last rows only
//! (George and Liu, "Computer Solution of Large Sparse Positive Definite Systems", 1981, chapter 4).

use nalgebra::{DMatrix, DVector};

use crate::problem::{Coordinate, Scope};

/// The lower factor of some rows and columns of a matrix.
#[derive(Debug, Clone)]
pub struct Factor {
    /// The rows and columns of the matrix, in the order in which they are factored.
    order: Vec<usize>,
    rows: Vec<Row>,
}

/// One row of the factor, from its first entry on.
#[derive(Debug, Clone)]
struct Row {
    first: usize,
    /// Up to the diagonal, without it.
    entries: Vec<f64>,
    diagonal: f64,
}

/// The order of coordinates in which a factor has the fewest entries: by record, then what all of them share.
pub fn ordered(coordinates: &[Coordinate]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..coordinates.len()).collect();
    order.sort_by_key(|index| match coordinates[*index].scope {
        Scope::Record(record) => record,
        Scope::Shared => usize::MAX,
    });
    order
}

impl Factor {
    /// Of the rows and columns of a symmetric matrix that `order` lists; nothing where that part is not positive definite.
    pub fn new(matrix: &DMatrix<f64>, order: Vec<usize>) -> Option<Self> {
        let mut rows: Vec<Row> = Vec::with_capacity(order.len());
        for (i, index) in order.iter().enumerate() {
            let first = order[..i].iter().position(|other| matrix[(*index, *other)] != 0.0).unwrap_or(i);
            let mut entries: Vec<f64> = Vec::with_capacity(i - first);
            for (j, other) in order.iter().enumerate().take(i).skip(first) {
                let row = &rows[j];
                let from = first.max(row.first);
                let known = dot(&entries[from - first..], &row.entries[from - row.first..j - row.first]);
                entries.push((matrix[(*index, *other)] - known) / row.diagonal);
            }
            let rest = matrix[(*index, *index)] - dot(&entries, &entries);
            if rest.is_nan() || rest <= 0.0 {
                return None;
            }
            rows.push(Row { first, entries, diagonal: rest.sqrt() });
        }
        Some(Self { order, rows })
    }

    /// The rows and columns that were factored.
    pub fn indices(&self) -> &[usize] {
        &self.order
    }

    /// Half the logarithm of the determinant of the factored part.
    pub fn half_log_determinant(&self) -> f64 {
        self.rows.iter().map(|row| row.diagonal.ln()).sum()
    }

    /// The solution for a right side, zero where the matrix was not factored.
    pub fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let mut half: Vec<f64> = Vec::with_capacity(self.rows.len());
        for (row, index) in self.rows.iter().zip(&self.order) {
            half.push((right[*index] - dot(&row.entries, &half[row.first..])) / row.diagonal);
        }
        for (i, row) in self.rows.iter().enumerate().rev() {
            half[i] /= row.diagonal;
            let value = half[i];
            half[row.first..i].iter_mut().zip(&row.entries).for_each(|(other, entry)| *other -= entry * value);
        }
        let mut solution = DVector::zeros(right.len());
        for (value, index) in half.into_iter().zip(&self.order) {
            solution[*index] = value;
        }
        solution
    }

    /// A column of the inverse of the factored part, zero elsewhere.
    pub fn inverse_column(&self, index: usize, size: usize) -> DVector<f64> {
        let mut unit = DVector::zeros(size);
        unit[index] = 1.0;
        self.solve(&unit)
    }
}

/// Products summed in four parts, which a machine adds side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (&a[..a.len().min(b.len())], &b[..a.len().min(b.len())]);
    let mut parts = [0.0; 4];
    let (quads, others) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = quads.remainder().iter().zip(others.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in quads.zip(others) {
        for (part, (a, b)) in parts.iter_mut().zip(a.iter().zip(b)) {
            *part += a * b;
        }
    }
    parts.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two records with two coordinates each, and two that both share, in mixed order.
    fn coordinates() -> Vec<Coordinate> {
        let scopes =
            [Scope::Shared, Scope::Record(1), Scope::Record(0), Scope::Record(1), Scope::Shared, Scope::Record(0)];
        scopes.map(|scope| Coordinate::standard("one", scope, 5.0)).into()
    }

    fn matrix() -> DMatrix<f64> {
        let coordinates = coordinates();
        let jacobian = DMatrix::from_fn(40, 6, |row, column| {
            let moved = coordinates[column].moves(row / 20);
            if moved { ((row * 7 + column * 3) as f64).sin() } else { 0.0 }
        });
        jacobian.transpose() * jacobian + DMatrix::identity(6, 6)
    }

    #[test]
    fn solves_as_a_dense_factor_does_and_keeps_the_zeros() {
        let (matrix, right) = (matrix(), DVector::from_fn(6, |i, _| i as f64 - 1.7));
        let factor = Factor::new(&matrix, ordered(&coordinates())).unwrap();
        let dense = matrix.clone().cholesky().unwrap();
        assert!((factor.solve(&right) - dense.solve(&right)).norm() < 1e-12);
        assert!((2.0 * factor.half_log_determinant() - dense.determinant().ln()).abs() < 1e-12);
        let inverse = dense.inverse();
        assert!((factor.inverse_column(3, 6) - inverse.column(3)).norm() < 1e-12);
        let entries: usize = factor.rows.iter().map(|row| row.entries.len()).sum();
        assert_eq!(entries, 2 + 4 + 5);
    }

    #[test]
    fn a_part_of_the_matrix_is_solved_alone() {
        let (matrix, right) = (matrix(), DVector::from_element(6, 1.0));
        let factor = Factor::new(&matrix, vec![2, 5, 4]).unwrap();
        let part = DMatrix::from_fn(3, 3, |i, j| matrix[([2, 5, 4][i], [2, 5, 4][j])]);
        let expected = part.cholesky().unwrap().solve(&DVector::from_element(3, 1.0));
        let solution = factor.solve(&right);
        for (place, index) in [2, 5, 4].into_iter().enumerate() {
            assert!((solution[index] - expected[place]).abs() < 1e-12);
        }
        assert_eq!(solution[0], 0.0);
    }

    #[test]
    fn what_is_not_positive_definite_has_no_factor() {
        assert!(Factor::new(&DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]), vec![0, 1]).is_none());
        assert!(Factor::new(&DMatrix::from_element(1, 1, f64::NAN), vec![0]).is_none());
    }
}
