//! A valve file and a campaign, read with a word about what looks wrong in them.

use std::path::Path;

use answers::CampaignInput;
use quantity::Dimension;

use crate::failure::Hinted;
use crate::output::{self, told_in};

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

/// Strokes that were made this much colder or warmer than the valve file states take about a percent longer or shorter, K.
const OTHER_TEMPERATURE_K: f64 = 5.0;

/// A word where the tables of a file that was fitted to strokes would be built for another temperature than theirs; else nothing.
pub fn temperature_words(input: &CampaignInput) -> String {
    let stated_k = input.file.valve().parameters().temperature_k;
    let runs = input.campaign.runs.iter().map(|run| run.conditions.temperature_k);
    let times = input.campaign.timings.iter().map(|row| row.conditions.temperature_k);
    let (coldest_k, warmest_k) =
        runs.chain(times).fold((f64::INFINITY, f64::NEG_INFINITY), |all, one| (all.0.min(one), all.1.max(one)));
    if !(coldest_k > stated_k + OTHER_TEMPERATURE_K || warmest_k < stated_k - OTHER_TEMPERATURE_K) {
        return String::new();
    }
    let unit = told_in(Dimension::Temperature);
    format!(
        "\nThe strokes were made at {} {unit_name}, the valve file states {} {unit_name}, for which tables are built: state the usual \
         temperature there, or build them over a range with --temperature-range.\n",
        unit.number(0.5 * (coldest_k + warmest_k), 1),
        unit.number(stated_k, 1),
        unit_name = unit.name()
    )
}
