//! The one definition of a model's error, for every verb, document, figure, page and history.
//!
//! A residual is measured minus simulated, row by row. Rows are means of samples, as identification cuts them
//! (`identification/setup.rs`): short where the valve moves, long where it rests. Of a model as its file states it,
//! instruments and conditions are taken at their word; of a fit, what they were found to be off by is taken out. Held out:
//! the same of records that a fit has not seen, shared values from the others.

use identify::Row;
use identify::problem::{Problem, predict_all, residuals};
use identify::select::Model;

use crate::identification::setup::{Kind, Recording};
use crate::identification::{Subject, ValveProblem};

/// The errors of residuals.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Errors {
    /// Root mean square of all rows in units of their noise as it is stated or estimated; 1: the noise explains it.
    pub normalised_rms: f64,
    /// Root mean square of the positions, m; nothing for stroke times alone.
    pub rmse_m: Option<f64>,
    /// The same as a share of the stroke.
    pub share_of_stroke: Option<f64>,
    /// Root mean square of the stroke times, s: of traces the times from a command until all but a twentieth of the
    /// stroke is travelled. Nothing where no stroke got there.
    pub time_rmse_s: Option<f64>,
}

/// Of a trace a stroke is over when this share of it is left, which both motions pass at speed.
const LEFT: f64 = 0.05;

/// A sum of squares and its count.
#[derive(Debug, Clone, Copy, Default)]
struct Squares(f64, f64);

impl Squares {
    fn add(&mut self, error: f64) {
        self.0 += error * error;
        self.1 += 1.0;
    }

    fn root(self) -> Option<f64> {
        (self.1 > 0.0).then(|| (self.0 / self.1).sqrt())
    }
}

impl Errors {
    /// Of residuals by record.
    pub fn of(problem: &ValveProblem<'_>, residual: &[Vec<f64>]) -> Self {
        Self::of_recordings(problem, residual, |_| true)
    }

    /// Of the residuals of some of the recordings alone.
    pub fn of_recordings(problem: &ValveProblem<'_>, residual: &[Vec<f64>], keep: impl Fn(&Recording) -> bool) -> Self {
        let (mut noise, mut position, mut time) = (Squares::default(), Squares::default(), Squares::default());
        let stroke_m = problem.setup().stroke_m;
        let recordings = problem.setup().recordings.iter().zip(problem.records()).zip(residual);
        for ((recording, record), residual) in recordings.filter(|((recording, _), _)| keep(recording)) {
            for (row, residual) in record.rows().zip(residual) {
                noise.add(residual / row.sigma);
            }
            let first = record.series.first().map_or(&[][..], |series| &series.rows);
            match &recording.kind {
                Kind::Trace(_) => {
                    residual[..first.len()].iter().for_each(|residual| position.add(*residual));
                    stroke_time_errors(recording, first, residual, stroke_m).for_each(|error| time.add(error));
                }
                Kind::Times(_) => residual.iter().for_each(|residual| time.add(*residual)),
            }
        }
        let rmse_m = position.root();
        Self {
            normalised_rms: noise.root().unwrap_or(0.0),
            rmse_m,
            share_of_stroke: rmse_m.map(|rmse_m| rmse_m / stroke_m),
            time_rmse_s: time.root(),
        }
    }
}

/// The errors of a model that was fitted to some of the records, or cheaply, as they are on all: as the errors of the same model
/// without effects, `less` so fitted and `all` fitted to the end, go.
pub fn as_on_all(errors: Errors, less: Errors, all: Errors) -> Errors {
    let share = |own: f64, less: f64, all: f64| if less > 0.0 { own / less * all } else { own };
    let of = |pick: fn(&Errors) -> Option<f64>| Some(share(pick(&errors)?, pick(&less)?, pick(&all)?));
    Errors {
        normalised_rms: share(errors.normalised_rms, less.normalised_rms, all.normalised_rms),
        rmse_m: of(|errors| errors.rmse_m),
        share_of_stroke: of(|errors| errors.share_of_stroke),
        time_rmse_s: of(|errors| errors.time_rmse_s),
    }
}

