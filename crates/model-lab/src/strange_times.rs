//! Stroke times that stand alone against everything else that was recorded.
//!
//! What repeats say of each other is known without a model (`campaign`). Of a row that has no repeats, or one, a model
//! is needed: its parameters are fitted to all stroke times, and one that is many times farther off than these usually
//! are is left out and named. Physics that is missing shows in every repeat of a condition, and in more conditions
//! than one; what is left of it makes the usual error large.

use campaign::{Campaign, Doubt, TimingRow, Warning};
use identify::problem::Problem;
use identify::select::Level;
use identify::{FitOptions, Stop, fit};
use valve_file::ValveFile;

use crate::data::{Dataset, MEDIAN_SIZE};
use crate::identification::{NuisanceSizes, Subject};

/// How many times the usual error a time is away before it is left out: as for repeats (`campaign`).
const USUAL_ERRORS: f64 = 8.0;

/// Fewer readings than this say nothing of what is usual.
const FEWEST_READINGS: usize = 10;

/// At most one reading in so many is left out: where more stand out, it is not they that are wrong.
const ONE_IN: usize = 20;

/// A stroke time beside what the model says of it.
struct Reading {
    /// Its row in the campaign.
    row: usize,
    closes: bool,
    /// The rows under its conditions are one group.
    group: usize,
    observed_s: f64,
    expected_s: f64,
    /// Distance in standard deviations of the stated noise.
    deviations: f64,
}

/// Leaves out stroke times that stand alone against all others, with a warning each in the campaign.
pub fn leave_out(file: &ValveFile, campaign: &mut Campaign, stop: &Stop) {
    let Some(name) = campaign.timings_file.clone() else { return };
    let most = readings_of(&campaign.timings).div_ceil(ONE_IN);
    for _ in 0..most {
        let Some(strange) = strangest(file, campaign, stop) else { return };
        let row = &mut campaign.timings[strange.row];
        let stroke = if strange.closes { "closing" } else { "opening" };
        *(if strange.closes { &mut row.close_time_s } else { &mut row.open_time_s }) = None;
        let (time_s, expected_s, deviations) = (strange.observed_s, strange.expected_s, strange.deviations);
        let doubt = Doubt::UnlikeModel { stroke, time_s, expected_s, deviations };
        campaign.warnings.push(Warning { file: name.clone(), line: row.line, doubt });
    }
}

fn readings_of(rows: &[TimingRow]) -> usize {
    rows.iter().flat_map(|row| [row.close_time_s, row.open_time_s]).flatten().count()
}

/// The reading that stands out most, if it does and no other of its stroke under the same conditions does; its distance in
/// usual errors.
fn strangest(file: &ValveFile, campaign: &Campaign, stop: &Stop) -> Option<Reading> {
    if readings_of(&campaign.timings) < FEWEST_READINGS {
        return None;
    }
    let readings = fitted(file, campaign, stop)?;
    let mut sizes: Vec<f64> = readings.iter().map(|reading| reading.deviations).collect();
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    let usual = (*median / MEDIAN_SIZE).max(1.0);
    let is_strange = |reading: &Reading| reading.deviations > USUAL_ERRORS * usual;
    let is_alone = |one: &Reading| {
        let alike = |other: &&Reading| other.group == one.group && other.closes == one.closes && other.row != one.row;
        !readings.iter().filter(alike).any(is_strange)
    };
    let strange = readings.iter().enumerate().filter(|(_, reading)| is_strange(reading) && is_alone(reading));
    let (place, _) = strange.max_by(|a, b| a.1.deviations.total_cmp(&b.1.deviations))?;
    let strange = readings.into_iter().nth(place)?;
    Some(Reading { deviations: strange.deviations / usual, ..strange })
}

/// All stroke times beside a model whose tolerated parameters are fitted to them.
fn fitted(file: &ValveFile, campaign: &Campaign, stop: &Stop) -> Option<Vec<Reading>> {
    let times = Campaign { runs: Vec::new(), planned: Vec::new(), ..campaign.clone() };
    let data = Dataset::new(&times, file.schedule());
    let subject = Subject::new(file, &times, &NuisanceSizes::default(), stop);
    let problem = subject.problem(subject.space.clone(), Level::Low, stop);
    let options = FitOptions::new(subject.setup(Level::Low).groups.clone());
    let fit = fit(&problem, &problem.start(), &options)?;
    let mut readings = Vec::new();
    for (group, (of_group, (record, residual))) in
        data.timing_groups.iter().zip(problem.records().iter().zip(&fit.linear.residual)).enumerate()
    {
        let of_row = |row: &usize| {
            let timed = &data.timing_rows[*row];
            [(timed.close_time_s, *row, true), (timed.open_time_s, *row, false)]
        };
        let timed = of_group.rows.iter().flat_map(of_row).filter_map(|(time, row, closes)| Some((time?, row, closes)));
        for ((observed_s, row, closes), (of_record, residual)) in timed.zip(record.rows().zip(residual)) {
            let expected_s = observed_s - residual;
            let deviations = residual.abs() / of_record.sigma;
            readings.push(Reading { row, closes, group, observed_s, expected_s, deviations });
        }
    }
    Some(readings)
}
