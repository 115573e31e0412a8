//! What is identified: coordinates with priors, records, and a model that predicts every row of them.

use rayon::prelude::*;

use crate::stop::Stop;

/// The shortest difference for derivatives, as a share of the first one: below it what a
/// simulation cuts short counts more.
const SHORTEST: f64 = 0.02;

/// Which records a coordinate moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// All of them.
    Shared,
    /// One, by index.
    Record(usize),
}

/// One coordinate of a fit, with what is known of it beforehand: a normal density, cut off at the bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinate {
    /// What it is called in answers.
    pub name: String,
    /// Which records it moves.
    pub scope: Scope,
    /// Mean of the prior.
    pub mean: f64,
    /// Standard deviation of the prior, more than zero.
    pub sigma: f64,
    /// Smallest value.
    pub lower: f64,
    /// Largest value.
    pub upper: f64,
    /// Difference for derivatives where nothing is known yet of how sharply data pin the coordinate.
    pub step: f64,
}

impl Coordinate {
    /// A coordinate with a standard normal prior, bounded at `bound` standard deviations.
    pub fn standard(name: impl Into<String>, scope: Scope, bound: f64) -> Self {
        Self { name: name.into(), scope, mean: 0.0, sigma: 1.0, lower: -bound, upper: bound, step: 0.05 }
    }

    /// Moves the prior, bounds and all.
    pub fn shift(&mut self, by: f64) {
        self.mean += by;
        self.lower += by;
        self.upper += by;
    }

    /// Whether the prior is one half of a normal density (the other half lies beyond a bound).
    pub fn is_half(&self) -> bool {
        self.lower == self.mean || self.upper == self.mean
    }

    /// Whether a value lies at a bound.
    pub fn is_at_bound(&self, u: f64) -> bool {
        u <= self.lower || u >= self.upper
    }

    /// A difference for derivatives at `u` that stays within the bounds. `sigma` is the deviation of the coordinate, all
    /// others known: data that pin it sharply see the curvature of a longer difference as a wrong slope.
    pub fn step_at(&self, u: f64, sigma: f64) -> f64 {
        let step = sigma.clamp(SHORTEST * self.step, self.step);
        if u + step > self.upper { -step } else { step }
    }

    /// Whether it moves a record.
    pub fn moves(&self, record: usize) -> bool {
        match self.scope {
            Scope::Shared => true,
            Scope::Record(one) => one == record,
        }
    }
}

/// One observed number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// When, s. Rows of a series stand in order of time.
    pub time_s: f64,
    /// What was observed.
    pub observed: f64,
    /// One standard deviation of its noise, before the multiplier of its group.
    pub sigma: f64,
    /// Standard deviation of the model error in this row per unit of the group's discrepancy; it grows with the
    /// speed of what is observed, since an error of timing shows where something moves.
    pub activity: f64,
}

/// Rows of one channel of one record.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// The rows, in order of time.
    pub rows: Vec<Row>,
    /// Which group's noise multiplier and discrepancy it has.
    pub group: usize,
    /// Whether its model error is a process in time; single readings have none.
    pub is_process: bool,
}

/// What was recorded at one time: channels whose errors are independent of one another.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Record {
    /// The channels.
    pub series: Vec<Series>,
    /// The condition it was recorded under, an index; records of one condition are replicates.
    pub condition: usize,
}

impl Record {
    /// Rows of all its series.
    pub fn row_count(&self) -> usize {
        self.series.iter().map(|series| series.rows.len()).sum()
    }

    /// Sum of the squared errors of predicted rows, in units of their activity: how far off a prediction is while
    /// nothing is known of how large errors may be.
    pub fn error_in_activity(&self, predicted: &[f64]) -> f64 {
        self.rows().zip(predicted).map(|(row, value)| ((row.observed - value) / row.activity).powi(2)).sum()
    }

    /// All rows, series after series.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.series.iter().flat_map(|series| &series.rows)
    }
}

/// A prediction wanted: at which of the points, of which record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request {
    /// Index of the point.
    pub point: usize,
    /// Index of the record.
    pub record: usize,
}

/// The predictions of one record at a point and their derivatives.
#[derive(Debug, Clone, Default)]
pub struct Linear {
    /// A value for each row.
    pub predicted: Vec<f64>,
    /// For each coordinate that moves the record, its index and the derivative of each row.
    pub columns: Vec<(usize, Vec<f64>)>,
}