/// Measured minus simulated stroke times of a trace, s: those of strokes that both motions go.
fn stroke_time_errors(
    recording: &Recording,
    rows: &[Row],
    residual: &[f64],
    stroke_m: f64,
) -> impl Iterator<Item = f64> {
    let commands = &recording.run.commands;
    commands.iter().enumerate().filter_map(move |(index, edge)| {
        let until_s = commands.get(index + 1).map_or(f64::INFINITY, |next| next.time_s + recording.origin_s);
        let from = rows.partition_point(|row| row.time_s < edge.time_s + recording.origin_s);
        let end = rows.partition_point(|row| row.time_s < until_s);
        let rows = rows.get(from..end)?;
        // Until a level is passed downwards; an opening is a closing seen in a mirror.
        let (sign, level_m) = if edge.closes() { (1.0, LEFT * stroke_m) } else { (-1.0, (LEFT - 1.0) * stroke_m) };
        let above = |row: usize, missed: f64| sign * (rows[row].observed - missed) - level_m;
        let crossing = |missed: &dyn Fn(usize) -> f64| -> Option<f64> {
            let hit = (1..rows.len()).find(|row| above(*row, missed(*row)) <= 0.0)?;
            let (before, after) = (above(hit - 1, missed(hit - 1)), above(hit, missed(hit)));
            let share = before / (before - after);
            (before > 0.0).then(|| rows[hit - 1].time_s + share * (rows[hit].time_s - rows[hit - 1].time_s))
        };
        Some(crossing(&|_| 0.0)? - crossing(&|row| residual[from + row])?)
    })
}

/// The errors of a fitted model.
pub fn fitted(model: &Model<ValveProblem<'_>>) -> Errors {
    Errors::of(&model.problem, &model.fit.linear.residual)
}

/// The errors of a fitted model on what is held out, fold by fold; nothing where there is only one record, or where it was
/// fitted cheaply.
pub fn held_out(model: &Model<ValveProblem<'_>>) -> Option<Errors> {
    model.held_out.as_ref().map(|held| Errors::of(&model.problem, &held.own))
}

/// Stroke times are not explained where they need a noise that is larger than what is known of it by more than so many of its prior
/// deviations.
const LARGE_DEVIATIONS: f64 = 3.0;

/// Whether what a fitted model leaves is large: a model error of positions beyond a limit (share of the stroke at full speed), or
/// stroke times beyond their noise.
pub fn is_large(model: &Model<ValveProblem<'_>>, largest_discrepancy: f64) -> bool {
    let (setup, noise) = (model.problem.setup(), &model.fit.noise.groups);
    if setup.noise_m.is_some() {
        noise[0].discrepancy > largest_discrepancy.hypot(by_driving(model).map_or(0.0, |error| error.share))
    } else {
        noise[2].multiplier > 1.0 + LARGE_DEVIATIONS * setup.groups[2].multiplier_sigma
    }
}

/// Recorded pressures that a model leaves unexplained though their sensors' zeros and gains were fitted: their root mean square, Pa,
/// and the same in units of their noise; nothing where what is left is no larger than `largest_discrepancy`, the limit of
/// [`is_large`].
pub fn pressures_left(model: &Model<ValveProblem<'_>>, largest_discrepancy: f64) -> Option<(f64, f64)> {
    const PRESSURES: usize = 1;
    let (problem, fit) = (&model.problem, &model.fit);
    if fit.noise.groups[PRESSURES].discrepancy <= largest_discrepancy {
        return None;
    }
    let (mut pressure, mut noise) = (Squares::default(), Squares::default());
    for (record, residual) in problem.records().iter().zip(&fit.linear.residual) {
        let mut rest = residual.as_slice();
        for series in &record.series {
            let Some(own) = rest.split_off(..series.rows.len()) else { continue };
            for (row, residual) in series.rows.iter().zip(own).filter(|_| series.group == PRESSURES) {
                pressure.add(*residual);
                noise.add(residual / row.sigma);
            }
        }
    }
    pressure.root().zip(noise.root())
}

/// An error of positions that the noise of measured pressures makes which drive a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ByDriving {
    /// Root mean square, m.
    pub rmse_m: f64,
    /// As a model error: a share of the stroke at full speed.
    pub share: f64,
}

