//! What is identified: coordinates with priors, records, and a model that predicts every row of them.

use rayon::prelude::*;

use crate::stop::Stop;

/// The shortest difference for derivatives, as a share of the first one: below it what a
/// simulation cuts short counts more.
const SHORTEST: f64 = 0.02;

/// The same for derivatives that must be exact: what data pin more sharply than this is moved by as much to both sides. What is
/// rough about a prediction then counts a tenth as much, and what curves cancels.
const SHORTEST_TO_BOTH_SIDES: f64 = 0.1;

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
    /// Whether it is of how records were made, not of what they are records of: a record that is held out and alone tells it
    /// (an area that was set for it) says nothing against the model by that.
    pub of_measuring: bool,
}

impl Coordinate {
    /// A coordinate with a standard normal prior, bounded at `bound` standard deviations.
    pub fn standard(name: impl Into<String>, scope: Scope, bound: f64) -> Self {
        let (lower, upper) = (-bound, bound);
        Self { name: name.into(), scope, mean: 0.0, sigma: 1.0, lower, upper, step: 0.05, of_measuring: false }
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
    pub fn step_at(&self, u: f64, sigma: f64) -> Difference {
        let step = sigma.clamp(SHORTEST * self.step, self.step);
        Difference { ahead: if u + step > self.upper { -step } else { step }, back: 0.0 }
    }

    /// The same for derivatives that must be exact: to both sides where data pin the coordinate so sharply that what curves, or
    /// what is rough about a prediction, would be taken for knowledge along directions in which others make up for it.
    pub fn exact_step_at(&self, u: f64, sigma: f64) -> Difference {
        let step = SHORTEST_TO_BOTH_SIDES * self.step;
        let has_room = u + step <= self.upper && u - step >= self.lower;
        if sigma < step && has_room { Difference { ahead: step, back: step } } else { self.step_at(u, sigma) }
    }

    /// Whether it moves a record.
    pub fn moves(&self, record: usize) -> bool {
        match self.scope {
            Scope::Shared => true,
            Scope::Record(one) => one == record,
        }
    }
}

/// A difference for a derivative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// By how much a coordinate is moved; less than zero where it has no room above.
    pub ahead: f64,
    /// By how much it is moved to the other side; zero where the difference is taken from the point itself.
    pub back: f64,
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
    /// How often what is observed turned back since it was last driven from outside: what a prediction has a little wrong adds up
    /// with each, until it lies between two of them.
    pub turns: usize,
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
    fn linearise(&self, u: &[f64], steps: &[Difference]) -> Option<Vec<Linear>> {
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
    /// The point itself, and one or two moved along each coordinate.
    pub points: Vec<Vec<f64>>,
    /// The predictions wanted: every record at the point itself, which is the first, and those that a coordinate moves; both
    /// ends of a difference stand side by side.
    pub requests: Vec<Request>,
    records: usize,
    /// By how much the coordinate that a point is moved along is moved, with its index; the point itself has none.
    steps: Vec<(usize, Difference)>,
}

impl Differences {
    /// With respect to some of the coordinates, by index; `steps` are the differences of all of them.
    pub fn new(
        coordinates: &[Coordinate],
        records: usize,
        u: &[f64],
        steps: &[Difference],
        which: impl IntoIterator<Item = usize>,
    ) -> Self {
        let mut points = vec![u.to_vec()];
        let mut requests: Vec<Request> = (0..records).map(|record| Request { point: 0, record }).collect();
        let mut of_points = Vec::new();
        for index in which {
            let first = points.len();
            let Difference { ahead, back } = steps[index];
            for by in [ahead, -back].into_iter().filter(|by| *by != 0.0) {
                let mut moved = u.to_vec();
                moved[index] += by;
                points.push(moved);
                of_points.push((index, steps[index]));
            }
            for record in (0..records).filter(|record| coordinates[index].moves(*record)) {
                requests.extend((first..points.len()).map(|point| Request { point, record }));
            }
        }
        Self { points, requests, records, steps: of_points }
    }