/// A model of records with coordinates.
pub trait Problem: Sync {
    /// The coordinates; a point has one value for each.
    fn coordinates(&self) -> &[Coordinate];

    /// The records.
    fn records(&self) -> &[Record];

    /// Predictions of the rows of records at points, one for each request; nothing where a point is impossible, or where
    /// somebody asked to stop before it was predicted.
    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>>;

    /// The predictions of every record at a point with all derivatives; finite differences unless a problem knows
    /// better. `steps` are the differences.
    fn linearise(&self, u: &[f64], steps: &[f64]) -> Option<Vec<Linear>> {
        let differences = Differences::new(self.coordinates(), self.records().len(), u, steps, 0..u.len());
        let predicted = self.predict(&differences.points, &differences.requests);
        differences.linear(predicted)
    }

    /// Whether somebody asked to stop; fits and searches look often.
    fn stop(&self) -> &Stop {
        Stop::never()
    }
}

/// Derivatives by finite differences: what has to be predicted for them, and what comes of it.
#[derive(Debug, Clone)]
pub struct Differences {
    /// The point itself, and one moved along each coordinate.
    pub points: Vec<Vec<f64>>,
    /// The predictions wanted: every record at the point itself, which is the first, and those that a coordinate moves.
    pub requests: Vec<Request>,
    records: usize,
    /// By how much each of the coordinates is moved, with its index.
    steps: Vec<(usize, f64)>,
}

impl Differences {
    /// With respect to some of the coordinates, by index; `steps` are the differences of all of them.
    pub fn new(
        coordinates: &[Coordinate],
        records: usize,
        u: &[f64],
        steps: &[f64],
        which: impl IntoIterator<Item = usize>,
    ) -> Self {
        let steps: Vec<(usize, f64)> = which.into_iter().map(|index| (index, steps[index])).collect();
        let mut points = vec![u.to_vec()];
        let mut requests: Vec<Request> = (0..records).map(|record| Request { point: 0, record }).collect();
        for (index, step) in &steps {
            let mut moved = u.to_vec();
            moved[*index] += step;
            let moves = (0..records).filter(|record| coordinates[*index].moves(*record));
            requests.extend(moves.map(|record| Request { point: points.len(), record }));
            points.push(moved);
        }
        Self { points, requests, records, steps }
    }

    /// The predictions with their derivatives, from what was predicted for the requests; nothing where the point itself is
    /// impossible. A moved one that is impossible has no derivative.
    pub fn linear(&self, predicted: Vec<Option<Vec<f64>>>) -> Option<Vec<Linear>> {
        let mut predicted = predicted.into_iter();
        let mut linear = Vec::with_capacity(self.records);
        for _ in 0..self.records {
            linear.push(Linear { predicted: predicted.next()??, columns: Vec::new() });
        }
        for (Request { point, record }, moved) in self.requests[self.records..].iter().zip(predicted) {
            let (index, step) = self.steps[point - 1];
            let at = &linear[*record].predicted;
            let column = match moved {
                Some(mut moved) => {
                    let inverse = 1.0 / step;
                    moved.iter_mut().zip(at).for_each(|(moved, at)| *moved = (*moved - at) * inverse);
                    moved
                }
                None => vec![0.0; at.len()],
            };
            linear[*record].columns.push((index, column));
        }
        Some(linear)
    }
}

/// The predictions of all records at each of several points; nothing for a point that is impossible.
pub fn predict_all(problem: &dyn Problem, points: &[Vec<f64>]) -> Vec<Option<Vec<Vec<f64>>>> {
    let records = problem.records().len();
    let requests: Vec<Request> =
        (0..points.len()).flat_map(|point| (0..records).map(move |record| Request { point, record })).collect();
    let mut predicted = problem.predict(points, &requests).into_iter();
    points.iter().map(|_| predicted.by_ref().take(records).collect::<Vec<_>>().into_iter().collect()).collect()
}

/// Sum over all records of [`Record::error_in_activity`].
pub fn error_in_activity(records: &[Record], predicted: &[Vec<f64>]) -> f64 {
    records.iter().zip(predicted).map(|(record, predicted)| record.error_in_activity(predicted)).sum()
}

/// Observed minus predicted, record by record.
pub fn residuals(problem: &dyn Problem, predicted: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let of = |(record, predicted): (&Record, &Vec<f64>)| {
        record.rows().zip(predicted).map(|(row, predicted)| row.observed - predicted).collect()
    };
    problem.records().par_iter().zip(predicted).map(of).collect()
}
