//! Fits that end before they are done go on more exactly.

use identify::select::{Level, Model, afresh};
use identify::{Coordinate, FitOptions, Record, fit};

use crate::common::{options, record, shared};
use crate::toy::{Member, Toy};

/// How exact a member may be at most.
const FINEST: usize = 2;

/// Rosenbrock's valley, long and narrow.
struct Valley {
    records: Vec<Record>,
    coordinates: Vec<Coordinate>,
}

impl Valley {
    fn new() -> Self {
        let coordinates = (0..2).map(|index| shared(&format!("x{index}"), 0.0, 2.0, 12.0)).collect();
        Self { records: vec![record(&rows(&[2.0, 4.0]), 1.0, false, 0)], coordinates }
    }
}

fn rows(x: &[f64]) -> Vec<f64> {
    (0..60).map(|row| if row < 40 { 300.0 * (x[1] - x[0] * x[0]) } else { 2.0 * x[0] }).collect()
}

impl Toy for Valley {
    fn records(&self) -> &[Record] {
        &self.records
    }

    fn coordinates(&self, _: &[usize], _: Level) -> Vec<Coordinate> {
        self.coordinates.clone()
    }

    fn rows(&self, _: &Member<'_>, _: usize, u: &[f64]) -> Vec<f64> {
        rows(u)
    }

    fn finest(&self) -> usize {
        FINEST
    }

    fn cold(&self, _: &Member<'_>) -> Vec<f64> {
        vec![-1.5, 2.25]
    }

    fn warm(&self, _: &Member<'_>, _: &Member<'_>, u: &[f64]) -> Vec<Vec<f64>> {
        vec![u.to_vec()]
    }

    fn shared(&self, _: &Member<'_>, _: &Member<'_>) -> Vec<Option<usize>> {
        vec![Some(0), Some(1)]
    }

    fn options(&self) -> FitOptions {
        // So few derivatives that a fit does not come far.
        FitOptions { annealed: 1, settled: 1, tolerance: 0.01, ..options() }
    }
}

#[test]
fn a_fit_that_ends_before_it_is_done_goes_on_more_exactly() {
    let family = Valley::new();
    let problem = Member::of(&family, &[], Level::High);
    let base = fit(&problem, &[-1.5, 2.25], &family.options()).expect("possible everywhere");
    let base = Model { set: Vec::new(), level: Level::High, problem, fit: base, held_out: None };
    let (problem, found) = afresh(&(&family as &dyn Toy), &[0], &base).expect("fitted");
    assert!(found.predicted_gain < found.tolerance, "{} nats are promised", found.predicted_gain);
    assert!((found.u[0] - 1.95).abs() < 0.01, "{:?}", found.u);
    // Once, since that was enough.
    assert_eq!(problem.exact, 1);
}
