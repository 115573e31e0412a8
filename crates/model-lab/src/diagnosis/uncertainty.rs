//! How sure fitted values are.
//!
//! The covariance of a fit knows noise, nuisances and the model error. Where single records disagree by more than it says,
//! the cluster-robust one takes its place: a jackknife over records, to first order. The sizes of effects are widened where fits that hold them
//! beside their optimum are better than the covariance says: a profile of the likelihood. All are as many times
//! wider as strokes that were held out are off more than their noise (the dispersion of a quasi-likelihood, McCullagh and Nelder,
//! Generalized Linear Models, 1989, chapter 9): what a model leaves is alike in every stroke, and a covariance takes it for an
//! error that goes away with their number.

use identify::left::normalised_rms;
use identify::normal::{Normal, Posterior};
use identify::problem::Problem;
use identify::select::Model;
use identify::special::t_quantile_95;
use identify::{Fit, FitOptions, fit};
use nalgebra::DMatrix;
use rayon::prelude::*;
use valve_model::effects::{ActsOn, EffectParameter, Search};
use valve_model::{EffectKind, ParameterId};

use super::answer::{FittedParameter, MovedParameter};
use crate::errors::{self, Errors};
use crate::identification::{Entry, Nuisance, ValveProblem};
use crate::space::{Coordinate, Target};

/// Steps of numerical derivatives, in standard deviations, and between which these are believed, in prior ones.
const STEP: f64 = 0.1;
const BELIEVED: (f64, f64) = (1e-6, 1.0);

/// Fewer records than this say nothing of how they disagree.
const FEWEST_RECORDS: usize = 4;

/// A fit with everything that is needed for standard errors.
#[derive(Debug)]
pub struct Certainty {
    covariance: DMatrix<f64>,
    /// Points that fits without one record each would end at, to first order.
    without: Vec<Vec<f64>>,
    /// How many times wider what is left makes everything.
    dispersion: f64,
}

impl Certainty {
    /// Of a fit.
    pub fn new(problem: &ValveProblem<'_>, fit: &Fit) -> Self {
        let normals = fit.linear.normals(problem, &fit.noise);
        let mut sum: Option<Normal> = None;
        for normal in &normals {
            match &mut sum {
                Some(sum) => sum.add(normal),
                None => sum = Some(normal.clone()),
            }
        }
        let coordinates = problem.coordinates();
        let Some(sum) = sum else { return Self::of(DMatrix::zeros(0, 0), Vec::new()) };
        let posterior = Posterior::new(coordinates, &fit.u, &sum);
        let covariance = posterior.covariance(&fit.held);
        let mut without = Vec::new();
        if normals.len() >= FEWEST_RECORDS {
            for normal in &normals {
                let mut rest = sum.clone();
                rest.subtract(normal);
                let posterior = Posterior::new(coordinates, &fit.u, &rest);
                without.extend(posterior.newton().map(|step| step.to));
            }
        }
        Self::of(covariance, without)
    }

    fn of(covariance: DMatrix<f64>, without: Vec<Vec<f64>>) -> Self {
        Self { covariance, without, dispersion: 1.0 }
    }

    /// Of a model, by its errors on what was held out.
    pub fn of_model(model: &Model<ValveProblem<'_>>) -> Self {
        Self::new(&model.problem, &model.fit).leaving(errors::held_out(model).as_ref())
    }

    fn leaving(self, held_out: Option<&Errors>) -> Self {
        Self { dispersion: held_out.map_or(1.0, |errors| errors.normalised_rms.max(1.0)), ..self }
    }

    /// The covariance of the coordinates.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// One standard deviation of a function of the point.
    pub fn sigma(&self, problem: &ValveProblem<'_>, u: &[f64], of: impl Fn(&[f64]) -> f64) -> f64 {
        let [covariance, jackknife] = self.sigmas(problem, u, of);
        covariance.max(jackknife)
    }

