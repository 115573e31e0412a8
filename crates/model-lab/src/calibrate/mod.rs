//! Calibration: the tolerated parameters fitted to a campaign, with honest errors and a verdict.
//!
//! Tolerances are priors: a parameter moves only as far as the data ask for. Whether that is enough is
//! judged by what is left (white noise and the scatter between repeats, or not) and by how far the
//! parameters had to go: a fit that needs them far beyond their tolerance is a sign of missing physics.

mod held_out;
mod identifiability;
mod polish;
mod relinearise;
mod repeatability;
mod settled;
mod verdict;

use campaign::Campaign;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use valve_file::{HistoryEntry, ValveFile, ValveFileError};
use valve_model::{ParameterId, Valve};

pub use held_out::{HeldOut, held_out};
pub use identifiability::{SingularDirection, singular_directions};
pub use polish::polished;
pub use relinearise::relinearised;
pub use repeatability::Repeatability;
pub use settled::Settled;
pub use verdict::{LackOfFit, Verdict, is_within_tolerances};

use crate::certainty::{quantile_90, widened};
use crate::compare::Comparison;
use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, fit, inverse, prior_cost};
use crate::forward::residuals;
use crate::scatter::Scatter;
use crate::space::Space;

/// Why nothing could be calibrated.
#[derive(Debug, thiserror::Error)]
pub enum CalibrateError {
    /// The valve file names no parameter that may move.
    #[error(
        "{file}: no parameter has a tolerance; expected a table [tolerance] with what is not known exactly, \
         such as \"actuator.viscous_friction\" = 0.2 for one standard deviation of 20 %"
    )]
    NoTolerances {
        /// The valve file.
        file: String,
    },
    /// The campaign has only planned runs.
    #[error("campaign {name}: nothing is recorded yet, only planned; expected a run with a file, or stroke times")]
    NothingRecorded {
        /// The campaign.
        name: String,
    },
    /// The file cannot be edited.
    #[error(transparent)]
    Edit(#[from] ValveFileError),
}

/// A parameter before and after.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibratedParameter {
    /// Which.
    pub id: ParameterId,
    /// Its tolerance, one standard deviation as a share of the value.
    pub tolerance: f64,
    /// Value before, SI.
    pub before: f64,
    /// Value after, SI.
    pub after: f64,
    /// Standard error of the value after, SI: noise, scatter between strokes and autocorrelation of
    /// what is left, with the tolerance as prior.
    pub standard_error: f64,
    /// The interval that holds the true value with a probability of 90 %, SI.
    pub interval_90: (f64, f64),
    /// How far it moved, in tolerances.
    pub shift: f64,
    /// Standard error of the shift, in tolerances: 1 means that the data say nothing about it.
    pub shift_error: f64,
}

/// A calibrated valve with everything that is known about how good it is.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// The parameters, in the order of `[tolerance]`.
    pub parameters: Vec<CalibratedParameter>,
    /// Correlations of their errors.
    pub correlations: DMatrix<f64>,
    /// Combinations that the data do not fix better than the tolerances do.
    pub singular: Vec<SingularDirection>,
    /// The model before, beside all runs.
    pub before: Comparison,
    /// The model after, beside all runs.
    pub after: Comparison,
    /// The error on runs left out of the fit; nothing where there are too few conditions to leave one out.
    pub held_out: Option<HeldOut>,
    /// How far repeated strokes differ; nothing without repeats.
    pub repeatability: Option<Repeatability>,
    /// What is left, against noise and scatter.
    pub lack_of_fit: LackOfFit,
    /// Variance by which autocorrelated residuals weaken the data; 1 for white ones.
    pub inflation: f64,
    /// What it comes to.
    pub verdict: Verdict,
    /// Why, in a sentence each.
    pub reasons: Vec<String>,
    /// The fit itself.
    pub fit: Fit,
    /// The scatter between strokes that it allows for.
    pub scatter: Scatter,
    /// Costs (chi-squared and priors) at the ends of all starts, best first.
    pub start_costs: Vec<f64>,
}

