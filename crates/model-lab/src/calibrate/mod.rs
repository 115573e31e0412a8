//! Calibration: the tolerated parameters fitted to a campaign, with honest errors and a verdict.
//!
//! It is the fit with which every search for missing physics begins: priors from the tolerances, instruments and
//! conditions allowed for, a model error whose size is estimated, nothing added. Whether that is enough is judged by what
//! is left and by how far the parameters had to go: a fit that needs them far beyond their tolerance is a sign of
//! missing physics.

mod identifiability;
mod lack_of_fit;
mod verdict;

use campaign::Campaign;
use identify::Stop;
use nalgebra::DMatrix;
use valve_file::{HistoryEntry, ValveFile, ValveFileError};
use valve_model::{ParameterId, Valve};

pub use identifiability::{NonIdentifiable, non_identifiable};
pub use verdict::Verdict;

use crate::data::Dataset;
use crate::diagnosis::uncertainty::{Certainty, found_beside, moved_parameters};
use crate::diagnosis::{MovedParameter, NuisanceReport, nuisance_reports};
use crate::errors::{self, CALIBRATED, StepReport};
use crate::identification::{NuisanceSizes, Subject};

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
    /// The model cannot be simulated.
    #[error("{file}: its strokes cannot be simulated; look at the valve with `valve simulate`")]
    CannotBeSimulated {
        /// The valve file.
        file: String,
    },
    /// The file cannot be edited.
    #[error(transparent)]
    Edit(#[from] ValveFileError),
}

/// A calibrated valve with everything that is known about how good it is.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// The parameters, in the order of `[tolerance]`.
    pub parameters: Vec<MovedParameter>,
    /// Parameters that have no tolerance and were found to be others than in the valve file.
    pub beside: Vec<MovedParameter>,
    /// Correlations of the errors of those with a tolerance.
    pub correlations: DMatrix<f64>,
    /// Practically non-identifiable combinations: the data do not fix them better than the tolerances do.
    pub non_identifiable: Vec<NonIdentifiable>,
    /// The errors of the datasheet's values, then of the calibrated ones.
    pub steps: [StepReport; 2],
    /// What instruments and conditions were found to be off by.
    pub nuisances: Vec<NuisanceReport>,
    /// What it comes to.
    pub verdict: Verdict,
    /// Why, in a sentence each.
    pub reasons: Vec<String>,
    /// Whether parameters had to go further than their tolerances let them (a conflict of prior and data): then they stand in for
    /// missing physics.
    pub has_prior_conflict: bool,
    /// The valve with the fitted parameters.
    pub valve: Valve,
}

impl Calibration {
    /// Calibrates the tolerated parameters of a valve file on a campaign.
    pub fn new(file: &ValveFile, campaign: &Campaign, stop: &Stop) -> Result<Self, CalibrateError> {
        let data = Dataset::new(campaign, file.schedule());
        if data.is_empty() {
            return Err(CalibrateError::NothingRecorded { name: campaign.name.clone() });
        }
        if file.tolerances().is_empty() {
            return Err(CalibrateError::NoTolerances { file: file.file_name().to_owned() });
        }
        let cannot = || CalibrateError::CannotBeSimulated { file: file.file_name().to_owned() };
        let subject = Subject::new(file, campaign, &NuisanceSizes::default(), stop);
        let model = subject.calibrated(stop).ok_or_else(cannot)?;
        let valve = model.problem.space.valve(&model.fit.u).ok_or_else(cannot)?;
        let certainty = Certainty::of_model(&model);
        let parameters = moved_parameters(&model.problem, &model.fit, &certainty);
        let datasheet = errors::at(&model.problem, &model.problem.at_their_word()).ok_or_else(cannot)?;
        let conflicts = verdict::prior_data_conflicts(&parameters);
        let (verdict, reasons) = verdict::judge(&model, &conflicts);
        let count = model.problem.space.coordinates.len();
        let covariance = certainty.covariance().view((0, 0), (count, count)).clone_owned();
        let beside = found_beside(&model, &certainty);
        let nuisances = nuisance_reports(&model, &certainty, &beside);
        Ok(Self {
            parameters,
            beside,
            correlations: correlations(&covariance),
            non_identifiable: non_identifiable(&model.problem.space, &covariance),
            steps: [StepReport::as_stated(&subject, datasheet), StepReport::new(CALIBRATED, &model)],
            nuisances,
            verdict,
            reasons,
            has_prior_conflict: !conflicts.is_empty(),
            valve,
        })
    }

    /// Every parameter that was found, those without a tolerance last.
    pub fn found(&self) -> impl Iterator<Item = &MovedParameter> {
        self.parameters.iter().chain(&self.beside)
    }

    /// The valve file with the calibrated values, its comments kept and its history extended.
    pub fn adopted(&self, file: &ValveFile, campaign_name: &str) -> Result<ValveFile, CalibrateError> {
        let values: Vec<(ParameterId, f64)> = self.found().map(|one| (one.id, one.after)).collect();
        let [before, after] = [0, 1].map(|step| self.steps[step].errors.normalised_rms);
        let found = self.found().filter_map(MovedParameter::found).collect();
        let entry = HistoryEntry::new(CALIBRATED, campaign_name, before, after).with_found(found);
        Ok(file.with_parameters(&values)?.with_history(entry)?)
    }
}

fn correlations(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    DMatrix::from_fn(n, n, |i, j| {
        let both = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
        if both > 0.0 { covariance[(i, j)] / both } else { f64::from(u8::from(i == j)) }
    })
}
