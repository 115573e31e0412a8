//! A valve file and a campaign, read together.

use std::path::{Path, PathBuf};

use campaign::{Campaign, CampaignError};
use identify::Stop;
use model_lab::compare::Comparison;
use model_lab::data::valve_facts;
use model_lab::identification::{NuisanceSizes, Subject};
use model_lab::{Dataset, strange_times};
use valve_file::{ValveFile, ValveFileError};

/// Why a valve file and a campaign cannot be looked at together.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// The valve file.
    #[error(transparent)]
    Valve(#[from] ValveFileError),
    /// The campaign file, or a file that it names.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// There are no readings.
    #[error("{file}: nothing is recorded yet, only planned")]
    OnlyPlanned {
        /// The campaign file.
        file: String,
    },
}

impl InputError {
    /// What to do about it, where the message does not say so.
    pub fn hint(&self) -> Option<&'static str> {
        matches!(self, Self::OnlyPlanned { .. }).then_some("record the planned runs and name their files in [[run]]")
    }
}

/// A campaign beside the valve on which it was recorded.
#[derive(Debug, Clone)]
pub struct CampaignInput {
    /// The valve file.
    pub file: ValveFile,
    /// The campaign.
    pub campaign: Campaign,
    /// Where the campaign was read from.
    pub campaign_path: PathBuf,
    /// The campaign made ready for the model.
    pub data: Dataset,
}

impl CampaignInput {
    /// Whether the last step in the valve file's history fitted it to this very campaign.
    pub fn is_fitted(&self) -> bool {
        self.file.history().last().is_some_and(|last| last.campaign == self.campaign.name)
    }

    /// Reads both. Refuses a campaign that only plans. What looks wrong is in [`CampaignInput::doubts`].
    pub fn read(valve: &Path, campaign: &Path) -> Result<Self, InputError> {
        Self::of(ValveFile::read(valve)?, campaign)
    }

    /// The campaign beside a valve that is read already.
    pub fn of(file: ValveFile, campaign: &Path) -> Result<Self, InputError> {
        let mut read = Campaign::read(campaign, &valve_facts(file.valve()))?;
        let cycle = file.schedule();
        read.doubt_times_beyond(cycle.open_at_s - cycle.close_at_s, cycle.end_s - cycle.open_at_s);
        strange_times::leave_out(&file, &mut read, Stop::never());
        let data = Dataset::new(&read, file.schedule());
        if data.is_empty() {
            return Err(InputError::OnlyPlanned { file: campaign.display().to_string() });
        }
        Ok(Self { file, campaign: read, campaign_path: campaign.to_path_buf(), data })
    }

    /// What looks wrong in either file and can be used all the same, a sentence each.
    pub fn doubts(&self) -> Vec<String> {
        let valve = self.file.doubts().into_iter().map(|doubt| doubt.to_string());
        valve.chain(self.campaign.doubts()).collect()
    }

    /// Every file that was read; none of them is to be replaced.
    pub fn files(&self) -> Vec<PathBuf> {
        let folder = self.campaign_path.parent().unwrap_or(Path::new(""));
        let runs = self.campaign.runs.iter().map(|run| folder.join(&run.file));
        let timings = self.campaign.timings_file.as_ref().map(PathBuf::from);
        runs.chain(timings).chain([PathBuf::from(self.file.file_name()), self.campaign_path.clone()]).collect()
    }

    /// Where the noise figure came from.
    pub fn noise_source(&self) -> &'static str {
        let sensors = &self.campaign.sensors;
        let stated = if self.data.runs.is_empty() {
            sensors.timing_noise_s.is_some_and(|stated_s| stated_s >= self.data.timing_noise_s)
        } else {
            sensors.position_noise_m.is_some()
        };
        if stated { "stated" } else { "estimated" }
    }
}

/// How far a valve file's model, as it stands, is from a campaign's positions, m (root mean square); nothing where its strokes cannot
/// be simulated, or where no positions were recorded.
pub fn position_error_m(file: &ValveFile, campaign: &Campaign) -> Option<f64> {
    let data = Dataset::new(campaign, file.schedule());
    let subject = Subject::new(file, campaign, &NuisanceSizes::default(), Stop::never());
    Comparison::new(&subject, file.valve(), &data)?.overall.errors.rmse_m
}
