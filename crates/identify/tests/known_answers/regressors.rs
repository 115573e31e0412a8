//! Which of several regressors are selected.

use std::sync::atomic::{AtomicUsize, Ordering};

use identify::left::{left_to_explain, normalised_rms};
use identify::select::{Level, Model, SelectOptions};
use identify::{Coordinate, Noise, Record};

use crate::common::{record, shared};
use crate::drawn::{noise, regressor};
use crate::toy::{Member, Toy, searched};

/// Candidates that each add something to the rows.
struct Regressors {
    records: Vec<Record>,
    candidates: usize,
    /// What a candidate of size one adds to a record at a time.
    adds: fn(usize, usize, f64) -> f64,
    /// An error in units of the noise below which nothing more is looked for.
    enough: f64,
    fitted: AtomicUsize,
    asked: AtomicUsize,
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
            fitted: AtomicUsize::new(0),
            asked: AtomicUsize::new(0),
        }
    }
}

impl Toy for Regressors {
    fn records(&self) -> &[Record] {
        &self.records
    }

    fn candidates(&self) -> usize {
        self.candidates
    }

    fn coordinates(&self, set: &[usize], _: Level) -> Vec<Coordinate> {
        let sizes = set.iter().map(|one| shared(&format!("size {one}"), 0.0, 1.0, 20.0));
        std::iter::once(shared("mean", 0.0, 3.0, 50.0)).chain(sizes).collect()
    }

    fn rows(&self, member: &Member<'_>, record: usize, u: &[f64]) -> Vec<f64> {
        self.asked.fetch_add(1, Ordering::Relaxed);
        let value = |row: usize| {
            let adds = |one: usize| (self.adds)(one, record, row as f64);
            u[0] + member.set.iter().zip(&u[1..]).map(|(one, size)| size * adds(*one)).sum::<f64>()
        };
        (0..self.records[record].row_count()).map(value).collect()
    }

    fn cold(&self, member: &Member<'_>) -> Vec<f64> {
        vec![0.0; 1 + member.set.len()]
    }

    fn warm(&self, member: &Member<'_>, from: &Member<'_>, u: &[f64]) -> Vec<Vec<f64>> {
        let size = |candidate: &usize| from.size_of(*candidate, u).unwrap_or(0.0);
        vec![std::iter::once(u[0]).chain(member.set.iter().map(size)).collect()]
    }

    fn is_enough(&self, model: &Model<Member<'_>>) -> bool {
        normalised_rms(&model.problem, &Noise::white(1), &model.fit.linear.residual) < self.enough
    }

    fn told(&self) {
        self.fitted.fetch_add(1, Ordering::Relaxed);
    }
}

#[test]
fn what_is_hidden_is_selected_and_nothing_else() {
    let cases: [&[(usize, f64)]; 4] = [&[], &[(4, 0.5)], &[(0, 0.4), (7, 0.3)], &[(11, -0.6)]];
    for (case, hidden) in cases.iter().enumerate() {
        for seed in [1000, 2000, 3000] {
            let family = Regressors::drawn(hidden, seed + 10 * case as u64);
            let found = searched(&family, &SelectOptions::default());
            let expected: Vec<usize> = hidden.iter().map(|(index, _)| *index).collect();
            assert_eq!(found.accepted(), expected, "seed {seed}");
            // Always in the same order, so that sums over them end in the same digits.
            assert!(found.models.is_sorted_by(|a, b| (&a.set, a.level) < (&b.set, b.level)), "seed {seed}");
            // A race fits few sets to the end: far from all pairs of twelve, from both starts.
            let fitted = family.fitted.load(Ordering::Relaxed);
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
        let found = searched(&family, &SelectOptions::default());
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
    let found = searched(&family, &SelectOptions::default());
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
    let found = searched(&family, &SelectOptions::default());
    assert_eq!(found.accepted(), [0, 1]);
    let error = |set: &[usize]| {
        let model = found.model(set).expect("fitted");
        normalised_rms(&model.problem, &Noise::white(1), &model.held_out.as_ref().expect("five conditions").own)
    };
    assert!(error(&[0]) > error(&[]) && error(&[1]) > error(&[]), "neither helps alone");
    assert!(error(&[0, 1]) > 1.5 && error(&[0, 1]) < 0.7 * error(&[]), "{} of {}", error(&[0, 1]), error(&[]));
}

#[test]
fn what_the_noise_takes_for_a_little_more_noise_is_found() {
    // A reading in twelve is off by 1.2 times the noise, one way and the other in turns: no model error that lasts, and an error of
    // the whole of a tenth more than the noise.
    let adds = |_: usize, _: usize, time: f64| match time.rem_euclid(12.0) {
        3.0 => 1.0,
        9.0 => -1.0,
        _ => 0.0,
    };
    let family = Regressors::with(1, adds, &[(0, 0.12)], 6000);
    let found = searched(&family, &SelectOptions::default());
    let base = found.model(&[]).expect("fitted");
    let left = left_to_explain(&base.problem, &base.fit, &family.options());
    assert!(left < SelectOptions::default().nothing_left, "{left} nats left");
    assert_eq!(found.accepted(), [0]);
}

#[test]
fn an_effect_below_a_noise_that_was_told_too_largely_is_found() {
    // A noise that is told as 3 times what it is: no error stands out of it, with the effect or without.
    let mut family = Regressors::with(1, |_, _, time| regressor(0, time), &[(0, 0.05)], 7000);
    for row in family.records.iter_mut().flat_map(|record| &mut record.series[0].rows) {
        row.sigma *= 3.0;
    }
    let found = searched(&family, &SelectOptions::default());
    let base = found.model(&[]).expect("fitted");
    let held = &base.held_out.as_ref().expect("five conditions").own;
    let error = normalised_rms(&base.problem, &base.fit.noise, held);
    assert!(error < 1.0, "{error} times the noise held out");
    assert_eq!(found.accepted(), [0]);
}

#[test]
fn a_pair_that_predicts_is_found_behind_a_likelier_one_that_does_not() {
    // What the last record alone has makes the third candidate the likeliest companion of the first, and predicts nothing.
    let adds =
        |one: usize, record: usize, time: f64| if one == 2 && record < 4 { 0.0 } else { regressor(3 * one, time) };
    let family = Regressors::with(3, adds, &[(0, 15.0), (1, 0.5), (2, 1.08)], 8000);
    let found = searched(&family, &SelectOptions::default());
    let evidence = |set: &[usize]| found.model(set).expect("fitted").fit.log_evidence;
    assert!(evidence(&[0, 2]) > evidence(&[0, 1]) + 10.0, "{} and {}", evidence(&[0, 2]), evidence(&[0, 1]));
    assert_eq!(found.accepted(), [0, 1]);
}
