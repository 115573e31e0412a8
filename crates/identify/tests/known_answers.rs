//! Evidence, variance components and selection where the answer is known.

mod common;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use common::{Function, Functions, options, record, shared, stated};
use identify::left::normalised_rms;
use identify::select::{Family, Level, Model, News, SelectOptions, afresh, select};
use identify::{Coordinate, FitOptions, GroupPrior, Noise, Problem, Record, Request, Scope, Stop, fit};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, Normal};

fn noise(count: usize, sigma: f64, seed: u64) -> Vec<f64> {
    let mut random = StdRng::seed_from_u64(seed);
    let normal = Normal::new(0.0, sigma).expect("a width");
    (0..count).map(|_| normal.sample(&mut random)).collect()
}

/// Some functions of time that are nowhere alike.
fn regressor(index: usize, time: f64) -> f64 {
    ((index as f64 + 1.0) * 0.37 * time + 0.2 * index as f64).sin()
}

#[test]
fn the_evidence_of_a_linear_model_is_that_of_its_normal_density() {
    let (rows, n, sigma) = (60, 3, 0.4);
    let observed: Vec<f64> = noise(rows, sigma, 3)
        .iter()
        .enumerate()
        .map(|(row, noise)| noise + 0.8 * regressor(0, row as f64) - 0.5 * regressor(2, row as f64))
        .collect();
    let priors = [1.0, 0.3, 2.0];
    let mut coordinates: Vec<Coordinate> = (0..n).map(|i| shared(&format!("b{i}"), 0.0, priors[i], 100.0)).collect();
    coordinates[1].mean = 0.1;
    let problem = Functions {
        coordinates,
        records: vec![record(&observed, sigma, false, 0)],
        of_records: vec![Box::new(move |b| {
            (0..rows).map(|row| (0..n).map(|i| b[i] * regressor(i, row as f64)).sum()).collect()
        })],
        asked: AtomicUsize::new(0),
    };
    let found = fit(&problem, &[0.0; 3], &options()).expect("linear");
    // Observed ~ N(X mean, sigma^2 + X S X').
    let x = DMatrix::from_fn(rows, n, |row, i| regressor(i, row as f64));
    let s = DMatrix::from_diagonal(&DVector::from_iterator(n, priors.iter().map(|sigma| sigma * sigma)));
    let covariance = &x * s * x.transpose() + DMatrix::identity(rows, rows) * sigma * sigma;
    let mean = &x * DVector::from_vec(vec![0.0, 0.1, 0.0]);
    let off = DVector::from_vec(observed) - mean;
    let factor = covariance.cholesky().expect("positive");
    let exact = -0.5 * off.dot(&factor.solve(&off))
        - factor.l().diagonal().map(f64::ln).sum()
        - 0.5 * rows as f64 * std::f64::consts::TAU.ln();
    assert!((found.log_evidence - exact).abs() < 1e-4, "{} for {exact}", found.log_evidence);
}

