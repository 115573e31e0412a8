//! Rows whose readings were rounded alike: together they tell of their place what one of them does.

use std::collections::HashMap;

use identify::{Record, Row};

use crate::data::ChannelData;

/// A row that moves by less than so many steps is at rest as far as rounding goes.
const AT_ONE_PLACE: f64 = 1.0;

/// What is added to the variance of a row, and to which others it is common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounded {
    /// The mean square of what its readings have in common.
    variance: f64,
    /// The half of a step it lies in, between two of which rounding changes its sign; nothing where it moves through several.
    place: Option<i64>,
}

impl Rounded {
    /// Of a row that moves by so much, with so many readings.
    pub fn new(channel: &ChannelData, row: &Row, moved: f64, readings: f64) -> Self {
        if channel.common_variance <= 0.0 {
            return Self { variance: 0.0, place: None };
        }
        let steps = moved / channel.step;
        // Through several steps the errors take turns, and only those at either end are left.
        let independent = (1.0 + steps * steps).min(readings);
        #[expect(clippy::cast_possible_truncation, reason = "which of the steps of a recorder")]
        let place = (2.0 * row.observed / channel.step).floor() as i64;
        Self { variance: channel.common_variance / independent, place: (steps < AT_ONE_PLACE).then_some(place) }
    }
}

/// Adds to each row's noise what it has in common with others: `rounded` by record, series and row.
pub fn add_what_is_common(records: &mut [Record], rounded: &[Vec<Vec<Rounded>>]) {
    let mut alike: HashMap<(usize, i64), f64> = HashMap::new();
    for (series, rows) in records.iter().zip(rounded).flat_map(|(record, rounded)| record.series.iter().zip(rounded)) {
        for place in rows.iter().filter_map(|one| one.place) {
            *alike.entry((series.group, place)).or_default() += 1.0;
        }
    }
    let all = records.iter_mut().zip(rounded);
    for (series, rows) in all.flat_map(|(record, rounded)| record.series.iter_mut().zip(rounded)) {
        let group = series.group;
        for (row, one) in series.rows.iter_mut().zip(rows) {
            let count = one.place.and_then(|place| alike.get(&(group, place))).copied().unwrap_or(1.0);
            row.sigma = row.sigma.hypot((one.variance * count).sqrt());
        }
    }
}

#[cfg(test)]
mod tests {
    use identify::{Record, Row, Series};

    use super::{Rounded, add_what_is_common};
    use crate::data::{Channel, ChannelData};

    const STEP: f64 = 1e-4;

    fn row(observed: f64) -> Row {
        Row { time_s: 0.0, observed, sigma: 1e-7, activity: 1.0, turns: 0 }
    }

    fn record(rows: Vec<Row>) -> Record {
        Record { series: vec![Series { rows, group: 0, is_process: true }], condition: 0 }
    }

    /// Rows at rest at the same place in two records, and one that moves, by steps.
    fn sigmas(common_variance: f64, moved_steps: f64) -> (f64, f64) {
        let channel =
            ChannelData { channel: Channel::Position, samples: Vec::new(), noise: 1e-5, step: STEP, common_variance };
        let rest = row(7.2 * STEP);
        let mut records = [record(vec![rest; 4]), record(vec![rest, row(9.2 * STEP)])];
        let at_rest = || Rounded::new(&channel, &rest, 0.1 * STEP, 50.0);
        let moves = Rounded::new(&channel, &row(9.2 * STEP), moved_steps * STEP, 50.0);
        add_what_is_common(&mut records, &[vec![vec![at_rest(); 4]], vec![vec![at_rest(), moves]]]);
        (records[0].series[0].rows[0].sigma, records[1].series[0].rows[1].sigma)
    }

    #[test]
    fn rows_at_one_place_tell_together_what_a_single_one_does() {
        let common = STEP * STEP / 12.0;
        let (at_rest, moves) = sigmas(common, 20.0);
        let together = at_rest / 5f64.sqrt();
        assert!((together / common.sqrt() - 1.0).abs() < 0.01, "{together}");
        // As many readings as there are, once it moves on by a step or so with each.
        let independent = (common / 50.0).sqrt();
        assert!((moves / independent - 1.0).abs() < 0.02, "{moves}");
    }

    #[test]
    fn what_noise_makes_independent_adds_nothing() {
        let (at_rest, moves) = sigmas(0.0, 20.0);
        assert!((at_rest - 1e-7).abs() < f64::EPSILON && (moves - 1e-7).abs() < f64::EPSILON);
    }
}
