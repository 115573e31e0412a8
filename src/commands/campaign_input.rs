//! A valve file and a campaign, read together.

use std::path::Path;

use campaign::Campaign;
use model_lab::Dataset;
use model_lab::data::valve_facts;
use valve_file::ValveFile;

use crate::failure::Hinted;
use crate::output;

/// A campaign beside the valve on which it was recorded.
#[derive(Debug)]
pub struct CampaignInput {
    /// The valve file.
    pub file: ValveFile,
    /// The campaign.
    pub campaign: Campaign,
    /// The campaign made ready for the model.
    pub data: Dataset,
}

impl CampaignInput {
    /// Reads both; what looks wrong is told on stderr. Refuses a campaign that only plans.
    pub fn read(valve: &Path, campaign: &Path) -> anyhow::Result<Self> {
        let file = ValveFile::read(valve)?;
        let read = Campaign::read(campaign, &valve_facts(file.valve()))?;
        for warning in &read.warnings {
            output::note(&format!("warning: {warning}"));
        }
        let data = Dataset::new(&read, file.schedule());
        if data.residual_count() == 0 {
            return Err(Hinted::error(
                format!("{}: nothing is recorded yet, only planned", campaign.display()),
                "record the planned runs and name their files in [[run]]",
            ));
        }
        Ok(Self { file, campaign: read, data })
    }

    /// Where the noise figure came from.
    pub fn noise_source(&self) -> &'static str {
        let sensors = &self.campaign.sensors;
        let stated = if self.data.runs.is_empty() {
            sensors.timing_noise_s.is_some()
        } else {
            sensors.position_noise_m.is_some()
        };
        if stated { "stated" } else { "estimated" }
    }
}