    /// Half the width of the interval that holds a function of the point with a probability of 90 %: wider than for a
    /// normal density where what a few records disagree by decides (Student's t).
    pub fn half_width_90(&self, problem: &ValveProblem<'_>, u: &[f64], of: impl Fn(&[f64]) -> f64) -> f64 {
        let [covariance, jackknife] = self.sigmas(problem, u, of);
        let freedom = self.without.len().saturating_sub(1).max(1) as f64;
        (t_quantile_95(f64::INFINITY) * covariance).max(t_quantile_95(freedom) * jackknife)
    }

    /// One standard deviation of a function of the point: by the covariance, and by what records disagree by.
    fn sigmas(&self, problem: &ValveProblem<'_>, u: &[f64], of: impl Fn(&[f64]) -> f64) -> [f64; 2] {
        let value = of(u);
        let slopes: Vec<f64> = (0..u.len())
            .map(|index| {
                let coordinate = &problem.coordinates()[index];
                let width = self.covariance[(index, index)].max(0.0).sqrt();
                let step = STEP * width.clamp(BELIEVED.0, BELIEVED.1);
                let step = if u[index] + step > coordinate.upper { -step } else { step };
                let mut moved = u.to_vec();
                moved[index] += step;
                (of(&moved) - value) / step
            })
            .collect();
        let mut variance = 0.0;
        for (i, a) in slopes.iter().enumerate() {
            for (j, b) in slopes.iter().enumerate() {
                variance += a * self.covariance[(i, j)] * b;
            }
        }
        let mut jackknife = 0.0;
        if self.without.len() >= FEWEST_RECORDS {
            let values: Vec<f64> = self.without.iter().map(|u| of(u)).collect();
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            jackknife = (count - 1.0) / count * values.iter().map(|one| (one - mean).powi(2)).sum::<f64>();
        }
        [variance, jackknife].map(|variance| self.dispersion * variance.max(0.0).sqrt())
    }
}

/// Derivatives of a fit that holds a size beside its optimum.
const PROFILED: usize = 4;

/// A profile is followed to this many times the covariance's width at most.
const WIDEST: f64 = 10.0;

/// Widths that a profile looks at, and the share of the rise wanted from which no further one is.
const LOOKS: usize = 2;
const ENOUGH: f64 = 0.7;

/// How much wider than by its covariance the likelihood holds a coordinate possible, at the end of the interval of 90 %:
/// all others are fitted anew where it is held there. A size that a shape can stand in for has a long curved valley, which a
/// covariance does not see. It is never narrower, and follows no further than [`WIDEST`].
fn profiled(problem: &ValveProblem<'_>, best: &Fit, certainty: &Certainty, index: usize) -> f64 {
    let sigma = certainty.covariance()[(index, index)].max(0.0).sqrt();
    let coordinate = &problem.coordinates()[index];
    if sigma <= 0.0 || best.held[index] {
        return 1.0;
    }
    let cost = |problem: &ValveProblem<'_>, fit: &Fit| {
        let normal = fit.linear.normal(problem, &best.noise);
        Posterior::new(problem.coordinates(), &fit.u, &normal).cost
    };
    let least = cost(problem, best);
    let wanted = t_quantile_95(f64::INFINITY);
    let options = FitOptions {
        annealed: 0,
        settled: PROFILED,
        known: Some(best.noise.clone()),
        ..FitOptions::new(problem.setup().groups.clone())
    };
    let of_side = |side: f64| -> f64 {
        let mut wide = 1.0;
        for _ in 0..LOOKS {
            let at = (best.u[index] + side * wide * wanted * sigma).clamp(coordinate.lower, coordinate.upper);
            let far = (at - best.u[index]) / sigma;
            // The others move as the covariance says, to begin with.
            let column = certainty.covariance().column(index);
            let start: Vec<f64> = best.u.iter().zip(column.iter()).map(|(u, c)| u + c * far / sigma).collect();
            let held = problem.held_at(index, at);
            let Some(fit) = fit(&held, &start, &options) else { break };
            let rise = (cost(&held, &fit) - least).max(0.0).sqrt();
            wide = (far.abs() / rise).clamp(1.0, WIDEST);
            if rise > ENOUGH * wanted || at <= coordinate.lower || at >= coordinate.upper {
                break;
            }
        }
        wide
    };
    let sides = [1.0, -1.0].into_par_iter().map(of_side);
    sides.reduce(|| 1.0, f64::max)
}

