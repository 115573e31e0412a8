//! A candidate whose shape is usual elsewhere than it is likely.

use identify::select::{Level, SelectOptions};
use identify::{Coordinate, Record, fit};

use crate::common::{record, shared};
use crate::drawn::{QUICK, SLOW, far_off, noise};
use crate::toy::{Member, Toy, searched};

/// A candidate with a shape: a swing of any pace, which its prior believes to be slow. Fits that know nothing begin there, and
/// those that begin where the base ended at a quick one as well.
struct Swings {
    records: Vec<Record>,
    coordinates: [Vec<Coordinate>; 2],
}

impl Toy for Swings {
    fn records(&self) -> &[Record] {
        &self.records
    }

    fn coordinates(&self, set: &[usize], _: Level) -> Vec<Coordinate> {
        self.coordinates[set.len()].clone()
    }

    fn rows(&self, _: &Member<'_>, record: usize, u: &[f64]) -> Vec<f64> {
        let swing = |row: usize| if u.len() > 1 { u[1] * (u[2] * row as f64).sin() } else { 0.0 };
        (0..self.records[record].row_count()).map(|row| u[0] + swing(row)).collect()
    }

    fn cold(&self, member: &Member<'_>) -> Vec<f64> {
        if member.set.is_empty() { vec![0.0] } else { vec![0.0, 1.0, SLOW] }
    }

    fn warm(&self, _: &Member<'_>, _: &Member<'_>, u: &[f64]) -> Vec<Vec<f64>> {
        [SLOW, 0.95 * QUICK].map(|pace| vec![u[0], 0.5, pace]).into()
    }

    fn shared(&self, from: &Member<'_>, to: &Member<'_>) -> Vec<Option<usize>> {
        if from.set.len() < to.set.len() {
            vec![Some(0), None, None]
        } else {
            (0..=2 * to.set.len()).map(Some).collect()
        }
    }
}

#[test]
fn an_effect_begins_with_the_shape_that_is_likely_and_not_with_the_one_that_is_usual() {
    let observed = |seed: u64| -> Vec<f64> {
        let row = |(row, noise): (usize, f64)| 0.2 + (QUICK * row as f64).sin() + noise;
        noise(40, 0.02, seed).into_iter().enumerate().map(row).collect()
    };
    let level = || shared("level", 0.0, 1.0, 20.0);
    let family = Swings {
        records: (0..4).map(|one| record(&observed(300 + one as u64), 0.02, true, one)).collect(),
        coordinates: [vec![level()], vec![level(), shared("size", 0.0, 1.0, 20.0), shared("pace", SLOW, 0.5, 3.0)]],
    };
    let cold = fit(&Member::of(&family, &[0], Level::Low), &[0.0, 1.0, SLOW], &far_off()).expect("a possible start");
    assert!((cold.u[2] - QUICK).abs() > 0.2, "it ends in another valley: {:?}", cold.u);
    let found = searched(&family, &SelectOptions::default());
    assert_eq!(found.accepted(), [0]);
    let model = found.model(&[0]).expect("fitted");
    assert!((model.fit.u[2] - QUICK).abs() < 1e-2, "{:?}", model.fit.u);
}
