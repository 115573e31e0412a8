//! Fits that end in the wrong one of two valleys.

use identify::select::{Family, Level, Model, SelectOptions, afresh, select};
use identify::{Coordinate, FitOptions, Problem, Record, Request, fit};

use crate::common::{record, shared};
use crate::drawn::{RIGHT_VALLEY, WRONG_VALLEY, far_off, noise, regressor};

/// A base whose fits that know nothing end in the wrong one of two valleys, and a candidate that does nothing but begin in
/// the right one.
struct Valleys {
    records: Vec<Record>,
    coordinates: [Vec<Coordinate>; 2],
}

impl Valleys {
    fn drawn(seed: u64) -> Self {
        let observed = |seed: u64| -> Vec<f64> {
            let rows = noise(60, 0.02, seed);
            rows.iter().enumerate().map(|(row, noise)| (RIGHT_VALLEY * row as f64).sin() + noise).collect()
        };
        let frequency = || shared("frequency", 0.5, 0.3, 1.5);
        Self {
            records: (0..4).map(|one| record(&observed(seed + one as u64), 0.02, true, one)).collect(),
            coordinates: [vec![frequency()], vec![frequency(), shared("size", 0.0, 1.0, 20.0)]],
        }
    }
}

/// A member of it: whether it has the candidate.
struct Valley<'a>(&'a Valleys, bool);

impl Problem for Valley<'_> {
    fn coordinates(&self) -> &[Coordinate] {
        &self.0.coordinates[usize::from(self.1)]
    }

    fn records(&self) -> &[Record] {
        &self.0.records
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        let of = |request: &Request| {
            let u = &points[request.point];
            let rows = self.0.records[request.record].row_count();
            let size = u.get(1).copied().unwrap_or(0.0);
            Some((0..rows).map(|row| (u[0] * row as f64).sin() + 1e-6 * size * regressor(3, row as f64)).collect())
        };
        requests.iter().map(of).collect()
    }
}

impl<'a> Family for &'a Valleys {
    type Member = Valley<'a>;

    fn candidates(&self) -> usize {
        1
    }

    fn member(&self, set: &[usize], _: Level) -> Option<Valley<'a>> {
        Some(Valley(self, !set.is_empty()))
    }

    fn carried(&self, _: &Valley<'a>, u: &[f64], _: &Valley<'a>) -> Vec<f64> {
        u.to_vec()
    }

    fn cold(&self, member: &Valley<'a>) -> Vec<Vec<f64>> {
        vec![if member.1 { vec![RIGHT_VALLEY, 0.1] } else { vec![WRONG_VALLEY] }]
    }

    fn warm(&self, member: &Valley<'a>, from: &Valley<'a>, u: &[f64]) -> Vec<Vec<f64>> {
        let size = if from.1 { u[1] } else { 0.1 };
        vec![if member.1 { vec![u[0], size] } else { vec![u[0]] }]
    }

    fn shared(&self, from: &Valley<'a>, to: &Valley<'a>) -> Vec<Option<usize>> {
        let size = to.1.then_some(from.1.then_some(1));
        std::iter::once(Some(0)).chain(size).collect()
    }

    fn options(&self) -> FitOptions {
        far_off()
    }
}

#[test]
fn a_set_fitted_afresh_takes_the_better_of_both_starts() {
    let family = Valleys::drawn(700);
    let problem = Valley(&family, false);
    let stuck = fit(&problem, &[WRONG_VALLEY], &(&family).options()).expect("a start that is possible");
    let base = Model { set: Vec::new(), level: Level::High, problem, fit: stuck, held_out: None };
    // From the base it would end beside it.
    let (_, fit) = afresh(&&family, &[0], &base).expect("fitted");
    assert!((fit.u[0] - RIGHT_VALLEY).abs() < 1e-3, "{:?}", fit.u);
}

#[test]
fn a_base_that_is_stuck_makes_no_effect_of_what_only_begins_elsewhere() {
    let family = Valleys::drawn(900);
    let cold = fit(&Valley(&family, false), &[WRONG_VALLEY], &(&family).options()).expect("a start that is possible");
    assert!((cold.u[0] - RIGHT_VALLEY).abs() > 0.05, "the base alone ends beside it: {:?}", cold.u);
    let found = select(&&family, &SelectOptions::default()).expect("fitted");
    assert!(found.accepted().is_empty(), "{:?}", found.accepted());
    let base = found.model(&[]).expect("fitted");
    assert!((base.fit.u[0] - RIGHT_VALLEY).abs() < 1e-3, "{:?}", base.fit.u);
}