/// What numbers of a datasheet that have no tolerance (moving mass, stroke, ratios of volumes) may be off by together, one
/// standard deviation: forces, flows and heat found with them, and factors of such, are as far off, however well they fit.
const UNDOUBTED: f64 = 0.02;

/// How far the size of a force, a flow or a conductance is off because the valve is a little other than its datasheet says.
fn by_datasheet(kind: EffectKind, parameter: &EffectParameter, value: f64) -> f64 {
    let is_size = matches!(parameter.search, Search::Size | Search::InverseSize);
    match kind.info().acts_on {
        ActsOn::Mechanics(_) | ActsOn::Pneumatics(_) if is_size => UNDOUBTED * value.abs(),
        _ => 0.0,
    }
}

/// Whether an effect that is a factor on what the datasheet states is nearer to one than the datasheet itself may be off.
pub fn is_of_datasheet(kind: EffectKind, values: &[f64]) -> bool {
    let none = kind.info().neutral;
    let mut factors = kind.parameters().iter().zip(values).filter(|(parameter, _)| parameter.is_size());
    none != 0.0 && factors.all(|(parameter, of)| (of - none).abs() < by_datasheet(kind, parameter, none))
}

/// The parameters of effects at the optimum, with standard deviations; those of sizes by profiles where these are asked for,
/// which takes several fits for each.
pub fn effect_parameters(
    problem: &ValveProblem<'_>,
    fit: &Fit,
    certainty: &Certainty,
    kinds: &[EffectKind],
    is_profiled: bool,
) -> Vec<FittedParameter> {
    let size_of = |kind: EffectKind| problem.space.effect_coordinates(kind).first().copied();
    let wider = |kind: &EffectKind| match size_of(*kind) {
        Some(size) if is_profiled => profiled(problem, fit, certainty, size),
        _ => 1.0,
    };
    let wider: Vec<f64> = kinds.par_iter().map(wider).collect();
    let mut all = Vec::new();
    for (kind, wider) in kinds.iter().zip(wider) {
        let Some(values) = problem.space.effect_values(*kind, &fit.u) else { continue };
        for (index, parameter) in kind.parameters().iter().enumerate() {
            let of = |u: &[f64]| problem.space.effect_values(*kind, u).map_or(values[index], |values| values[index]);
            let [covariance, jackknife] = certainty.sigmas(problem, &fit.u, of);
            let wider = if parameter.is_size() { wider } else { 1.0 };
            let floor = by_datasheet(*kind, parameter, values[index]);
            let sigma = jackknife.max(wider * covariance).hypot(floor);
            // What ended at a bound moves by rounding alone.
            let sigma = if sigma > BY_ROUNDING * values[index].abs() { sigma } else { 0.0 };
            all.push(FittedParameter {
                effect: *kind,
                name: parameter.name,
                unit: parameter.si_unit,
                value: values[index],
                sigma,
            });
        }
    }
    all
}

/// A share of a value by which calculations alone move it.
const BY_ROUNDING: f64 = 1e-12;

/// A nuisance is told where it is this many of its prior standard deviations off.
const TOLD: f64 = 1.0;

/// Or this many of its standard errors, where it takes an error larger than the noise: what is nothing unusual may be most of what
/// is wrong.
const SURE_ERRORS: f64 = 3.0;