impl Calibration {
    /// Whether parameters had to go further than their tolerances let them: then they stand in for missing physics.
    pub fn has_strayed(&self) -> bool {
        !is_within_tolerances(&self.fit)
    }
}

/// What to spend on a calibration.
#[derive(Debug, Clone, Copy)]
pub struct CalibrateOptions {
    /// Points at which a fit may start; the best of them are followed.
    pub candidates: usize,
    /// Fits that are followed to their end.
    pub starts: usize,
    /// Jacobians after which the starts are compared and only the best is followed on.
    pub first_steps: usize,
    /// Whether conditions are left out in turn to see how the fit predicts.
    pub hold_out: bool,
}

impl Default for CalibrateOptions {
    fn default() -> Self {
        Self { candidates: 12, starts: 3, first_steps: 2, hold_out: true }
    }
}

impl Calibration {
    /// Calibrates the tolerated parameters of a valve file on a campaign.
    pub fn new(file: &ValveFile, campaign: &Campaign, options: CalibrateOptions) -> Result<Self, CalibrateError> {
        let data = Dataset::new(campaign, file.schedule());
        if data.residual_count() == 0 {
            return Err(CalibrateError::NothingRecorded { name: campaign.name.clone() });
        }
        if file.tolerances().is_empty() {
            return Err(CalibrateError::NoTolerances { file: file.file_name().to_owned() });
        }
        Ok(Self::of(&Space::tolerated(file), &data, file.valve(), options))
    }

    /// Calibrates a space of tolerated parameters around a valve on a dataset.
    pub fn of(space: &Space, data: &Dataset, valve: &Valve, options: CalibrateOptions) -> Self {
        let (mut found, start_costs) = best_fit(space, data, valve, options);
        if found.lack_of_fit(data).excess().is_some()
            && let Some(supposed) = Settled::supposed(data, &found.scatter, &found.fit)
        {
            found = supposed.polished();
        }
        let lack_of_fit = found.lack_of_fit(data);
        let inflation = lack_of_fit.inflation();
        let after = Comparison::new(data, &found.fit.valve());
        let (verdict, reasons) = verdict::judge(&found, &lack_of_fit, &after);
        let Settled { fit, scatter, data: straight } = found;
        let (information, _) = scatter.normal_equations(&fit.jacobian, &fit.residual);
        let information = information / inflation;
        let covariance = widened(&scatter, &fit, &posterior(space, &information));
        let before = Comparison::new(data, valve);
        let parameters = parameters(space, &fit, &covariance, quantile_90(&scatter));
        let held_out =
            if options.hold_out { held_out(space, (data, &straight), &fit, &scatter, &before) } else { None };
        let repeatability = Repeatability::of(data, &scatter);
        Self {
            correlations: correlations(&covariance),
            singular: singular_directions(space, &information),
            parameters,
            before,
            after,
            held_out,
            repeatability,
            lack_of_fit,
            inflation,
            verdict,
            reasons,
            fit,
            scatter,
            start_costs,
        }
    }

    /// The valve file with the calibrated values, its comments kept and its history extended.
    pub fn adopted(&self, file: &ValveFile, campaign_name: &str) -> Result<ValveFile, CalibrateError> {
        let values: Vec<(ParameterId, f64)> = self.parameters.iter().map(|one| (one.id, one.after)).collect();
        let entry = HistoryEntry::new(
            "calibrated",
            campaign_name,
            self.before.overall.normalised_rms,
            self.after.overall.normalised_rms,
        );
        Ok(file.with_parameters(&values)?.with_history(entry)?)
    }
}

/// The best of several fits with the scatter it allows for, and the costs at which all of them ended.
fn best_fit(space: &Space, data: &Dataset, valve: &Valve, options: CalibrateOptions) -> (Settled, Vec<f64>) {
    // The scatter shows in how repeats differ, whatever the model; only its directions need one.
    let mut scatter = Scatter::estimate(data, valve);
    let rough = data.rough();
    let mut fits = followed(space, &rough, &scatter, options);
    let start_costs = fits.iter().map(|fit| fit.cost).collect();
    if scatter.is_known() && fits[0].chi2 > HOPELESS * data.residual_count() as f64 && !data.runs.is_empty() {
        // Where physics is missing, a fit that may call misfit scatter follows neither.
        scatter = Scatter::unknown(data);
        fits = followed(space, &rough, &scatter, options);
    }
    (Settled::new(data, scatter, fits.swap_remove(0)).polished(), start_costs)
}

