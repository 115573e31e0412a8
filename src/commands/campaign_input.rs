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
    Ok(input)
}