/// By how much a nuisance at a point is off beyond what is usual, in prior standard deviations.
///
/// Clock and commands are told by what they do together: one makes up for the other. A command is given somewhere between the
/// last row without it and the first one with it, and with a controller that records as well always at the same place there.
pub fn deviation(problem: &ValveProblem<'_>, u: &[f64], place: usize) -> f64 {
    let first = problem.space.coordinates.len();
    let entry = &problem.nuisances[place];
    if entry.nuisance != Nuisance::Clock {
        return (u[first + place] - entry.coordinate.mean) / entry.coordinate.sigma;
    }
    let is_delay = |entry: &Entry| matches!(entry.nuisance, Nuisance::CloseDelay(_) | Nuisance::OpenDelay(_));
    let (mut late_s, mut usual_s, mut count) = (0.0, 0.0, 0.0);
    for (place, delay) in problem.nuisances.iter().enumerate().filter(|(_, entry)| is_delay(entry)) {
        late_s += delay.size * u[first + place];
        // Half of the time between two rows.
        usual_s += delay.size * delay.coordinate.mean;
        count += 1.0;
    }
    let count = f64::max(count, 1.0);
    let together_s = entry.size * u[first + place] + late_s / count;
    let earliest_s = 2.0 * usual_s / count;
    (together_s - together_s.clamp(earliest_s.min(0.0), 0.0)) / entry.size
}

/// Whether a nuisance is told that is off by so many prior standard deviations, of such a standard error in them.
pub fn is_told(problem: &ValveProblem<'_>, fit: &Fit, place: usize, (off, standard_error): (f64, f64)) -> bool {
    let takes = || takes(problem, fit, problem.space.coordinates.len() + place, off);
    off.abs() >= TOLD || (off.abs() >= SURE_ERRORS * standard_error && takes() >= 1.0)
}

/// The error that a coordinate takes by being off by so much, in units of the noise, on the records that it moves.
fn takes(problem: &ValveProblem<'_>, fit: &Fit, index: usize, off: f64) -> f64 {
    let by_record = |columns: &Vec<(usize, Vec<f64>)>| {
        let own = columns.iter().find(|(of, _)| *of == index);
        own.map(|(_, column)| column.iter().map(|slope| slope * off).collect()).unwrap_or_default()
    };
    normalised_rms(problem, &fit.noise, &fit.linear.columns.iter().map(by_record).collect::<Vec<Vec<f64>>>())
}

/// Nats that the damping of the stops has to be worth to be told as another than the valve file's: as many as an effect. Records of
/// a piston that hardly bounces make up some: of 35 sound drawn valves on undamped stops five had more than two standard errors of it, one ten nats.
const WORTH_TELLING: f64 = 10.0;

/// Parameters of the valve that have no tolerance, with the nuisances that stand for them.
const BESIDE: [(Nuisance, ParameterId); 2] =
    [(Nuisance::Bore, ParameterId::PistonArea), (Nuisance::StopDamping, ParameterId::StopDamping)];

/// Whether a nuisance stands for one of these parameters of the valve.
pub fn stands_for(nuisance: Nuisance, parameters: &[MovedParameter]) -> bool {
    BESIDE.iter().any(|(one, id)| *one == nuisance && parameters.iter().any(|parameter| parameter.id == *id))
}

/// Parameters of the valve that have no tolerance and were found to be others than in the valve file.
///
/// The piston area where it is off by enough to be told, and not where the supply's gauge was found to be off throughout as well:
/// strokes tell the product of both, and each alone makes up for the other. (Of 41 drawn campaigns nine had an area told and no
/// gauge: with it the stroke times of the adopted file were nearer to the true valve's in eight, by up to 2.6 s of 98 s. With a
/// gauge told as well they were farther off in four of six.)
///
/// The damping of the stops where records show it, which only those of a piston that bounces do: without it the model would
/// bounce on where the valve came to rest.
pub fn found_beside(model: &Model<ValveProblem<'_>>, certainty: &Certainty) -> Vec<MovedParameter> {
    let (problem, fit) = (&model.problem, &model.fit);
    let place = |which: Nuisance| problem.nuisances.iter().position(|entry| entry.nuisance == which);
    let index_of = |place: usize| problem.space.coordinates.len() + place;
    let is_off = |place: &usize| deviation(problem, &fit.u, *place).abs() >= TOLD;
    let with_gauge = place(Nuisance::Gauge).is_some_and(|gauge| is_off(&gauge));
    let is_worth_it = |place: &usize| {
        let index = index_of(*place);
        let sigma = certainty.sigma(problem, &fit.u, |u: &[f64]| u[index]);
        !fit.held[index] && 0.5 * (fit.u[index] / sigma).powi(2) > WORTH_TELLING
    };
    let found = |(nuisance, id): (Nuisance, ParameterId)| {
        let place = place(nuisance).filter(|place| match nuisance {
            Nuisance::Bore => !with_gauge && is_off(place),
            _ => is_worth_it(place),
        })?;
        let before = problem.space.parameters().get(id);
        // The area is counted as a share of itself.
        let unit = if nuisance == Nuisance::Bore { before } else { 1.0 };
        let size = unit * problem.nuisances[place].size;
        let index = index_of(place);
        let at = |u: f64| before + size * u;
        // Of nothing there is no share.
        let tolerance = (size / if before > 0.0 { before } else { at(fit.u[index]) }).ln_1p();
        Some(moved(problem, fit, certainty, (index, id), tolerance, at))
    };
    BESIDE.into_iter().filter_map(found).collect()
}