#[test]
fn variance_components_of_a_mixed_model_are_those_it_was_drawn_with() {
    // Each of 40 records has a level of its own, and errors that are white and an Ornstein-Uhlenbeck process.
    let (records, rows, white, size, time) = (40, 60, 0.2, 0.5, 6.0);
    let mut all: Vec<Record> = Vec::new();
    let mut coordinates = vec![shared("mean", 0.0, 10.0, 100.0)];
    for one in 0..records {
        let steps = noise(rows, 1.0, 100 + one as u64);
        let whites = noise(rows, white, 900 + one as u64);
        let level = noise(1, 1.0, 5000 + one as u64)[0];
        let keep = (-1.0_f64 / time).exp();
        let mut state = size * steps[0];
        let mut observed = Vec::with_capacity(rows);
        for row in 0..rows {
            if row > 0 {
                state = keep * state + size * (1.0 - keep * keep).sqrt() * steps[row];
            }
            observed.push(3.0 + level + state + whites[row]);
        }
        all.push(record(&observed, 0.1, true, one));
        coordinates.push(Coordinate { scope: Scope::Record(one), ..shared("level", 0.0, 1.0, 6.0) });
    }
    let functions = (0..records).map(|one| {
        let function: Function = Box::new(move |u| vec![u[0] + u[1 + one]; rows]);
        function
    });
    let problem = Functions { coordinates, records: all, of_records: functions.collect(), asked: AtomicUsize::new(0) };
    let prior =
        GroupPrior { multiplier_sigma: 2.0, multiplier: (0.1, 20.0), discrepancy: (1e-3, 10.0), time_s: (0.5, 60.0) };
    let found = fit(&problem, &vec![0.0; records + 1], &FitOptions::new(vec![prior])).expect("linear");
    let group = found.noise.groups[0];
    // The rows state half of the white noise.
    assert!((group.multiplier / 2.0 - 1.0).abs() < 0.15, "{group:?}");
    assert!((group.discrepancy / size - 1.0).abs() < 0.15, "{group:?}");
    assert!((group.time_s / time - 1.0).abs() < 0.3, "{group:?}");
    // Without a process it is nothing.
    let plain: Vec<Record> = (0..5).map(|one| record(&noise(rows, 0.1, 70 + one), 0.1, true, 0)).collect();
    let problem = Functions {
        coordinates: vec![shared("mean", 0.0, 10.0, 100.0)],
        records: plain,
        of_records: (0..5).map(|_| Box::new(move |u: &[f64]| vec![u[0]; rows]) as Box<_>).collect(),
        asked: AtomicUsize::new(0),
    };
    let found = fit(&problem, &[0.0], &FitOptions::new(vec![prior])).expect("linear");
    assert!(found.noise.groups[0].discrepancy < 0.03, "{:?}", found.noise);
}

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
        let prior = GroupPrior { discrepancy: (1e-4, 3.0), time_s: (1.0, 20.0), multiplier: (0.3, 20.0), ..stated() };
        FitOptions::new(vec![prior])
    }

    fn tell(&self, news: News<'_>) {
        if let News::Fitted { .. } = news {
            *self.fitted.lock().expect("no panic") += 1;
        }
    }

    fn stop(&self) -> &Stop {
        Stop::never()
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

/// Errors of fits that may end far from what is observed.
fn far_off() -> FitOptions {
    FitOptions::new(vec![GroupPrior {
        discrepancy: (1e-4, 3.0),
        time_s: (1.0, 20.0),
        multiplier: (0.3, 20.0),
        ..stated()
    }])
}

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

    fn tell(&self, _: News<'_>) {}

    fn stop(&self) -> &Stop {
        Stop::never()
    }
}

/// A frequency of what is observed, and one a few valleys off.
const RIGHT_VALLEY: f64 = 0.31;
const WRONG_VALLEY: f64 = 0.52;

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

/// Two candidates that do much the same, the right one of which begins in the wrong one of two valleys, and perhaps a third that
/// does something else.
struct Rivals {
    records: Vec<Record>,
    candidates: usize,
    coordinates: [Vec<Coordinate>; 3],
}

impl Rivals {
    /// Records of the right valley with what some candidates add.
    fn with(candidates: usize, hidden: &[(usize, f64)]) -> Self {
        let observed = |seed: u64| -> Vec<f64> {
            let row = |(row, noise): (usize, f64)| {
                let row = row as f64;
                let added = hidden.iter().map(|(one, size)| size * added(*one, row));
                (RIGHT_VALLEY * row).sin() + added.sum::<f64>() + noise
            };
            noise(60, 0.02, seed).into_iter().enumerate().map(row).collect()
        };
        let size = || shared("size", 0.0, 1.0, 20.0);
        let frequency = || shared("frequency", 0.5, 0.3, 1.5);
        Self {
            records: (0..4).map(|one| record(&observed(700 + one as u64), 0.02, true, one)).collect(),
            candidates,
            coordinates: [vec![frequency()], vec![frequency(), size()], vec![frequency(), size(), size()]],
        }
    }
}

/// A member of it: its candidates.
struct Rival<'a>(&'a Rivals, Vec<usize>);

