//! Candidates that do much the same, one of which begins in the wrong valley.

use identify::select::{Level, SelectOptions};
use identify::{Coordinate, Record, fit};

use crate::common::{record, shared};
use crate::drawn::{RIGHT_VALLEY, WRONG_VALLEY, far_off, noise, regressor};
use crate::toy::{Member, Toy, searched};

/// Two candidates that do much the same, the right one of which begins in the wrong one of two valleys, and perhaps a third that
/// does something else.
struct Rivals {
    records: Vec<Record>,
    candidates: usize,
    coordinates: [Vec<Coordinate>; 3],
}

impl Rivals {
    /// Records of the right valley with what some candidates add.
    fn with(candidates: usize, hidden: &[(usize, f64)]) -> Self {
        let observed = |seed: u64| -> Vec<f64> {
            let row = |(row, noise): (usize, f64)| {
                let row = row as f64;
                let added = hidden.iter().map(|(one, size)| size * added(*one, row));
                (RIGHT_VALLEY * row).sin() + added.sum::<f64>() + noise
            };
            noise(60, 0.02, seed).into_iter().enumerate().map(row).collect()
        };
        let size = || shared("size", 0.0, 1.0, 20.0);
        let frequency = || shared("frequency", 0.5, 0.3, 1.5);
        Self {
            records: (0..4).map(|one| record(&observed(700 + one as u64), 0.02, true, one)).collect(),
            candidates,
            coordinates: [vec![frequency()], vec![frequency(), size()], vec![frequency(), size(), size()]],
        }
    }
}

/// What a candidate adds to a row.
fn added(candidate: usize, row: f64) -> f64 {
    match candidate {
        0 => regressor(3, row) + 0.3 * regressor(5, row),
        1 => regressor(3, row),
        _ => regressor(4, row),
    }
}

impl Toy for Rivals {
    fn records(&self) -> &[Record] {
        &self.records
    }

    fn candidates(&self) -> usize {
        self.candidates
    }

    fn coordinates(&self, set: &[usize], _: Level) -> Vec<Coordinate> {
        self.coordinates[set.len()].clone()
    }

    fn rows(&self, member: &Member<'_>, record: usize, u: &[f64]) -> Vec<f64> {
        let value = |row: f64| {
            let added = member.set.iter().zip(&u[1..]).map(|(one, size)| size * added(*one, row));
            (u[0] * row).sin() + added.sum::<f64>()
        };
        (0..self.records[record].row_count()).map(|row| value(row as f64)).collect()
    }

    fn cold(&self, member: &Member<'_>) -> Vec<f64> {
        let valley = if member.set.contains(&0) { RIGHT_VALLEY } else { WRONG_VALLEY };
        std::iter::once(valley).chain(member.set.iter().map(|_| 0.1)).collect()
    }

    fn warm(&self, member: &Member<'_>, from: &Member<'_>, u: &[f64]) -> Vec<Vec<f64>> {
        let size = |candidate: &usize| from.size_of(*candidate, u).unwrap_or(0.1);
        vec![std::iter::once(u[0]).chain(member.set.iter().map(size)).collect()]
    }
}

#[test]
fn a_rival_that_ended_in_another_valley_is_fitted_from_the_best_one_s_optimum() {
    let family = Rivals::with(2, &[(1, 1.0)]);
    let alone =
        fit(&Member::of(&family, &[1], Level::High), &[WRONG_VALLEY, 0.1], &far_off()).expect("a possible start");
    assert!((alone.u[0] - RIGHT_VALLEY).abs() > 0.05, "it ends beside it: {:?}", alone.u);
    let single = SelectOptions { most: 1, ..SelectOptions::default() };
    assert_eq!(searched(&family, &single).accepted(), [1]);
    // Without the second look the other one stays.
    let once = SelectOptions { rivals: 0, ..single };
    assert_eq!(searched(&family, &once).accepted(), [0]);
}

#[test]
fn so_are_the_rivals_of_a_pair_that_fell_behind_in_a_first_look() {
    let family = Rivals::with(3, &[(1, 1.0), (2, 3.0)]);
    assert_eq!(searched(&family, &SelectOptions::default()).accepted(), [1, 2]);
    let once = SelectOptions { rivals: 0, ..SelectOptions::default() };
    assert_ne!(searched(&family, &once).accepted(), [1, 2]);
}
