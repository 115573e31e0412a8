//! What was said of a campaign, filled through the library. The only file that knows the library's interface.

use std::path::Path;

use anyhow::{Context, Result};
use blind_benchmark::Campaign;
use identify::Stop;
use model_lab::Dataset;
use model_lab::data::valve_facts;
use model_lab::diagnosis::{DiagnoseOptions, Explanation, explain};
use valve_file::ValveFile;

/// A fitted parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Its effect.
    pub effect: String,
    /// Its name.
    pub name: String,
    /// Its value, SI.
    pub value: f64,
    /// One sigma.
    pub sigma: f64,
}

/// What was said of a campaign.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Answer {
    /// The verdict, as its id.
    pub verdict: String,
    /// The effects recommended, in order.
    pub recommended: Vec<String>,
    /// For each of them, it and what cannot be told from it.
    pub groups: Vec<Vec<String>>,
    /// Fitted parameters of the recommended effects.
    pub parameters: Vec<Fitted>,
    /// What instruments and conditions were found to be off by, as text.
    pub nuisances: String,
    /// Error on what was held out, in units of the noise.
    pub held_out: Option<f64>,
    /// The same in millimetres, where it is told.
    pub held_out_mm: Option<f64>,
    /// How much more likely a model error makes the records than noise alone, nats.
    pub lack: Option<f64>,
}

/// A campaign as the program sees it.
#[derive(Debug)]
pub struct Drawn {
    /// The valve as it is believed to be.
    pub file: ValveFile,
    /// The campaign.
    pub campaign: campaign::Campaign,
    /// The records.
    pub data: Dataset,
}

impl Drawn {
    /// Writes a campaign to a folder and reads it as the program would.
    pub fn through_files(drawn: &Campaign, parent: &Path) -> Result<Self> {
        Self::read(&drawn.write_to(parent)?)
    }

    /// Reads a campaign's folder as the program would.
    pub fn read(folder: &Path) -> Result<Self> {
        let file = ValveFile::read(&folder.join("valve.toml"))?;
        let campaign = campaign::Campaign::read(&folder.join("campaign.toml"), &valve_facts(file.valve()))?;
        let data = Dataset::new(&campaign, file.schedule());
        Ok(Self { file, campaign, data })
    }
}

/// What the library says of the campaign in a folder.
pub fn from_library(folder: &Path) -> Result<Answer> {
    let Drawn { file, campaign, .. } = Drawn::read(folder)?;
    let said = explain(&file, &campaign, &DiagnoseOptions::default(), &|_| (), Stop::never())
        .context("the valve file's own values cannot be simulated")?;
    Ok(answer(&said))
}

fn answer(said: &Explanation) -> Answer {
    let groups = said.recommended.iter().map(|kind| {
        let twins = said.indistinguishable.iter().filter(|twins| twins.kind == *kind).flat_map(|twins| &twins.with);
        std::iter::once(kind.id().to_owned()).chain(twins.map(|twin| twin.kind.id().to_owned())).collect()
    });
    let fitted = said.parameters.iter().map(|p| Fitted {
        effect: p.effect.id().to_owned(),
        name: p.name.to_owned(),
        value: p.value,
        sigma: p.sigma,
    });
    Answer {
        verdict: said.verdict.id().to_owned(),
        recommended: said.recommended.iter().map(|kind| kind.id().to_owned()).collect(),
        groups: groups.collect(),
        parameters: fitted.collect(),
        nuisances: String::new(),
        held_out: said.steps.last().and_then(|step| step.held_out).map(|errors| errors.normalised_rms),
        held_out_mm: said.steps.last().and_then(|step| step.held_out?.rmse_m).map(|rmse| 1e3 * rmse),
        lack: Some(said.remainder.nats),
    }
}
