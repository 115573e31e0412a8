//! A companion is judged against a fit that has gone on as far as its own.

use identify::select::{Level, SelectOptions};
use identify::{Coordinate, Record};

use crate::common::{record, shared};
use crate::drawn::{noise, regressor};
use crate::toy::{Member, Toy, searched};

const ROWS: usize = 300;

/// Sizes of two regressors; the second is so small that it is not worth its place.
const SIZES: [f64; 2] = [3.0, 0.03];

/// What a member that decides is off by unless it is more exact than usual, in the noise of a row, and how much of that comes and goes
/// with the first size, so quickly that derivatives promise to take all of it away.
const OFF: f64 = 1.5;
const ROUGH: f64 = 0.05;
const QUICKLY: f64 = 1e7;

/// A family in which fits end at what is rough about them.
struct Rough {
    records: Vec<Record>,
}

impl Rough {
    fn drawn(seed: u64) -> Self {
        let observed: Vec<f64> =
            noise(ROWS, 0.1, seed).iter().enumerate().map(|(row, noise)| noise + adds(SIZES, row)).collect();
        Self { records: vec![record(&observed, 0.1, true, 0)] }
    }
}

fn adds(sizes: [f64; 2], row: usize) -> f64 {
    (0..2).map(|one| sizes[one] * regressor(one, row as f64)).sum()
}

impl Toy for Rough {
    fn records(&self) -> &[Record] {
        &self.records
    }

    fn candidates(&self) -> usize {
        2
    }

    fn coordinates(&self, set: &[usize], _: Level) -> Vec<Coordinate> {
        let sizes = set.iter().map(|one| shared(&format!("size {one}"), 0.0, 1.0, 20.0));
        std::iter::once(shared("mean", 0.0, 3.0, 50.0)).chain(sizes).collect()
    }

    fn rows(&self, member: &Member<'_>, _: usize, u: &[f64]) -> Vec<f64> {
        let sizes = [0, 1].map(|one| member.size_of(one, u).unwrap_or(0.0));
        let is_rough = member.level == Level::High && member.exact == 0 && !member.set.is_empty();
        let off = if is_rough { 0.1 * (OFF + ROUGH * (QUICKLY * sizes[0]).sin()) } else { 0.0 };
        (0..ROWS).map(|row| u[0] + adds(sizes, row) + off * regressor(4, row as f64)).collect()
    }

    fn finest(&self) -> usize {
        1
    }

    fn cold(&self, member: &Member<'_>) -> Vec<f64> {
        vec![0.0; 1 + member.set.len()]
    }

    fn warm(&self, member: &Member<'_>, from: &Member<'_>, u: &[f64]) -> Vec<Vec<f64>> {
        let size = |candidate: &usize| from.size_of(*candidate, u).unwrap_or(0.0);
        vec![std::iter::once(u[0]).chain(member.set.iter().map(size)).collect()]
    }
}

#[test]
fn a_companion_is_not_needed_because_only_the_pair_went_on_more_exactly() {
    for seed in 1..=60 {
        let family = Rough::drawn(seed);
        let found = searched(&family, &SelectOptions::default());
        assert_eq!(found.accepted(), [0], "seed {seed}");
    }
}
