//! A candidate whose shape is usual elsewhere than it is likely.

use identify::select::{Family, Level, SelectOptions, select};
use identify::{Coordinate, FitOptions, Problem, Record, Request, fit};

use crate::common::{record, shared};
use crate::drawn::{QUICK, SLOW, far_off, noise};

/// A candidate with a shape: a swing of any pace, which its prior believes to be slow. Fits that know nothing begin there, and
/// those that begin where the base ended at a quick one as well.
struct Swings {
    records: Vec<Record>,
    coordinates: [Vec<Coordinate>; 2],
}

/// A member of it, with or without the candidate.
struct Swing<'a>(&'a Swings, bool);

impl Problem for Swing<'_> {
    fn coordinates(&self) -> &[Coordinate] {
        &self.0.coordinates[usize::from(self.1)]
    }

    fn records(&self) -> &[Record] {
        &self.0.records
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        let of = |request: &Request| {
            let u = &points[request.point];
            let swing = |row: usize| if self.1 { u[1] * (u[2] * row as f64).sin() } else { 0.0 };
            Some((0..self.0.records[request.record].row_count()).map(|row| u[0] + swing(row)).collect())
        };
        requests.iter().map(of).collect()
    }
}

impl<'a> Family for &'a Swings {
    type Member = Swing<'a>;

    fn candidates(&self) -> usize {
        1
    }

    fn member(&self, set: &[usize], _: Level) -> Option<Swing<'a>> {
        Some(Swing(self, !set.is_empty()))
    }

    fn carried(&self, _: &Swing<'a>, u: &[f64], _: &Swing<'a>) -> Vec<f64> {
        u.to_vec()
    }

    fn cold(&self, member: &Swing<'a>) -> Vec<Vec<f64>> {
        vec![if member.1 { vec![0.0, 1.0, SLOW] } else { vec![0.0] }]
    }

    fn warm(&self, _: &Swing<'a>, _: &Swing<'a>, u: &[f64]) -> Vec<Vec<f64>> {
        [SLOW, 0.95 * QUICK].map(|pace| vec![u[0], 0.5, pace]).into()
    }

    fn shared(&self, from: &Swing<'a>, to: &Swing<'a>) -> Vec<Option<usize>> {
        if from.1 || !to.1 { (0..to.coordinates().len()).map(Some).collect() } else { vec![Some(0), None, None] }
    }

    fn options(&self) -> FitOptions {
        far_off()
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
    let cold = fit(&Swing(&family, true), &[0.0, 1.0, SLOW], &(&family).options()).expect("a possible start");
    assert!((cold.u[2] - QUICK).abs() > 0.2, "it ends in another valley: {:?}", cold.u);
    let found = select(&&family, &SelectOptions::default()).expect("fitted");
    assert_eq!(found.accepted(), [0]);
    let model = found.model(&[0]).expect("fitted");
    assert!((model.fit.u[2] - QUICK).abs() < 1e-2, "{:?}", model.fit.u);
}
