//! Which of several regressors are selected.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use identify::left::normalised_rms;
use identify::select::{Family, Level, Model, News, SelectOptions, select};
use identify::{Coordinate, FitOptions, Noise, Problem, Record, Request};

use crate::common::{record, shared};
use crate::drawn::{far_off, noise, regressor};

/// Candidates that each add something to the rows.
struct Regressors {
    records: Vec<Record>,
    candidates: usize,
    /// What a candidate of size one adds to a record at a time.
    adds: fn(usize, usize, f64) -> f64,
    /// An error in units of the noise below which nothing more is looked for.
    enough: f64,
    fitted: Mutex<usize>,
    asked: AtomicUsize,
}

struct Member<'a> {
    family: &'a Regressors,
    set: Vec<usize>,
    coordinates: Vec<Coordinate>,
}

impl Problem for Member<'_> {
    fn coordinates(&self) -> &[Coordinate] {
        &self.coordinates
    }

    fn records(&self) -> &[Record] {
        &self.family.records
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        self.family.asked.fetch_add(requests.len(), Ordering::Relaxed);
        let of = |request: &Request| {
            let u = &points[request.point];
            let rows = self.family.records[request.record].row_count();
            let value = |row: usize| {
                let adds = |one: usize| (self.family.adds)(one, request.record, row as f64);
                u[0] + self.set.iter().zip(&u[1..]).map(|(one, size)| size * adds(*one)).sum::<f64>()
            };
            Some((0..rows).map(value).collect())
        };
        requests.iter().map(of).collect()
    }
}

impl Regressors {
    /// Twelve candidates that each add a regressor; records differ by a gain.
    fn drawn(hidden: &[(usize, f64)], seed: u64) -> Self {
        Self::with(12, |one, record, time| (1.0 + 0.2 * record as f64) * regressor(one, time), hidden, seed)
    }

    fn with(candidates: usize, adds: fn(usize, usize, f64) -> f64, hidden: &[(usize, f64)], seed: u64) -> Self {
        let records = (0..5_usize).map(|one| {
            let observed: Vec<f64> = noise(120, 0.1, seed + one as u64)
                .iter()
                .enumerate()
                .map(|(row, noise)| {
                    let adds = |(index, size): &(usize, f64)| size * adds(*index, one, row as f64);
                    noise + 1.0 + hidden.iter().map(adds).sum::<f64>()
                })
                .collect();
            record(&observed, 0.1, true, one)
        });
        Self {
            records: records.collect(),
            candidates,
            adds,
            enough: 0.0,
            fitted: Mutex::new(0),
            asked: AtomicUsize::new(0),
        }
    }
}

impl<'a> Family for &'a Regressors {
    type Member = Member<'a>;

    fn is_enough(&self, model: &Model<Member<'a>>) -> bool {
        normalised_rms(&model.problem, &Noise::white(1), &model.fit.linear.residual) < self.enough
    }

    fn candidates(&self) -> usize {
        self.candidates
    }

    fn member(&self, set: &[usize], _: Level) -> Option<Member<'a>> {
        let sizes = set.iter().map(|one| shared(&format!("size {one}"), 0.0, 1.0, 20.0));
        let coordinates = std::iter::once(shared("mean", 0.0, 3.0, 50.0)).chain(sizes).collect();
        Some(Member { family: self, set: set.to_vec(), coordinates })
    }

    fn carried(&self, _: &Member<'a>, u: &[f64], _: &Member<'a>) -> Vec<f64> {
        u.to_vec()
    }

    fn cold(&self, member: &Member<'a>) -> Vec<Vec<f64>> {
        vec![vec![0.0; member.coordinates.len()]]
    }

    fn warm(&self, member: &Member<'a>, from: &Member<'a>, u: &[f64]) -> Vec<Vec<f64>> {
        let of = |one: &usize| from.set.iter().position(|other| other == one).map_or(0.0, |place| u[1 + place]);
        vec![std::iter::once(u[0]).chain(member.set.iter().map(of)).collect()]
    }

    fn shared(&self, from: &Member<'a>, to: &Member<'a>) -> Vec<Option<usize>> {
        let of = |one: &usize| from.set.iter().position(|other| other == one).map(|place| 1 + place);
        std::iter::once(Some(0)).chain(to.set.iter().map(of)).collect()
    }

    fn options(&self) -> FitOptions {
        far_off()
    }

    fn tell(&self, news: News<'_>) {
        if let News::Fitted { .. } = news {
            *self.fitted.lock().expect("no panic") += 1;
        }
    }
}