/// What a candidate adds to a row.
fn added(candidate: usize, row: f64) -> f64 {
    match candidate {
        0 => regressor(3, row) + 0.3 * regressor(5, row),
        1 => regressor(3, row),
        _ => regressor(4, row),
    }
}

impl Problem for Rival<'_> {
    fn coordinates(&self) -> &[Coordinate] {
        &self.0.coordinates[self.1.len()]
    }

    fn records(&self) -> &[Record] {
        &self.0.records
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        let of = |request: &Request| {
            let u = &points[request.point];
            let row = |row: usize| {
                let added = self.1.iter().zip(&u[1..]).map(|(one, size)| size * added(*one, row as f64));
                (u[0] * row as f64).sin() + added.sum::<f64>()
            };
            Some((0..self.0.records[request.record].row_count()).map(row).collect())
        };
        requests.iter().map(of).collect()
    }
}

impl<'a> Family for &'a Rivals {
    type Member = Rival<'a>;

    fn candidates(&self) -> usize {
        self.candidates
    }

    fn member(&self, set: &[usize], _: Level) -> Option<Rival<'a>> {
        Some(Rival(self, set.to_vec()))
    }

    fn carried(&self, _: &Rival<'a>, u: &[f64], _: &Rival<'a>) -> Vec<f64> {
        u.to_vec()
    }

    fn cold(&self, member: &Rival<'a>) -> Vec<Vec<f64>> {
        let valley = if member.1.contains(&0) { RIGHT_VALLEY } else { WRONG_VALLEY };
        vec![std::iter::once(valley).chain(member.1.iter().map(|_| 0.1)).collect()]
    }

    fn warm(&self, member: &Rival<'a>, from: &Rival<'a>, u: &[f64]) -> Vec<Vec<f64>> {
        let had = |one: &usize| from.1.iter().position(|other| other == one);
        let size = |one: &usize| had(one).map_or(0.1, |place| u[1 + place]);
        vec![std::iter::once(u[0]).chain(member.1.iter().map(size)).collect()]
    }

    fn shared(&self, from: &Rival<'a>, to: &Rival<'a>) -> Vec<Option<usize>> {
        let had = |one: &usize| from.1.iter().position(|other| other == one).map(|place| 1 + place);
        std::iter::once(Some(0)).chain(to.1.iter().map(had)).collect()
    }

    fn options(&self) -> FitOptions {
        far_off()
    }

    fn tell(&self, _: News<'_>) {}

    fn stop(&self) -> &Stop {
        Stop::never()
    }
}

#[test]
fn a_rival_that_ended_in_another_valley_is_fitted_from_the_best_one_s_optimum() {
    let family = Rivals::with(2, &[(1, 1.0)]);
    let alone = fit(&Rival(&family, vec![1]), &[WRONG_VALLEY, 0.1], &(&family).options()).expect("a possible start");
    assert!((alone.u[0] - RIGHT_VALLEY).abs() > 0.05, "it ends beside it: {:?}", alone.u);
    let single = SelectOptions { most: 1, ..SelectOptions::default() };
    assert_eq!(select(&&family, &single).expect("fitted").accepted(), [1]);
    // Without the second look the other one stays.
    let once = SelectOptions { rivals: 0, ..single };
    assert_eq!(select(&&family, &once).expect("fitted").accepted(), [0]);
}

#[test]
fn so_are_the_rivals_of_a_pair_that_fell_behind_in_a_first_look() {
    let family = Rivals::with(3, &[(1, 1.0), (2, 3.0)]);
    assert_eq!(select(&&family, &SelectOptions::default()).expect("fitted").accepted(), [1, 2]);
    let once = SelectOptions { rivals: 0, ..SelectOptions::default() };
    assert_ne!(select(&&family, &once).expect("fitted").accepted(), [1, 2]);
}