/// How far the pressures that drive a fitted model take it with another draw of their noise; nothing where none does. A piston
/// that a small difference of pressures moves adds that noise up on its way.
pub fn by_driving(model: &Model<ValveProblem<'_>>) -> Option<ByDriving> {
    let (problem, u) = (&model.problem, std::slice::from_ref(&model.fit.u));
    if !problem.setup().is_prescribed {
        return None;
    }
    let mut redrawn = problem.setup().clone();
    for recording in &mut redrawn.recordings {
        if let Some(pressures) = recording.redrawn.take() {
            recording.run.prescribed = Some(pressures);
        }
    }
    let other = problem.on(&redrawn);
    let [as_recorded, other] = [problem, &other].map(|problem| predict_all(problem, u).pop().flatten());
    let (mut moved, mut activity, mut rows) = (0.0, 0.0, 0.0);
    for (record, (as_recorded, other)) in problem.records().iter().zip(as_recorded?.iter().zip(&other?)) {
        let groups = record.series.iter().flat_map(|series| series.rows.iter().map(|row| (series.group, row)));
        for ((group, row), (as_recorded, other)) in groups.zip(as_recorded.iter().zip(other)) {
            if group == 0 {
                moved += (other - as_recorded).powi(2);
                activity += row.activity * row.activity;
                rows += 1.0;
            }
        }
    }
    (activity > 0.0).then(|| ByDriving { rmse_m: f64::sqrt(moved / rows), share: f64::sqrt(moved / activity) })
}

/// The errors at a point that nothing was fitted to.
pub fn at(problem: &ValveProblem<'_>, u: &[f64]) -> Option<Errors> {
    let predicted = predict_all(problem, &[u.to_vec()]).pop()??;
    Some(Errors::of(problem, &residuals(problem, &predicted)))
}

/// The step of a model as a datasheet states it.
const DATASHEET: &str = "datasheet";
/// The step of a model as a file states it that was fitted before.
const VALVE_FILE: &str = "valve file";
/// The step of a model whose parameters were fitted within their tolerances.
pub const CALIBRATED: &str = "calibrated";

/// One step of the model sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// "datasheet" ("valve file" where it was fitted before), "calibrated", then the effect added.
    pub step: String,
    /// What is left.
    pub errors: Errors,
    /// What is left where it was held out; nothing with a single record.
    pub held_out: Option<Errors>,
    /// Size of the model error that is left, as a share of the stroke at full speed; nothing where it was not asked for.
    pub discrepancy: Option<f64>,
    /// How long it hangs together, s.
    pub correlation_time_s: Option<f64>,
}

impl StepReport {
    /// Of a model as its file states it: by a datasheet, or by the steps in its history.
    pub fn as_stated(subject: &Subject, errors: Errors) -> Self {
        Self::of(if subject.was_fitted { VALVE_FILE } else { DATASHEET }, errors, None)
    }

    /// Its name for people: steps come on top of one another, so that an effect is told as added to those before.
    pub fn told(&self) -> String {
        let is_model = [DATASHEET, VALVE_FILE, CALIBRATED].contains(&self.step.as_str());
        if is_model { self.step.clone() } else { format!("+ {}", self.step) }
    }

    /// Of errors alone.
    pub fn of(step: impl Into<String>, errors: Errors, held_out: Option<Errors>) -> Self {
        Self { step: step.into(), errors, held_out, discrepancy: None, correlation_time_s: None }
    }

    /// Of a fitted model.
    pub fn new(step: impl Into<String>, model: &Model<ValveProblem<'_>>) -> Self {
        Self {
            step: step.into(),
            errors: fitted(model),
            held_out: held_out(model),
            discrepancy: Some(model.fit.noise.groups[0].discrepancy),
            correlation_time_s: Some(model.fit.noise.groups[0].time_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Errors, as_on_all};

    #[test]
    fn a_first_look_at_an_effect_is_told_by_how_much_less_it_leaves_there() {
        let of = |rms: f64, rmse_m: Option<f64>| Errors { normalised_rms: rms, rmse_m, ..Errors::default() };
        // On the few records both are larger; the effect takes half, and that is told of the error on all.
        let told = as_on_all(of(4.0, Some(2e-4)), of(8.0, Some(4e-4)), of(6.0, Some(3e-4)));
        assert_eq!(told, of(3.0, Some(1.5e-4)));
        assert_eq!(as_on_all(of(4.0, None), of(0.0, None), of(6.0, None)), of(4.0, None));
    }
}
