//! A valve file and a campaign, read with a word about what looks wrong in them.

use std::path::Path;

use answers::CampaignInput;

use crate::failure::Hinted;
use crate::output;

/// Reads both; what looks wrong is told on stderr. Refuses a campaign that only plans.
pub fn read(valve: &Path, campaign: &Path) -> anyhow::Result<CampaignInput> {
    let input = CampaignInput::read(valve, campaign).map_err(|error| match error.hint() {
        Some(hint) => Hinted::error(error.to_string(), hint),
        None => error.into(),
    })?;
    for doubt in input.doubts() {
        output::note(&format!("warning: {doubt}"));
    }
    output::detail(&format!(
        "{}: {} readings of {} traces and {} rows of stroke times; noise {}; {} parameters with a tolerance",
        input.campaign.name,
        input.data.reading_count(),
        input.campaign.runs.len(),
        input.campaign.timings.len(),
        input.noise_source(),
        input.file.tolerances().len(),
    ));
    Ok(input)
}
