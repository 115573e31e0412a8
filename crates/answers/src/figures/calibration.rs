//! The picture of a calibration.

use model_lab::calibrate::Calibration;
use report::figures::{ParameterShift, ParametersFigure};

use crate::CampaignInput;
use crate::calibration::verdict_words;

/// How far each parameter moved.
pub fn shifts(input: &CampaignInput, calibration: &Calibration) -> ParametersFigure {
    ParametersFigure {
        title: format!("{} calibrated on {}", input.file.name(), input.campaign.name),
        subtitle: verdict_words(calibration).to_owned(),
        parameters: calibration
            .parameters
            .iter()
            .map(|parameter| ParameterShift {
                name: parameter.id.key().to_owned(),
                calibrated: parameter.pull,
                calibrated_error: parameter.pull_sigma,
                repaired: None,
            })
            .collect(),
    }
}
