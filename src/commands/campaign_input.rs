//! A valve file and a campaign, read together.

use std::path::{Path, PathBuf};

use campaign::Campaign;
use model_lab::Dataset;
use model_lab::data::valve_facts;
use valve_file::ValveFile;

use super::valve_input;
use crate::failure::Hinted;
use crate::output;

/// A campaign beside the valve on which it was recorded.
#[derive(Debug)]
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
    /// Reads both; what looks wrong is told on stderr. Refuses a campaign that only plans.
    pub fn read(valve: &Path, campaign: &Path) -> anyhow::Result<Self> {
        let file = valve_input::read(valve)?;
        let mut read = Campaign::read(campaign, &valve_facts(file.valve()))?;
        let cycle = file.schedule();
        read.doubt_times_beyond(cycle.open_at_s - cycle.close_at_s, cycle.end_s - cycle.open_at_s);
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
        Ok(Self { file, campaign: read, campaign_path: campaign.to_path_buf(), data })
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