#[test]
fn what_is_hidden_is_selected_and_nothing_else() {
    let cases: [&[(usize, f64)]; 4] = [&[], &[(4, 0.5)], &[(0, 0.4), (7, 0.3)], &[(11, -0.6)]];
    for (case, hidden) in cases.iter().enumerate() {
        for seed in [1000, 2000, 3000] {
            let family = Regressors::drawn(hidden, seed + 10 * case as u64);
            let found = select(&&family, &SelectOptions::default()).expect("fitted");
            let expected: Vec<usize> = hidden.iter().map(|(index, _)| *index).collect();
            assert_eq!(found.accepted(), expected, "seed {seed}");
            // Always in the same order, so that sums over them end in the same digits.
            assert!(found.models.is_sorted_by(|a, b| (&a.set, a.level) < (&b.set, b.level)), "seed {seed}");
            // A race fits few sets to the end: far from all pairs of twelve, from both starts.
            let fitted = *family.fitted.lock().expect("no panic");
            assert!(fitted < 40 + 90 * hidden.len(), "{fitted} fits for {hidden:?}");
            assert!(family.asked.load(Ordering::Relaxed) < 40_000, "{:?}", family.asked);
        }
    }
}

#[test]
fn a_search_ends_where_enough_is_explained() {
    // The one makes an error of about 20 times the noise, the other of 3.
    for (enough, expected) in [(100.0, vec![]), (8.0, vec![0]), (0.0, vec![0, 7])] {
        let family = Regressors { enough, ..Regressors::drawn(&[(0, 2.0), (7, 0.25)], 4000) };
        let found = select(&&family, &SelectOptions::default()).expect("fitted");
        assert_eq!(found.accepted(), expected, "enough: {enough} times the noise");
    }
}

#[test]
fn an_effect_outside_the_family_is_not_replaced_by_one_of_it() {
    // A ramp is no sine: what is left is said to be left.
    let mut family = Regressors::drawn(&[], 77);
    for record in &mut family.records {
        for row in &mut record.series[0].rows {
            row.observed += 0.004 * row.time_s;
        }
    }
    let found = select(&&family, &SelectOptions::default()).expect("fitted");
    assert!(found.accepted().is_empty(), "{:?}", found.accepted());
    let base = found.model(&[]).expect("fitted");
    assert!(base.fit.noise.groups[0].discrepancy > 0.05, "{:?}", base.fit.noise);
}

#[test]
fn two_effects_that_help_only_together_are_kept_though_they_leave_something() {
    // The last record has each of them ten times over, against each other: one alone, sized by the other records, is far off there.
    let adds = |one: usize, record: usize, time: f64| {
        let gains = [[1.0, 1.0, 1.0, 1.0, 10.0], [0.3, 0.3, -0.3, -0.3, -9.0]];
        gains[one][record] * regressor(0, time)
    };
    let mut family = Regressors::with(2, adds, &[(0, 1.0), (1, 1.0)], 5000);
    for row in family.records.iter_mut().flat_map(|record| &mut record.series[0].rows) {
        row.observed += 0.006 * (row.time_s - 60.0);
    }
    let found = select(&&family, &SelectOptions::default()).expect("fitted");
    assert_eq!(found.accepted(), [0, 1]);
    let error = |set: &[usize]| {
        let model = found.model(set).expect("fitted");
        normalised_rms(&model.problem, &Noise::white(1), &model.held_out.as_ref().expect("five conditions").own)
    };
    assert!(error(&[0]) > error(&[]) && error(&[1]) > error(&[]), "neither helps alone");
    assert!(error(&[0, 1]) > 1.5 && error(&[0, 1]) < 0.7 * error(&[]), "{} of {}", error(&[0, 1]), error(&[]));
}
