//! Sets whose cheap fits lead them into another valley than the one that a smaller set is in.

use identify::select::{Level, SelectOptions};
use identify::{Coordinate, Record, fit};

use crate::common::{record, shared};
use crate::drawn::{RIGHT_VALLEY, WRONG_VALLEY, far_off, noise, regressor};
use crate::toy::{Member, Toy, searched};

/// Two candidates beside a frequency.
struct Misled {
    /// How much of each candidate is in the records.
    sizes: [f64; 2],
    /// Whether a level leads a set of so many candidates astray.
    leads_astray: fn(usize, Level) -> bool,
    records: Vec<Record>,
    /// The frequency, and the sizes of the candidates.
    coordinates: Vec<Coordinate>,
}

impl Misled {
    fn drawn(seed: u64, sizes: [f64; 2], leads_astray: fn(usize, Level) -> bool) -> Self {
        let observed = |seed: u64| -> Vec<f64> {
            let rows = noise(60, 0.02, seed);
            let row = |(row, noise): (usize, &f64)| predicted(&[RIGHT_VALLEY, sizes[0], sizes[1]], row) + noise;
            rows.iter().enumerate().map(row).collect()
        };
        Self {
            sizes,
            leads_astray,
            records: (0..4).map(|one| record(&observed(seed + one as u64), 0.02, true, one)).collect(),
            coordinates: vec![
                shared("frequency", 0.3, 0.3, 1.5),
                shared("first", 0.0, 1.0, 20.0),
                shared("second", 0.0, 1.0, 20.0),
            ],
        }
    }
}

/// A row at a frequency with both sizes.
fn predicted(values: &[f64; 3], row: usize) -> f64 {
    let time = row as f64;
    (values[0] * time).sin() + values[1] * regressor(3, time) + values[2] * regressor(5, time)
}

impl Misled {
    /// By how much the frequency of a member reads wrong: what is led astray fits as well a few valleys off.
    fn reads_wrong(&self, member: &Member<'_>) -> f64 {
        if (self.leads_astray)(member.set.len(), member.level) { WRONG_VALLEY - RIGHT_VALLEY } else { 0.0 }
    }
}

impl Toy for Misled {
    fn records(&self) -> &[Record] {
        &self.records
    }

    fn candidates(&self) -> usize {
        2
    }

    fn coordinates(&self, set: &[usize], _: Level) -> Vec<Coordinate> {
        let own = std::iter::once(0).chain(set.iter().map(|one| 1 + one));
        own.map(|index| self.coordinates[index].clone()).collect()
    }

    fn rows(&self, member: &Member<'_>, record: usize, u: &[f64]) -> Vec<f64> {
        let size = |candidate| member.size_of(candidate, u).unwrap_or(0.0);
        let values = [u[0] - self.reads_wrong(member), size(0), size(1)];
        (0..self.records[record].row_count()).map(|row| predicted(&values, row)).collect()
    }

    fn cold(&self, member: &Member<'_>) -> Vec<f64> {
        let sizes = member.set.iter().map(|candidate| self.sizes[*candidate]);
        std::iter::once(RIGHT_VALLEY + self.reads_wrong(member)).chain(sizes).collect()
    }

    fn warm(&self, member: &Member<'_>, from: &Member<'_>, u: &[f64]) -> Vec<Vec<f64>> {
        let frequency = u[0] - self.reads_wrong(from) + self.reads_wrong(member);
        let size = |candidate: &usize| from.size_of(*candidate, u).unwrap_or(0.01);
        vec![std::iter::once(frequency).chain(member.set.iter().map(size)).collect()]
    }
}

/// What a search finds of them, with the frequency that it ends at.
fn found_of(family: &Misled) -> (Vec<usize>, f64) {
    let found = searched(family, &SelectOptions::default());
    let accepted = found.accepted().to_vec();
    let frequency = found.model(&accepted).expect("fitted").fit.u[0];
    (accepted, frequency)
}

#[test]
fn a_pair_can_do_what_one_of_its_effects_does_alone() {
    let sizes = [1.5, 0.1];
    let family = Misled::drawn(300, sizes, |size, level| size > 1 && level != Level::High);
    let problem = Member::of(&family, &[0, 1], Level::High);
    let misled = fit(&problem, &[WRONG_VALLEY, sizes[0], sizes[1]], &far_off()).expect("a possible start");
    assert!((misled.u[0] - RIGHT_VALLEY).abs() > 0.05, "from its cheap fit it ends beside it: {:?}", misled.u);
    let (accepted, frequency) = found_of(&family);
    assert_eq!(accepted, [0, 1]);
    assert!((frequency - RIGHT_VALLEY).abs() < 1e-3, "{frequency}");
}

#[test]
fn an_effect_that_a_first_look_misleads_can_do_what_none_does() {
    let family = Misled::drawn(400, [0.2, 0.0], |size, level| size > 0 && level == Level::Screen);
    let (accepted, frequency) = found_of(&family);
    assert_eq!(accepted, [0]);
    assert!((frequency - RIGHT_VALLEY).abs() < 1e-3, "{frequency}");
}
