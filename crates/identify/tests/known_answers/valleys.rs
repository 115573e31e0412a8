//! Fits that end in the wrong one of two valleys.

use identify::select::{Level, Model, SelectOptions, afresh};
use identify::{Coordinate, Problem, Record, fit};

use crate::common::{record, shared};
use crate::drawn::{RIGHT_VALLEY, WRONG_VALLEY, far_off, noise, regressor};
use crate::toy::{Member, Toy, searched};

/// A start on the slope of the right valley, where the error is larger than at the bottom of the wrong one.
const BESIDE: f64 = 0.06;

/// A base whose fits that know nothing end in the wrong one of two valleys, and a candidate that does nothing but begin in
/// the right one, or beside it too.
struct Valleys {
    records: Vec<Record>,
    coordinates: [Vec<Coordinate>; 2],
    /// Frequencies that fits of the candidate may start from that know nothing.
    cold: Vec<f64>,
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
            cold: vec![RIGHT_VALLEY],
        }
    }
}

impl Toy for Valleys {
    fn records(&self) -> &[Record] {
        &self.records
    }

    fn coordinates(&self, set: &[usize], _: Level) -> Vec<Coordinate> {
        self.coordinates[set.len()].clone()
    }

    fn rows(&self, member: &Member<'_>, record: usize, u: &[f64]) -> Vec<f64> {
        let size = member.size_of(0, u).unwrap_or(0.0);
        let row = |row: f64| (u[0] * row).sin() + 1e-6 * size * regressor(3, row);
        (0..self.records[record].row_count()).map(|one| row(one as f64)).collect()
    }

    fn cold(&self, member: &Member<'_>) -> Vec<f64> {
        if member.set.is_empty() { vec![WRONG_VALLEY] } else { vec![self.cold[0], 0.1] }
    }

    fn elsewhere(&self, member: &Member<'_>) -> Vec<Vec<f64>> {
        if member.set.is_empty() { Vec::new() } else { self.cold[1..].iter().map(|one| vec![*one, 0.1]).collect() }
    }

    fn warm(&self, member: &Member<'_>, from: &Member<'_>, u: &[f64]) -> Vec<Vec<f64>> {
        let size = |candidate: &usize| from.size_of(*candidate, u).unwrap_or(0.1);
        vec![std::iter::once(u[0]).chain(member.set.iter().map(size)).collect()]
    }
}

#[test]
fn a_set_fitted_afresh_takes_the_better_of_both_starts() {
    let family = Valleys::drawn(700);
    let problem = Member::of(&family, &[], Level::High);
    let stuck = fit(&problem, &[WRONG_VALLEY], &far_off()).expect("a start that is possible");
    let base = Model { set: Vec::new(), level: Level::High, problem, fit: stuck, held_out: None };
    // From the base it would end beside it.
    let (_, fit) = afresh(&(&family as &dyn Toy), &[0], &base).expect("fitted");
    assert!((fit.u[0] - RIGHT_VALLEY).abs() < 1e-3, "{:?}", fit.u);
}

#[test]
fn a_set_fitted_afresh_looks_from_everywhere_before_it_leaves_what_fits_best_at_first() {
    let beside = RIGHT_VALLEY + BESIDE;
    let family =
        Valleys { cold: vec![WRONG_VALLEY, WRONG_VALLEY - 0.01, WRONG_VALLEY + 0.01, beside], ..Valleys::drawn(700) };
    let problem = Member::of(&family, &[], Level::High);
    let stuck = fit(&problem, &[WRONG_VALLEY], &far_off()).expect("a start that is possible");
    let error = |u: f64| {
        let rows = family.rows(&problem, 0, &[u]);
        problem.records()[0].error_in_activity(&rows)
    };
    assert!(error(stuck.u[0]) < error(beside), "the wrong valley is likelier at first");
    let base = Model { set: Vec::new(), level: Level::High, problem, fit: stuck, held_out: None };
    let (_, fit) = afresh(&(&family as &dyn Toy), &[0], &base).expect("fitted");
    assert!((fit.u[0] - RIGHT_VALLEY).abs() < 1e-3, "{:?}", fit.u);
}

#[test]
fn a_base_that_is_stuck_makes_no_effect_of_what_only_begins_elsewhere() {
    let family = Valleys::drawn(900);
    let cold =
        fit(&Member::of(&family, &[], Level::High), &[WRONG_VALLEY], &far_off()).expect("a start that is possible");
    assert!((cold.u[0] - RIGHT_VALLEY).abs() > 0.05, "the base alone ends beside it: {:?}", cold.u);
    let found = searched(&family, &SelectOptions::default());
    assert!(found.accepted().is_empty(), "{:?}", found.accepted());
    let base = found.model(&[]).expect("fitted");
    assert!((base.fit.u[0] - RIGHT_VALLEY).abs() < 1e-3, "{:?}", base.fit.u);
}