/// The tolerated parameters at the optimum.
pub fn moved_parameters(problem: &ValveProblem<'_>, fit: &Fit, certainty: &Certainty) -> Vec<MovedParameter> {
    let coordinates = problem.space.coordinates.iter().enumerate();
    let of = |(index, coordinate): (usize, &Coordinate)| {
        let Target::Base(id) = coordinate.target else { return None };
        let tolerance = (coordinate.value(1.0) / problem.space.parameters().get(id)).ln();
        Some(moved(problem, fit, certainty, (index, id), tolerance, |u| coordinate.value(u)))
    };
    coordinates.filter_map(of).collect()
}

/// A parameter at the optimum, with its coordinate's index and its value, SI, as a function of that coordinate.
fn moved(
    problem: &ValveProblem<'_>,
    fit: &Fit,
    certainty: &Certainty,
    (index, id): (usize, ParameterId),
    tolerance: f64,
    value: impl Fn(f64) -> f64,
) -> MovedParameter {
    let pull = |u: &[f64]| u[index];
    let normal_90 = t_quantile_95(f64::INFINITY);
    // However much records disagree by, no less is known than the tolerance said before.
    let half = certainty.half_width_90(problem, &fit.u, pull).min(normal_90);
    let pull_sigma = certainty.sigma(problem, &fit.u, pull);
    let known = if pull_sigma > 1.0 { pull_sigma.recip() } else { 1.0 };
    MovedParameter {
        id,
        before: problem.space.parameters().get(id),
        after: value(fit.u[index]),
        sigma: known * certainty.sigma(problem, &fit.u, |u| value(u[index])),
        interval_90: (value(fit.u[index] - half), value(fit.u[index] + half)),
        tolerance,
        pull: fit.u[index],
        pull_sigma: known * pull_sigma,
        is_at_bound: fit.held[index],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vent_within_what_its_datasheet_may_be_off_by_is_no_effect() {
        let is_none = |kind: EffectKind, size: f64| {
            let mut values: Vec<f64> = kind.parameters().iter().map(|_| 0.0).collect();
            values[0] = size;
            is_of_datasheet(kind, &values)
        };
        assert!(is_none(EffectKind::VENT_RESTRICTION, 0.994) && is_none(EffectKind::VENT_RESTRICTION, 1.015));
        assert!(!is_none(EffectKind::VENT_RESTRICTION, 0.97));
        // How small a force is does not make it one of the datasheet.
        assert!(!is_none(EffectKind::DRY_FRICTION, 0.01));
    }

    #[test]
    fn what_is_left_makes_everything_wider_and_nothing_narrower() {
        let leaving = |normalised_rms: f64| {
            let errors = Errors { normalised_rms, ..Errors::default() };
            Certainty::of(DMatrix::identity(1, 1), Vec::new()).leaving(Some(&errors)).dispersion
        };
        assert_eq!([leaving(8.5), leaving(0.9)], [8.5, 1.0]);
        assert_eq!(Certainty::of(DMatrix::identity(1, 1), Vec::new()).leaving(None).dispersion, 1.0);
    }
}