/// A candidate with a shape: a swing of any pace, which its prior believes to be slow. Fits that know nothing begin there, and
/// those that begin where the base ended at a quick one as well.
struct Swings {
    records: Vec<Record>,
    coordinates: [Vec<Coordinate>; 2],
}

/// A member of it, with or without the candidate.
struct Swing<'a>(&'a Swings, bool);

/// The pace that the prior believes in, rad a row, and that of the records.
const SLOW: f64 = 0.4;
const QUICK: f64 = 1.3;

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

    fn tell(&self, _: News<'_>) {}

    fn stop(&self) -> &Stop {
        Stop::never()
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

/// A candidate with a ripple on it, whose pace is free in the end only.
struct Rippled {
    records: Vec<Record>,
    coordinates: [Vec<Coordinate>; 3],
}

/// A member of it: with or without the candidate, and its ripple's pace.
struct Ripple<'a>(&'a Rippled, usize);

impl Problem for Ripple<'_> {
    fn coordinates(&self) -> &[Coordinate] {
        &self.0.coordinates[self.1]
    }

    fn records(&self) -> &[Record] {
        &self.0.records
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        let of = |request: &Request| {
            let u = &points[request.point];
            let (size, pace) = (u.get(1).copied().unwrap_or(0.0), u.get(2).copied().unwrap_or(SLOW));
            let rows = 0..self.0.records[request.record].row_count();
            Some(rows.map(|row| u[0] + size * rippled(pace, row as f64)).collect())
        };
        requests.iter().map(of).collect()
    }
}

/// What the candidate adds to a row.
fn rippled(pace: f64, row: f64) -> f64 {
    regressor(3, row) + 0.5 * (pace * row).sin()
}

impl<'a> Family for &'a Rippled {
    type Member = Ripple<'a>;

    fn candidates(&self) -> usize {
        1
    }

    fn member(&self, set: &[usize], level: Level) -> Option<Ripple<'a>> {
        Some(Ripple(self, set.len() * if level == Level::High { 2 } else { 1 }))
    }

    fn carried(&self, _: &Ripple<'a>, u: &[f64], to: &Ripple<'a>) -> Vec<f64> {
        u.iter().copied().chain([1.0, SLOW].into_iter().skip(u.len() - 1)).take(to.coordinates().len()).collect()
    }

    fn cold(&self, member: &Ripple<'a>) -> Vec<Vec<f64>> {
        vec![[0.0, 1.0, SLOW][..member.coordinates().len()].to_vec()]
    }

    fn warm(&self, member: &Ripple<'a>, from: &Ripple<'a>, u: &[f64]) -> Vec<Vec<f64>> {
        vec![self.carried(from, u, member)]
    }

    fn shared(&self, from: &Ripple<'a>, to: &Ripple<'a>) -> Vec<Option<usize>> {
        let theirs = from.coordinates().len();
        (0..to.coordinates().len()).map(|index| (index < theirs).then_some(index)).collect()
    }

    fn options(&self) -> FitOptions {
        far_off()
    }

    fn tell(&self, _: News<'_>) {}

    fn stop(&self) -> &Stop {
        Stop::never()
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
    let from_usual = fit(&Ripple(&family, 2), &[0.2, 1.5, SLOW], &(&family).options()).expect("a possible start");
    assert!((from_usual.u[2] - QUICK).abs() > 0.2, "it ends in another valley: {:?}", from_usual.u);
    let found = select(&&family, &SelectOptions::default()).expect("fitted");
    assert_eq!(found.accepted(), [0]);
    let pace = found.model(&[0]).expect("fitted").fit.u[2];
    assert!((pace - QUICK).abs() < 1e-2, "{pace}");
}