    /// The predictions with their derivatives, from what was predicted for the requests; nothing where the point itself is
    /// impossible. Of two ends one does where the other is impossible; without any there is no derivative.
    pub fn linear(&self, predicted: Vec<Option<Vec<f64>>>) -> Option<Vec<Linear>> {
        let mut predicted = predicted.into_iter();
        let mut linear = Vec::with_capacity(self.records);
        for _ in 0..self.records {
            linear.push(Linear { predicted: predicted.next()??, columns: Vec::new() });
        }
        let mut moved = self.requests[self.records..].iter().zip(predicted);
        while let Some((Request { point, record }, ahead)) = moved.next() {
            let (index, step) = self.steps[point - 1];
            let back = if step.back == 0.0 { None } else { moved.next()?.1 };
            let at = &linear[*record].predicted;
            let column = match (ahead, back) {
                (Some(ahead), Some(back)) => quotient(ahead, &back, step.ahead + step.back),
                (Some(ahead), None) => quotient(ahead, at, step.ahead),
                (None, Some(back)) => quotient(back, at, -step.back),
                (None, None) => vec![0.0; at.len()],
            };
            linear[*record].columns.push((index, column));
        }
        Some(linear)
    }
}

/// The quotient of a difference, row by row.
fn quotient(mut to: Vec<f64>, from: &[f64], length: f64) -> Vec<f64> {
    let inverse = 1.0 / length;
    to.iter_mut().zip(from).for_each(|(to, from)| *to = (*to - from) * inverse);
    to
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

#[cfg(test)]
mod tests {
    use super::{Coordinate, Difference, Differences, Scope};

    fn derivatives(steps: [Difference; 2], value: impl Fn(&[f64]) -> Option<f64>) -> Vec<(usize, f64)> {
        let coordinates = [0, 1].map(|index| Coordinate::standard(format!("x{index}"), Scope::Record(index), 3.0));
        let differences = Differences::new(&coordinates, 2, &[1.0, 2.0], &steps, 0..2);
        let predicted =
            differences.requests.iter().map(|request| Some(vec![value(&differences.points[request.point])?]));
        let linear = differences.linear(predicted.collect()).expect("possible there");
        linear.into_iter().flat_map(|one| one.columns).map(|(index, column)| (index, column[0])).collect()
    }

    #[test]
    fn what_curves_cancels_where_a_difference_goes_to_both_sides() {
        let (one, both) = (Difference { ahead: 0.1, back: 0.0 }, Difference { ahead: 0.1, back: 0.1 });
        let square = |x: &[f64]| Some(x[0] * x[0] + 10.0 * x[1] * x[1]);
        let found = derivatives([both, one], square);
        assert!((found[0].1 - 2.0).abs() < 1e-9 && (found[1].1 - 41.0).abs() < 1e-9, "{found:?}");
        // Of two ends one does, where the other is impossible.
        let bounded = |x: &[f64]| if x[0] > 1.0 || x[1] < 2.0 { None } else { square(x) };
        let found = derivatives([both, both], bounded);
        assert!((found[0].1 - 1.9).abs() < 1e-9 && (found[1].1 - 41.0).abs() < 1e-9, "{found:?}");
        assert_eq!(derivatives([one, both], bounded)[0], (0, 0.0));
    }

    #[test]
    fn only_what_is_known_sharply_and_has_room_is_moved_to_both_sides() {
        let coordinate = Coordinate::standard("x", Scope::Shared, 3.0);
        let is = |(u, sigma): (f64, f64), (ahead, back): (f64, f64)| {
            let found = coordinate.exact_step_at(u, sigma);
            assert!((found.ahead - ahead).abs() < 1e-12 && (found.back - back).abs() < 1e-12, "{found:?}");
        };
        is((0.0, 1e-4), (0.005, 0.005));
        is((0.0, 0.02), (0.02, 0.0));
        is((2.999, 1e-4), (0.001, 0.0));
        is((3.0, 1e-4), (-0.001, 0.0));
    }
}
