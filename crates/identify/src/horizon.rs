//! Fits that go through what happens early before what happens late.
//!
//! Where something is thrown back ten times depends on each time before: a prediction a little off lies between two of them
//! there, and every such place is a valley of its own. A fit that counts at first only what comes before the first turn, then
//! four times as many each time, is in the right valley when the next ones are added (as fits over horizons that grow).

use crate::problem::{Coordinate, Difference, Linear, Problem, Record, Request};
use crate::stop::Stop;

/// A problem without the rows that come after so many turns.
pub(crate) struct Until<'a> {
    whole: &'a dyn Problem,
    turns: usize,
    records: Vec<Record>,
}

/// How many times more turns each stage goes through than the one before.
const LONGER: usize = 4;

/// The stages before the whole problem: none where nothing turns.
pub(crate) fn stages(whole: &dyn Problem) -> impl Iterator<Item = Until<'_>> {
    let most = whole.records().iter().flat_map(Record::rows).map(|row| row.turns).max().unwrap_or(0);
    let turns = std::iter::successors(Some(0), |turns| Some(LONGER * (turns + 1) - 1));
    turns.take_while(move |turns| *turns < most).map(|turns| Until::new(whole, turns))
}

impl<'a> Until<'a> {
    fn new(whole: &'a dyn Problem, turns: usize) -> Self {
        let mut records = whole.records().to_vec();
        for series in records.iter_mut().flat_map(|record| &mut record.series) {
            series.rows.retain(|row| row.turns <= turns);
        }
        Self { whole, turns, records }
    }

    /// A value of every row of a record, without those of rows that are left out.
    fn cut(&self, record: usize, values: Vec<f64>) -> Vec<f64> {
        let rows = self.whole.records()[record].rows();
        rows.zip(values).filter(|(row, _)| row.turns <= self.turns).map(|(_, value)| value).collect()
    }
}

impl Problem for Until<'_> {
    fn coordinates(&self) -> &[Coordinate] {
        self.whole.coordinates()
    }

    fn records(&self) -> &[Record] {
        &self.records
    }

    fn predict(&self, points: &[Vec<f64>], requests: &[Request]) -> Vec<Option<Vec<f64>>> {
        let predicted = self.whole.predict(points, requests).into_iter().zip(requests);
        predicted.map(|(values, request)| Some(self.cut(request.record, values?))).collect()
    }

    fn linearise(&self, u: &[f64], steps: &[Difference]) -> Option<Vec<Linear>> {
        let linear = self.whole.linearise(u, steps)?.into_iter().enumerate();
        let cut = |(record, of): (usize, Linear)| Linear {
            predicted: self.cut(record, of.predicted),
            columns: of.columns.into_iter().map(|(index, column)| (index, self.cut(record, column))).collect(),
        };
        Some(linear.map(cut).collect())
    }

    fn stop(&self) -> &Stop {
        self.whole.stop()
    }
}
