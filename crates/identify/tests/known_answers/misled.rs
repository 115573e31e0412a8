//! Sets whose cheap fits lead them into another valley than the one that a smaller set is in.

use identify::select::{Family, Level, SelectOptions, select};
use identify::{Coordinate, FitOptions, Problem, Record, Request, fit};

use crate::common::{record, shared};
use crate::drawn::{RIGHT_VALLEY, WRONG_VALLEY, far_off, noise, regressor};

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

/// A member: its candidates, its coordinates, and by how much its frequency reads wrong.
struct Member<'a> {
    family: &'a Misled,
    set: Vec<usize>,
    coordinates: Vec<Coordinate>,
    reads_wrong: f64,
}

impl Problem for Member<'_> {
    fn coordinates(&self) -> &[Coordinate] {
        &self.coordinates
    }

    fn records(&self) -> &[Record] {
        &self.family.records
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        let of = |request: &Request| {
            let u = &points[request.point];
            let mut values = [u[0] - self.reads_wrong, 0.0, 0.0];
            self.set.iter().zip(&u[1..]).for_each(|(candidate, size)| values[1 + candidate] = *size);
            Some((0..self.family.records[request.record].row_count()).map(|row| predicted(&values, row)).collect())
        };
        requests.iter().map(of).collect()
    }
}

impl<'a> Family for &'a Misled {
    type Member = Member<'a>;

    fn candidates(&self) -> usize {
        2
    }

    fn member(&self, set: &[usize], level: Level) -> Option<Member<'a>> {
        let own = std::iter::once(0).chain(set.iter().map(|one| 1 + one));
        let coordinates = own.map(|index| self.coordinates[index].clone()).collect();
        // What is led astray fits as well a few valleys off.
        let reads_wrong = if (self.leads_astray)(set.len(), level) { WRONG_VALLEY - RIGHT_VALLEY } else { 0.0 };
        Some(Member { family: self, set: set.to_vec(), coordinates, reads_wrong })
    }

    fn carried(&self, _: &Member<'a>, u: &[f64], _: &Member<'a>) -> Vec<f64> {
        u.to_vec()
    }

    fn cold(&self, member: &Member<'a>) -> Vec<Vec<f64>> {
        let sizes = member.set.iter().map(|candidate| self.sizes[*candidate]);
        vec![std::iter::once(RIGHT_VALLEY + member.reads_wrong).chain(sizes).collect()]
    }

    fn warm(&self, member: &Member<'a>, from: &Member<'a>, u: &[f64]) -> Vec<Vec<f64>> {
        let frequency = u[0] - from.reads_wrong + member.reads_wrong;
        let size = |candidate: &usize| from.set.iter().position(|one| one == candidate).map_or(0.01, |at| u[1 + at]);
        vec![std::iter::once(frequency).chain(member.set.iter().map(size)).collect()]
    }

    fn shared(&self, from: &Member<'a>, to: &Member<'a>) -> Vec<Option<usize>> {
        let place = |candidate: &usize| from.set.iter().position(|one| one == candidate).map(|at| 1 + at);
        std::iter::once(Some(0)).chain(to.set.iter().map(place)).collect()
    }

    fn options(&self) -> FitOptions {
        far_off()
    }
}

/// What a search finds of them, with the frequency that it ends at.
fn found_of(family: &Misled) -> (Vec<usize>, f64) {
    let found = select(&family, &SelectOptions::default()).expect("fitted");
    let accepted = found.accepted().to_vec();
    let frequency = found.model(&accepted).expect("fitted").fit.u[0];
    (accepted, frequency)
}

#[test]
fn a_pair_can_do_what_one_of_its_effects_does_alone() {
    let sizes = [1.5, 0.1];
    let family = Misled::drawn(300, sizes, |size, level| size > 1 && level != Level::High);
    let problem = (&family).member(&[0, 1], Level::High).expect("a member");
    let misled = fit(&problem, &[WRONG_VALLEY, sizes[0], sizes[1]], &(&family).options()).expect("a possible start");
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
