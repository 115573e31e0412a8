//! Candidates that do much the same, one of which begins in the wrong valley.

use identify::select::{Family, Level, SelectOptions, select};
use identify::{Coordinate, FitOptions, Problem, Record, Request, fit};

use crate::common::{record, shared};
use crate::drawn::{RIGHT_VALLEY, WRONG_VALLEY, far_off, noise, regressor};

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

/// A member of it: its candidates.
struct Rival<'a>(&'a Rivals, Vec<usize>);

/// What a candidate adds to a row.
fn added(candidate: usize, row: f64) -> f64 {
    match candidate {
        0 => regressor(3, row) + 0.3 * regressor(5, row),
        1 => regressor(3, row),
        _ => regressor(4, row),
    }
}

impl Problem for Rival<'_> {
    fn coordinates(&self) -> &[Coordinate] {
        &self.0.coordinates[self.1.len()]
    }

    fn records(&self) -> &[Record] {
        &self.0.records
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        let of = |request: &Request| {
            let u = &points[request.point];
            let row = |row: usize| {
                let added = self.1.iter().zip(&u[1..]).map(|(one, size)| size * added(*one, row as f64));
                (u[0] * row as f64).sin() + added.sum::<f64>()
            };
            Some((0..self.0.records[request.record].row_count()).map(row).collect())
        };
        requests.iter().map(of).collect()
    }
}

impl<'a> Family for &'a Rivals {
    type Member = Rival<'a>;

    fn candidates(&self) -> usize {
        self.candidates
    }

    fn member(&self, set: &[usize], _: Level) -> Option<Rival<'a>> {
        Some(Rival(self, set.to_vec()))
    }

    fn carried(&self, _: &Rival<'a>, u: &[f64], _: &Rival<'a>) -> Vec<f64> {
        u.to_vec()
    }

    fn cold(&self, member: &Rival<'a>) -> Vec<Vec<f64>> {
        let valley = if member.1.contains(&0) { RIGHT_VALLEY } else { WRONG_VALLEY };
        vec![std::iter::once(valley).chain(member.1.iter().map(|_| 0.1)).collect()]
    }

    fn warm(&self, member: &Rival<'a>, from: &Rival<'a>, u: &[f64]) -> Vec<Vec<f64>> {
        let had = |one: &usize| from.1.iter().position(|other| other == one);
        let size = |one: &usize| had(one).map_or(0.1, |place| u[1 + place]);
        vec![std::iter::once(u[0]).chain(member.1.iter().map(size)).collect()]
    }

    fn shared(&self, from: &Rival<'a>, to: &Rival<'a>) -> Vec<Option<usize>> {
        let had = |one: &usize| from.1.iter().position(|other| other == one).map(|place| 1 + place);
        std::iter::once(Some(0)).chain(to.1.iter().map(had)).collect()
    }

    fn options(&self) -> FitOptions {
        far_off()
    }
}

#[test]
fn a_rival_that_ended_in_another_valley_is_fitted_from_the_best_one_s_optimum() {
    let family = Rivals::with(2, &[(1, 1.0)]);
    let alone = fit(&Rival(&family, vec![1]), &[WRONG_VALLEY, 0.1], &(&family).options()).expect("a possible start");
    assert!((alone.u[0] - RIGHT_VALLEY).abs() > 0.05, "it ends beside it: {:?}", alone.u);
    let single = SelectOptions { most: 1, ..SelectOptions::default() };
    assert_eq!(select(&&family, &single).expect("fitted").accepted(), [1]);
    // Without the second look the other one stays.
    let once = SelectOptions { rivals: 0, ..single };
    assert_eq!(select(&&family, &once).expect("fitted").accepted(), [0]);
}

#[test]
fn so_are_the_rivals_of_a_pair_that_fell_behind_in_a_first_look() {
    let family = Rivals::with(3, &[(1, 1.0), (2, 3.0)]);
    assert_eq!(select(&&family, &SelectOptions::default()).expect("fitted").accepted(), [1, 2]);
    let once = SelectOptions { rivals: 0, ..SelectOptions::default() };
    assert_ne!(select(&&family, &once).expect("fitted").accepted(), [1, 2]);
}
