//! A candidate whose shape is free in the end only.

use identify::select::{Level, SelectOptions};
use identify::{Coordinate, Problem, Record, fit};

use crate::common::{record, shared};
use crate::drawn::{QUICK, SLOW, far_off, noise, regressor};
use crate::toy::{Member, Toy, searched};

/// A candidate with a ripple on it, whose pace is free in the end only.
struct Rippled {
    records: Vec<Record>,
    coordinates: [Vec<Coordinate>; 3],
}

/// What the candidate adds to a row.
fn rippled(pace: f64, row: f64) -> f64 {
    regressor(3, row) + 0.5 * (pace * row).sin()
}

impl Toy for Rippled {
    fn records(&self) -> &[Record] {
        &self.records
    }

    fn coordinates(&self, set: &[usize], level: Level) -> Vec<Coordinate> {
        self.coordinates[set.len() * if level == Level::High { 2 } else { 1 }].clone()
    }

    fn rows(&self, _: &Member<'_>, record: usize, u: &[f64]) -> Vec<f64> {
        let (size, pace) = (u.get(1).copied().unwrap_or(0.0), u.get(2).copied().unwrap_or(SLOW));
        let rows = 0..self.records[record].row_count();
        rows.map(|row| u[0] + size * rippled(pace, row as f64)).collect()
    }

    fn cold(&self, member: &Member<'_>) -> Vec<f64> {
        [0.0, 1.0, SLOW][..member.coordinates().len()].to_vec()
    }

    fn warm(&self, member: &Member<'_>, _: &Member<'_>, u: &[f64]) -> Vec<Vec<f64>> {
        vec![self.carried(u, member)]
    }

    fn carried(&self, u: &[f64], to: &Member<'_>) -> Vec<f64> {
        u.iter().copied().chain([1.0, SLOW].into_iter().skip(u.len() - 1)).take(to.coordinates().len()).collect()
    }

    fn shared(&self, from: &Member<'_>, to: &Member<'_>) -> Vec<Option<usize>> {
        let theirs = from.coordinates().len();
        (0..to.coordinates().len()).map(|index| (index < theirs).then_some(index)).collect()
    }
}

#[test]
fn a_shape_that_is_free_in_the_end_only_begins_in_the_valley_that_the_rows_ask_for() {
    let observed = |seed: u64| -> Vec<f64> {
        let row = |(row, noise): (usize, f64)| 0.2 + 1.5 * rippled(QUICK, row as f64) + noise;
        noise(14, 0.02, seed).into_iter().enumerate().map(row).collect()
    };
    let (level, size) = (|| shared("level", 0.0, 1.0, 20.0), || shared("size", 0.0, 1.0, 20.0));
    let family = Rippled {
        records: (0..4).map(|one| record(&observed(500 + one as u64), 0.02, true, one)).collect(),
        coordinates: [vec![level()], vec![level(), size()], vec![level(), size(), shared("pace", SLOW, 0.5, 3.0)]],
    };
    let from_usual =
        fit(&Member::of(&family, &[0], Level::High), &[0.2, 1.5, SLOW], &far_off()).expect("a possible start");
    assert!((from_usual.u[2] - QUICK).abs() > 0.2, "it ends in another valley: {:?}", from_usual.u);
    let found = searched(&family, &SelectOptions::default());
    assert_eq!(found.accepted(), [0]);
    let pace = found.model(&[0]).expect("fitted").fit.u[2];
    assert!((pace - QUICK).abs() < 1e-2, "{pace}");
}