/// chi-squared per reading beyond which scatter between strokes is not what is wrong, even before it
/// was made linear.
const HOPELESS: f64 = 6.0;

/// Fits from several starts, best first: a little at first, the best of them to its end.
fn followed(space: &Space, data: &Dataset, scatter: &Scatter, options: CalibrateOptions) -> Vec<Fit> {
    let first = FitOptions { steps: options.first_steps, tolerance: 5.0, ..FitOptions::default() };
    let starts = starts(space, data, scatter, options);
    let mut fits: Vec<Fit> = starts.par_iter().filter_map(|start| fit(data, scatter, space, start, first)).collect();
    fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let whole = FitOptions { steps: 10, tolerance: 0.1, ..FitOptions::default() };
    if let Some(best) = fits.first().and_then(|best| fit(data, scatter, space, &best.u, whole)) {
        fits[0] = best;
    }
    fits
}

/// Where fits start: at the datasheet, and at the best of points spread over the tolerances.
fn starts(space: &Space, data: &Dataset, scatter: &Scatter, options: CalibrateOptions) -> Vec<Vec<f64>> {
    let zero = space.start();
    let spread: Vec<Vec<f64>> = (1..options.candidates)
        .map(|point| {
            space.clamped(&(0..zero.len()).map(|axis| zero[axis] + spread_point(point, axis)).collect::<Vec<f64>>())
        })
        .collect();
    let possible: Vec<(Vec<f64>, Valve)> =
        spread.into_iter().filter_map(|u| space.valve(&u).map(|valve| (u, valve))).collect();
    let valves: Vec<Valve> = possible.iter().map(|(_, valve)| valve.clone()).collect();
    let mut costs: Vec<(f64, Vec<f64>)> = residuals(data, &valves)
        .iter()
        .zip(possible)
        .map(|(residual, (u, _))| (scatter.dot(residual, residual) + prior_cost(space, &u), u))
        .collect();
    costs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut starts = vec![zero];
    starts.extend(costs.into_iter().map(|(_, u)| u).take(options.starts.saturating_sub(1)));
    starts
}

/// A point of a Halton sequence (Halton 1960) between -1.5 and 1.5 tolerances.
fn spread_point(point: usize, axis: usize) -> f64 {
    const PRIMES: [usize; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];
    let base = PRIMES[axis % PRIMES.len()];
    let (mut rest, mut share, mut value) = (point, 1.0, 0.0);
    while rest > 0 {
        share /= base as f64;
        value += share * (rest % base) as f64;
        rest /= base;
    }
    3.0 * value - 1.5
}

/// Covariance of the coordinates from the information of the data and the priors.
fn posterior(space: &Space, information: &DMatrix<f64>) -> DMatrix<f64> {
    let n = information.nrows();
    let (matrix, _) = space.with_priors(&space.start(), (information.clone(), DVector::zeros(n)));
    inverse(&matrix)
}

fn correlations(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt())
}

fn parameters(space: &Space, fit: &Fit, covariance: &DMatrix<f64>, quantile_90: f64) -> Vec<CalibratedParameter> {
    space
        .coordinates
        .iter()
        .enumerate()
        .filter_map(|(index, coordinate)| {
            let crate::space::Target::Base(id) = coordinate.target else { return None };
            let (shift, shift_error) = (fit.u[index], covariance[(index, index)].sqrt());
            let (before, after) = (coordinate.value(0.0), coordinate.value(shift));
            let tolerance = (coordinate.value(1.0) / before).ln();
            Some(CalibratedParameter {
                id,
                tolerance,
                before,
                after,
                standard_error: after * tolerance * shift_error,
                interval_90: (
                    coordinate.value(shift - quantile_90 * shift_error),
                    coordinate.value(shift + quantile_90 * shift_error),
                ),
                shift,
                shift_error,
            })
        })
        .collect()
}
